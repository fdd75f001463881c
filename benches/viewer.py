#!/usr/bin/env python3
"""Times of the viewer: viewer.py TETMILL ARGUMENT..., for example

    benches/viewer.py target/release/tetmill generate geometries/crankshaft.geo -n 2 -e 1e9 -f none -q --view

Runs the command, opens its page in headless Chromium with software WebGL, and prints a line of a table for each step: seconds,
bytes received, tets and triangles drawn; then the triangles drawn per second, and the memory of JavaScript, of all processes of
the browser (their proportional set size) and of the server (resident). Needs Playwright, and Linux for the memory.
"""

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

ARGUMENTS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox", "--enable-precise-memory-info"]
# Frames of the mesh turned a little each: triangles per second.
FRAMES = """() => { const app = tetmillApp, frames = 10, start = performance.now(), pixel = new Uint8Array(4), { gl } = app.drawing;
  for (let k = 0; k < frames; k++) { app.turn(5, 0); cancelAnimationFrame(app.waiting); app.waiting = 0; draw(app.drawing, app.view(), app.state.style, false);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); }
  const triangles = (app.drawing.faces.count + app.drawing.near.count) / 3;
  return [triangles, frames * triangles / (performance.now() - start) * 1000]; }"""
# Notes the time from the request of the page to its first picture.
FIRST = """(() => { const look = () => { if (window.tetmillApp && tetmillApp.drawn.length) window.firstPicture = performance.now();
  else requestAnimationFrame(look); }; requestAnimationFrame(look); })()"""
SETTLED = "window.tetmillApp && tetmillApp.mesh && !tetmillApp.waiting"


def children(pid):
    """A process and those below it."""
    found = [pid]
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in task.read_text().split():
            found += children(int(child))
    return found


def proportional(pids):
    """The proportional set size of processes in MB."""
    sizes = [re.search(r"Pss:\s+(\d+)", Path(f"/proc/{pid}/smaps_rollup").read_text()) for pid in pids]
    return sum(int(size[1]) for size in sizes if size) / 1e3


def browser_processes():
    """The processes of the browser, which are below this one."""
    return [pid for pid in children(os.getpid()) if "chrom" in Path(f"/proc/{pid}/cmdline").read_text()]


class Bench:
    def __init__(self, page):
        self.page, self.received = page, 0
        page.on("response", self.count)
        page.on("pageerror", lambda error: sys.exit(f"the page failed: {error}"))

    def count(self, response):
        self.received += int(response.headers.get("content-length", 0))

    def wait(self, condition, seconds=120):
        deadline = time.monotonic() + seconds
        while not self.page.evaluate(f"Boolean({condition})"):
            if time.monotonic() > deadline:
                sys.exit(f"never: {condition}; the page says: {self.page.inner_text('#message')}")
            time.sleep(0.01)

    def step(self, name, act, condition):
        """Does something and prints how long it takes until a condition holds and the picture is drawn."""
        before, start = self.received, time.monotonic()
        act()
        self.wait(f"{SETTLED} && ({condition})")
        took = time.monotonic() - start
        tets, triangles, note = self.page.evaluate("[tetmillApp.drawn.reduce((sum, { mesh }) => sum + mesh.tetCount, 0), (tetmillApp.drawing.faces.count + tetmillApp.drawing.near.count) / 3, tetmillApp.cutNote]")
        print(f"| {name} | {took:.2f} s | {(self.received - before) / 1e6:.1f} MB | {tets:,.0f} tets | {triangles:,.0f} triangles | {note} |", flush=True)

    def zoom_out(self):
        """Undoes zooming in, and waits for the cut."""
        self.page.evaluate("tetmillApp.state.zoom *= 5; tetmillApp.rebuild()")
        time.sleep(0.5)
        self.wait(f"{SETTLED} && !tetmillApp.fetching")


def main(command):
    start = time.monotonic()
    server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    for line in server.stderr:
        if found := re.search(r"http://\S+", line):
            break
    else:
        sys.exit(f"the command ended with {server.wait()}")
    print(f"| start to address | {time.monotonic() - start:.2f} s |", flush=True)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        bench = Bench(page)
        page.add_init_script(FIRST)
        bench.step("address to the first choice of the level", lambda: page.goto(found[0]), "tetmillApp.level >= tetmillApp.index.start")
        print(f"| address to first picture | {page.evaluate('window.firstPicture') / 1000:.2f} s |")
        cuts = page.evaluate("tetmillApp.index.cuts")
        is_cut = "!tetmillApp.index.cuts || (tetmillApp.cut && tetmillApp.drawn.length === 2 && !tetmillApp.fetching)"
        bench.step("cut by y", lambda: page.click("#cut-y"), is_cut)
        if cuts:
            zoom = "tetmillApp.state.cut.at = 0.1; tetmillApp.state.zoom *= 0.2; tetmillApp.rebuild()"
            is_new = f"({is_cut}) && tetmillApp.cut.key === cutKey(tetmillApp)"
            bench.step("cut beside it, zoomed in five times", lambda: page.evaluate(zoom), is_new)
            bench.zoom_out()
            bench.step("box of half the size", lambda: page.click("#cut-box"), is_new)
            zoom = "tetmillApp.state.zoom *= 0.2; moveCut(tetmillApp.state.cut, -0.03); tetmillApp.rebuild()"
            bench.step("smaller box, zoomed in five times", lambda: page.evaluate(zoom), is_new)
            bench.zoom_out()
        triangles, rate = page.evaluate(FRAMES)
        print(f"| drawn with the cut | {rate / 1e6:.2f} million triangles/s | {triangles:,.0f} triangles |")
        last = page.evaluate("tetmillApp.index.levels.length - 1")
        page.evaluate("tetmillApp.state.cut.on = false; tetmillApp.rebuild()")
        bench.step("last level", lambda: page.evaluate(f"void tetmillApp.load({last})"), f"tetmillApp.level === {last}")
        triangles, rate = page.evaluate(FRAMES)
        print(f"| drawn | {rate / 1e6:.2f} million triangles/s | {triangles:,.0f} triangles |")
        print(f"| memory of JavaScript | {page.evaluate('performance.memory.usedJSHeapSize') / 1e6:.0f} MB |")
        print(f"| memory of the browser | {proportional(browser_processes()):.0f} MB |")
        browser.close()
    status = Path(f"/proc/{server.pid}/status").read_text()
    resident, peak = (int(re.search(rf"{name}:\s+(\d+)", status)[1]) / 1e3 for name in ["VmRSS", "VmHWM"])
    print(f"| memory of the server | {resident:.0f} MB, at most {peak:.0f} MB |")
    server.terminate()
    server.wait()


if __name__ == "__main__":
    main(sys.argv[1:])
