"""palpate analyze of trials with tasks: a table with known functions, its text and JSON, and what is refused."""

import csv
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest

PALPATE = sys.argv.pop(1)
COLUMNS = ["participant_id", "session", "block", "trial", "renderer", "shape", "response", "correct",
           "response_time", "practice", "timed_out", "simulated", "task", "block_name", "track", "level",
           "standard_level", "catch_trial", "success", "number", "confidence"]


def logistic(x):
    return 1 / (1 + math.exp(-x))


def rows_of_a_study(seed):
    """Six participants, two renderers: compare about 500 N/m, detect, rate, adjust, identify."""
    draw = random.Random(seed)
    rows = []

    def add(participant, task, block, renderer, shape, response, success, **more):
        rows.append({"participant_id": participant, "session": 1, "block": 1, "trial": len(rows) + 1,
                     "renderer": renderer, "shape": shape, "response": response, "correct": int(success),
                     "response_time": 1.5, "practice": 0, "timed_out": 0, "simulated": 1, "task": task,
                     "block_name": block, "track": 1, "success": int(success), "catch_trial": 0, **more})

    for person in range(6):
        name = f"T{person}"
        shift = draw.gauss(0, 10)
        for renderer, pse in (("point", 540 + shift), ("ray", 500 + shift)):
            for _ in range(30):
                for level in range(300, 701, 50):
                    success = draw.random() < logistic((level - pse) / 40)
                    add(name, "compare", "stiffness", renderer, "ball", "2" if success else "1", success,
                        level=level, standard_level=500, confidence=draw.randint(1, 3) + 2 * int(success))
        for _ in range(40):
            for level in (0, 1, 2, 3, 4):
                success = draw.random() < 0.1 + 0.88 * logistic(3 * (level - 2)) if level else draw.random() < 0.1
                add(name, "detect", "bump", "ray", "bump", "yes" if success else "no", success,
                    level=level or "", catch_trial=int(level == 0))
        for level in (1, 10, 100):
            for _ in range(3):
                add(name, "rate", "roughness", "ray", "plate", "", False, correct="", level=level,
                    number=round((person + 1) * level ** 0.6, 6))
        for above in (True, False):
            for _ in range(4):
                add(name, "adjust", "match", "ray", "ball", "", False, correct="", level=700 if above else 300,
                    standard_level=500, number=round(505 + (5 if above else -5) + draw.gauss(0, 4), 3))
        for shape in ("sphere", "cube"):
            for _ in range(20):
                right = draw.random() < 0.9
                add(name, "identify", "shapes", "ray", shape, shape if right else {"sphere": "cube", "cube": "sphere"}[shape], right)
    return rows


class Tasks(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)

    def write(self, rows):
        with open(self.path / "trials.csv", "w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)

    def analyze(self, *more):
        return subprocess.run([PALPATE, "analyze", "--csv", self.path / "trials.csv", *more], capture_output=True,
                              text=True)

    def test_known_functions_are_found(self):
        for seed in (1, 2):
            self.write(rows_of_a_study(seed))
            json_file = self.path / f"{seed}.json"
            done = self.analyze("--json", json_file)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertTrue(done.stdout.startswith("SIMULATED PARTICIPANTS"))
            found = json.loads(json_file.read_text())
            self.assertTrue(found["simulated"])
            cells = {(cell["task"], cell["renderer"]): cell for cell in found["cells"]}
            functions = cells["compare", "point"]["psychometric_functions"]
            self.assertEqual(len(functions), 6)
            self.assertFalse(cells["compare", "point"]["forced_choice"])
            pses = [one["fit"]["pse"] for one in functions]
            self.assertAlmostEqual(sum(pses) / 6, 540, delta=12)
            for one in functions:
                self.assertAlmostEqual(one["fit"]["jnd"], 40 * math.log(3), delta=22)
                self.assertEqual(sum(level["trials"] for level in one["levels"]), 270)
                self.assertEqual([len(track["levels"]) for track in one["tracks"]], [270])
                self.assertEqual(one["tracks"][0]["reversal_trials"], [])  # constant stimuli do not turn
                bayes = one["bayes"]
                self.assertAlmostEqual(bayes["threshold"], one["fit"]["threshold"], delta=8)
                self.assertLess(bayes["threshold_ci95"][0], bayes["threshold"])
            difference, = found["renderer_comparisons"][0]["differences"]
            self.assertAlmostEqual(math.exp(difference["mean"]), 500 / 540, delta=0.02)
            self.assertLess(difference["p"], 0.05)
            self.assertGreater(cells["compare", "ray"]["confidence"]["type2_roc_area"], 0.4)
            for one in cells["detect", "ray"]["psychometric_functions"]:
                self.assertAlmostEqual(one["fit"]["threshold"], 2, delta=0.7)
                self.assertGreater(one["detectability"]["d_prime"], 1)
            rated = cells["rate", "ray"]["magnitude_estimation"]
            self.assertAlmostEqual(rated["exponent"], 0.6, places=5)
            for one in cells["adjust", "ray"]["adjustments"]:
                self.assertAlmostEqual(one["constant_error"], 5, delta=5)
                self.assertAlmostEqual(one["start_effect"], 10, delta=10)
            bits = cells["identify", "ray"]["information_transfer"]
            self.assertLess(bits["bits_corrected"], bits["bits"])
            self.assertAlmostEqual(bits["stimulus_entropy_bits"], 1, places=9)

    def test_levels_on_one_side_of_the_standard_are_a_forced_choice(self):
        draw = random.Random(3)
        rows = []
        for row in rows_of_a_study(1):
            if row["task"] == "compare":
                row["level"] = 500 + 0.5 * (row["level"] - 290)
                row["success"] = int(draw.random() < 0.5 + 0.5 * logistic((row["level"] - 600) / 20))
                rows.append(row)
        self.write(rows)
        self.assertEqual(self.analyze("--json", self.path / "forced.json").returncode, 0)
        for cell in json.loads((self.path / "forced.json").read_text())["cells"]:
            self.assertTrue(cell["forced_choice"])
            for one in cell["psychometric_functions"]:
                self.assertEqual(one["fit"]["guess"], 0.5)
                self.assertAlmostEqual(one["fit"]["threshold"], 600, delta=30)

    def test_report_and_figures_show_points_fits_and_tracks(self):
        self.write([row for row in rows_of_a_study(4) if row["participant_id"] < "T2"])
        done = self.analyze("--report", self.path / "report.html", "--figures", self.path / "figures")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        page = (self.path / "report.html").read_text()
        self.assertIn("SIMULATED PARTICIPANTS", page)
        self.assertIn("Psychometric functions: compare, stiffness, ball, point", page)
        names = {file.name for file in (self.path / "figures").iterdir()}
        self.assertLessEqual({f"{kind}{i}.svg" for kind in ("function", "track") for i in (1, 2, 3)}, names)
        self.assertIn("figure15.svg", names)  # of identification, as in version 1
        drawn = (self.path / "figures" / "function1.svg").read_text()
        self.assertIn("of 30 trials", drawn)

    def test_faults_name_line_and_column(self):
        rows = rows_of_a_study(1)[:20]
        rows[3]["level"] = "soft"
        rows[5]["task"] = "guess"
        self.write(rows)
        done = self.analyze()
        self.assertEqual(done.returncode, 2)
        self.assertIn("line 5, level", done.stderr)
        self.assertIn("line 7, task", done.stderr)

    def test_only_practice_is_no_study(self):
        rows = rows_of_a_study(1)[:4]
        for row in rows:
            row["practice"] = 1
        self.write(rows)
        self.assertEqual(self.analyze().returncode, 2)


if __name__ == "__main__":
    unittest.main()
