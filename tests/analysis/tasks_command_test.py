"""palpate analyze of trials with tasks: a table with known functions, its text and JSON, and what is refused."""

import csv
import json
import math
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile
import unittest

PALPATE = sys.argv.pop(1)
FIXTURES = pathlib.Path(__file__).with_name("fixtures")
PEOPLE = 5  # of a forced choice
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
            there = {name: None for row in rows for name in row}
            columns = [name for name in COLUMNS if name in there] + [name for name in there if name not in COLUMNS]
            writer = csv.DictWriter(file, columns, extrasaction="raise", restval="")
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

    def forced(self, draw, level, guess, **more):
        """40 trials at six levels above a standard of 300; the threshold is 350, the slope 0.06 per N/m."""
        return [{"participant_id": f"T{person}", "session": 1, "block": 1, "trial": person * 1000 + i + 1, "renderer": "point",
                 "shape": "ball", "response": "1", "correct": 0, "response_time": 1, "practice": 0, "timed_out": 0, "simulated": 1,
                 "task": "compare", "block_name": "b", "track": 1, "level": x, "standard_level": 300, "catch_trial": 0,
                 "success": int(draw.random() < guess + (1 - guess) * logistic(0.06 * (x - level))), **more}
                for person in range(PEOPLE) for i, x in enumerate(list(range(310, 420, 18)) * 40)]

    def found(self, rows):
        self.write(rows)
        self.assertEqual(self.analyze("--json", self.path / "found.json", "--force").returncode, 0)
        return json.loads((self.path / "found.json").read_text())

    def test_functions_by_command_are_those_of_r(self):
        """Maximum likelihood by R's optim on the definition (fixtures/make_psychophysics.R): of a comparison about a standard,
        and of a forced choice. The JND of a forced choice is measured half-way from guessing to certainty, of a Weibull
        function by its inverse."""
        for case in json.loads((FIXTURES / "psychophysics.json").read_text())["by_command"]:
            function, scale = case["name"].split()
            standard = 500 if case["guess"] == 0 else 100
            rows = [{"participant_id": "T1", "session": 1, "block": 1, "trial": 1000 * place + i + 1, "renderer": "ray", "shape": "ball",
                     "response": "2", "correct": 1, "task": "compare", "block_name": "b", "track": 1, "level": level,
                     "standard_level": standard, "success": int(i < k)}
                    for place, (level, n, k) in enumerate(zip(case["levels"], case["n"], case["k"])) for i in range(n)]
            self.write(rows)
            for chosen in ([["--scale", scale]] if function != "weibull" else [[], ["--scale", "log"]]):
                with self.subTest(case["name"], guess=case["guess"], chosen=chosen):
                    done = self.analyze("--function", function, *chosen, "--json", self.path / "one.json", "--force")
                    self.assertEqual((done.returncode, done.stderr), (0, ""))
                    self.assertIn(f"Psychometric functions: {function}", done.stdout)
                    cell, = json.loads((self.path / "one.json").read_text())["cells"]
                    fit = cell["psychometric_functions"][0]["fit"]
                    self.assertEqual((fit["function"], fit["scale"], fit["guess"]), (function, scale, case["guess"]))
                    self.assertAlmostEqual(fit["log_likelihood"], case["log_likelihood"], delta=1e-6)
                    self.assertAlmostEqual(fit["threshold"] / case["threshold"], 1, delta=1e-4)
                    self.assertAlmostEqual(fit["slope"] / case["slope"], 1, delta=2e-3)
                    self.assertAlmostEqual(fit["lapse"], case["fitted_lapse"], delta=1e-4)
                    for end, value in zip(("lapse_low", "lapse_high"), fit["lapse_ci95"]):
                        self.assertAlmostEqual(value, case[end], delta=1e-4)
                    self.assertEqual(fit["guess_ci95"], [case["guess"]] * 2)
                    for end, value in zip(("threshold_low", "threshold_high"), fit["threshold_ci95"]):
                        self.assertAlmostEqual(value / case[end], 1, delta=1e-3)
                    if case["guess"] == 0.5:
                        half_way = fit["threshold"] * (math.log(2) ** (1 / fit["slope"]) if function == "weibull" else 1)
                        self.assertAlmostEqual(fit["jnd"], half_way - standard, delta=1e-6 * standard)
                    elif scale == "log":
                        quartile = {"logistic": lambda p: math.log(p / (1 - p)), "normal": statistics.NormalDist().inv_cdf,
                                    "weibull": lambda p: math.log10(-math.log(1 - p))}[function]
                        ratio = 10 ** ((quartile(0.75) - quartile(0.25)) / 2 / fit["slope"])
                        self.assertAlmostEqual(fit["weber_fraction"], ratio - 1, delta=1e-6)

    def scales(self, *more):
        done = subprocess.run([PALPATE, "analyze", *more, "--json", self.path / "scales.json", "--force"], capture_output=True,
                              text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        cells = json.loads((self.path / "scales.json").read_text())["cells"]
        return {cell["block_name"]: cell["psychometric_functions"][0]["fit"]["scale"] for cell in cells}, done.stdout

    def test_levels_are_taken_on_the_scale_that_their_procedure_has(self):
        ball = {"shape": "sphere", "radius_m": 0.025, "subdivisions": 1, "stiffness_n_per_m": 400}
        compare = {"task": "compare", "stimuli": ["ball"], "standard": "ball", "level": {"path": "/radius_m"}}
        stairs = {"kind": "staircase", "start": 0.034, "min": 0.026, "max": 0.036, "stop": {"trials": 12}}
        constant = {"kind": "constant", "repetitions": 4}
        logs = stairs | {"scale": "log", "steps": [0.02]}
        procedures = {
            "even": constant | {"levels": [0.027, 0.03, 0.033]},
            "ratios": constant | {"levels": {"from": 0.026, "to": 0.036, "count": 5, "spacing": "log"}},
            "metres": stairs | {"steps": [0.001]}, "logs": logs,
            "mixed": [stairs | {"steps": [0.001]}, logs]}
        (self.path / "p.json").write_text(json.dumps({
            "version": 2, "name": "scales", "renderers": ["ray"], "orientation": "fixed", "stimuli": [{"name": "ball"} | ball],
            "blocks": [{"name": name, **compare, "procedure": one} for name, one in procedures.items()]}))
        db = self.path / "scales.db"
        subprocess.run([PALPATE, "simulate", self.path / "p.json", "--db", db, "--participants", "1"], check=True,
                       capture_output=True)
        expected = {"even": "linear", "ratios": "log", "metres": "linear", "logs": "log", "mixed": "linear"}
        found, text = self.scales("--db", db)
        self.assertEqual(found, expected)
        for block, scale in expected.items():
            words = {"linear": "levels as they are", "log": "logarithm (base 10) of the levels"}[scale]
            self.assertRegex(text, rf"compare, {block}, .*\n  functions over the {words.replace('(', '[(]').replace(')', '[)]')}\n")
        self.assertNotIn("[-", text, "no size is below 0")
        for wish in ("linear", "log"):
            self.assertEqual(set(self.scales("--db", db, "--scale", wish)[0].values()), {wish})
        self.assertEqual(set(self.scales("--db", db, "--function", "weibull")[0].values()), {"log"})
        # A table has no protocol: levels alone tell.
        table = self.path / "scales.csv"
        subprocess.run([PALPATE, "export", "--db", db, "--format", "csv", "--out", table], check=True, capture_output=True)
        self.assertNotIn("--scale log", text)
        found, text = self.scales("--csv", table)
        self.assertIn("give --scale log", text)
        self.assertNotIn("[-", text)
        self.assertNotIn("--scale log", self.scales("--csv", table, "--scale", "linear")[1])
        self.assertEqual((found["even"], found["ratios"]), ("linear", "log"))

    def test_functions_are_refused_where_they_have_no_meaning(self):
        self.write(rows_of_a_study(1)[:50])
        for wrong, said in ((["--function", "gumbel"], "logistic, normal or weibull"), (["--scale", "db"], "linear or log"),
                            (["--function", "weibull", "--scale", "linear"], "log with --function weibull")):
            done = self.analyze(*wrong)
            self.assertEqual(done.returncode, 2, wrong)
            self.assertIn(said, done.stderr)
        rows = [row | {"level": row["level"] - 400} for row in rows_of_a_study(1) if row["task"] == "compare"]
        self.write(rows)
        done = self.analyze("--scale", "log")
        self.assertEqual(done.returncode, 0)
        self.assertIn("levels below 0 have no place on a logarithmic scale", done.stdout)

    def test_catch_trials_tell_guesses_on_a_logarithmic_scale_too(self):
        draw = random.Random(8)
        for function in ("logistic", "normal", "weibull"):
            rows = [{"participant_id": "T1", "session": 1, "block": 1, "trial": i + 1, "renderer": "ray", "shape": "bump", "correct": "",
                     "task": "detect", "block_name": "b", "track": 1, "level": level or "", "catch_trial": int(level == 0),
                     "success": int(draw.random() < 0.2 + 0.78 * (1 - math.exp(-(level / 2) ** 3))), "response": "yes"}
                    for i, level in enumerate([0, 0, 0.5, 1, 1.5, 2, 2.5, 3, 4] * 60)]
            self.write(rows)
            done = self.analyze("--function", function, "--scale", "log", "--json", self.path / "one.json", "--force")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            one, = json.loads((self.path / "one.json").read_text())["cells"][0]["psychometric_functions"]
            false_alarms = sum(row["success"] for row in rows if row["catch_trial"]) / 120
            self.assertAlmostEqual(one["fit"]["guess"], false_alarms, delta=0.09)
            self.assertAlmostEqual(one["fit"]["threshold"], 2 if function == "weibull" else 1.77, delta=0.35)
            self.assertTrue(one["fit"]["determined"])
            self.assertAlmostEqual(one["bayes"]["threshold"], one["fit"]["threshold"], delta=0.15)

    def test_three_intervals_are_guessed_by_a_third(self):
        rows = [{**row, "interval_onsets": "0;1;2"} for row in self.forced(random.Random(5), 350, 1 / 3)]
        cell, = self.found(rows)["cells"]
        self.assertEqual((cell["n_intervals"], cell["forced_choice"]), (3, True))
        held = 0
        for one in cell["psychometric_functions"]:
            fit = one["fit"]
            self.assertAlmostEqual(fit["guess"], 1 / 3)
            self.assertIsNone(fit["pse"])
            # The JND of a forced choice is the threshold's distance from the standard, in text and JSON alike.
            self.assertAlmostEqual(fit["jnd"], fit["threshold"] - 300)
            self.assertAlmostEqual(fit["weber_fraction"], fit["jnd"] / 300)
            self.assertAlmostEqual(fit["jnd_ci95"][0], fit["threshold_ci95"][0] - 300)
            held += fit["threshold_ci95"][0] <= 350 <= fit["threshold_ci95"][1]
        self.assertGreaterEqual(held, PEOPLE - 2)
        both = [{**row, "standard_level": 350} for row in rows]
        cell, = self.found(both)["cells"]
        self.assertIn("both sides", cell["psychometric_functions"][0]["fit"]["reason"])

    def test_same_different_has_guesses_of_its_catch_trials_and_a_d_prime(self):
        draw = random.Random(6)
        rows = self.forced(draw, 350, 0.2)
        for row in rows:
            row["response"] = "different" if row["success"] else "same"
        for person in range(PEOPLE):
            for i in range(160):
                success = int(draw.random() < 0.2)
                rows.append({**rows[0], "participant_id": f"T{person}", "trial": 100000 + i, "level": "", "catch_trial": 1,
                             "success": success, "response": "different" if success else "same"})
        cell, = self.found(rows)["cells"]
        self.assertEqual((cell["same_different"], cell["forced_choice"]), (True, False))
        for one in cell["psychometric_functions"]:
            self.assertAlmostEqual(one["fit"]["guess"], 0.2, delta=0.1)
            self.assertAlmostEqual(one["fit"]["threshold"], 350, delta=15)
            self.assertIsNone(one["fit"]["pse"])
            self.assertGreater(one["detectability"]["d_prime"], 1)

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
