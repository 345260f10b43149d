"""The page of palpate watch in a headless Chromium, from a file. Usage: watch_browser_test.py PALPATE"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "analysis" / "report"))
import report_chromium  # noqa: E402
import watch_page  # noqa: E402

PALPATE = sys.argv.pop(1)
PROTOCOL = {"version": 1, "name": "short", "title": "</script><script>alert(1)</script>", "renderers": ["point", "ray"],
            "samples": True, "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": 0.03, "subdivisions": 3},
                                         {"name": "cube", "shape": "cube", "edge_m": 0.05}],
            "repetitions": 1, "response": {"keys": {"1": "sphere", "2": "cube"}, "time_out_s": 5}, "seed": 7}
READY = "new Promise(r => { const f = () => window.trial?.shows ? r() : setTimeout(f, 10); f(); })"
SETTLED = "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"
# Messages of a browser without a graphics card.
OF_THE_MACHINE = ("software WebGL", "GL Driver Message")


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.dir = pathlib.Path(cls.folder.name)
        (cls.dir / "p.json").write_text(json.dumps(PROTOCOL))
        cls.run_palpate("simulate", cls.dir / "p.json", "--db", cls.dir / "s.db", "--participants", 1, "--seed", 3)
        cls.page = cls.dir / "trial.html"
        cls.run_palpate("watch", "--db", cls.dir / "s.db", "--trial", "S001/1/2", "--trial", "S001/1/4", "--out", cls.page)
        cls.document = watch_page.read(cls.page.read_text())
        cls.browser = report_chromium.Browser(report_chromium.find())

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.folder.cleanup()

    @staticmethod
    def run_palpate(*args):
        done = subprocess.run([PALPATE, *map(str, args)], capture_output=True, text=True, timeout=600)
        if done.returncode != 0:
            raise AssertionError(done.stderr)

    def open(self, width=1200, dark=False):
        self.browser.window(width, 900, dark)
        self.browser.open(self.page)
        self.browser.run(READY)
        self.assert_quiet()

    def assert_quiet(self):
        said = [one for one in self.browser.complaints() if not any(word in one for word in OF_THE_MACHINE)]
        self.assertEqual(said, [])
        self.assertEqual(self.browser.requests(), [])
        self.assertNotIn("Page.javascriptDialogOpening", [name for name, _ in self.browser.events])

    def press(self, key, code=0, **more):
        for kind in ("keyDown", "keyUp"):
            self.browser.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code, **more)
        self.browser.run(SETTLED)

    def at(self):
        return self.browser.run("trial.at()")

    def a_tick_seen(self):
        """Of the cube by the ray: a tick whose force is large and points to the viewer."""
        c = self.document["shows"][1]["columns"]
        into = (-math.sin(-0.5) * math.cos(0.42), math.cos(-0.5) * math.cos(0.42), -math.sin(0.42))
        force = list(zip(c["force_x"], c["force_y"], c["force_z"]))
        return max(range(len(force)), key=lambda i: -dot(force[i], into) if c["contacts"][i] else 0)

    def test_the_script_decodes_the_pages_numbers(self):
        self.open()
        for number, show in enumerate(self.document["shows"]):
            for name, values in show["columns"].items():
                found = self.browser.run(f"Array.from(trial.shows[{number}].c.{name})")
                self.assertEqual(found, values, name)

    def test_the_texts_describe_the_tick(self):
        self.open()
        i = self.a_tick_seen()
        self.browser.run(f"trial.seek(trial.shows[1].time[{i}])")
        c = self.document["shows"][1]["columns"]
        shown = self.browser.run("[...document.querySelectorAll('section:nth-of-type(2) dd')].filter(d => !d.hidden)"
                                 ".map(d => d.textContent)")
        force = [c[f"force_{axis}"][i] for axis in "xyz"]
        self.assertEqual(shown[0], f"{c['t'][i]:.3f} s, tick {i}")
        self.assertTrue(shown[1].startswith(f"{math.hypot(*force):.3f} N ("), shown)
        self.assertEqual(shown[3], f"{1000 * c['depth'][i]:.3f} mm")
        self.assertTrue(shown[4].startswith(self.document["types"][int(c["type"][i])] + ", "), shown)

    def test_pixels_agree_with_the_geometry(self):
        self.open()
        i = self.a_tick_seen()
        self.browser.run(f"trial.seek(trial.shows[1].time[{i}])")
        width, height = self.browser.run("(() => { const c = document.querySelectorAll('canvas')[1]; return [c.width, c.height]; })()")

        def pixel(x, y):  # of the canvas, from -1 to 1
            return self.browser.run(
                "(() => { const g = document.querySelectorAll('canvas')[1].getContext('webgl'), p = new Uint8Array(4); "
                f"g.readPixels({round((x + 1) / 2 * (width - 1))}, {round((y + 1) / 2 * (height - 1))}, 1, 1, g.RGBA, "
                "g.UNSIGNED_BYTE, p); return [...p]; })()")

        c = self.document["shows"][1]["columns"]
        yaw, pitch = -0.5, 0.42
        right = (math.cos(yaw), math.sin(yaw), 0)
        up = (math.sin(yaw) * -math.sin(pitch), math.cos(yaw) * math.sin(pitch), math.cos(pitch))
        # Both objects are centred at the origin; the cube's corners are the farthest points.
        radius = math.sqrt(3) * 0.025
        scale = 1 / (1.7 * radius)
        strongest = max(math.hypot(*f) for s in self.document["shows"]
                        for f in zip(s["columns"]["force_x"], s["columns"]["force_y"], s["columns"]["force_z"]))
        contact = [c[f"tip_{a}"][i] + c[f"lag_tip_{a}"][i] + c[f"contact_{a}"][i] for a in "xyz"]
        middle = [p + 0.45 * 0.9 * radius / strongest * c[f"force_{a}"][i] for p, a in zip(contact, "xyz")]
        red, green, blue, _ = pixel(scale * dot(middle, right) * height / width, scale * dot(middle, up))
        self.assertGreater(red, 1.8 * blue, "the arrow")
        self.assertEqual(pixel(-0.98, -0.98)[:3], [255, 255, 255])
        # The tool in free space does not hide the other object: its middle is blue.
        red, green, blue, _ = self.browser.run(
            "(() => { const c = document.querySelectorAll('canvas')[0], g = c.getContext('webgl'), p = new Uint8Array(4); "
            "trial.seek(0); g.readPixels(c.width >> 1, c.height >> 1, 1, 1, g.RGBA, g.UNSIGNED_BYTE, p); return [...p]; })()")
        self.assertGreater(blue, red + 15)

    def test_without_webgl_there_are_three_views(self):
        hook = self.browser.call("Page.addScriptToEvaluateOnNewDocument",
                                 source="HTMLCanvasElement.prototype.getContext = () => null;")["identifier"]
        try:
            self.open()
        finally:
            self.browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=hook)
        i = self.a_tick_seen()
        self.browser.run(f"trial.seek(trial.shows[1].time[{i}])")
        self.assertEqual(self.browser.run("[...document.querySelectorAll('canvas')].map(c => c.hidden)"), [True, True])
        self.assertTrue(self.browser.run("document.getElementById('solid').disabled"))
        views = self.browser.run(
            "[...document.querySelectorAll('section:nth-of-type(2) .picture g')].map(g => [...'object crease virtual ideal force'"
            ".split(' ')].length && Object.fromEntries([...g.children].map(e => [e.getAttribute('class'), "
            "e.getAttribute('d') ?? [+e.getAttribute('cx'), +e.getAttribute('cy')]])))")
        self.assertEqual(len(views), 3)
        c = self.document["shows"][1]["columns"]
        contact = [c[f"tip_{a}"][i] + c[f"lag_tip_{a}"][i] + c[f"contact_{a}"][i] for a in "xyz"]
        scale = 45 / (math.sqrt(3) * 0.025)
        for view, (x, y, across, up) in zip(views, [(100, 75, 0, 1), (100, 225, 0, 2), (300, 225, 1, 2)]):
            self.assertAlmostEqual(view["contact"][0], x + scale * contact[across], delta=0.06)
            self.assertAlmostEqual(view["contact"][1], y - scale * contact[up], delta=0.06)
            self.assertEqual(view["crease"].count("M"), 9, "of a cube at a slant 9 edges are seen")
            self.assertGreater(len(view["ideal"]), 8)
        self.assertTrue(any(view["force"] for view in views))

    def test_keys_and_buttons(self):
        self.open()
        self.press("Home", 36)
        self.assertEqual(self.at(), 0)
        self.press("ArrowRight", 39)
        self.assertAlmostEqual(self.at(), 0.01, places=9)
        self.press(".", 190)
        self.assertAlmostEqual(self.at(), 0.011, places=9)
        self.press(",", 188)
        self.press("ArrowLeft", 37)
        self.assertAlmostEqual(self.at(), 0, places=9)
        self.press("End", 35)
        self.assertAlmostEqual(self.at(), self.document["shows"][0]["columns"]["t"][-1], places=9)
        for key, speed in (("[", "0.5"), ("[", "0.2"), ("]", "0.5"), ("]", "1"), ("]", "2"), ("]", "4"), ("]", "4")):
            self.press(key)
            self.assertEqual(self.browser.run("document.getElementById('speed').value"), speed)
        self.press("v", 86)
        self.assertEqual(self.browser.run("document.getElementById('views').getAttribute('aria-pressed')"), "true")
        self.press("v", 86)
        # It plays to the end and then stops.
        self.browser.run("trial.seek(trial.shows[0].time.at(-1) - 0.2)")
        self.press(" ", 32)
        self.browser.run("new Promise(r => { const f = () => document.getElementById('play').textContent === 'Play' ? r() : "
                         "setTimeout(f, 20); f(); })")
        self.assertAlmostEqual(self.at(), self.document["shows"][0]["columns"]["t"][-1], places=9)
        reached = set()
        self.browser.run("document.activeElement.blur()")
        for _ in range(8):
            self.press("Tab", 9)
            reached.add(self.browser.run("document.activeElement.id || document.activeElement.tagName"))
        self.assertLessEqual({"play", "time", "speed", "solid", "views", "CANVAS"}, reached)
        self.assert_quiet()

    def test_a_finger_turns_the_object_and_moves_in_time(self):
        self.open(width=390)
        self.assertLessEqual(self.browser.run("document.documentElement.scrollWidth"), 390)
        before, x, y = self.browser.run(
            "(() => { const c = document.querySelector('canvas'); c.scrollIntoView({block: 'center'}); "
            "const b = c.getBoundingClientRect(); return [c.toDataURL(), b.x + b.width / 2, b.y + b.height / 2]; })()")
        self.browser.call("Emulation.setTouchEmulationEnabled", enabled=True)
        try:
            self.browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
            for step in range(1, 6):
                self.browser.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=[{"x": x + 12 * step, "y": y}])
            self.browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
            self.browser.run(SETTLED)
            self.assertNotEqual(self.browser.run("document.querySelector('canvas').toDataURL()"), before)
            x, y, left = self.browser.run(
                "(() => { const p = document.querySelector('.plot'); p.scrollIntoView({block: 'center'}); "
                "const b = p.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2, b.width]; })()")
            self.browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
            self.browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
            self.browser.run(SETTLED)
            last = self.document["shows"][0]["columns"]["t"][-1]
            self.assertAlmostEqual(self.at(), last * (left / 2 - 44) / (left - 52), delta=0.01)
        finally:
            self.browser.call("Emulation.setTouchEmulationEnabled", enabled=False)

    def test_dark_light_and_paper(self):
        backs = []
        for dark in (False, True):
            self.open(dark=dark)
            backs.append(self.browser.run(
                "(() => { const c = document.querySelector('canvas'), g = c.getContext('webgl'), p = new Uint8Array(4); "
                "g.readPixels(1, 1, 1, 1, g.RGBA, g.UNSIGNED_BYTE, p); return p[0]; })()"))
        self.assertEqual(backs[0], 255)
        self.assertLess(backs[1], 60)
        # Paper is white, whatever the screen's theme.
        self.browser.run("window.dispatchEvent(new Event('beforeprint'))")
        self.assertEqual(self.browser.run(
            "(() => { const c = document.querySelector('canvas'), g = c.getContext('webgl'), p = new Uint8Array(4); "
            "g.readPixels(1, 1, 1, 1, g.RGBA, g.UNSIGNED_BYTE, p); return p[0]; })()"), 255)
        self.assertGreater(len(self.browser.pdf()), 20_000)

    def test_nothing_foreign_runs_and_nothing_is_fetched(self):
        self.open()
        self.assertTrue(self.browser.run(
            "(() => { const s = document.createElement('script'); s.textContent = 'window.ran = 1';"
            "document.body.append(s); return window.ran === undefined; })()"))
        self.assertEqual(self.browser.run("fetch('http://127.0.0.1:9/').then(() => 'got', () => 'refused')"), "refused")
        self.assertIn("Content Security Policy", " ".join(self.browser.complaints()))


if report_chromium.find() is None:
    print("no Chromium")
    sys.exit(77)
unittest.main()
