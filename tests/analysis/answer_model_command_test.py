"""analyze --glmm: PSE and JND of every cell against R's glmer (fixtures/make_answers.R), whoever asks.

Usage: answer_model_command_test.py PALPATE FIXTURES
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

PALPATE, FIXTURES = pathlib.Path(sys.argv.pop(1)).resolve(), pathlib.Path(sys.argv.pop(1))
STUDIES = json.loads((FIXTURES / "answers.json").read_text())["studies"]
COLUMNS = ["participant_id", "task", "block_name", "renderer", "shape", "response", "level", "standard_level", "success",
           "comparison_interval", "n_intervals", "catch_trial"]
STANDARD = 10  # the fixture's levels are about 0


def rows_of(study, centre=STANDARD):
    """The fixture's answers as trials; its cells are renderers."""
    rows = []
    for person, cell, place, trials, successes in zip(*(study[key] for key in (
            "participant", "cell", "place", "trials", "successes"))):
        for i in range(trials):
            success = int(i < successes)
            rows.append({"participant_id": f"P{person:02}", "task": "compare", "block_name": "b", "renderer": f"r{cell}",
                         "shape": "ball", "response": 1 + success, "level": centre + place, "standard_level": centre,
                         "success": success, "comparison_interval": 2, "n_intervals": 2, "catch_trial": 0})
    return rows


class AnswerModel(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)

    def analyzed(self, rows, *options):
        with (self.path / "trials.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
        return subprocess.run([PALPATE, "analyze", "--csv", self.path / "trials.csv", "--json", self.path / "a.json", "--force",
                               "--report", self.path / "a.html", *options], capture_output=True, text=True)

    def models(self, rows, *options):
        done = self.analyzed(rows, "--scale", "linear", "--glmm", *options)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.text = done.stdout
        return json.loads((self.path / "a.json").read_text())["answer_models"]

    def test_cells_agree_with_glmer(self):
        for study in (STUDIES[0], STUDIES[3]):  # one group: the fixture's groups are no renderers
            model, = self.models(rows_of(study), "--bootstrap", "0")
            self.assertEqual(model["left_out"], [])
            self.assertAlmostEqual(model["log_likelihood"], study["log_likelihood"], places=4)
            cells = sorted(model["cells"], key=lambda one: one["renderer"])
            self.assertEqual(len(cells), study["cells"])
            for found, expected in zip(cells, study["figures"]):
                self.assertAlmostEqual(found["pse"]["estimate"], STANDARD + expected["pse"], delta=1e-4)
                self.assertAlmostEqual(found["pse"]["se"], expected["pse_se"], delta=1e-4)
                self.assertAlmostEqual(found["jnd"]["estimate"], expected["jnd"], delta=1e-4)
                self.assertAlmostEqual(found["jnd"]["se"], expected["jnd_se"], delta=1e-4)
                self.assertIsNone(found["pse"]["bootstrap_ci95"])

    def test_two_cells_have_one_test(self):
        model, = self.models(rows_of(STUDIES[1]), "--bootstrap", "200")
        for measure in ("pse", "jnd"):
            contrast, = model[measure]["contrasts"]
            effect = model[measure]["effects"]["renderer"]
            self.assertAlmostEqual(contrast["z"] ** 2, effect["chi_squared"], places=6)
            self.assertAlmostEqual(contrast["p"], effect["p"], places=9)
            low, high = contrast["bootstrap_ci95"]
            self.assertTrue(low < contrast["estimate"] < high, contrast)
            self.assertLess(abs((high - low) / (contrast["ci95"][1] - contrast["ci95"][0]) - 1), 0.25)
        self.assertEqual(model["bootstrap"]["studies"], 200)
        self.assertIn("Mixed model of all answers", self.text)
        self.assertIn("Mixed model of all answers", (self.path / "a.html").read_text())

    def test_ratios_on_a_logarithmic_scale(self):
        rows = rows_of(STUDIES[1], 0)
        for row in rows:
            row["level"], row["standard_level"] = 300 * 10 ** (row["level"] / 20), 300
        done = self.analyzed(rows, "--scale", "log", "--glmm", "--bootstrap", "0")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        model, = json.loads((self.path / "a.json").read_text())["answer_models"]
        for found, expected in zip(model["cells"], STUDIES[1]["figures"]):
            self.assertAlmostEqual(found["pse"]["estimate"], 300 * 10 ** (expected["pse"] / 20), delta=0.01)
            self.assertAlmostEqual(found["weber_fraction"]["estimate"], 10 ** (expected["jnd"] / 20) - 1, delta=1e-5)

    def test_guessing_has_a_reason(self):
        rows = [row for row in rows_of(STUDIES[0]) if row["level"] > STANDARD]
        model, = self.models(rows)
        self.assertIn("guessing", model["reason"])

    def test_reversed_answers_are_left_out(self):
        rows = rows_of(STUDIES[3])
        for row in rows:
            if row["participant_id"] == "P04":
                row["success"] = 1 - row["success"]
        model, = self.models(rows, "--bootstrap", "0")
        self.assertEqual((model["left_out"], model["n_participants"]), (["P04"], 9))

    def test_steep_answers_have_no_bootstrap(self):
        """People whose simulated answers often are a step: a slope without an end."""
        study = {"participant": [], "cell": [], "place": [], "trials": [], "successes": []}
        for person in range(6):
            for place, successes in ((-2, 0), (-1, int(person < 1)), (1, 5 - int(person in (0, 2))), (2, 5)):
                for key, value in (("participant", person), ("cell", 0), ("place", place), ("trials", 5), ("successes", successes)):
                    study[key].append(value)
        model, = self.models(rows_of(study), "--bootstrap", "100")
        self.assertGreater(model["bootstrap"]["without_value"], 2)
        self.assertIsNone(model["cells"][0]["pse"]["bootstrap_ci95"])
        self.assertIn("No bootstrap", self.text)

    def test_rows_and_origin_of_levels_change_nothing(self):
        rows = rows_of(STUDIES[0])
        first, = self.models(rows, "--bootstrap", "100")
        far, = self.models(rows_of(STUDIES[0], 1e8)[::-1], "--bootstrap", "100")
        for measure, shift in (("pse", 1e8 - STANDARD), ("jnd", 0)):
            one, other = first["cells"][0][measure], far["cells"][0][measure]
            self.assertAlmostEqual(other["estimate"] - shift, one["estimate"], delta=1e-5)
            self.assertAlmostEqual(other["se"], one["se"], delta=1e-5)
            for a, b in zip(other["bootstrap_ci95"], one["bootstrap_ci95"]):
                self.assertAlmostEqual(a - shift, b, delta=1e-4)

    def test_options_that_do_not_fit(self):
        for options, words in ((("--bootstrap", "200"), "give --glmm"), (("--glmm", "--bootstrap", "20"), "100 to 100000"),
                               (("--glmm", "--cues"), "cannot be combined with --cues")):
            done = self.analyzed(rows_of(STUDIES[0]), *options)
            self.assertEqual(done.returncode, 2)
            self.assertIn(words, done.stderr)


if __name__ == "__main__":
    unittest.main()
