"""Served meshes in headless Chromium, and the server without a browser: run by scripts/test-viewer.sh."""

import json
import os
import re
import shutil
import signal
import socket
import time
import unittest
import urllib.error
import urllib.request
from pathlib import Path

from browser import Browser, run, until

# Set by a cut: the plane, and what the browser has of the tets near it.
NEAR = """() => { const { cut, mesh, state } = tetmillApp, near = cut.mesh, plane = planeOf(mesh, state.cut);
  const sides = (t) => [0, 1, 2, 3].map((k) => dot(pointOf(near, near.tets[4 * t + k]), plane.normal) - plane.offset);
  const slack = 1e-5 * mesh.radius; let off = 0;
  for (let t = 0; t < near.tetCount; t++) { const s = sides(t); if (Math.min(...s) > slack || Math.max(...s) < -slack) off++; }
  return { off, tets: near.tetCount, pieces: cut.pieces, drawn: tetmillApp.drawn[1].faces.length, note: document.getElementById("cut-note").textContent }; }"""

# Of a box: tets of the cut that are inside it or apart from it, and tets of the mesh itself with corners on both sides that the cut lacks.
BOX = """async () => { const { cut, mesh, state } = tetmillApp, near = cut.mesh, [low, high] = boxOf(mesh, state.cut), slack = 1e-5 * mesh.radius;
  const corners = (m, t) => [0, 1, 2, 3].map((k) => sub(pointOf(m, m.tets[4 * t + k]), sub(mesh.center, m.center)));
  const isIn = (p, more) => p.every((x, i) => low[i] - more < x && x < high[i] + more);
  const apart = (all) => [0, 1, 2].some((i) => all.every((p) => p[i] < low[i] - slack) || all.every((p) => p[i] > high[i] + slack));
  const off = [...Array(near.tetCount).keys()].filter((t) => { const all = corners(near, t); return all.every((p) => isIn(p, -slack)) || apart(all); });
  const whole = decode(await (await fetch(`mesh/level/${mesh.pieces[0]}`)).arrayBuffer()), ids = new Set(near.tetIds), lacking = [];
  for (let t = 0; t < whole.tetCount; t++) {
    const all = corners(whole, t);
    if (all.some((p) => isIn(p, -slack)) && !all.every((p) => isIn(p, slack)) && !ids.has(whole.tetIds[t])) lacking.push(t);
  }
  return { off: off.length, lacking: lacking.length, tets: near.tetCount, pieces: cut.pieces, shown: tetmillApp.drawn[1].faces.length }; }"""
AT_CUT = "tetmillApp.cut && !tetmillApp.fetching && !tetmillApp.waiting && tetmillApp.drawn.length === 2"


class Served(Browser):
    def test_the_coarsest_level_comes_first_and_others_on_demand(self):
        server, address = self.serve("generate", self.geo, "-n", 2, "--levels", 2, "-f", "none", "-q", "--view")
        page = self.open_served(address)
        self.assertTrue(all(url.startswith(address) or url.startswith("data:") for url in self.asked), self.asked)
        levels = [url.split("/mesh/")[1] for url in self.asked if "/mesh/" in url]
        self.assertEqual(levels, ["level/1", "level/4"], "the coarsest, and the finest that is small")
        fine = page.evaluate("tetmillApp.mesh.tetCount")
        page.select_option("#level", "0")
        until(page, "tetmillApp.level === 0 && !tetmillApp.waiting")
        self.assertEqual(page.evaluate("tetmillApp.mesh.tetCount") * 64, fine)
        self.assertIn("coarser level", page.inner_text("#note"))
        until(page, "location.hash.includes('level=1')")
        again = self.open(address + page.evaluate("location.hash").replace("level=1", "level=2"))
        until(again, "tetmillApp.mesh.pieces[1] === 2")
        server.send_signal(signal.SIGINT)
        self.assertEqual(server.wait(10), 0)

    def test_a_server_that_ignores_ctrl_c_ends_with_sigterm(self):
        server, address = self.serve("view", self.geo, "-q", ignored=[signal.SIGINT, signal.SIGHUP])
        for which in [signal.SIGINT, signal.SIGHUP]:
            server.send_signal(which)
        time.sleep(0.2)
        with urllib.request.urlopen(address) as answer:
            self.assertEqual(answer.status, 200)
        server.send_signal(signal.SIGTERM)
        self.assertEqual(server.wait(10), 0)

    def fine(self, *more):
        """A mesh of 12 subdivisions whose level that is shown is coarser."""
        return self.serve("generate", self.geo, "--pieces", 12, "-f", "none", "-q", "--view", *more)

    def test_a_cut_has_the_finest_tets_near_the_plane(self):
        _, address = self.fine("-n", 2)
        page = self.open_served(address)
        before = self.drawn(page)
        page.click("#cut-y")
        until(page, "tetmillApp.cut && !tetmillApp.waiting && tetmillApp.drawn.length === 2")
        near = page.evaluate(NEAR)
        self.assertEqual((near["off"], near["pieces"]), (0, 12))
        self.assertIn("of the mesh itself", near["note"])
        # A plane through the middle of a unit cube meets some n² of N = n³ tets.
        total = page.evaluate("tetmillApp.mesh.totals.tets")
        self.assertTrue(total ** (2 / 3) < near["tets"] < 5 * total ** (2 / 3), (near, total))
        self.assertNotEqual(self.drawn(page)["hash"], before["hash"])
        # Nothing more is asked for as long as nothing changes.
        asked = lambda: sum("/mesh/cut/" in url for url in self.asked)
        page.wait_for_timeout(500)
        self.assertEqual(asked(), 1)
        # A click on the cut finds a tet of the mesh itself, with the id that the mesh has.
        box = page.locator("#canvas").bounding_box()
        page.mouse.click(box["x"] + box["width"] / 2 + 1, box["y"] + box["height"] / 2 + 1)
        about = page.evaluate("({ near: tetmillApp.selected.mesh === tetmillApp.cut.mesh, text: document.getElementById('info').innerText })")
        self.assertTrue(about["near"], about["text"])
        # The plane moves: the layer is of the new plane.
        plane = page.evaluate("tetmillApp.cut.key")
        page.keyboard.press("]")
        until(page, f"tetmillApp.cut && tetmillApp.cut.key !== {json.dumps(plane)} && !tetmillApp.waiting")
        self.assertEqual(page.evaluate(NEAR)["off"], 0)
        page.click("#cut-fine")
        until(page, "!tetmillApp.waiting && tetmillApp.drawn.length === 1")

    def test_a_box_has_the_finest_tets_at_its_faces(self):
        _, address = self.fine("-n", 2)
        page = self.open_served(address)
        before = self.drawn(page)
        page.click("#cut-box")
        until(page, AT_CUT)
        found = page.evaluate(BOX)
        self.assertEqual((found["off"], found["lacking"], found["pieces"]), (0, 0, 12))
        self.assertIn("of the mesh itself", page.inner_text("#cut-note"))
        self.assertLess(self.drawn(page)["drawn"], before["drawn"])
        # The faces of half the size have a quarter of the tets.
        key = page.evaluate("tetmillApp.cut.key")
        for axis in "xyz":
            for end, value in [("low", -0.25), ("high", 0.25)]:
                page.evaluate("([id, value]) => { const thumb = document.getElementById(id); thumb.value = value; thumb.dispatchEvent(new Event('input')); }", [f"box-{axis}-{end}", value])
        until(page, f"{AT_CUT} && tetmillApp.cut.key === cutKey(tetmillApp) && tetmillApp.cut.key !== {json.dumps(key)}")
        smaller = page.evaluate(BOX)
        self.assertEqual((smaller["off"], smaller["lacking"]), (0, 0))
        self.assertTrue(0.15 < smaller["tets"] / found["tets"] < 0.4, (smaller, found))
        # A click on the front of the box finds a tet of the mesh itself.
        box = page.locator("#canvas").bounding_box()
        page.mouse.click(box["x"] + box["width"] / 2 + 1, box["y"] + box["height"] / 2 + 1)
        self.assertTrue(page.evaluate("tetmillApp.selected.mesh === tetmillApp.cut.mesh"))
        page.click("#cut-fine")
        until(page, "!tetmillApp.waiting && tetmillApp.drawn.length === 1")

    def test_a_box_seen_closely_has_the_tets_of_the_visible_piece(self):
        _, address = self.fine("-n", 2)
        page = self.open_served(address + "#box=-0.5,-0.5,-0.5,0.5,0.5,0.5")
        until(page, AT_CUT)
        all_tets = page.evaluate("tetmillApp.cut.mesh.tetCount")
        page.evaluate("Object.assign(tetmillApp.state, { zoom: 0.1 * tetmillApp.mesh.radius, focus: [0, -0.25, 0], turn: looking(-90, 0) }); tetmillApp.state.cut.box[0][1] = -0.49; tetmillApp.update()")
        until(page, f"{AT_CUT} && tetmillApp.cut.key === cutKey(tetmillApp)")
        near = page.evaluate("({ tets: tetmillApp.cut.mesh.tetCount, high: tetmillApp.cut.window[1][1] })")
        self.assertLess(near["tets"], 0.2 * all_tets)
        self.assertLess(near["high"], -0.2, "only the face towards the viewer")
        # Nothing is asked for if the box is out of sight.
        asked = sum("/mesh/cut/" in url for url in self.asked)
        page.evaluate("tetmillApp.state.focus = [0, 0, 9]; tetmillApp.state.cut.box[0][1] = -0.4; tetmillApp.update()")
        page.wait_for_timeout(400)
        self.assertEqual(sum("/mesh/cut/" in url for url in self.asked), asked)

    def test_a_range_of_quality_selects_at_the_cut_too(self):
        _, address = self.fine("-n", 2)
        page = self.open_served(address + "#color=angle")
        page.click("#cut-y")
        until(page, AT_CUT)
        whole = self.drawn(page)["drawn"]
        page.select_option("#counted", "cut")
        page.locator("#histogram").scroll_into_view_if_needed()
        box = page.locator("#histogram").bounding_box()
        page.mouse.move(box["x"] + 2, box["y"] + 40)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + 40)
        page.mouse.up()
        self.assertLess(self.drawn(page)["drawn"], whole)
        found = page.evaluate(
            """() => { const { drawn, cut, state } = tetmillApp, angles = (d) => [...d.faces].map((f) => d.mesh.quality[2 * (f >> 2)]);
            const [level, near] = drawn.map(angles), kept = [...Array(cut.mesh.tetCount).keys()].filter((t) => cut.mesh.quality[2 * t] <= state.range[1]);
            return { most: Math.max(...level, ...near), near: near.length, kept: kept.length, all: cut.mesh.tetCount, high: state.range[1], worst: Math.min(...cut.mesh.quality.filter((_, k) => k % 2 === 0)) }; }"""
        )
        self.assertLessEqual(found["most"], found["high"])
        self.assertTrue(0 < found["near"] and 0 < found["kept"] < found["all"], found)
        # The ten worst are of the cut as well, and a click on one goes there.
        page.click("#worst-0")
        about = page.evaluate("({ near: tetmillApp.selected.mesh === tetmillApp.cut.mesh, angle: tetmillApp.selected.mesh.quality[2 * tetmillApp.selected.tetIndex] })")
        self.assertEqual(about, {"near": True, "angle": found["worst"]})
        until(page, "location.hash.includes('histogram=cut')")
        page.keyboard.press("Escape")
        until(page, "!tetmillApp.waiting && !tetmillApp.state.range && tetmillApp.cut")
        page.click("#cut-none")
        until(page, "!tetmillApp.waiting && !tetmillApp.cut && !document.getElementById('counted')")

    def test_a_cut_with_too_many_tets_of_a_file_is_shown_in_the_middle(self):
        folder = self.folder / "second"
        run("generate", self.geo, "-n", 2, "--pieces", 12, "--order", 2, "-f", "vtu", "-q", "-o", folder)
        _, address = self.serve("view", folder / "cube.pvtu", "-q")
        page = self.open_served(address + "#box=-0.9,-0.9,-0.9,0.9,0.9,0.9")
        until(page, AT_CUT)
        found = page.evaluate("({ tets: tetmillApp.cut.mesh.tetCount, window: tetmillApp.cut.mesh.window, note: document.getElementById('cut-note').textContent })")
        self.assertTrue(50_000 < found["tets"] <= 100_000, found)
        self.assertIn("in the middle of the view: zoom in", found["note"])
        self.assertTrue(all(0 < low < high < 1 for low, high in zip(*found["window"])), found["window"])
        page.evaluate("tetmillApp.state.zoom *= 0.3; tetmillApp.state.focus = [0, -0.4, 0]; tetmillApp.update()")
        until(page, f"{AT_CUT} && !tetmillApp.cut.mesh.window")
        self.assertIn("of the mesh itself", page.inner_text("#cut-note"))

    def test_a_large_mesh_from_files_is_hollow_and_its_cuts_are_not(self):
        folder = self.folder / "large"
        run("generate", self.geo, "-n", 2, "--pieces", 10, "-f", "vtu", "-q", "-o", folder)
        _, address = self.serve("view", folder / "cube.pvtu", "-q")
        page = self.open_served(address)
        self.assertTrue(page.evaluate("tetmillApp.mesh.hollow"))
        page.click("#cut-x")
        until(page, "tetmillApp.cut && !tetmillApp.waiting && tetmillApp.drawn.length === 2")
        near = page.evaluate(NEAR)
        self.assertEqual((near["off"], page.evaluate("tetmillApp.cut.mesh.parts")), (0, 2))
        total = page.evaluate("tetmillApp.mesh.totals.tets")
        self.assertTrue(total ** (2 / 3) < near["tets"] < 5 * total ** (2 / 3), (near, total))

    def test_ghosts_touch_their_part(self):
        _, address = self.serve("generate", self.geo, "-n", 3, "-f", "none", "-q", "--view")
        page = self.open_served(address)
        self.differs(page, lambda: (page.select_option("#ghosts", "1"), until(page, "tetmillApp.ghosts && tetmillApp.drawn.length === 2")))
        wrong = page.evaluate(
            """() => { const { mesh, ghosts, state } = tetmillApp, ids = new Set();
            mesh.tets.forEach((v, k) => { if (mesh.tetPart[k >> 2] === 1) ids.add(mesh.ids[v]); });
            const touching = (t) => [0, 1, 2, 3].some((k) => ids.has(ghosts.ids[ghosts.tets[4 * t + k]]));
            const all = [...Array(ghosts.tetCount).keys()];
            return { count: all.length, off: all.filter((t) => !touching(t) || ghosts.owners[t] === 1).length, hidden: [...state.partsOff] }; }"""
        )
        self.assertGreater(wrong.pop("count"), 50)
        self.assertEqual(wrong, {"off": 0, "hidden": [0, 2]})
        self.assertIn("a ghost of part 2", page.evaluate("aboutTet(tetmillApp.ghosts, 0).rows.flat().join()"))
        page.select_option("#ghosts", "-1")
        until(page, "!tetmillApp.ghosts && tetmillApp.state.partsOff.size === 0")

    def test_bad_queries_get_a_reason_and_nothing_else(self):
        _, address = self.fine()

        def ask(query):
            try:
                with urllib.request.urlopen(f"{address}mesh/{query}") as answer:
                    return answer.status, answer.read()
            except urllib.error.HTTPError as error:
                return error.code, error.read()

        box = "-9,-9,-9,9,9,9"
        self.assertEqual(ask("level/1")[0], 200)
        self.assertEqual(ask(f"cut/12/0,0,1,0.5/{box}")[0], 200)
        bad = ["level/0", "level/13", "level/99999999999", "level/x", "level/1/1", "level", f"cut/12/0,0,0,1/{box}", f"cut/12/0,0,1/{box}", f"cut/12/0,0,1,nan/{box}"]
        bad += [f"cut/12/0,0,0,1,1/{box}", f"cut/12/0,0,0,1,1,1,1/{box}", f"cut/12/0,0,0,1,-1,1/{box}", f"cut/12/0,0,0,1,1,inf/{box}", f"cut/12/0,0,0,1,1,1e200/{box}"]
        bad += [f"cut/12/0,0,0,1,1,/{box}", "cut/12/0,0,0,1,1,1", f"cut/12/0,0,0,1,1,1/{box},1", f"cut/13000000000/0,0,0,1,1,1/{box}", f"box/12/0,0,0,1,1,1/{box}"]
        bad += [f"cut/12/0,0,1e999,0/{box}", "cut/12/0,0,1,0/0,0,0,1,1", f"cut/0/0,0,1,0/{box}", "ghosts/1/1", "ghosts/1/-1", "ghosts/12/0", "other/1"]
        for query in bad:
            status, text = ask(query)
            self.assertEqual(status, 422, query)
            self.assertTrue(0 < len(text) < 200 and text.decode().isprintable(), (query, text))
        for query in [f"cut/12/0,0,0,1,1,{'1' * 300}/{box}", f"cut/12/0,0,0;1,1,1/{box}", "", "level/1?x", "level/%31", "LEVEL/1", "9" * 301, "level/1%00"]:
            self.assertEqual(ask(query)[0], 404, query)
        # A cut of nothing is no error, and the server still answers.
        for nothing in ["0,0,1,50", "50,50,50,51,51,51", "-1e99,-1e99,-1e99,1e99,1e99,1e99"]:
            self.assertEqual(ask(f"cut/12/{nothing}/{box}")[0], 200, nothing)

    @unittest.skipUnless(shutil.which("mpirun"), "no mpirun")
    def test_processes_of_mpi_answer_together_and_sleep_meanwhile(self):
        mpi = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        launcher = ["mpirun", "--oversubscribe", "-n", "3"]
        server, address = self.serve("generate", self.geo, "--pieces", 12, "-f", "none", "-q", "--view", launcher=launcher, env=mpi)
        page = self.open_served(address)
        page.click("#cut-z")
        until(page, "tetmillApp.cut && !tetmillApp.waiting && tetmillApp.drawn.length === 2")
        near = page.evaluate(NEAR)
        self.assertEqual((near["off"], near["pieces"], page.evaluate("tetmillApp.cut.mesh.parts")), (0, 12, 3))
        page.close()
        children = Path(f"/proc/{server.pid}/task/{server.pid}/children").read_text().split()
        self.assertEqual(len(children), 3)
        used = lambda: sum(sum(map(int, Path(f"/proc/{child}/stat").read_text().rsplit(")", 1)[1].split()[11:13])) for child in children)
        start = used()
        time.sleep(1)
        # A rank that waits busily uses 100 ticks in a second.
        self.assertLess(used() - start, 30)
        server.send_signal(signal.SIGINT)
        server.wait(20)
        # The launcher may be gone before the last of them.
        deadline = time.monotonic() + 5
        while left := [child for child in children if Path(f"/proc/{child}").exists()]:
            self.assertLess(time.monotonic(), deadline, left)
            time.sleep(0.05)

    def test_requests_without_token_or_with_other_hosts_get_an_error_only(self):
        _, address = self.serve("view", self.geo, "-q")
        token, port = re.search(r":(\d+)/([0-9a-f]{32})/", address).group(2), int(re.search(r":(\d+)/", address)[1])

        def ask(raw):
            with socket.create_connection(("127.0.0.1", port)) as stream:
                stream.sendall(raw)
                stream.shutdown(socket.SHUT_WR)
                answer = b""
                try:
                    while chunk := stream.recv(65536):
                        answer += chunk
                except ConnectionResetError:
                    pass
                return answer

        def get(path, host="127.0.0.1"):
            return ask(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())

        self.assertIn(b"200 OK", get(f"/{token}/"))
        refused = [get("/"), get("/mesh/0"), get(f"/{'0' * 32}/"), get(f"/{token}/", "evil.example"), get(f"/{token}/../../etc/passwd")]
        refused += [get(f"/{token}/mesh/"), get(f"/{token}/mesh/<b>"), get(f"/{token}/mesh/level/1?" + "x" * 100), ask(b"\0" * 64 + b"\r\n\r\n"), ask(b"GET / HTTP/1.1\r\n")]
        for answer in refused:
            self.assertRegex(answer.split(b"\r\n")[0], rb"^HTTP/1.1 (400|403|404) ")
            self.assertLess(len(answer.split(b"\r\n\r\n")[1]), 40)
        self.assertNotIn(b"200", ask(b"GET /" + b"x" * 20000).split(b"\r\n")[0])
        # Not on other addresses of this machine.
        with self.assertRaises(OSError):
            socket.create_connection((socket.gethostbyname(socket.gethostname()) if socket.gethostbyname(socket.gethostname()) != "127.0.0.1" else "127.0.0.2", port), 2).close()
        with urllib.request.urlopen(address) as answer:
            self.assertEqual(answer.headers["X-Frame-Options"], "DENY")


if __name__ == "__main__":
    unittest.main()
