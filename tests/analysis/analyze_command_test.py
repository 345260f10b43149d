"""The analyze command: well-formed files, escaped names, statuses, exit codes.

Usage: analyze_command_test.py PALPATE FIXTURES
"""

import base64
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from html.parser import HTMLParser

PALPATE, FIXTURES = sys.argv[1], pathlib.Path(sys.argv[2])
HEADER = "participant_id,session,block,trial,renderer,shape,response,correct,response_time\n"
SVG = "{http://www.w3.org/2000/svg}"


class Tags(HTMLParser):
    """Every element and attribute of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.attributes = set(), {}
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        for name, value in attrs:
            self.attributes.setdefault(name, []).append(value)


def without_scripts(page):
    """The page without scripts, and the contents of its scripts."""
    page = page.removeprefix("<!DOCTYPE html>\n")
    pattern = re.compile(r"<script[^>]*>(.*?)</script>", re.S)
    return pattern.sub("", page), pattern.findall(page)


class Analyze(unittest.TestCase):
    def setUp(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.addCleanup(self.scratch.cleanup)
        self.dir = pathlib.Path(self.scratch.name)

    def run_palpate(self, *args):
        return subprocess.run([PALPATE, "analyze", *map(str, args)], capture_output=True, text=True,
                              encoding="utf-8")

    def hostile(self, participants, shapes):
        """A study with markup as names."""
        rows = []
        for who in participants:
            for number, (renderer, shape) in enumerate(
                    ((r, s) for r in ("point", "ray") for s in shapes for _ in range(2)), 1):
                quoted = ['"%s"' % name.replace('"', '""') for name in (who, shape)]
                rows.append(f"{quoted[0]},1,1,{number},{renderer},{quoted[1]},{quoted[1]},1,"
                            f"{2 + 0.1 * number + 0.01 * len(who) * number}\n")
        path = self.dir / "trials.csv"
        path.write_text(HEADER + "".join(rows), encoding="utf-8")
        return path

    def all_outputs(self, csv):
        done = self.run_palpate("--csv", csv, "--json", self.dir / "a.json", "--report",
                                self.dir / "a.html", "--figures", self.dir / "figures", "--force")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "")
        return (done.stdout, json.loads((self.dir / "a.json").read_text("utf-8")),
                (self.dir / "a.html").read_text("utf-8"),
                (self.dir / "figures" / "figure15.svg").read_text("utf-8"))

    def test_of_several_protocols_in_a_database_one_can_be_chosen(self):
        quick = json.loads((FIXTURES.parents[2] / "protocols" / "quick.json").read_text())
        database = self.dir / "two.db"
        for name, repetitions in (("first", 2), ("second", 3)):
            protocol = self.dir / f"{name}.json"
            protocol.write_text(json.dumps({**quick, "name": name, "repetitions": repetitions, "samples": True,
                                            "blocks_per_renderer": 1}))
            subprocess.run([PALPATE, "simulate", protocol, "--db", database, "--participants", "2"], check=True,
                           capture_output=True)
        report = self.dir / "a.json"
        for options in ((), ("--movement",)):
            for name, repetitions in (("first", 2), ("second", 3)):
                done = self.run_palpate("--db", database, *options, "--protocol", name, "--json", report, "--force")
                self.assertEqual(done.returncode, 0, done.stderr)
                # Participants, renderers, shapes, repetitions.
                found = json.loads(report.read_text())
                self.assertEqual(found.get("counts", found)["n_trials"], 2 * 2 * 4 * repetitions)
        together = self.run_palpate("--db", database)
        self.assertIn("first, second", together.stdout + together.stderr)
        self.assertIn("--protocol", together.stdout + together.stderr)
        self.assertNotIn("repeat the participant", together.stdout)
        moved = self.run_palpate("--db", database, "--movement", "--json", report, "--force")
        self.assertIn("(first, second) are pooled", " ".join(moved.stdout.split()))
        self.assertEqual(len(json.loads(report.read_text())["warnings"]), 1)
        none = self.run_palpate("--db", database, "--protocol", "third")
        self.assertEqual(none.returncode, 2)
        self.assertIn("third", none.stderr)

    def test_a_table_of_several_protocols_gives_the_numbers_of_its_database(self):
        protocols = FIXTURES.parents[2] / "protocols"
        quick = json.loads((protocols / "quick.json").read_text())
        (self.dir / "other.json").write_text(json.dumps({**quick, "name": "other", "repetitions": 1}))
        database, table = self.dir / "several.db", self.dir / "several.csv"
        for protocol in (protocols / "quick.json", self.dir / "other.json", protocols / "roughness-magnitude.json"):
            subprocess.run([PALPATE, "simulate", protocol, "--db", database, "--participants", "2"], check=True,
                           capture_output=True)
        subprocess.run([PALPATE, "export", "--db", database, "--format", "csv", "--out", table], check=True,
                       capture_output=True)
        for name in ("quick", "other"):
            found = []
            for source in ("--db", database), ("--csv", table):
                wanted = name if not found else found[0]["protocol"]["sha256"][:12]
                done = self.run_palpate(*source, "--protocol", wanted, "--json", self.dir / "a.json", "--force")
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                found.append(json.loads((self.dir / "a.json").read_text()))
            self.assertEqual(found[0]["protocol"]["sha256"], found[1]["protocol"]["sha256"])
            for origin in "source", "protocol", "observer_sha256":
                for one in found:
                    del one[origin]
            self.assertEqual(*found)
        done = self.run_palpate("--csv", table, "--protocol", "quick")
        self.assertEqual(done.returncode, 2)

    def test_names_are_text_not_markup(self):
        who = ["<script>alert(1)</script>", "b&\"'<img src=x onerror=alert(1)>", "]]>", "c" * 200]
        csv = self.hostile(who, ["cone", "</svg><script>", "a&b"])
        text, figures, page, svg = self.all_outputs(csv)
        self.assertIn("</svg><script>", figures["times"]["ray"])
        root = xml.fromstring(svg)
        self.assertEqual({e.tag for e in root.iter()} - {SVG + t for t in (
            "svg", "title", "desc", "g", "line", "rect", "circle", "polygon", "polyline", "text")}, set())
        self.assertTrue([e.text for e in root.iter(SVG + "title") if e.text.startswith(who[0] + ", ")])
        markup, scripts = without_scripts(page)
        xml.fromstring(markup)
        self.assertEqual(len(scripts), 2)
        tags = Tags(markup)
        self.assertFalse({"script", "img", "iframe", "object"} & tags.tags)
        self.assertFalse([name for name in tags.attributes if name.startswith("on")])
        self.assertNotIn("src", tags.attributes)
        self.assertEqual([], [value for value in re.findall(r'href="([^"]*)"', markup)
                              if not re.fullmatch(r"#[a-z0-9-]+|data:,", value)])
        policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page).group(1)
        self.assertTrue(policy.startswith("default-src 'none'; script-src 'sha256-"), policy)
        self.assertNotIn("unsafe-eval", policy)
        self.assertNotIn("http", policy)
        for script in scripts[1:]:  # the first is data
            digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
            self.assertIn(f"'sha256-{digest}'", policy)

    def test_every_fixture_gives_well_formed_files(self):
        for csv in sorted(FIXTURES.glob("*.csv")):
            with self.subTest(csv=csv.name):
                text, figures, page, svg = self.all_outputs(csv)
                xml.fromstring(svg)
                for other in (self.dir / "figures").iterdir():
                    xml.fromstring(other.read_text("utf-8"))
                    self.assertEqual("SIMULATED" in other.read_text("utf-8"), figures["simulated"] is True)
                page = without_scripts(page)[0]
                xml.fromstring(page)
                self.assertTrue(all(len(line) <= 100 for line in text.splitlines()))
                labelled = figures["simulated"] is True
                self.assertEqual("SIMULATED" in text, labelled)
                self.assertEqual("SIMULATED" in page, labelled)
                self.assertEqual("SIMULATED" in svg, labelled)

    def test_a_second_run_replaces_its_files_and_leaves_no_others(self):
        csv = FIXTURES / "full.csv"
        first, second = self.all_outputs(csv), self.all_outputs(csv)
        self.assertEqual(first, second)
        self.assertEqual(sorted(p.name for p in self.dir.iterdir()), ["a.html", "a.json", "figures"])

    def test_figures_that_are_there_are_kept_unless_forced(self):
        (self.dir / "figures").mkdir()
        (self.dir / "figures" / "servo-of-mine.svg").write_text("mine")
        (self.dir / "figures" / "times.svg").write_text("mine")
        args = ("--csv", FIXTURES / "full.csv", "--figures", self.dir / "figures")
        done = self.run_palpate(*args)
        self.assertEqual(done.returncode, 2)
        self.assertIn("times.svg", done.stderr)
        self.assertEqual(sorted(p.read_text() for p in (self.dir / "figures").iterdir()), ["mine"] * 2)
        self.assertEqual(self.run_palpate(*args, "--force").returncode, 0)
        self.assertIn("</svg>", (self.dir / "figures" / "times.svg").read_text("utf-8"))
        self.assertEqual((self.dir / "figures" / "servo-of-mine.svg").read_text(), "mine")

    def test_bad_input_is_status_2_and_writes_nothing(self):
        bad = self.dir / "bad.csv"
        bad.write_text(HEADER + "P1,1,1,1,ray,cone,cone,1,soon\n")
        for args in (["--csv", bad], ["--csv", self.dir / "none.csv"], ["--db", bad], [],
                     ["--csv", bad, "--db", bad], ["--csv", FIXTURES / "full.csv", "--too-fast-s", 0],
                     ["--csv", self.dir], ["--nonsense"]):
            with self.subTest(args=args):
                done = self.run_palpate(*args, "--json", self.dir / "a.json")
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertNotEqual(done.stderr, "")
                self.assertEqual(done.stdout, "")
                self.assertFalse((self.dir / "a.json").exists())
        self.assertIn("line 2, column response_time", self.run_palpate("--csv", bad).stderr)

    def test_the_data_is_never_overwritten(self):
        csv = self.hostile(["A"], ["cone"])
        before = csv.read_bytes()
        (self.dir / "link").symlink_to(csv)
        for out in (csv, self.dir / "." / "trials.csv", self.dir / "link"):
            self.assertEqual(self.run_palpate("--csv", csv, "--json", out).returncode, 2)
        self.assertEqual(csv.read_bytes(), before)
        self.assertEqual(self.run_palpate("--csv", csv, "--json", self.dir / "same", "--report",
                                          self.dir / "same").returncode, 2)

    def test_what_cannot_be_written_is_status_1(self):
        csv = self.hostile(["A", "B"], ["cone"])
        done = self.run_palpate("--csv", csv, "--json", self.dir / "no" / "folder.json")
        self.assertEqual(done.returncode, 1)
        self.assertIn("folder.json", done.stderr)

    def test_the_limit_for_anticipations_is_a_setting(self):
        csv = FIXTURES / "full.csv"
        used = []
        for limit in ("0.1", "0.2", "0.21"):
            self.run_palpate("--csv", csv, "--too-fast-s", limit, "--json", self.dir / "a.json", "--force")
            used.append(json.loads((self.dir / "a.json").read_text())["counts"]["n_used_for_times"])
        self.assertTrue(used[0] > used[1] > used[2], used)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
