"""palpate serve from pages in a headless Chromium: its watchers' page, palpate.js, and a block of trials of jsPsych.

Usage: serve_browser_test.py CACHE PALPATE PROTOCOLS CLIENT.py
jsPsych comes from npm's registry, once, into the folder CACHE; without it that test is skipped.
"""

import contextlib
import csv
import functools
import hashlib
import http.server
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import threading
import time
import unittest

sys.dont_write_bytecode = True
CACHE = pathlib.Path(sys.argv.pop(1))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "analysis" / "report"))
import report_chromium  # noqa: E402
from serve_case import PALPATE, PATIENCE, ServeCase  # noqa: E402

SOURCES = pathlib.Path(__file__).resolve().parents[3]
JSPSYCH, JSPSYCH_SHA256 = "jspsych@8.2.1", "39cb6e85375bec08544994b0e9419d809685e4544906b5afd1e914faa6c4ec8b"
OF_THE_MACHINE = ("software WebGL", "GL Driver Message")  # a browser without a graphics card says so
PROTOCOL = {
    "version": 2, "name": "page", "renderers": ["point", "ray"], "seed": 5, "servo": {"rate_hz": 100},
    "home": {"rest_s": 0.1}, "material": {"stiffness_n_per_m": 50},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "blocks": [{"name": "free", "task": "external", "stimuli": ["ball", "box"], "trials": 6}],
}
PAGE = """<!DOCTYPE html><meta charset="utf-8"><link rel="icon" href="data:,"><title>block</title>
<script src="jspsych.js"></script><body></body>
<script type="module">
import {connect} from './palpate.js';
import {palpate_plugin} from './jspsych-palpate.js';
window.run = async (url, token) => {
  const hand = await connect(url, token);
  const jsPsych = initJsPsych();
  const type = palpate_plugin(hand);
  const shown = [['ball', 'ray'], ['box', 'point'], ['ball', 'point'], ['box', 'ray'], ['ball', 'ray'], ['box', 'ray']];
  await jsPsych.run(shown.map(([stimulus, renderer]) =>
      ({type, stimulus, renderer, choices: ['ball', 'box'], keys: ['1', '2'], prompt: '<p>Which was it?</p>'})));
  await hand.close();
  return jsPsych.data.get().values();
};
window.ready = true;
</script>"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@functools.cache
def jspsych():
    """The script of the package, or why there is none."""
    if shutil.which("npm") is None:
        raise unittest.SkipTest("npm is not installed")
    CACHE.mkdir(parents=True, exist_ok=True)
    package = CACHE / "jspsych-8.2.1.tgz"
    if not package.exists():
        done = subprocess.run(["npm", "pack", "--silent", JSPSYCH], cwd=CACHE, capture_output=True, text=True, timeout=PATIENCE)
        if done.returncode != 0:
            raise unittest.SkipTest("npm's registry gives no jsPsych: " + done.stderr[:200])
    if hashlib.sha256(package.read_bytes()).hexdigest() != JSPSYCH_SHA256:
        raise AssertionError(f"{package} is another file")
    with tarfile.open(package) as files:
        return files.extractfile("package/dist/index.browser.min.js").read()


class Pages(ServeCase):
    @classmethod
    def setUpClass(cls):
        cls.browser = report_chromium.Browser(report_chromium.find(), loopback=True)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()

    def pages(self, files):
        """An address of its own on the loopback, with these files and the module."""
        folder = self.dir / f"pages-{len(list(self.dir.iterdir()))}"
        folder.mkdir()
        for name, content in files.items():
            (folder / name).write_bytes(content)
        for name in ("palpate.js", "jspsych-palpate.js"):
            shutil.copy(SOURCES / "runner" / "javascript" / name, folder)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        return f"http://127.0.0.1:{server.server_port}"

    def complaints(self):
        return [one for one in self.browser.complaints() if not any(word in one for word in OF_THE_MACHINE)]

    def until(self, script):
        end = time.monotonic() + PATIENCE
        while not self.browser.run(script):
            self.assertLess(time.monotonic(), end, script)
            time.sleep(0.05)

    def open_block(self, page=PAGE, protocol=PROTOCOL):
        """The server of a page with jsPsych that is ready to run."""
        origin = self.pages({"index.html": page.encode(), "jspsych.js": jspsych()})
        (self.dir / "p.json").write_text(json.dumps(protocol))
        process = self.run_server([PALPATE, "serve", "--device", "simulated", "--protocol", self.dir / "p.json", "--db",
                                   self.dir / "page.db", "--participant", "P01", "--allow-origin", origin])
        self.browser.open_url(origin + "/index.html")
        self.until("window.ready === true")
        return process

    def run_block(self):
        self.browser.run(f"void (window.done = run({json.dumps(self.said['url'])}, {json.dumps(self.said['token'])})"
                         ".then(data => window.data = data, error => window.failed = String(error)))")

    def answer_block(self):
        """Answers by turns with the mouse and with keys; what jsPsych kept."""
        answered = 0
        while not self.browser.run("window.data !== undefined"):
            self.assertIsNone(self.browser.run("window.failed ?? null"))
            wanted = ("ball", "box", "box")[answered % 3]
            if self.browser.run("document.querySelector('[data-choice=\"go on\"]')?.click() ?? null") is not None:
                continue
            if answered % 2 and self.browser.run("document.querySelector('[data-choice]') !== null"):
                key = {"ball": "1", "box": "2"}[wanted]
                for kind in ("keyDown", "keyUp"):
                    self.browser.call("Input.dispatchKeyEvent", type=kind, key=key, text=key if kind == "keyDown" else "")
                answered += 1
            elif self.browser.run(f"(b => b ? (b.click(), true) : false)(document.querySelector('[data-choice={wanted}]'))"):
                answered += 1
            time.sleep(0.05)
        return self.browser.run("window.data")

    def test_a_block_of_jspsych(self):
        process = self.open_block()
        self.run_block()
        data = self.answer_block()
        self.assertEqual(process.wait(PATIENCE), 0)
        self.assertEqual(self.complaints(), [])
        out = self.dir / "rows.csv"
        subprocess.run([PALPATE, "export", "--db", self.dir / "page.db", "--format", "csv", "--out", out], check=True,
                       capture_output=True)
        with open(out, newline="", encoding="utf-8") as table:
            rows = list(csv.DictReader(table))
        self.assertEqual(len(rows), 6)
        self.assertEqual([(str(one["trial"]), one["stimulus"], one["renderer"], one["response"], str(int(one["correct"]))) for one in data],
                         [(row["trial"], row["shape"], row["renderer"], row["response"], row["correct"]) for row in rows])
        for one, row in zip(data, rows):
            self.assertAlmostEqual(one["response_time_s"], float(row["response_time"]), places=9)
            self.assertAlmostEqual(one["rt"], 1000 * float(row["response_time"]), places=5)
            self.assertEqual(one["trial_type"], "palpate")
            # The answer's time by both clocks, as on record.
            self.assertAlmostEqual((one["t_ns"] - one["zero_t_ns"]) * 1e-9, float(row["response_time"]), places=8)
            self.assertIn(one["stamped"], ("client", "arrival"))
            of_page = 1e6 * (one["at_ms"] + one["clock_offset_ms"])
            if one["stamped"] == "client":
                self.assertLess(abs(one["t_ns"] - of_page), 2)
            else:
                self.assertGreater(one["t_ns"], of_page - 1e6 * one["clock_within_ms"])
        self.assertEqual({one["response"] for one in data}, {"ball", "box"})

    def test_trials_whose_time_is_over_are_data_too(self):
        block = {**PROTOCOL["blocks"][0], "time_out_s": 0.3}
        process = self.open_block(protocol={**PROTOCOL, "blocks": [block]})
        self.run_block()
        self.until("document.querySelector('[data-choice=\"go on\"]')?.click(), window.failed || window.data !== undefined")
        self.assertIsNone(self.browser.run("window.failed ?? null"))
        self.assertEqual([(one["trial"], one["timed_out"], one["response"], one["rt"]) for one in self.browser.run("window.data")],
                         [(trial, True, None, None) for trial in range(1, 7)])
        self.assertEqual(process.wait(PATIENCE), 0)

    def test_a_block_is_simulated(self):
        process = self.open_block(PAGE.replace("jsPsych.run(", "jsPsych.simulate(").replace("})));", "})), window.mode);", 1))
        self.browser.run("window.mode = 'data-only'")
        self.run_block()
        self.until("window.failed || window.data !== undefined")
        self.assertIsNone(self.browser.run("window.failed ?? null"))
        self.assertEqual({one["response"] for one in self.browser.run("window.data")} - {"ball", "box"}, set())
        self.browser.run("window.data = undefined, window.mode = 'visual'")
        self.run_block()
        self.until("document.querySelector('[data-choice=\"go on\"]')?.click(), window.failed || window.data !== undefined")
        self.assertIsNone(self.browser.run("window.failed ?? null"))
        self.assertEqual([one["trial"] for one in self.browser.run("window.data")], list(range(1, 7)))
        self.assertEqual(process.wait(PATIENCE), 0)

    def test_a_block_ends_with_the_server(self):
        process = self.open_block()
        self.browser.run(f"""void (async () => {{
          const {{connect}} = await import('./palpate.js');
          const eye = await connect({json.dumps(self.said["url"])}, {json.dumps(self.said["token"])}, {{role: 'watch'}});
          window.late = eye.wait_for('never').catch(error => error.code).then(code => window.late = code);
          run({json.dumps(self.said["url"])}, {json.dumps(self.said["token"])}).catch(error => window.failed = error.code);
        }})()""")
        self.until("document.querySelector('[data-choice=ball]') !== null")
        process.kill()
        self.until("window.failed === 'closed' && window.late === 'closed'")
        self.assertIn("the server has gone. Forces are off.", self.browser.run("document.body.textContent"))

    def test_the_block_of_the_readme(self):
        readme = (SOURCES / "runner" / "README.md").read_text(encoding="utf-8")
        block, = re.findall(r"```js\n(import .*?)```", readme, re.DOTALL)
        imports, _, rest = block.partition("\n\n")
        page = PAGE[:PAGE.index("import ")] + imports + """
window.run = async (url, token) => {
  const jsPsych = initJsPsych();
""" + rest + """
  await hand.close();
  return jsPsych.data.get().values();
};
window.ready = true;
</script>"""
        free = {"name": "free", "task": "external", "stimuli": ["ball", "box"], "trials": 1, "answers": ["yes", "no"]}
        process = self.open_block(page, {**PROTOCOL, "blocks": [free]})
        self.run_block()
        self.until("""window.failed || window.data ||
            (document.querySelector('[data-choice="go on"]') ?? document.querySelector('[data-choice=yes]'))?.click(), window.data""")
        self.assertIsNone(self.browser.run("window.failed ?? null"))
        self.assertEqual([(one["stimulus"], one["response"]) for one in self.browser.run("window.data")], [("ball", "yes")])
        self.assertEqual(process.wait(PATIENCE), 0)

    def run_pairs(self, timed):
        """A block of two pairs, of which the second interval is always the answer; what jsPsych kept."""
        pairs = {"name": "pairs", "task": "external", "stimuli": ["ball"], "trials": 2, "intervals": 2, "inter_interval_s": 0.1,
                 **({"interval_limit_s": 0.3} if timed else {})}
        shown = PAGE[PAGE.index("  const shown"):PAGE.index("  await hand.close()")]
        page = PAGE.replace(shown, """
  const pair = [{stimulus: 'ball', renderer: 'ray', standard: true}, {stimulus: 'ball', renderer: 'ray'}];
  const trial = {type, intervals: pair, choices: ['1', '2'], timed_intervals: TIMED};
  await jsPsych.run([trial, trial]);
""".replace("TIMED", json.dumps(timed)))
        process = self.open_block(page, {**PROTOCOL, "blocks": [pairs]})
        self.run_block()
        self.until("""window.failed || window.data || (document.querySelector('[data-choice="go on"]') ??
            document.querySelector('[data-choice=Next]') ?? document.querySelector('[data-choice="2"]'))?.click(), window.data""")
        self.assertIsNone(self.browser.run("window.failed ?? null"))
        self.assertEqual(process.wait(PATIENCE), 0)
        return self.browser.run("window.data")

    def test_pairs_are_trials_of_two_intervals(self):
        for timed in (False, True):
            with self.subTest(timed=timed):
                self.assertEqual([(one["response"], one["correct"]) for one in self.run_pairs(timed)], [("2", True)] * 2)
                (self.dir / "page.db").unlink()

    def test_foreign_pages_cannot_connect(self):
        mine, other = self.pages({"index.html": PAGE.encode()}), self.pages({"index.html": PAGE.encode()})
        self.serve("--allow-origin", mine)
        for origin, token, said in ((mine, self.said["token"], "connected"), (mine, "0" * 32, "bad-token"),
                                    (other, self.said["token"], "closed")):
            self.browser.open_url(origin + "/palpate.js")
            got = self.browser.run(f"import('./palpate.js').then(m => m.connect({json.dumps(self.said['url'])}, {json.dumps(token)}))"
                                   ".then(async hand => (await hand.close(), 'connected'), error => error.code)")
            self.assertEqual(got, said)

    def in_module(self, script):
        """What a script of a page returns that has a connection of the module, hand."""
        origin = self.pages({"index.html": b"<!DOCTYPE html><title>module</title>"})
        self.serve("--allow-origin", origin)
        self.browser.open_url(origin + "/index.html")
        return self.browser.run(f"""(async () => {{
          const {{connect}} = await import('./palpate.js');
          const hand = await connect({json.dumps(self.said["url"])}, {json.dumps(self.said["token"])});
          {script}
        }})()""")

    def test_the_module_streams_samples(self):
        got = self.in_module("""
          const rows = [];
          hand.addEventListener('samples', event => rows.push(...event.detail));
          await hand.subscribe(50, ['tip', 'depth']);
          const refused = await hand.start({renderer: 'line'}).catch(error => [error.code, error.place]);
          await hand.start();
          await new Promise(r => setTimeout(r, 700));  // longer than silence may last
          const stopped = await hand.stop();
          return {rows, refused, stopped};""")
        self.assertEqual(got["refused"], ["bad-message", "/renderer"])
        self.assertGreater(len(got["rows"]), 10)
        self.assertEqual(sorted(got["rows"][0]), ["depth", "t_ns", "tick", "tip"])
        self.assertEqual(len(got["rows"][0]["tip"]), 3)
        self.assertGreater(got["stopped"]["ticks"], 0)

    def test_the_module_measures_clocks(self):
        got = self.in_module("""
          const unknown = (() => { try { return hand.server_ns(); } catch (error) { return error.message; } })();
          const clock = await hand.clock();
          const again = await hand.clock(1);
          window.hand = hand;
          while (!(await hand.ask('clock')).known) await hand.clock();  // a busy machine answers late
          await hand.start();
          const at_ms = performance.now();
          await new Promise(r => setTimeout(r, 30));
          const said = await hand.answer('ball', {at_ms});
          const apart_ms = Math.abs(said.t_ns / 1e6 - at_ms - hand.best_clock.offset_ms);
          const early = await hand.start().then(() => hand.answer('ball', {at_ms: 1})).catch(error => error.place);
          await hand.stop();
          return {clock, again, unknown, there_and_back: hand.page_ms(hand.server_ns(1234.5)), stamped: said.stamped,
                  apart_ms, early};""")
        self.assertLess(got["clock"]["round_trip_ms"], 1000)
        self.assertIn("ask clock() first", got["unknown"])
        self.assertEqual((got["stamped"], got["early"]), ("client", "/t_ns"))
        self.assertLess(got["apart_ms"], 1e-3)
        self.assertAlmostEqual(got["there_and_back"], 1234.5, places=5)
        self.assertLess(got["again"]["within_ms"], got["clock"]["within_ms"] + 0.1)  # one slow question does not spoil it
        self.assertEqual(got["clock"]["within_ms"], got["clock"]["round_trip_ms"] / 2)
        before = time.monotonic_ns()
        page, kept = self.browser.run("[window.hand.server_ns(), window.hand.best_clock.within_ms]")
        after = time.monotonic_ns()
        self.assertGreater(page, before - 1e6 * kept - 200_000)  # a page's clock has steps of 0.1 ms
        self.assertLess(page, after + 1e6 * kept + 200_000)

    def test_the_watchers_page(self):
        self.serve()
        self.browser.window(1200, 800)
        self.browser.open_url(self.said["page"])
        self.until("document.getElementById('state').textContent === 'forces off'")
        self.assertEqual(self.browser.run("location.hash"), "")
        self.until("window.live.objects().length === 1")
        with self.client() as hand:
            self.touch(hand)
            self.until("window.live.newest() !== null && Math.hypot(...window.live.newest().force) > 0.05")
            tip = self.browser.run("window.live.newest().tip")
            self.assertLess(max(map(abs, tip)), 0.2)
            self.until("[...document.querySelectorAll('#events li')].some(e => e.textContent.includes('first contact'))")
            hand.note("<script>alert(1)</script>")
            self.until("document.getElementById('events').textContent.includes('<script>')")
            self.assertEqual(self.complaints(), [])
            sockets = [url for url in self.browser.requests() if not url.startswith("ws://127.0.0.1")]
            self.assertEqual(sockets, [])
            picture = CACHE / "live.png"
            with contextlib.suppress(OSError):
                CACHE.mkdir(parents=True, exist_ok=True)
                picture.write_bytes(self.browser.screenshot())
            self.browser.run("document.getElementById('off').click()")
            off = hand.wait_for("forces_off", PATIENCE)
            self.assertEqual(off["code"], "emergency")
            self.until("document.getElementById('state').className === 'off'")
            hand.stop()
            self.refused("emergency", hand.clear)
            self.browser.run("document.getElementById('allow').click()")
            hand.wait_for("cleared", PATIENCE)
            self.until("document.getElementById('allow').hidden")
        self.browser.open_url(self.said["page"].split("#")[0])
        self.until("document.getElementById('state').textContent.includes('no token')")


if __name__ == "__main__":
    if report_chromium.find() is None:
        print("skipped: there is no Chromium")
        sys.exit(77)
    unittest.main()
