"""Pages of the viewer in headless Chromium: run by scripts/test-viewer.sh."""

import json
import unittest

from browser import HOSTILE, Browser, message_of, run, until


class Viewer(Browser):
    def test_a_page_works_without_a_network_and_asks_for_nothing(self):
        page = self.open(self.file.as_uri(), offline=True)
        drawn = self.drawn(page)["drawn"]
        self.assertGreater(drawn, 50_000)
        self.assertEqual([url for url in self.asked if not url.startswith(("file:", "data:"))], [])
        self.assertLess(self.file.stat().st_size, 2_000_000)

    def test_the_head_agrees_with_the_run(self):
        head = message_of(self.file.read_text())
        report = self.folder / "report.json"
        run("generate", self.geo, "-n", 3, "-f", "none", "-q", "--report", report)
        mesh = json.loads(report.read_text())["mesh"]
        self.assertEqual(sum(head["tets"]), mesh["tets"])
        self.assertEqual(head["totals"]["vertices"], mesh["vertices"])
        names = [name for patch in head["patches"] for name in patch["names"]]
        self.assertIn("inner", names)

    def test_each_toggle_changes_the_picture_and_back(self):
        page = self.open(self.file.as_uri() + "#explode=0.6&on=boundary,interfaces,volume")
        for key in ["boundary", "interfaces", "curves", "corners", "vertices", "shared"]:
            start = self.drawn(page)
            self.differs(page, lambda: page.click(f"#show-{key}"))
            self.differs(page, lambda: page.click(f"#show-{key}"))
            self.assertEqual(self.drawn(page), start, key)

    def test_colours_styles_themes_and_parts_change_the_picture(self):
        page = self.open(self.file.as_uri())
        for color in ["patch", "body", "angle", "ratio", "part"]:
            self.differs(page, lambda: page.select_option("#color", color)) if color != "body" else page.select_option("#color", color)
        for style in ["filled", "grid", "transparent", "both"]:
            self.differs(page, lambda: page.select_option("#style", style))
        before, after = self.differs(page, lambda: page.click("#part-0"))
        self.assertLess(after, before)
        page.click("#part-0")
        page.click("#theme")
        # The background is that of the page: only the theme changes.
        until(page, "!tetmillApp.waiting")
        self.assertEqual(page.evaluate("document.documentElement.dataset.theme"), "dark")

    def test_a_cut_shows_whole_tets_behind_the_plane(self):
        page = self.open(self.file.as_uri())
        self.differs(page, lambda: page.click("#cut-x"))
        wrong = page.evaluate(
            """() => { const { mesh, faces, state } = tetmillApp, plane = planeOf(mesh, state.cut);
            return [...faces].filter((f) => dot([0, 1, 2].map((i) => mesh.centers[3 * (f >> 2) + i]), plane.normal) >= plane.offset).length; }"""
        )
        self.assertEqual(wrong, 0)
        inside = page.evaluate("[...tetmillApp.faces].filter((f) => tetmillApp.mesh.neighbours[f] >= 0).length")
        self.assertGreater(inside, 10)
        # What is visible is closed: each edge is in an even number of faces.
        odd = page.evaluate(
            """() => { const { mesh, faces } = tetmillApp, count = new Map();
            for (const f of faces) { const v = FACES[f & 3].map((k) => mesh.tets[4 * (f >> 2) + k]);
              for (let k = 0; k < 3; k++) { const e = [v[k], v[(k + 1) % 3]].sort((a, b) => a - b).join(); count.set(e, (count.get(e) || 0) + 1); } }
            return [...count.values()].filter((n) => n % 2).length; }"""
        )
        self.assertEqual(odd, 0)

    def test_a_box_shows_whole_tets_inside_it(self):
        page = self.open(self.file.as_uri() + "#on=boundary,interfaces,volume")
        whole, _ = self.differs(page, lambda: page.click("#cut-box"))
        inside = """() => { const { mesh, faces, state } = tetmillApp, [low, high] = boxOf(mesh, state.cut), tets = new Set([...faces].map((f) => f >> 2));
            const isIn = (t) => [0, 1, 2].every((i) => low[i] < mesh.centers[3 * t + i] && mesh.centers[3 * t + i] < high[i]);
            return { off: [...tets].filter((t) => !isIn(t)).length, tets: tets.size, all: [...Array(mesh.tetCount).keys()].filter(isIn).length, edges: tetmillApp.drawing.frame.count, low, high }; }"""
        found = page.evaluate(inside)
        self.assertEqual((found["off"], found["edges"]), (0, 12))
        self.assertTrue(0 < found["tets"] <= found["all"], found)
        self.assertTrue(all(abs(x + 0.25) < 1e-6 for x in found["low"]) and all(abs(x - 0.25) < 1e-6 for x in found["high"]), found)
        self.assertLess(self.drawn(page)["drawn"], whole)
        # The box grows and shrinks by keys, and a thumb that is dragged moves one face.
        before, after = self.differs(page, lambda: [page.keyboard.press("]") for _ in range(5)])
        self.assertGreater(after, before)
        box = page.locator("#box-z-high").bounding_box()
        place = page.evaluate("(tetmillApp.state.cut.box[1][2] + 1.02) / 2.04") * (box["width"] - 16) + 8
        page.mouse.move(box["x"] + place, box["y"] + box["height"] / 2)
        page.mouse.down()
        page.mouse.move(box["x"] + 8, box["y"] + box["height"] / 2)
        page.mouse.up()
        low, high = page.evaluate("tetmillApp.state.cut.box.map((corner) => corner[2])")
        self.assertAlmostEqual(high - low, 0.01, places=2, msg="a thumb stops at the other one")
        page.keyboard.press("b")
        until(page, "!tetmillApp.waiting && !tetmillApp.state.cut.on")
        self.assertEqual(self.drawn(page)["drawn"], whole)

    def test_a_click_in_a_box_finds_a_tet_inside_and_the_address_keeps_the_box(self):
        page = self.open(self.file.as_uri())
        page.click("#cut-box")
        page.evaluate("tetmillApp.state.cut.box = [[-0.9, -0.35, -0.9], [0.9, 0.7, 0.8]]; tetmillApp.state.turn = looking(-90, 0); tetmillApp.rebuild()")
        self.drawn(page)
        box = page.locator("#canvas").bounding_box()
        page.mouse.click(box["x"] + box["width"] / 2 + 7, box["y"] + box["height"] / 2 + 7)
        y = page.evaluate("(() => { const { mesh, selected } = tetmillApp, t = mesh.tetIds.indexOf(selected.tet ?? -1); return t < 0 ? null : mesh.centers[3 * t + 1]; })()")
        self.assertTrue(y is None or y > -0.5 * 0.35, y)
        until(page, "location.hash.includes('box=-0.9,-0.35,-0.9,0.9,0.7,0.8')")
        page.wait_for_timeout(300)
        again, other = self.open(page.url), self.open(page.url)
        self.assertEqual(again.evaluate("tetmillApp.state.cut.shape"), "box")
        self.assertEqual(self.drawn(again), self.drawn(other))
        self.assertEqual(again.get_attribute("#cut-box", "aria-pressed"), "true")
        nonsense = self.open(self.file.as_uri() + "#box=1,1,1,0,0,0")
        self.assertFalse(nonsense.evaluate("tetmillApp.state.cut.on"))

    def test_a_click_finds_what_is_there(self):
        page = self.open(self.file.as_uri())
        # The middle of the front face of the cube, seen from -y, is on the boundary `outer`.
        page.keyboard.press("4")
        box = page.locator("#canvas").bounding_box()
        found = set()
        for k in range(24):
            page.mouse.click(box["x"] + box["width"] / 2 + 5 * k, box["y"] + box["height"] / 2 + 3 * k)
            about = page.evaluate("tetmillApp.selected && { ...tetmillApp.selected, text: document.getElementById('info').innerText }")
            found.add(about["kind"])
            if about["kind"] == "face":
                self.assertIn("outer", about["text"])
                facts = page.evaluate(
                    """(about) => { const { mesh } = tetmillApp, t = mesh.tetIds.indexOf(about.tet);
                    return { ids: [0, 1, 2, 3].map((k) => mesh.ids[mesh.tets[4 * t + k]]), y: about.edges.flat().map((v) => mesh.points[3 * v + 1] + mesh.center[1]) }; }""",
                    about,
                )
                self.assertTrue(set(about["id"]) <= set(facts["ids"]))
                self.assertTrue(all(abs(y) < 1e-6 for y in facts["y"]), facts["y"])
        self.assertIn("face", found)
        corner = page.evaluate(
            """() => { const { mesh } = tetmillApp; for (let v = 0; v < mesh.ids.length; v++) {
            const p = [0, 1, 2].map((i) => Math.abs(mesh.points[3 * v + i] + mesh.center[i])); if (Math.max(...p) < 1e-6) return [mesh.ids[v], ...tetmillApp.toScreen(pointOf(mesh, v))]; } }"""
        )
        page.mouse.click(box["x"] + corner[1] + 2, box["y"] + corner[2] - 2)
        about = page.evaluate("tetmillApp.selected")
        self.assertEqual((about["kind"], about["id"]), ("vertex", corner[0]))
        self.assertEqual(about["rows"][0][1], "0, 0, 0")
        rows = dict(about["rows"])
        sides = rows["Boundaries"].splitlines()
        self.assertEqual((len(sides), sum("outer" in side for side in sides)), (3, 3), "the corner of three sides")
        self.assertEqual(len(rows["Body"].splitlines()), 1)
        # A vertex of the ball is in both bodies.
        inner = page.evaluate(
            """() => { const { mesh } = tetmillApp, inner = mesh.patches.findIndex((p) => p.names.includes("inner"));
            const f = mesh.facePatches.indexOf(inner), v = mesh.tets[4 * (f >> 2) + FACES[f & 3][0]]; return aboutVertex(mesh, v).rows; }"""
        )
        self.assertEqual(len(dict(inner)["Bodies"].splitlines()), 2)

    def test_the_search_finds_ids_and_names(self):
        page = self.open(self.file.as_uri())
        for text, kind in [("t5", "tet"), ("v7", "vertex"), ("inner", "face"), ("t99999999", None), ("<b>", None)]:
            page.fill("#search", text)
            page.press("#search", "Enter")
            self.assertEqual(page.evaluate("tetmillApp.selected.kind ?? null"), kind, text)
        self.assertIn("Not found", page.inner_text("#info"))

    def test_a_distance_is_that_of_the_vertices(self):
        page = self.open(self.file.as_uri())
        page.keyboard.press("4")
        page.keyboard.press("m")
        box = page.locator("#canvas").bounding_box()
        corners = page.evaluate("[[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5]].map((p) => tetmillApp.toScreen(p))")
        for (x, y), dx in zip(corners, [2, -2]):
            page.mouse.click(box["x"] + x + dx, box["y"] + y - 2)
        self.assertIn("Distance", page.inner_text("#info"))
        self.assertRegex(page.inner_text("#info"), r"Length\s+1\b")

    def test_the_address_shows_the_same_again(self):
        page = self.open(self.file.as_uri())
        page.click("#cut-z")
        page.select_option("#color", "angle")
        page.click("#part-1")
        page.keyboard.press("+")
        until(page, "location.hash.includes('partsOff=1') && location.hash.includes('cut=')")
        page.wait_for_timeout(300)
        again = self.open(page.url)
        # Addresses have five digits: pixels can differ from those before, but not from each other.
        self.assertEqual(self.drawn(page)["drawn"], self.drawn(again)["drawn"])
        self.assertEqual(self.drawn(again), self.drawn(self.open(page.url)))
        nonsense = self.open(self.file.as_uri() + "#turn=x,1&zoom=-1&cut=0,0,0,0&range=2,1&color=<b>&explode=1e99&partsOff=-3,x")
        self.assertGreater(self.drawn(nonsense)["drawn"], 0)

    def test_the_histogram_selects_and_the_worst_tets_are_the_worst(self):
        page = self.open(self.file.as_uri())
        page.locator("#histogram").scroll_into_view_if_needed()
        box = page.locator("#histogram").bounding_box()
        page.mouse.move(box["x"] + 2, box["y"] + 40)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] * 0.55, box["y"] + 40)
        page.mouse.up()
        high = page.evaluate("tetmillApp.state.range[1]")
        self.drawn(page)
        worst = page.evaluate("Math.max(0, ...[...tetmillApp.faces].map((f) => tetmillApp.mesh.quality[2 * (f >> 2)]))")
        self.assertTrue(0 < worst <= high, (worst, high))
        page.keyboard.press("Escape")
        page.click("#worst-0")
        least = page.evaluate("Math.min(...tetmillApp.mesh.quality.filter((_, k) => k % 2 === 0))")
        self.assertEqual(page.evaluate("tetmillApp.mesh.quality[2 * tetmillApp.selected.tetIndex]"), least)

    def test_hostile_names_are_text(self):
        mesh, file = self.folder / "hostile.msh", self.folder / "hostile.html"
        run("mesh", self.geo, "-q", "-o", mesh)
        text = mesh.read_text()
        self.assertIn('"outer"', text)
        mesh.write_text(text.replace('"outer"', f'"{HOSTILE}"'))
        run("view", mesh, "-q", "-o", file)
        page = self.open(file.as_uri())
        page.fill("#search", "hacked")
        page.press("#search", "Enter")
        self.assertIn("<script>window.hacked=1", page.inner_text("#info"))
        self.assertIsNone(page.evaluate("window.hacked ?? null"))

    def test_a_report_page_has_the_numbers_of_the_report(self):
        file, report = self.folder / "report.html", self.folder / "r.json"
        run("generate", self.geo, "-n", 2, "--levels", 1, "-f", "none", "-q", "--report-html", file, "--report", report)
        page = self.open(file.as_uri())
        page.keyboard.press("r")
        text = page.inner_text("#report")
        self.assertIn(f"{json.loads(report.read_text())['mesh']['tets']:,}", text)
        self.assertIn("partition", text)
        self.assertEqual(page.evaluate("[...document.querySelectorAll('#report img')].map((img) => [img.complete, img.naturalWidth])"), [[True, 720]] * 2)
        counted = page.evaluate("[...document.querySelectorAll('#report svg')].map((svg) => [...svg.querySelectorAll('rect title')].reduce((sum, bar) => sum + Number(bar.textContent.split(': ')[1].replace(/\\D/g, '')), 0))")
        self.assertEqual(counted, [json.loads(report.read_text())["mesh"]["tets"]] * 2, "all tets are in the histograms")
        self.assertIn("peak memory", text)
        self.assertIn("shared vertices", text)

    def test_a_touch_screen_and_a_small_window_work(self):
        page = self.open(self.file.as_uri(), size=(390, 800))
        self.assertGreater(self.drawn(page)["drawn"], 10_000)
        self.assertGreater(page.locator("#canvas").bounding_box()["width"], 380)

    def test_help_opens_and_closes(self):
        page = self.open(self.file.as_uri())
        page.keyboard.press("?")
        self.assertTrue(page.is_visible("#help"))
        page.keyboard.press("Escape")
        self.assertFalse(page.is_visible("#help"))

    def test_elmer_parts_and_other_meshes_are_read(self):
        folder = self.folder / "elmer"
        run("generate", self.geo, "-n", 3, "-f", "elmer,msh", "-q", "-o", folder)
        for mesh, parts in [(folder, 3), (folder / "cube.msh", 1)]:
            file = self.folder / "mesh.html"
            run("view", mesh, "-q", "-o", file)
            head, expected = message_of(file.read_text()), message_of(self.file.read_text())
            self.assertEqual((len(head["tets"]), sum(head["tets"])), (parts, sum(expected["tets"])))
            page = self.open(file.as_uri())
            self.assertGreater(self.drawn(page)["drawn"], 50_000)

    def test_the_pieces_of_a_pvtu_are_parts(self):
        folder, file = self.folder / "vtu", self.folder / "pvtu.html"
        run("generate", self.geo, "-n", 3, "-f", "vtu", "--halo", "vertices", "-q", "-o", folder)
        run("view", folder / "cube.pvtu", "-q", "-o", file)
        self.assertEqual(message_of(file.read_text())["tets"], message_of(self.file.read_text())["tets"])

    def test_edges_of_second_order_are_curved(self):
        ball, mesh, file = self.folder / "ball.geo", self.folder / "ball.msh", self.folder / "ball.html"
        ball.write_text("algebraic3d\nsolid s = sphere (0, 0, 0; 1) -maxh=1.0;\ntlo s;\n")
        run("mesh", ball, "--order", 2, "-q", "-o", mesh)
        run("view", mesh, "-q", "-o", file)
        page = self.open(file.as_uri())
        # All drawn corners are on the sphere; those of flat triangles would not be, at most of a
        # quadratic patch.
        off = page.evaluate(
            """() => { const { mesh, state } = tetmillApp, { faces, buffer } = visibleFaces(mesh, state, shownTets(mesh, state, null));
            const numbers = new Float32Array(buffer), c = mesh.center; let most = 0;
            for (let k = 0; k < 3 * faces.length; k++) most = Math.max(most, Math.abs(Math.hypot(numbers[5 * k] + c[0], numbers[5 * k + 1] + c[1], numbers[5 * k + 2] + c[2]) - 1));
            return { most, pieces: faces.length / new Set(faces).size, straight: Math.max(...[...new Set(faces)].map((f) => 1 - norm(add(scaled(FACES[f & 3].map((k) => pointOf(mesh, mesh.tets[4 * (f >> 2) + k])).reduce(add), 1 / 3), c)))) }; }"""
        )
        self.assertEqual(off["pieces"], 16)
        self.assertLess(off["most"], 0.12 * off["straight"], off)

if __name__ == "__main__":
    unittest.main()
