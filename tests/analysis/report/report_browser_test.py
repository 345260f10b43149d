"""The report in a headless Chromium. Usage: report_browser_test.py PALPATE QUICK_PROTOCOL FIXTURES"""

import csv
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree as xml

import report_chromium

PALPATE, QUICK, FIXTURES = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
SVG = "{http://www.w3.org/2000/svg}"
TITLE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"
FIGURES = ["figure15", "speedup", "times", "confusion", "speed-accuracy", "learning", "order", "exclusions"]
# The visible one of the two drawings of a figure, for wide and narrow screens.
DRAWN = "[...document.querySelectorAll('.drawing svg')].filter(s => s.getClientRects().length)"


def texts(svg):
    return sorted(e.text for e in svg.iter() if e.text and e.text.strip() and e.tag != SVG + "style")


class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.dir = pathlib.Path(cls.folder.name)
        protocol = json.loads(QUICK.read_text("utf-8"))
        protocol.pop("$schema", None)
        protocol["title"] = TITLE
        (cls.dir / "protocol.json").write_text(json.dumps(protocol))
        cls.run_palpate("simulate", cls.dir / "protocol.json", "--db", cls.dir / "study.db", "--participants", 4)
        cls.page = cls.dir / "report.html"
        cls.run_palpate("analyze", "--db", cls.dir / "study.db", "--report", cls.page, "--figures", cls.dir / "figures")
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

    def open(self, path=None, width=1200, dark=False):
        self.browser.window(width, 900, dark)
        self.browser.open(path or self.page)
        self.assertEqual(self.browser.complaints(), [])
        self.assertEqual(self.browser.requests(), [])
        self.assertNotIn("Page.javascriptDialogOpening", [name for name, _ in self.browser.events])

    def press(self, key, code, **more):
        for kind in ("keyDown", "keyUp"):
            self.browser.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code,
                              **(more if kind == "keyDown" else {}))

    def shown(self):
        """Of each visible figure: section, width, height, number of elements."""
        return self.browser.run(DRAWN + ".map(s => { const b = s.getBoundingClientRect(); return "
                                "[s.closest('section').id, b.width, b.height, "
                                "s.querySelectorAll('path, line, circle, rect, polygon, text').length]; })")

    def test_every_figure_is_drawn_without_a_complaint_or_a_request(self):
        self.open()
        shown = self.shown()
        self.assertEqual([figure[0] for figure in shown], FIGURES)
        for name, width, height, things in shown:
            self.assertGreater(width, 300, name)
            self.assertGreater(height, 150, name)
            self.assertGreater(things, 20, name)

    def test_every_fixture_is_drawn(self):
        for csv in sorted(FIXTURES.glob("*.csv")):
            with self.subTest(csv=csv.name):
                self.run_palpate("analyze", "--csv", csv, "--report", self.dir / "other.html", "--force")
                self.open(self.dir / "other.html")
                self.assertTrue(all(figure[1] > 200 and figure[3] > 10 for figure in self.shown()), self.shown())

    def test_texts_from_files_are_text(self):
        self.open()
        self.assertEqual(self.browser.run("document.querySelector('.study').textContent"), TITLE)
        self.assertEqual(self.browser.run("document.querySelectorAll('img').length"), 0)
        csv = self.dir / "hostile.csv"
        shape, who = "<b>x</b></script>", "</script><script>alert(3)</script>"
        rows = [f"{p},1,1,{i},{r},{s},{s},1,{2 + 0.3 * i + 0.2 * len(r)}\n" for p in (who, "B", "C")
                for i, (r, s) in enumerate([(r, s) for r in ("point", "ray") for s in (shape, "cube")] * 3, 1)]
        csv.write_text("participant_id,session,block,trial,renderer,shape,response,correct,response_time\n" +
                       "".join(rows))
        self.run_palpate("analyze", "--csv", csv, "--report", self.dir / "other.html", "--force")
        self.open(self.dir / "other.html")
        self.assertIn(shape, self.browser.run("[...document.querySelectorAll('.cards b')].map(b => b.textContent)"))
        self.assertIn(shape, self.browser.run(DRAWN + "[0].textContent"))
        self.assertEqual(self.browser.run("document.querySelector('#person').options[1].value"), who)
        self.assertEqual(self.browser.run("document.querySelectorAll('.drawing b').length"), 0)

    def test_many_renderers_are_distinguished_and_their_names_are_text(self):
        csv = self.dir / "renderers.csv"
        renderers = ["</script><b>x</b>", "tip 2", "tip 3", "tip 4", "tip 5", "tip 6", "tip 7"]
        rows = [f"{p},1,1,{i},{r},{s},{s},1,{2 + 0.3 * (i % 5) + 0.2 * len(s) + 0.1 * (i * ord(p) % 7)}\n" for p in "ABC"
                for i, (r, s) in enumerate([(r, s) for r in renderers for s in ("cone", "cube")] * 3, 1)]
        csv.write_text("participant_id,session,block,trial,renderer,shape,response,correct,response_time\n" +
                       "".join(rows))
        self.run_palpate("analyze", "--csv", csv, "--report", self.dir / "other.html", "--force")
        colours = {}
        for dark in (False, True):
            self.open(self.dir / "other.html", dark=dark)
            self.assertEqual([figure[0] for figure in self.shown()],
                             [name for name in FIGURES if name != "order"])
            self.assertEqual(self.browser.run("document.querySelectorAll('.drawing b, .cards + b').length"), 0)
            self.assertIn(renderers[0], self.browser.run(DRAWN + "[0].textContent"))
            colours[dark] = set(self.browser.run(
                "[...document.querySelectorAll('#figure15 .wide-screen svg g:not(.alone) > :not(title)')].map(e => e.getAttribute('fill'))"
                ".filter(f => f && f !== 'none').map(f => { const p = document.createElement('p'); p.style.color = f; "
                "document.body.append(p); const c = getComputedStyle(p).color; p.remove(); return c; })"))
            self.assertEqual(len(colours[dark]), 6, "of the first six renderers")
        self.assertFalse(colours[False] & colours[True])

    def test_nothing_foreign_runs_and_nothing_is_fetched(self):
        self.open()
        self.assertEqual(self.browser.run(
            "(() => { const s = document.createElement('script'); s.textContent = 'window.ran = 1';"
            "document.body.append(s); return window.ran === undefined; })()"), True)
        self.assertEqual(self.browser.run("fetch('http://127.0.0.1:9/').then(() => 'got', () => 'refused')"), "refused")
        self.assertIn("Content Security Policy", " ".join(self.browser.complaints()))
        policy = self.browser.run("document.querySelector('meta[http-equiv]').content")
        self.assertNotIn("unsafe-eval", policy)

    def test_figures_are_saved_as_svg_and_png(self):
        self.open()
        out = self.dir / "saved"
        out.mkdir()
        self.browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(out))
        for name in FIGURES:
            for kind in ("svg", "png"):
                self.browser.run(f"document.querySelector('#{name} button[data-save={kind}]').focus()")
                self.press("Enter", 13, text="\r")
                path = out / f"{name}.{kind}"
                deadline = time.monotonic() + 60
                while not path.exists() and time.monotonic() < deadline:
                    self.browser.run("new Promise(r => setTimeout(r, 20))")
                self.assertTrue(path.exists(), path.name)
                # Chromium drops the eleventh download within a second.
                self.browser.run("new Promise(r => setTimeout(r, 120))")
            saved = (out / f"{name}.svg").read_text("utf-8")
            self.assertNotIn("var(", saved)
            self.assertIn("SIMULATED PARTICIPANTS", saved)
            written = xml.parse(self.dir / "figures" / f"{name}.svg").getroot()
            self.assertEqual(texts(xml.fromstring(saved)), texts(written))
            png = (out / f"{name}.png").read_bytes()
            self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
            width, height = struct.unpack(">II", png[16:24])
            self.assertEqual([width, height], [2 * int(written.get(side)) for side in ("width", "height")])
        self.assertEqual(self.browser.complaints(), [])

    def test_tables_are_saved_as_csv_and_copied(self):
        self.open()
        out = self.dir / "tables"
        out.mkdir()
        self.browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(out))
        cells = self.browser.run("[...document.querySelector('#speedup table').rows].map("
                                 "r => [...r.cells].map(c => c.textContent))")
        wanted = [[text.replace("\u00a0", " ").replace("\u2212", "-") for text in row] for row in cells]
        self.assertEqual(wanted[0][0], "shape")
        self.browser.run("document.querySelector('#speedup button[data-table=csv]').focus()")
        self.press("Enter", 13, text="\r")
        deadline = time.monotonic() + 60
        while not list(out.glob("*.csv")) and time.monotonic() < deadline:
            self.browser.run("new Promise(r => setTimeout(r, 20))")
        saved, = out.glob("*.csv")
        self.assertEqual(saved.name, "reduction-of-response-time-with-the-ray-simulated-participan.csv")
        with saved.open(encoding="utf-8-sig", newline="") as opened:
            self.assertEqual(list(csv.reader(opened)), wanted)
        self.browser.run("document.addEventListener('copy', () => { window.copied = document.activeElement.value; })")
        self.browser.run("document.querySelector('#speedup button[data-table=copy]').focus()")
        self.press("Enter", 13, text="\r")
        self.assertEqual(self.browser.run("window.copied"), "\n".join("\t".join(row) for row in wanted))
        self.assertEqual(self.browser.run("document.activeElement.textContent"), "Copied")

    def test_a_copied_name_is_no_formula(self):
        page = self.dir / "formula.html"
        fixture = (FIXTURES / "two_people.csv").read_text()
        table = self.dir / "formula.csv"
        table.write_text(fixture.replace("cone", "=1+2").replace("cube", "@sum"))
        self.run_palpate("analyze", "--csv", table, "--report", page)
        self.open(page)
        self.browser.run("document.addEventListener('copy', () => { window.copied = document.activeElement.value; })")
        self.browser.run("document.querySelector('#speedup button[data-table=copy]').focus()")
        self.press("Enter", 13, text="\r")
        copied = self.browser.run("window.copied")
        self.assertRegex(copied, r"(?m)^'=1\+2\t")
        self.assertRegex(copied, r"(?m)^'@sum\t")
        self.assertNotRegex(copied, r"(?m)(^|\t)[=@]")

    def test_words_in_cells_stay_whole(self):
        broken = """(() => {
          for (const part of document.querySelectorAll('details')) part.open = true;
          const found = [];
          for (const cell of document.querySelectorAll('th.name, td.name')) {
            const text = cell.firstChild;
            if (!text) continue;
            for (const word of text.data.matchAll(/[A-Za-z]{2,20}/g)) {
              const range = document.createRange();
              range.setStart(text, word.index);
              range.setEnd(text, word.index + word[0].length);
              if (range.getClientRects().length > 1) found.push(word[0]);
            }
          }
          return found;
        })()"""
        for width in (1280, 390):
            self.open(width=width)
            self.assertEqual(self.browser.run(broken), [], width)

    def test_the_page_and_the_files_show_the_same_numbers(self):
        for width in (1200, 390):
            self.open(width=width)
            for name in FIGURES:
                written = xml.parse(self.dir / "figures" / f"{name}.svg").getroot()
                shown = self.browser.run(
                    f"[...({DRAWN}).find(s => s.closest('#{name}')).querySelectorAll('[data-tip]')].map(e => e.dataset.tip)")
                self.assertEqual(sorted(shown), sorted(t.text for g in written.iter(SVG + "g") for t in g.findall(SVG + "title")))

    def test_a_tooltip_tells_the_exact_numbers_of_what_is_pointed_at(self):
        self.open()
        for name in FIGURES:
            tip, x, y = self.browser.run(
                f"(() => {{ const m = [...document.querySelectorAll('#{name} .wide-screen [data-tip] > *')].pop(); "
                "m.scrollIntoView({block: 'center', behavior: 'instant'}); const b = m.getBoundingClientRect(); "
                "return [m.parentNode.dataset.tip, b.x + b.width / 2, b.y + b.height / 2]; })()")
            self.browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
            seen = self.browser.run("[document.getElementById('tip').hidden, document.getElementById('tip').textContent]")
            self.assertEqual(seen[0], False, name)
            self.assertRegex(seen[1], r"\d", name)
            under = self.browser.run(f"document.elementFromPoint({x}, {y}).closest('[data-tip]').dataset.tip")
            self.assertEqual(seen[1], under)
        self.browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=2, y=2)
        self.assertTrue(self.browser.run("document.getElementById('tip').hidden"))

    def test_dark_and_light(self):
        seen = {}
        for dark in (False, True):
            self.open(dark=dark)
            seen[dark] = self.browser.run(
                "[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.querySelector("
                "'#figure15 .wide-screen text')).fill]")
        light, dark = ([[int(n) for n in re.findall(r"\d+", c)[:3]] for c in seen[k]] for k in (False, True))
        self.assertGreater(min(light[0]), 200)
        self.assertLess(max(dark[0]), 60)
        self.assertLess(max(light[1]), 160)
        self.assertGreater(min(dark[1]), 130)

    def test_a_phone_need_not_scroll_sideways(self):
        self.open(width=390)
        self.assertLessEqual(self.browser.run("document.documentElement.scrollWidth"), 390)
        for name, width, _, _ in self.shown():
            self.assertLessEqual(width, 362, name)
        # Texts stay legible.
        sizes = self.browser.run(f"({DRAWN}).map(s => s.getBoundingClientRect().width / s.viewBox.baseVal.width)")
        self.assertGreater(min(sizes), 0.8)

    def test_keyboard_and_screen_reader(self):
        self.open()
        for name in FIGURES:
            named, said = self.browser.run(
                f"(() => {{ const s = document.querySelector('#{name} .wide-screen svg'); return [s.getAttribute('aria-label'), "
                "document.getElementById(s.getAttribute('aria-describedby')).textContent]; })()")
            self.assertGreater(len(named), 10, name)
            self.assertGreater(len(said), 40, name)
            self.assertEqual(self.browser.run(f"document.querySelectorAll('#{name} button[data-save]').length"), 2)
        reached = []
        for _ in range(30):
            self.press("Tab", 9)
            reached.append(self.browser.run("document.activeElement.dataset.save || document.activeElement.tagName"))
        self.assertIn("svg", reached)
        self.assertIn("png", reached)
        self.assertIn("SUMMARY", reached)
        self.assertEqual(self.browser.run("document.querySelectorAll('[id]').length"),
                         self.browser.run("new Set([...document.querySelectorAll('[id]')].map(e => e.id)).size"))

    def test_a_participant_can_be_picked_out(self):
        self.open()
        # In the drawing for wide screens: highlighted lines and faded marks.
        seen = ("(() => { const all = [...document.querySelectorAll('#figure15 .wide-screen [data-person]')]; return ["
                "all.filter(g => g.querySelector('polyline') && getComputedStyle(g.querySelector('polyline')).strokeWidth === "
                "'2.5px').map(g => g.dataset.person), all.filter(g => getComputedStyle(g).opacity < 0.5)"
                ".map(g => g.dataset.person)]; })()")
        self.assertEqual(self.browser.run(seen), [[], []])
        who = self.browser.run("(() => { const s = document.getElementById('person'); s.selectedIndex = 2; "
                               "s.dispatchEvent(new Event('change')); return s.value; })()")
        bold, faint = self.browser.run(seen)
        self.assertEqual(bold, [who] * 4)  # one for each shape
        self.assertEqual(len(set(faint)), 3)
        self.assertNotIn(who, faint)
        # Hovering highlights another participant until the pointer leaves.
        other, x, y = self.browser.run(
            "(() => { const g = document.querySelector('#figure15 .wide-screen [data-person] circle'); "
            "g.scrollIntoView({block: 'center', behavior: 'instant'}); const b = g.getBoundingClientRect(); "
            "return [g.parentNode.dataset.person, b.x + b.width / 2, b.y + b.height / 2]; })()")
        self.browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        self.assertEqual(set(self.browser.run(seen)[0]), {other})
        self.browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=2, y=2)
        self.assertEqual(set(self.browser.run(seen)[0]), {who})
        self.browser.run("(() => { const s = document.getElementById('person'); s.selectedIndex = 0; "
                         "s.dispatchEvent(new Event('change')); })()")
        self.assertEqual(self.browser.run(seen), [[], []])

    def test_without_scripts_the_figures_are_there(self):
        self.browser.call("Emulation.setScriptExecutionDisabled", value=True)
        try:
            self.open()
        finally:
            self.browser.call("Emulation.setScriptExecutionDisabled", value=False)
        self.assertEqual([figure[0] for figure in self.shown()], FIGURES)
        # Title and notes are visible once: in the page, not in the drawing as well.
        seen = ("[...document.querySelectorAll('#%s h2, #%s figcaption, #%s .drawing text')]"
                ".filter(e => e.getClientRects().length).map(e => [e.tagName, e.textContent])")
        for name in FIGURES:
            parts = self.browser.run(seen % (name, name, name))
            caption = next(text for tag, text in parts if tag == "FIGCAPTION")
            drawn = [text for tag, text in parts if tag == "text"]
            self.assertTrue(drawn, name)
            plain = caption.replace("\u00a0", " ")
            self.assertEqual([t for t in drawn if len(t) > 40 and t in plain], [], name)
            self.assertIn("SIMULATED PARTICIPANTS", drawn)

    def test_every_text_of_a_figure_is_within_it(self):
        self.run_palpate("analyze", "--csv", FIXTURES / "censored.csv", "--figures", self.dir / "censored")
        files = [*(self.dir / "figures").glob("*.svg"), *(self.dir / "censored").glob("*.svg")]
        self.assertGreater(len(files), 14)
        outside = ("(() => { const s = document.documentElement, v = s.viewBox.baseVal; "
                   "return [...document.querySelectorAll('text')].filter(t => { const b = t.getBBox(), "
                   "m = t.getCTM(), at = (x, y) => new DOMPoint(x, y).matrixTransform(m); "
                   "return [at(b.x, b.y), at(b.x + b.width, b.y + b.height)].some(p => p.x < -1 || "
                   "p.y < -1 || p.x > v.width + 1 || p.y > v.height + 1); }).map(t => t.textContent); })()")
        for path in files:
            self.browser.window(1600, 1200)
            self.browser.open(path)
            self.assertEqual(self.browser.run(outside), [], path.name)

    def test_it_prints_and_is_as_before(self):
        self.open()
        before = self.shown()
        self.assertEqual(self.browser.pdf()[:5], b"%PDF-")
        self.assertEqual(self.shown(), before)
        self.assertEqual(self.browser.run("document.querySelectorAll('details[open]').length"), 0)
        self.assertEqual(self.browser.complaints(), [])


if __name__ == "__main__":
    if report_chromium.find() is None:
        print("SKIPPED: no Chromium is installed (runner/install_packages.sh quality brings it)")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
