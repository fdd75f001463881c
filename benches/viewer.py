#!/usr/bin/env python3
"""Times of the viewer: viewer.py TETMILL ARGUMENT..., for example

    benches/viewer.py target/release/tetmill generate geometries/crankshaft.geo -n 2 -e 1e9 -f none --view

Runs the command, opens its page in headless Chromium with software WebGL, and prints: seconds from the start to the address,
to the first picture, of a cut and of the last level; the memory of JavaScript and of the server. Needs Playwright.
"""

import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

ARGUMENTS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox", "--enable-precise-memory-info"]
CUT = """() => { const start = performance.now(); tetmillApp.state.cut.on = true; tetmillApp.changed = true; tetmillApp.paint();
  tetmillApp.drawing.gl.finish(); return (performance.now() - start) / 1000; }"""


def said(what, start):
    print(f"{what:32} {time.monotonic() - start:8.2f} s", flush=True)


def wait(page):
    while not page.evaluate("Boolean(window.tetmillApp && tetmillApp.mesh && !tetmillApp.waiting)"):
        time.sleep(0.01)


def shown(page):
    tets, faces = page.evaluate("[tetmillApp.mesh.tetCount, tetmillApp.faces.length]")
    memory = page.evaluate("performance.memory.usedJSHeapSize") / 1e6
    print(f"{'':32} {tets} tets, {faces} faces drawn, {memory:.0f} MB of JavaScript", flush=True)


def main(command):
    start = time.monotonic()
    server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    for line in server.stderr:
        if found := re.search(r"http://\S+", line):
            break
    else:
        sys.exit(f"the command ended with {server.wait()}")
    said("start to address", start)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        start = time.monotonic()
        page.goto(found[0])
        wait(page)
        said("address to first picture", start)
        shown(page)
        print(f"{'cut':32} {page.evaluate(CUT):8.2f} s")
        start = time.monotonic()
        page.evaluate("tetmillApp.load(tetmillApp.levels.length - 1)")
        wait(page)
        said("last level", start)
        shown(page)
        browser.close()
    status = Path(f"/proc/{server.pid}/status").read_text()
    memory = int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1e3
    print(f"{'memory of the server':32} {memory:8.0f} MB")
    server.send_signal(signal.SIGINT)
    server.wait()


if __name__ == "__main__":
    main(sys.argv[1:])
