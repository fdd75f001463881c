#!/usr/bin/env python3
"""Makes pictures of the viewer for the guide: viewer-pictures.py TETMILL FOLDER.

Seven views in headless Chromium with software WebGL, so they are the same on every machine with the same fonts. Needs Playwright
and Pillow, which reduces the colours: each picture has less than 200 kB. To be looked at before they replace those of the guide.
"""

import io
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[1]
ARGUMENTS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
MOST = 200_000
LOADED = "window.tetmillApp && tetmillApp.mesh && !tetmillApp.waiting && (!tetmillApp.index || tetmillApp.level >= tetmillApp.index.start)"

# Name, arguments of the program (without a server: a page is written), what is done in the page, size.
GENERATE = ["generate", "-f", "none", "-q", "--view"]
VIEWS = [
    ("viewer", ["view", "-q", "geometries/tee.geo", "-n", "4"], "app.state.color = 'angle'; cut([0, -1, 0], 0); look(-62, 24, 0.86)", (1000, 640)),
    ("viewer-parts", ["view", "-q", "geometries/crankshaft.geo", "-n", "4"], "app.state.explode = 0.5; app.state.shared = true; look(-55, 28, 1.15)", (1000, 640)),
    ("viewer-cut", [*GENERATE, "geometries/tee.geo", "-n", "4", "-e", "1e8"], "cut([0, -1, 0], 0); app.state.color = 'angle'; look(-62, 35, 0.13, [1.5, 0, -0.35])", (1000, 760)),
    ("viewer-box", [*GENERATE, "geometries/tee.geo", "-n", "4", "-e", "6e4"], "box([-1.02, -0.1, -1.02], [0.4, 1.02, 0.6]); look(-55, 28, 0.78)", (1000, 640)),
    ("viewer-ghosts", ["view", "-q", "geometries/tee.geo", "-n", "4"], "showGhosts(app, 1); look(-60, 25, 0.6)", (1000, 640)),
    ("viewer-curved", [*GENERATE, "geometries/tee.geo", "--order", "2"], "app.state.color = 'body'; look(-35, 30, 0.4)", (1000, 640)),
    ("viewer-report", ["generate", "geometries/tee.geo", "-n", "4", "--levels", "1", "-f", "none", "-q", "--report-html"], "document.getElementById('report').showModal()", (1000, 820)),
]
PRELUDE = """const app = tetmillApp;
const cut = (normal, at) => Object.assign(app.state.cut, { on: true, normal, at });
const box = (...corners) => Object.assign(app.state.cut, { on: true, shape: "box", box: corners });
const look = (azimuth, elevation, zoom, focus = [0, 0, 0]) => Object.assign(app.state, { turn: looking(azimuth, elevation), zoom: zoom * app.mesh.radius, focus });
// A plain background takes fewer bytes.
if (!app.state.dark) for (const end of ["a", "b"]) document.documentElement.style.setProperty(`--stage-${end}`, "#ffffff");"""


def until(page, condition, seconds=120):
    deadline = time.monotonic() + seconds
    while not page.evaluate(f"Boolean({condition})"):
        if time.monotonic() > deadline:
            raise TimeoutError(condition)
        time.sleep(0.05)


def reduced(picture):
    """A PNG below the largest size: with fewer colours if that is needed."""
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    for colors in [None, 256, 192, 128]:
        made, fewer = io.BytesIO(), image
        if colors:
            # Not the colours of the largest areas only: legends keep theirs.
            fewer = image.quantize(colors, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        fewer.save(made, "PNG", optimize=True)
        if made.tell() < MOST:
            return made.getvalue()
    raise ValueError("no picture below the largest size")


def shot(browser, address, act, size):
    page = browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme="light")
    page.on("pageerror", lambda error: sys.exit(f"the page failed: {error}"))
    page.goto(address)
    until(page, LOADED)
    page.evaluate(f"() => {{ {PRELUDE} {act}; app.rebuild(); }}")
    time.sleep(1)
    until(page, "!tetmillApp.waiting && !tetmillApp.fetching")
    time.sleep(0.5)
    until(page, "!tetmillApp.waiting && !tetmillApp.fetching")
    picture = page.screenshot()
    page.close()
    return picture


def main(program, folder):
    with sync_playwright() as driver, tempfile.TemporaryDirectory() as scratch:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        for name, arguments, act, size in VIEWS:
            server = None
            if arguments[-1] == "--report-html":
                file = Path(scratch) / f"{name}.html"
                subprocess.run([program, *arguments, file], check=True, cwd=ROOT)
                address = file.as_uri()
            else:
                server = subprocess.Popen([program, *arguments], stderr=subprocess.PIPE, text=True, cwd=ROOT)
                address = next(found[0] for line in server.stderr if (found := re.search(r"http://\S+", line)))
            picture = reduced(shot(browser, address, act, size))
            (Path(folder) / f"{name}.png").write_bytes(picture)
            print(f"{name}.png: {len(picture) // 1000} kB")
            if server:
                server.send_signal(signal.SIGINT)
                server.wait()
        browser.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
