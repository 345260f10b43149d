"""palpate analyze on ratings, from outside: named stimuli, labelled steps, magnitude estimation; numbers against sums
made here. Usage: rating_command_test.py PALPATE"""

import itertools
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

sys.dont_write_bytecode = True
PALPATE = sys.argv.pop(1)
SVG = "{http://www.w3.org/2000/svg}"
STIMULI = ("silk", "wool", "sandpaper")


def mean(values):
    return sum(values) / len(values)


def sd(values):
    return math.sqrt(sum((one - mean(values)) ** 2 for one in values) / (len(values) - 1))


def p_of_t(t, df):
    """Two-sided, by Simpson's rule over the density from 0 to |t|."""
    constant = math.exp(math.lgamma((df + 1) / 2) - math.lgamma(df / 2)) / math.sqrt(df * math.pi)
    steps, t = 20000, abs(t)
    total = sum((1 if i in (0, steps) else 4 if i % 2 else 2) * (1 + (t * i / steps) ** 2 / df) ** (-(df + 1) / 2)
                for i in range(steps + 1))
    return 1 - 2 * constant * total * t / steps / 3


def signed_rank_p(differences):
    """Exact: all signs of the midranks of the differences that are not 0."""
    sizes = [abs(d) for d in differences if abs(d) > 1e-9]
    ranks = [sum(b < a - 1e-9 for b in sizes) + (sum(abs(b - a) <= 1e-9 for b in sizes) + 1) / 2 for a in sizes]
    observed = sum(rank for rank, d in zip(ranks, [d for d in differences if abs(d) > 1e-9]) if d > 0)
    sums = [sum(rank for rank, sign in zip(ranks, signs) if sign) for signs in itertools.product((0, 1), repeat=len(ranks))]
    low = sum(one <= observed + 1e-9 for one in sums) / len(sums)
    high = sum(one >= observed - 1e-9 for one in sums) / len(sums)
    return observed, min(1, 2 * min(low, high))


class Ratings(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)

    def palpate(self, *args):
        done = subprocess.run([PALPATE, *map(str, args)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def analysed(self, source, *args):
        out = self.path / "a.json"
        text = self.palpate("analyze", *source, "--json", out, "--report", self.path / "a.html",
                            "--figures", self.path / "figures", "--force", *args)
        return text, json.loads(out.read_text())

    def named_study(self, seed, people):
        """Two renderers, three stimuli, four ratings of 1 to 7 each; the ray feels rougher. No number column: a
        program that asks on a scale writes its number as the response."""
        draw = random.Random(seed)
        ratings = {}
        lines = ["participant_id,task,renderer,shape,response,block_name"]
        for person in range(people):
            own = draw.gauss(0, 0.5)
            for r, renderer in enumerate(("point", "ray")):
                for s, stimulus in enumerate(STIMULI):
                    for _ in range(4):
                        number = min(7, max(1, round(2 + 1.5 * s + 0.8 * r + own + draw.gauss(0, 0.8))))
                        ratings.setdefault((renderer, stimulus), {}).setdefault(f"P{person}", []).append(number)
                        lines.append(f"P{person},rate,{renderer},{stimulus},{number},rough")
        table = self.path / "named.csv"
        table.write_text("\n".join(lines) + "\n")
        return table, ratings

    def check_difference(self, found, differences):
        n = len(differences)
        t = mean(differences) / (sd(differences) / math.sqrt(n))
        self.assertEqual((found["n_pairs"], found["df"]), (n, n - 1))
        self.assertAlmostEqual(found["mean"], mean(differences), places=12)
        self.assertAlmostEqual(found["t"], t, places=9)
        self.assertAlmostEqual(found["p"], p_of_t(t, n - 1), places=7)
        self.assertAlmostEqual(found["dz"], mean(differences) / sd(differences), places=9)
        v, p = signed_rank_p(differences)
        self.assertAlmostEqual(found["wilcoxon"]["V_positive_rank_sum"], v)
        self.assertAlmostEqual(found["wilcoxon"]["p"], p, places=12)
        self.assertEqual("note" in found["wilcoxon"], found["wilcoxon"]["n_nonzero"] <= 5)

    def test_named_stimuli_are_compared_as_defined(self):
        for seed, people in ((1, 6), (2, 9)):
            table, ratings = self.named_study(seed, people)
            text, found = self.analysed(["--csv", table])
            self.assertEqual(len(found["cells"]), 6)
            means = {place: {who: mean(own) for who, own in people_.items()} for place, people_ in ratings.items()}
            for cell in found["cells"]:
                own = ratings[cell["renderer"], cell["shape"]]
                rated = cell["ratings"]
                self.assertNotIn("magnitude_estimation", cell)
                everybody = sorted(itertools.chain(*own.values()))
                self.assertEqual(rated["all"]["n_ratings"], len(everybody))
                self.assertAlmostEqual(rated["all"]["median"], mean([everybody[(len(everybody) - 1) // 2], everybody[len(everybody) // 2]]))
                self.assertAlmostEqual(rated["mean_of_participants"]["mean"], mean([mean(x) for x in own.values()]))
                self.assertAlmostEqual(sum(step["share"] for step in rated["steps"]), 1)
                for step in rated["steps"]:
                    self.assertEqual(step["n_ratings"], everybody.count(step["number"]))
                    self.assertAlmostEqual(step["share"], mean([x.count(step["number"]) / len(x) for x in own.values()]))
            by_stimulus = {one["shape"]: one for one in found["renderer_comparisons"]}
            self.assertEqual(set(by_stimulus), set(STIMULI))
            for stimulus, one in by_stimulus.items():
                self.check_difference(one["differences"][0], [means["ray", stimulus][who] - means["point", stimulus][who]
                                                              for who in means["ray", stimulus]])
                self.assertEqual(one["n_tests"], 3)
            pairs = [(one["renderer"], one["reference"], each["condition"], each)
                     for one in found["condition_comparisons"] for each in one["differences"]]
            self.assertEqual(len(pairs), 6, "three pairs of stimuli with each renderer")
            for renderer, first, second, each in pairs:
                self.check_difference(each, [means[renderer, second][who] - means[renderer, first][who]
                                             for who in means[renderer, first]])
            self.assertIn("Mean ratings by renderer, rate, rough, silk (differences)", text)
            self.assertIn("To quote", text)
            self.assertEqual("(5 or fewer differ: p cannot be below 0.05)" in text,
                             any("note" in each["wilcoxon"] for *_, each in pairs)
                             or any("note" in one["differences"][0]["wilcoxon"] for one in by_stimulus.values()))

    def test_the_page_opens_with_the_finding_and_has_tables(self):
        table, _ = self.named_study(3, 8)
        text, _ = self.analysed(["--csv", table])
        page = (self.path / "a.html").read_text()
        title = page.split("<h1>")[1].split("</h1>")[0]
        self.assertRegex(title, r"(Mean ratings|No clear difference)")
        self.assertTrue(text.startswith(title[:40].replace("\u00a0", " ")), (title, text[:200]))
        self.assertNotIn("<pre", page)
        for said in ("Shares of the answers", "p (Wilcoxon)", "Means over participants", "To quote", "Save as CSV"):
            self.assertIn(said, page)
        drawn = [title.text for title in xml.parse(self.path / "figures" / "rating1.svg").getroot().iter(SVG + "title")]
        self.assertTrue(any(one.startswith("sandpaper, ray: mean") for one in drawn))
        self.assertTrue(any(one.startswith("P0, silk, point: mean") for one in drawn))

    def study(self, **block):
        protocol = {"version": 2, "name": "rated", "renderers": ["point"], "orientation": "fixed", "seed": 3,
                    "stimuli": [{"name": "plate", "shape": "box", "size_m": [0.05, 0.05, 0.02], "stiffness_n_per_m": 500,
                                 "friction_static": 0.3, "friction_dynamic": 0.3}],
                    "blocks": [{"name": "rough", "task": "rate", "question": "How rough?", "stimuli": ["plate"],
                                "level": {"path": "/friction_static"},
                                "procedure": {"kind": "constant", "levels": [0.3, 0.6, 1.2], "repetitions": 4}} | block]}
        (self.path / "p.json").write_text(json.dumps(protocol))
        self.palpate("simulate", self.path / "p.json", "--db", self.path / "s.db", "--participants", 5)
        return ["--db", self.path / "s.db"]

    def test_options_of_functions_are_refused(self):
        table, _ = self.named_study(1, 2)
        for option in (["--function", "logistic"], ["--scale", "log"], ["--glmm"]):
            done = subprocess.run([PALPATE, "analyze", "--csv", table, *option], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stdout), (2, ""), option)
            self.assertIn("there are no tasks with psychometric functions", done.stderr)

    def test_labelled_steps_get_no_power_law(self):
        source = self.study(scale=[{"label": "smooth"}, {"label": "so so"}, {"label": "rough"}, {"label": "never said"}])
        text, found = self.analysed(source)
        cell, = found["cells"]
        self.assertNotIn("magnitude_estimation", cell)
        self.assertNotIn("exponent", text)
        self.assertEqual([step["label"] for step in cell["ratings"]["steps"]], ["smooth", "so so", "rough", "never said"])
        self.assertEqual([level["level"] for level in cell["ratings"]["levels"]], [0.3, 0.6, 1.2])
        self.assertTrue((self.path / "figures" / "rating1.svg").exists())

    def test_magnitudes_are_drawn_over_their_levels(self):
        _, found = self.analysed(self.study(min=0.001))
        cell, = found["cells"]
        self.assertNotIn("ratings", cell)
        root = xml.parse(self.path / "figures" / "magnitude1.svg").getroot()
        drawn = [title.text for title in root.iter(SVG + "title")]
        for level in cell["magnitude_estimation"]["levels"]:
            wanted = f"level {level['level']:.4g}: geometric mean {level['geometric_mean']:.4g}"
            self.assertTrue(any(one.startswith(wanted) for one in drawn), wanted)
        for one in cell["magnitude_estimation"]["participants"]:
            self.assertTrue(any(text.startswith(f"{one['participant_id']}: exponent") for text in drawn))
            self.assertEqual([point["level"] for point in one["levels"]], [0.3, 0.6, 1.2])

    def test_odd_answers_are_no_ratings(self):
        table = self.path / "odd.csv"
        table.write_text("participant_id,task,renderer,shape,response\n" + "".join(
            f"P{p},rate,point,{shape},{response}\n" for p in range(2)
            for shape, response in (("silk", "nan"), ("silk", "inf"), ("silk", "4x"), ("wool", "3"), ("wool", "NA"))))
        _, found = self.analysed(["--csv", table])
        counts = {cell["shape"]: cell["ratings"]["all"] for cell in found["cells"]}
        self.assertIsNone(counts["silk"])
        self.assertEqual(counts["wool"]["n_ratings"], 2)


if __name__ == "__main__":
    unittest.main()
