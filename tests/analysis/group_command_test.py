"""The group's results from the command line against values of an independent program, whatever the order of the table.

Usage: group_command_test.py PALPATE FIXTURES
"""

import csv
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest

PALPATE, FIXTURES = pathlib.Path(sys.argv.pop(1)).resolve(), pathlib.Path(sys.argv.pop(1)) / "group"
EXPECTED = json.loads((FIXTURES / "expected.json").read_text())
COLUMNS = ["participant_id", "task", "block_name", "renderer", "shape", "response", "level", "standard_level", "success",
           "comparison_interval", "n_intervals", "catch_trial"]


def trials_of(file, standard):
    rows = []
    for counts in csv.DictReader((FIXTURES / file).read_text().splitlines()):
        for i in range(int(counts["trials"])):
            success = int(i < int(counts["successes"]))
            rows.append({"participant_id": counts["participant_id"], "task": "compare", "block_name": "b",
                         "renderer": counts["renderer"], "shape": "ball", "response": 1 + success, "level": counts["level"],
                         "standard_level": standard, "success": success, "comparison_interval": 2, "n_intervals": 2,
                         "catch_trial": 0})
    return rows


class GroupCommand(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)

    def found(self, rows, *options):
        with (self.path / "trials.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
        done = subprocess.run([PALPATE, "analyze", "--csv", self.path / "trials.csv", "--json", self.path / "a.json", "--force",
                               *options], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.text = done.stdout
        return json.loads((self.path / "a.json").read_text())

    def test_levels_on_both_sides(self):
        found, want = self.found(trials_of("two-sided.csv", 300)), EXPECTED["two-sided.csv"]
        for renderer in ("point", "ray"):
            for measure in ("pse", "jnd"):
                one = found[measure]["b"][renderer]
                self.assertAlmostEqual(one["estimate"], want[renderer][measure], places=5)
                self.assertAlmostEqual(one["ci95_low"], want[renderer][measure + "_ci95"][0], places=5)
                self.assertAlmostEqual(one["ci95_high"], want[renderer][measure + "_ci95"][1], places=5)
        self.assertAlmostEqual(found["jnd"]["b"]["ratio"], math.exp(want["ln_jnd_ray_minus_point"]["difference"]), places=4)
        self.assertAlmostEqual(found["jnd"]["b"]["p"], want["ln_jnd_ray_minus_point"]["p"], places=5)
        self.assertAlmostEqual(found["pse"]["b"]["difference"], want["pse_ray_minus_point"]["difference"], places=4)
        self.assertAlmostEqual(found["pse"]["b"]["ci95_high"], want["pse_ray_minus_point"]["ci95"][1], places=4)
        # P3 makes no error with the ray: the single fit has no JND, the group uses the answers.
        jnd, = [one for one in found["group_comparisons"] if one["measure"] == "jnd"]
        self.assertEqual((jnd["n"], jnd["individual_fits"]["n"], jnd["individual_fits"]["left_out_participants"]), (6, 5, ["P3"]))
        self.assertIn("1 function left out (P3)", self.text)

    def test_a_forced_choice_from_level_0(self):
        found, want = self.found(trials_of("detection-2afc.csv", 0), "--scale", "log"), EXPECTED["detection-2afc.csv"]
        for renderer in ("point", "ray"):
            one = found["jnd"]["b"][renderer]
            self.assertEqual(one["n"], want[renderer]["n"])
            self.assertAlmostEqual(one["estimate"], want[renderer]["threshold"], places=5)
        self.assertAlmostEqual(found["jnd"]["b"]["ratio"], math.exp(want["ln_threshold_ray_minus_point"]["difference"]), places=4)
        self.assertAlmostEqual(found["jnd"]["b"]["p"], want["ln_threshold_ray_minus_point"]["p"], places=5)
        self.assertIn("no trials: P", self.text)

    def test_order_changes_nothing(self):
        rows = trials_of("two-sided.csv", 300)
        first = self.found(rows)
        random.Random(1).shuffle(rows)
        names = {f"P{i}": f"Q{9 - i}" for i in range(1, 7)}
        again = self.found([{**row, "participant_id": names[row["participant_id"]]} for row in rows])
        other = self.found([{**row, "renderer": {"point": "ray", "ray": "point"}[row["renderer"]]} for row in rows])
        for measure, value in (("jnd", "ratio"), ("pse", "difference")):
            one, same, turned = (found[measure]["b"] for found in (first, again, other))
            self.assertAlmostEqual(one[value], same[value], places=5)
            self.assertAlmostEqual(one["p"], same["p"], places=7)
            self.assertAlmostEqual(one["p"], turned["p"], places=7)
            sign = (lambda x: 1 / x) if value == "ratio" else (lambda x: -x)
            self.assertAlmostEqual(one[value], sign(turned[value]), places=4)
            self.assertAlmostEqual(one["ci95_low"], sign(turned["ci95_high"]), places=4)

    def test_sensitivity_at_a_level(self):
        want, rows = EXPECTED["small"]["d_yes_no"], []
        for number, (hits, alarms) in enumerate(zip(want["hits"], want["false_alarms"])):
            for level, count, catch in ((2, hits, 0), (4, 20, 0), (0, alarms, 1)):
                for i in range(20):
                    rows.append({"participant_id": f"P{number}", "task": "detect", "block_name": "b", "renderer": "ray",
                                 "shape": "bump", "response": "yes" if i < count else "no", "level": level,
                                 "success": int(i < count), "catch_trial": catch})
        found = self.found(rows)
        one = found["d_prime_at_2"]["b"]["ray"]
        self.assertAlmostEqual(one["estimate"], want["d"], places=5)
        self.assertAlmostEqual(one["ci95_low"], want["d_ci95"][0], places=4)
        self.assertAlmostEqual(one["ci95_high"], want["d_ci95"][1], places=4)
        self.assertAlmostEqual(found["criterion_at_2"]["b"]["ray"]["estimate"], want["criterion"], places=5)
        # Everybody detects the other level always: d' is above a value.
        self.assertIsNone(found["d_prime_at_4"]["b"]["ray"]["ci95_high"])
        self.assertIn("d' at 2, ray: 2.363 [0.9864, 4.079] (6 participants)", self.text)

    def test_all_perfect_answers_bound_the_jnd_from_above(self):
        rows = [{**row, "success": int(float(row["level"]) > 300), "response": 1 + int(float(row["level"]) > 300)}
                for row in trials_of("two-sided.csv", 300)]
        found = self.found(rows)
        one = found["jnd"]["b"]["point"]
        self.assertIsNone(one["ci95_low"])
        self.assertGreater(one["ci95_high"], 0)
        self.assertIn("JND below ", self.text)


if __name__ == "__main__":
    unittest.main()
