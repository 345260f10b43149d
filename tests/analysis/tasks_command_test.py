"""palpate analyze of trials with tasks: a table with known functions, its text and JSON, and what is refused."""

import json
import math
import random
import unittest

from task_study import PEOPLE, TaskStudy, logistic, rows_of_a_study


class Tasks(TaskStudy):
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

    def test_thresholds_that_nothing_tells_are_not_compared(self):
        draw = random.Random(7)
        rows = self.forced(draw, 350, 0.5)
        for row in rows:
            row["participant_id"] += "" if row["participant_id"] != "T4" else "x"
        other = [{**row, "renderer": "ray", "trial": row["trial"] + 500,
                  "success": int(draw.random() < 0.5 + 0.5 * logistic(0.06 * (row["level"] - 360)))} for row in rows]
        for row in other:  # one of them guesses all the time
            if row["participant_id"] == "T1":
                row["success"] = int(draw.random() < 0.5)
        found = self.found(rows + other)
        one, = found["renderer_comparisons"]
        self.assertEqual((one["measure"], one["natural_logarithms"]), ("jnd", True))
        self.assertGreaterEqual(one["n_undetermined"], 1)
        self.assertLess(one["differences"][0]["n_pairs"], PEOPLE)
        self.assertLess(abs(one["differences"][0]["mean"]), 1)

    def test_without_success_it_follows_from_the_answer_or_is_asked_for(self):
        rows = rows_of_a_study(1)
        with_column = self.found(rows)["cells"]
        for row in rows:
            row["comparison_interval"] = "2" if row["task"] == "compare" else ""
            del row["success"]
        cells = self.found(rows)["cells"]
        for a, b in zip(with_column, cells):
            if a["task"] in ("compare", "detect"):
                self.assertEqual([one["levels"] for one in a["psychometric_functions"]],
                                 [one["levels"] for one in b["psychometric_functions"]])
        for row in rows:
            del row["comparison_interval"]
        self.write(rows)
        done = self.analyze()
        self.assertEqual(done.returncode, 2)
        self.assertIn("comparison_interval", done.stderr)

    def test_trials_given_twice_are_refused_and_somebody_may_be_called_NA(self):
        rows = self.forced(random.Random(8), 350, 0.5)
        for row in rows:
            row["participant_id"] = row["participant_id"].replace("T1", "NA")
        cell, = self.found(rows)["cells"]
        self.assertIn("NA", [one["participant_id"] for one in cell["psychometric_functions"]])
        self.write(rows + rows[:3])
        done = self.analyze()
        self.assertEqual(done.returncode, 2)
        self.assertIn("expected each trial once", done.stderr)

    def test_several_protocols_are_told_apart(self):
        rows = [{**row, "protocol_name": "one", "protocol_sha256": "ab12cd34ef"} for row in self.forced(random.Random(9), 350, 0.5)]
        rows += [{**row, "protocol_name": "two", "protocol_sha256": "77aa55"} for row in self.forced(random.Random(9), 390, 0.5)]
        self.write(rows)
        done = self.analyze()
        self.assertEqual(done.returncode, 2)
        self.assertIn("--protocol", done.stderr)
        for wanted, threshold in (("one", 350), ("ab12cd", 350), ("two", 390)):
            self.assertEqual(self.analyze("--protocol", wanted, "--json", self.path / "p.json", "--force").returncode, 0)
            cell, = json.loads((self.path / "p.json").read_text())["cells"]
            mean = sum(one["fit"]["threshold"] for one in cell["psychometric_functions"]) / PEOPLE
            self.assertAlmostEqual(mean, threshold, delta=15)
        self.assertEqual(self.analyze("--protocol", "three").returncode, 2)

    def test_perfect_answers_transmit_no_more_than_there_is(self):
        rows = [row for row in rows_of_a_study(1) if row["task"] == "identify"]
        for row in rows:
            row["response"], row["correct"] = row["shape"], 1
        cell, = self.found(rows)["cells"]
        self.assertEqual(cell["information_transfer"]["bits_corrected"], 1)
        self.assertEqual(cell["information_transfer"]["mean_of_participants_bits_corrected"], 1)
        self.assertEqual(len(cell["information_transfer"]["participants"]), 6)

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
