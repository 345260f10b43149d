"""palpate accuracy from outside. Usage: accuracy_command_test.py PALPATE"""

import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

PALPATE = sys.argv[1]
SMALL = ["--quick", "--paths", "1", "--ticks", "40", "--most-triangles", "80"]


def accuracy(*args, status=0):
    done = subprocess.run([PALPATE, "accuracy", *map(str, args)], capture_output=True, text=True, timeout=300)
    assert done.returncode == status, done.stdout + done.stderr
    return done


class Results(unittest.TestCase):
    """Of one small study: its text, numbers, figure and page."""

    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        numbers, cls.figure, page = (pathlib.Path(scratch.name) / f"a.{end}" for end in ("json", "svg", "html"))
        cls.done = accuracy(*SMALL, "--json", numbers, "--figure", cls.figure, "--report", page)
        cls.result = json.loads(numbers.read_text())
        cls.page = page.read_text()
        cls.seen = {(r["shape"], r["triangles"], r["probe"], r["method"]) for r in cls.result["rows"]}
        cls.methods = {m["name"] for m in cls.result["methods"]}

    def test_every_shape_has_a_recommendation(self):
        self.assertEqual(self.done.stderr, "")
        for shape in ["sphere", "cone", "cylinder", "cube", "box"]:
            self.assertRegex(self.done.stdout, rf"(?m)^  {shape}: .*\.$")
        recommended = self.result["recommended"]
        self.assertEqual([r["shape"] for r in recommended], ["sphere", "cone", "cylinder", "cube", "box"])
        # 80 triangles are too few for a sphere and enough for a cube.
        self.assertIsNone(recommended[0]["triangles_for_device"])
        self.assertEqual(recommended[3]["triangles_for_device"], 12)

    def test_the_recommended_tessellation_meets_the_demands_and_the_next_coarser_one_does_not(self):
        def keeps(row):
            errors = row["against_shape"]
            return (errors["lost"] == 0 and errors["phantom"] == 0 and errors["depth"]["p999_m"] < 1e-3 and
                    math.degrees(errors["direction"]["p999_rad"]) < 10)

        for one in self.result["recommended"]:
            rows = [r for r in self.result["rows"] if r["shape"] == one["shape"] and r["method"] == "tick"]
            chosen = one["triangles_for_hand"] or math.inf
            self.assertTrue(all(keeps(r) for r in rows if r["triangles"] >= chosen), one)
            coarser = {r["triangles"] for r in rows if r["triangles"] < chosen}
            if coarser:
                self.assertFalse(all(keeps(r) for r in rows if r["triangles"] == max(coarser)), one)

    def test_all_own_methods_and_the_peers_that_are_present_are_measured(self):
        self.assertLessEqual({"tick", "walk", "walk-float", "walk-cold", "scan", "brute-force"}, self.methods)
        self.assertEqual(self.methods - {"bullet", "fcl"},
                         {"tick", "walk", "walk-float", "walk-cold", "scan", "brute-force"})
        self.assertEqual({p["name"] for p in self.result["peers"] if p["present"]}, self.methods & {"bullet", "fcl"})
        for peer in self.result["peers"]:
            if not peer["present"]:
                self.assertIn(f"{peer['name']:<12}absent", self.done.stdout)
        self.assertEqual(len(self.seen), len(self.result["rows"]))
        self.assertEqual(len(self.seen), 9 * 2 * len(self.methods))

    def test_the_tick_is_exact_on_the_polyhedron(self):
        for row in self.result["rows"]:
            self.assertGreater(row["ns_per_tick"], 0)
            if row["method"] == "tick":
                exact = row["against_polyhedron"]
                self.assertEqual((exact["lost"], exact["phantom"]), (0, 0), row)
                self.assertLess(exact["depth"]["worst_m"], 1e-15)
                self.assertLess(exact["force"]["worst_n"], 1e-12)
        self.assertTrue(all(r["exact_missed"] == 0 for r in self.result["first_contact"]["rows"]))

    def test_the_figure_has_a_dot_for_each_tessellation_and_method(self):
        drawn = xml.etree.ElementTree.parse(self.figure).getroot()
        said = [title.text for title in drawn.iter("{http://www.w3.org/2000/svg}title")]
        dots = [text for text in said if " triangles: " in text]
        self.assertEqual(len(dots), len(self.seen))  # both panels of a shape
        self.assertEqual({text.split(",")[0] for text in dots}, self.methods)

    def test_the_page_has_the_figure_and_every_table_and_loads_nothing(self):
        as_xml = re.sub(r"<!DOCTYPE html>|<script>.*?</script>", "", self.page, flags=re.S)
        root = xml.etree.ElementTree.fromstring(as_xml)
        # Of the shapes and of the scenes, for wide and narrow screens.
        self.assertEqual(len(root.findall(".//{http://www.w3.org/2000/svg}svg")), 4)
        scenes = {s["scene"]: s for s in self.result["scenes"]}
        self.assertEqual(len(scenes), 12)
        for scene in scenes.values():
            self.assertIn(scene["scene"], self.page)
            for row in scene["rows"]:
                self.assertLessEqual(0, row["median_ns"])
                self.assertLessEqual(row["median_ns"], row["p99_ns"])
                self.assertLessEqual(row["p99_ns"], row["worst_ns"])
        for kind in ("gear", "plate", "scan", "dumbbell", "layer", "tool", "moves", "soft"):
            self.assertTrue(any(kind in name for name in scenes), kind)
        tables = re.findall(r"(?m)^\S.*\n  (?:triangles|method|shape|case|wrong|scene) ", self.done.stdout)
        self.assertEqual(len(root.findall(".//table")), len(tables))
        self.assertNotRegex(self.page, r"src=|href=\"(?!#|data:)")
        self.assertIn("default-src 'none'; script-src 'sha256-", self.page)

    def test_both_probes_pass_every_extreme_case_and_the_searches_find_no_fault(self):
        self.assertTrue(all(e["holds"] for e in self.result["extremes"]))
        self.assertEqual(len(self.result["extremes"]) % 2, 0)
        self.assertGreaterEqual(len(self.result["extremes"]), 30)
        self.assertEqual(self.result["search"]["wrong"], 0)
        self.assertEqual(self.result["search"]["ticks"], 100000)
        unions = self.result["union_search"]
        self.assertEqual((unions["wrong"], unions["ticks"]), (0, 100000))

    def test_unions_match_closed_forms_and_have_a_row_for_each_method(self):
        unions = self.result["unions"]
        names = [m["name"] for m in unions["methods"]]
        self.assertEqual(names, ["law", "one per part", "penalties"])
        cases = list(dict.fromkeys(r["case"] for r in unions["rows"]))
        self.assertEqual([(r["case"], r["method"]) for r in unions["rows"]], [(c, m) for c in cases for m in names])
        for row in unions["rows"]:
            if row["method"] == "law":
                self.assertEqual(row["inside"], 0, row)
                if row["truth"] != "oracle":
                    self.assertLess(row["force"]["worst_n"], 1e-9, row)
            else:
                self.assertIsNone(row["inside"], row)


class Accuracy(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)

    def test_the_search_gives_the_same_counts_with_any_number_of_threads(self):
        one, three = self.dir / "1.json", self.dir / "3.json"
        # Status 1 if it finds a fault; this test compares the counts only.
        for jobs, path in ((1, one), (3, three)):
            done = subprocess.run([PALPATE, "accuracy", "--search", "31000", "--jobs", str(jobs), "--json", path],
                                  capture_output=True, text=True, timeout=300)
            wrong = json.loads(path.read_text())["search"]["wrong"]
            self.assertEqual(done.returncode, 1 if wrong else 0, done.stderr)
            self.assertIn("31,000 ticks in 62 walks", done.stdout)
            unions = self.dir / f"u{jobs}.json"
            accuracy("--search", "15000", "--unions", "--jobs", jobs, "--json", unions)
            self.assertNotIn("search", json.loads(unions.read_text()))
            self.assertEqual(json.loads(unions.read_text())["union_search"]["walks"], 30)
        self.assertEqual(one.read_text(), three.read_text())
        self.assertEqual((self.dir / "u1.json").read_text(), (self.dir / "u3.json").read_text())
        other = self.dir / "s.json"
        subprocess.run([PALPATE, "accuracy", "--search", "31000", "--seed", "2", "--json", other],
                       capture_output=True, timeout=300)
        self.assertNotEqual(json.loads(one.read_text())["search"]["in_contact"],
                            json.loads(other.read_text())["search"]["in_contact"])

    def test_does_not_replace_files_unasked(self):
        there = self.dir / "there.json"
        there.write_text("mine")
        done = accuracy("--search", "500", "--json", there, status=2)
        self.assertIn("--force", done.stderr)
        self.assertEqual(there.read_text(), "mine")
        accuracy("--search", "500", "--json", there, "--force")
        self.assertIn("search", json.loads(there.read_text()))

    def test_wrong_usage_is_status_2(self):
        for args in (["--search", "0"], ["--search", "-5"], ["--search", "x"], ["--paths", "0"], ["--ticks", "0"],
                     ["--most-triangles", "19"], ["--unions"], ["--jobs", "0", "--search", "500"], ["extra"],
                     ["--search", "500", "--figure", self.dir / "f.json"], ["--json", self.dir]):
            done = accuracy(*args, status=2)
            self.assertEqual(done.stdout, "")
            self.assertTrue(done.stderr)
        self.assertEqual(list(self.dir.iterdir()), [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
