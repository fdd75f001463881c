"""What the tests of the viewer share: headless Chromium with software WebGL, and a geometry.

Needs Playwright and Chromium. TETMILL is the program to be tested.
"""

import base64
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[2]
TETMILL = os.environ["TETMILL"]
# SwiftShader draws on the processor: the same picture on every machine.
ARGUMENTS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]

CUBE = """algebraic3d
solid cube = orthobrick (0, 0, 0; 1, 1, 1) -bcname=outer -maxh=0.3;
solid ball = sphere (0.5, 0.5, 0.5; 0.25) -bcname=inner;
solid core = ball -maxh=0.3;
solid rest = cube and not ball;
tlo core;
tlo rest;
"""
HOSTILE = "</script><script>window.hacked=1</script><img src=x onerror=window.hacked=1>"


def run(*arguments):
    return subprocess.run([TETMILL, *map(str, arguments)], check=True, capture_output=True, text=True, cwd=ROOT)


def until(page, condition):
    """Waits for a condition in a page. Playwright's own waiting needs `eval`, which the page forbids."""
    deadline = time.monotonic() + 20
    while not page.evaluate(f"Boolean({condition})"):
        if time.monotonic() > deadline:
            raise TimeoutError(condition)
        page.wait_for_timeout(20)


def message_of(page_text):
    """The head of the message in a page."""
    text = re.search(r'id="data">([^<]*)</script>', page_text)[1]
    data = base64.b64decode(text)
    (length,) = struct.unpack_from("<I", data)
    return json.loads(data[4 : 4 + length])


class Browser(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp())
        cls.geo = cls.folder / "cube.geo"
        cls.geo.write_text(CUBE)
        cls.file = cls.folder / "cube.html"
        run("view", cls.geo, "-n", 3, "-q", "-o", cls.file)
        cls.driver = sync_playwright().start()
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        cls.browser = cls.driver.chromium.launch(executable_path=chromium, args=ARGUMENTS)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.driver.stop()
        shutil.rmtree(cls.folder)

    def open(self, address, offline=False, size=(1000, 700)):
        """A page with its mesh drawn; any message on the console is a failure at the end of the test."""
        context = self.browser.new_context(offline=offline, viewport={"width": size[0], "height": size[1]}, color_scheme="light")
        self.addCleanup(context.close)
        page = context.new_page()
        said = []
        page.on("console", lambda line: said.append(line.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: self.asked.append(request.url))
        self.asked = []
        self.addCleanup(lambda: self.assertEqual(said, []))
        page.goto(address)
        until(page, "window.tetmillApp && tetmillApp.mesh && !tetmillApp.waiting")
        return page

    def drawn(self, page):
        """A fingerprint of the canvas, and how many of its pixels are drawn."""
        until(page, "!tetmillApp.waiting")
        return page.evaluate(
            """() => { const { gl, canvas } = tetmillApp.drawing, n = canvas.width * canvas.height;
            const pixels = new Uint8Array(4 * n); let drawn = 0, hash = 0;
            gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
            for (let k = 0; k < pixels.length; k += 4) { if (pixels[k + 3]) drawn++;
              hash = (Math.imul(hash, 31) + pixels[k] + 3 * pixels[k + 1] + 7 * pixels[k + 2] + 11 * pixels[k + 3]) | 0; }
            return { drawn, hash }; }"""
        )

    def open_served(self, address, **options):
        """A served page with the level that it loads after the coarsest one."""
        page = self.open(address, **options)
        until(page, "tetmillApp.level >= tetmillApp.index.start && !tetmillApp.waiting")
        return page

    def differs(self, page, act):
        before = self.drawn(page)
        act()
        after = self.drawn(page)
        self.assertNotEqual(before["hash"], after["hash"])
        return before["drawn"], after["drawn"]

    def serve(self, *arguments, launcher=(), env=None, ignored=()):
        # Background jobs ignore Ctrl-C, and jobs under nohup hang-ups: a server would inherit that.
        def interruptible():
            for which in (signal.SIGINT, signal.SIGHUP):
                signal.signal(which, signal.SIG_IGN if which in ignored else signal.SIG_DFL)

        server = subprocess.Popen([*launcher, TETMILL, *map(str, arguments)], env=env, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, cwd=ROOT,
                                  preexec_fn=interruptible)
        self.addCleanup(server.stderr.close)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        for line in server.stderr:
            if found := re.search(r"http://\S+", line):
                return server, found[0]
        self.fail("no address")
