"""Psychometric functions that palpate analyze fits: which form, scale and guesses, and where they have no meaning."""

import json
import math
import pathlib
import random
import statistics
import subprocess
import unittest

from task_study import PALPATE, PEOPLE, TaskStudy, logistic, rows_of_a_study

FIXTURES = pathlib.Path(__file__).with_name("fixtures")


def golden_section(f, low, high, steps=44):
    """The least value of f, and where it is."""
    share = (math.sqrt(5) - 1) / 2
    a, b = high - share * (high - low), low + share * (high - low)
    at_a, at_b = f(a), f(b)
    for _ in range(steps):
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - share * (high - low)
            at_a = f(a)
        else:
            low, a, at_a = a, b, at_b
            b = low + share * (high - low)
            at_b = f(b)
    return min(((f(x), x) for x in (low, high, (low + high) / 2)))


class LapsesAtBothEnds:
    """By the definition: maximum and profile likelihood with one lapse rate up to 0.06 at both ends."""

    def __init__(self, case, function, scale):
        place = math.log10 if scale == "log" else float
        self.points = [(place(level), n, k) for level, n, k in zip(case["levels"], case["n"], case["k"])]
        self.core = {"logistic": logistic, "normal": statistics.NormalDist().cdf,
                     "weibull": lambda z: 1 - math.exp(-10 ** min(z, 30))}[function]
        self.back = (lambda x: 10 ** x) if scale == "log" else float
        xs = [x for x, _, _ in self.points]
        self.low, self.high = min(xs), max(xs)
        self.steep = math.log(40 / (self.high - self.low))  # wide enough: the maximum lies within
        self.flat = self.steep - 4

    def loss(self, threshold, log_slope, lapse):
        total = 0
        for x, n, k in self.points:
            z = max(-700, min(700, math.exp(log_slope) * (x - threshold)))
            p = min(1 - 1e-15, max(1e-15, lapse + (1 - 2 * lapse) * self.core(z)))
            total -= k * math.log(p) + (n - k) * math.log(1 - p)
        return total

    def over_slope(self, threshold, lapse):
        return golden_section(lambda s: self.loss(threshold, s, lapse), self.flat, self.steep)

    def over_lapse(self, threshold):
        inner = golden_section(lambda r: self.over_slope(threshold, r)[0], 0, 0.06, 30)
        return min(inner, *((self.over_slope(threshold, r)[0], r) for r in (0, 0.06)))

    def best(self, threshold=None, lapse=None):
        """Loss, threshold, log slope and lapse, with what is given held."""
        def at(t):
            return self.over_lapse(t) if lapse is None else (self.over_slope(t, lapse)[0], lapse)

        t = threshold if threshold is not None else golden_section(lambda x: at(x)[0], self.low, self.high, 34)[1]
        value, rate = at(t)
        return value, t, self.over_slope(t, rate)[1], rate

    def found(self):
        least, threshold, log_slope, lapse = self.best()
        allowed = least + 0.5 * 3.841458820694124

        def end(inside, outside, held):
            if held(outside) <= allowed:
                return outside
            for _ in range(16):
                middle = (inside + outside) / 2
                inside, outside = (middle, outside) if held(middle) <= allowed else (inside, middle)
            return (inside + outside) / 2

        reach = (self.high - self.low) / 4
        low, high = (end(threshold, threshold + way, lambda t: self.best(threshold=t)[0]) for way in (-reach, reach))
        return {"log_likelihood": -least, "threshold": self.back(threshold), "slope": math.exp(log_slope),
                "fitted_lapse": lapse, "threshold_low": self.back(low), "threshold_high": self.back(high),
                "lapse_low": end(lapse, 0, lambda r: self.best(lapse=r)[0]),
                "lapse_high": end(lapse, 0.06, lambda r: self.best(lapse=r)[0])}


def trials_of(case, standard):
    return [{"participant_id": "T1", "session": 1, "block": 1, "trial": 1000 * place + i + 1, "renderer": "ray",
             "shape": "ball", "response": "2", "correct": 1, "task": "compare", "block_name": "b", "track": 1,
             "level": level, "standard_level": standard, "success": int(i < k)}
            for place, (level, n, k) in enumerate(zip(case["levels"], case["n"], case["k"])) for i in range(n)]


class PsychometricFunctions(TaskStudy):
    def test_levels_on_one_side_of_the_standard_are_a_forced_choice(self):
        seed = 3
        draw = random.Random(seed)
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

    def test_functions_by_command_are_those_of_r(self):
        """Maximum likelihood by R's optim on the definition (fixtures/make_psychophysics.R): of a comparison about a standard,
        and of a forced choice."""
        for case in json.loads((FIXTURES / "psychophysics.json").read_text())["by_command"]:
            function, scale = case["name"].split()
            both_sides = case["guess"] == 0
            standard = 500 if both_sides else 100
            if both_sides:  # R's lower end is 0 there, without lapses
                case |= LapsesAtBothEnds(case, function, scale).found()
            self.write(trials_of(case, standard))
            for chosen in ([["--scale", scale]] if function != "weibull" else [[], ["--scale", "log"]]):
                with self.subTest(case["name"], guess=case["guess"], chosen=chosen):
                    done = self.analyze("--function", function, *chosen, "--json", self.path / "one.json", "--force")
                    self.assertEqual((done.returncode, done.stderr), (0, ""))
                    self.assertIn(f"Psychometric functions: {function}", done.stdout)
                    cell, = json.loads((self.path / "one.json").read_text())["cells"]
                    fit = cell["psychometric_functions"][0]["fit"]
                    self.assertEqual((fit["function"], fit["scale"], fit["guess"]),
                                     (function, scale, fit["lapse"] if both_sides else case["guess"]))
                    self.check_fit(fit, case, both_sides)
                    self.check_discrimination(fit, case["guess"], standard)

    def check_fit(self, fit, case, both_sides):
        self.assertEqual(fit["guess_is_lapse"], both_sides)
        self.assertAlmostEqual(fit["log_likelihood"], case["log_likelihood"], delta=1e-6)
        self.assertAlmostEqual(fit["threshold"] / case["threshold"], 1, delta=1e-4)
        self.assertAlmostEqual(fit["slope"] / case["slope"], 1, delta=2e-3)
        self.assertAlmostEqual(fit["lapse"], case["fitted_lapse"], delta=1e-4)
        for end, value in zip(("lapse_low", "lapse_high"), fit["lapse_ci95"]):
            self.assertAlmostEqual(value, case[end], delta=1e-4)
        self.assertEqual(fit["guess_ci95"], fit["lapse_ci95"] if both_sides else [case["guess"]] * 2)
        for end, value in zip(("threshold_low", "threshold_high"), fit["threshold_ci95"]):
            self.assertAlmostEqual(value / case[end], 1, delta=1e-3)

    def check_discrimination(self, fit, guess, standard):
        """The JND of a forced choice is measured half-way from guessing to certainty, of a Weibull function by its
        inverse."""
        function = fit["function"]
        if guess == 0.5:
            half_way = fit["threshold"] * (math.log(2) ** (1 / fit["slope"]) if function == "weibull" else 1)
            self.assertAlmostEqual(fit["jnd"], half_way - standard, delta=1e-6 * standard)
        elif fit["scale"] == "log":
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
            words = {"linear": "untransformed levels", "log": "logarithm (base 10) of the levels"}[scale]
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
        seed = 8
        draw = random.Random(seed)
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
        seed = 5
        rows = [{**row, "interval_onsets": "0;1;2"} for row in self.forced(random.Random(seed), 350, 1 / 3)]
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
        seed = 6
        draw = random.Random(seed)
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


if __name__ == "__main__":
    unittest.main()
