"""Any renderers, each compared with the first: numbers against an independent computation; names are escaped.

Usage: several_renderers_test.py PALPATE
"""

import json
import math
import pathlib
import random
import re
import statistics
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

PALPATE = sys.argv[1]
HEADER = "participant_id,session,block,trial,renderer,shape,response,correct,response_time\n"
SHAPES = ["sphere", "cone", "cylinder", "cube"]
SVG = "{http://www.w3.org/2000/svg}"
GAINS = {"ray": -0.25, "tube": 0.3, "glove": -0.1, "pen": -0.02}


def quoted(text):
    return '"%s"' % text.replace('"', '""')


def study(participants, renderers, repetitions=5, seed=7, keep=lambda who, renderer, shape: True,
          shapes=SHAPES, wrong=0.05):
    """Rows as tuples; the order of renderers is rotated by participant."""
    draw = random.Random(seed)
    rows = []
    for p, who in enumerate(participants):
        own, number = draw.gauss(0, 0.3), 0
        slope = {renderer: draw.gauss(0, 0.12) for renderer in renderers}
        turn = p % len(renderers)
        for block, renderer in enumerate(renderers[turn:] + renderers[:turn], 1):
            for shape in shapes * repetitions:
                number += 1
                time = math.exp(2 + own + (slope[renderer] if renderer != renderers[0] else 0) +
                                GAINS.get(renderer, 0) * (1 + shapes.index(shape)) / 2 +
                                draw.gauss(0, 0.3))
                right = draw.random() >= wrong
                answer = shape if right else shapes[shapes.index(shape) - 1]
                if keep(who, renderer, shape):
                    rows.append((who, 1, block, number, renderer, shape, answer, int(right),
                                 float(f"{time:.6g}")))
    return rows


def student_p(t, df):
    """Two-sided p of Student's t, by Simpson's rule."""
    n = 20000
    c = math.exp(math.lgamma((df + 1) / 2) - math.lgamma(df / 2)) / math.sqrt(df * math.pi)
    h = abs(t) / n
    f = [c * (1 + (i * h) ** 2 / df) ** (-(df + 1) / 2) for i in range(n + 1)]
    return 1 - 2 * h / 3 * (f[0] + f[-1] + 4 * sum(f[1:-1:2]) + 2 * sum(f[2:-1:2]))


def holm(p):
    """Holm-adjusted p values by key."""
    out, largest = {}, 0
    for i, key in enumerate(sorted(p, key=p.get)):
        largest = max(largest, (len(p) - i) * p[key])
        out[key] = min(1, largest)
    return out


def comparisons_of(rows, reference, others):
    """{(renderer, shape): results} computed from the rows."""
    logs, times = {}, {}
    for who, _, _, _, renderer, shape, _, right, time in rows:
        if right and time >= 0.2:
            logs.setdefault((who, renderer, shape), []).append(math.log(time))
            times.setdefault((who, renderer, shape), []).append(time)
    participants = sorted({row[0] for row in rows})
    out = {}
    for renderer in others:
        for shape in sorted({row[5] for row in rows}):
            both = [who for who in participants
                    if (who, renderer, shape) in logs and (who, reference, shape) in logs]
            d = [statistics.fmean(logs[who, renderer, shape]) -
                 statistics.fmean(logs[who, reference, shape]) for who in both]
            mean, n = statistics.fmean(d), len(d)
            t = mean / (statistics.stdev(d) / math.sqrt(n))
            a = statistics.fmean(statistics.fmean(times[who, reference, shape]) for who in both)
            b = statistics.fmean(statistics.fmean(times[who, renderer, shape]) for who in both)
            out[renderer, shape] = {
                "n_pairs": n, "mean_log_ratio": mean,
                "percent_reduction_geometric": 100 * (1 - math.exp(mean)),
                "percent_reduction_arithmetic": 100 * (a - b) / a, "t": t, "df": n - 1,
                "p": student_p(t, n - 1)}
    adjusted = holm({key: value["p"] for key, value in out.items()})
    for key, value in out.items():
        value["p_holm"] = adjusted[key]
    return out


def order_effect_of(rows, reference, renderer, shape):
    """Mean log ratios of those who had the reference first and of the others."""
    first = {}
    for who, _, block, _, name, *_ in rows:
        first.setdefault(who, {}).setdefault(name, block)
    groups = {True: [], False: []}
    for who, blocks in first.items():
        own = [row for row in rows if row[0] == who and row[5] == shape and row[7]]
        logs = {name: [math.log(row[8]) for row in own if row[4] == name]
                for name in (reference, renderer)}
        if all(logs.values()):
            groups[blocks[reference] < blocks[renderer]].append(
                statistics.fmean(logs[renderer]) - statistics.fmean(logs[reference]))
    return groups[True], groups[False]


class SeveralRenderers(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        self.csv = self.dir / "trials.csv"

    def palpate(self, command, rows, *args):
        self.csv.write_text(HEADER + "".join(
            ",".join(quoted(x) if isinstance(x, str) else str(x) for x in row) + "\n"
            for row in rows), encoding="utf-8")
        return subprocess.run([PALPATE, command, "--csv", self.csv, *map(str, args)],
                              capture_output=True, text=True, encoding="utf-8")

    def analyze(self, rows):
        done = self.palpate("analyze", rows, "--json", self.dir / "a.json", "--report",
                            self.dir / "a.html", "--figures", self.dir / "figures", "--force")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertTrue(all(len(line) <= 100 for line in done.stdout.splitlines()))
        self.page = (self.dir / "a.html").read_text("utf-8")
        self.figures = {path.stem: path.read_text("utf-8")
                        for path in (self.dir / "figures").glob("*.svg")}
        for figure in self.figures.values():
            xml.fromstring(figure)
        return json.loads((self.dir / "a.json").read_text("utf-8")), done.stdout

    def check_pairs(self, expected, renderer, by_shape):
        for shape, found in by_shape.items():
            want = expected[renderer, shape]
            for key in ("mean_log_ratio", "percent_reduction_geometric",
                        "percent_reduction_arithmetic"):
                self.assertAlmostEqual(found[key], want[key], places=9)
            self.assertEqual(found["n_pairs"], want["n_pairs"])
            test = found["t_test"]
            self.assertAlmostEqual(test["t"], want["t"], places=8)
            self.assertEqual(test["df"], want["df"])
            self.assertAlmostEqual(test["p"], want["p"], places=9)
            self.assertAlmostEqual(test["p_holm"], want["p_holm"], places=8)

    def test_three_and_five_renderers_agree_with_an_own_calculation(self):
        participants = [f"P{i:02}" for i in range(12)]
        for others in (["ray", "tube"], ["ray", "tube", "glove", "pen"]):
            with self.subTest(others=others):
                rows = study(participants, ["point"] + others)
                expected = comparisons_of(rows, "point", others)
                found, text = self.analyze(rows)
                self.assertNotIn("paired_by_shape_of", found)
                self.check_pairs(expected, "ray", found["paired_by_shape"])
                further = found["further_comparisons"]
                self.assertEqual([one["renderer"] for one in further], others[1:])
                for one in further:
                    self.assertEqual(one["reference"], "point")
                    self.check_pairs(expected, one["renderer"], one["by_shape"])
                    self.assertEqual(list(one["by_shape"]), SHAPES)
                    for shape in SHAPES:
                        groups = order_effect_of(rows, "point", one["renderer"], shape)
                        order = one["practice"]["renderer_order"]["shapes"][shape]
                        for group, key in zip(groups, ("reference_first", "renderer_first")):
                            self.assertEqual(order[key]["n_participants"], len(group))
                            self.assertAlmostEqual(order[key]["mean_log_ratio"],
                                                   statistics.fmean(group), places=9)
                        accuracy = one["speed_accuracy"][shape]
                        for key, name in (("accuracy_reference", "point"),
                                          ("accuracy_renderer", one["renderer"])):
                            self.assertAlmostEqual(
                                accuracy[key],
                                found["accuracy"][name][shape]["mean_of_participant_accuracies"])
                self.check_mixed_model(found["mixed_model"], others, expected)
                effects = found["rm_anova"]["effects"]
                self.assertEqual(effects["renderer"]["num_df"], len(others))
                self.assertEqual(effects["renderer:shape"]["num_df"], 3 * len(others))
                self.assertTrue(text.startswith("The ray is faster than the point for "), text)
                self.assertIn("tube is slower than the point for ", text)
                self.assertIn("adjusted over all shapes and comparisons (Holm)",
                              " ".join(text.split()))
                self.check_figures(["point"] + others)

    def check_mixed_model(self, model, others, expected):
        self.assertIn(model["status"], ("ok", "singular"))
        contrasts = {"ray": model["contrasts_ray_minus_point"]}
        contrasts.update({one["renderer"]: one["by_shape"] for one in model["contrasts"]})
        self.assertEqual(list(contrasts), others)
        adjusted = holm({(renderer, shape): one["p"] for renderer, shapes in contrasts.items()
                         for shape, one in shapes.items()})
        for (renderer, shape), p in adjusted.items():
            self.assertAlmostEqual(contrasts[renderer][shape]["p_holm"], p, places=12)
            self.assertAlmostEqual(contrasts[renderer][shape]["estimate"],
                                   expected[renderer, shape]["mean_log_ratio"], delta=0.1)
        components = model["variance_components"]
        self.assertEqual(list(components["participant_renderer_slope_sds"]), others)
        self.assertEqual(len(components["correlations"]), len(others) * (len(others) + 1) // 2)
        self.assertIsNotNone(components["participant_intercept_sd"])

    def check_figures(self, renderers):
        """Renderers have different colours and symbols; each comparison has a panel."""
        means = xml.fromstring(self.figures["figure15"])
        looks = {}
        for group in means.iter(SVG + "g"):
            title = group.find(SVG + "title").text
            mark = list(group)[1]
            for renderer in renderers:
                if title.startswith(f"cone, {renderer}: mean") and mark.tag != SVG + "line":
                    corners = len(mark.get("points", "").split())
                    looks[renderer] = (mark.get("fill"), mark.tag, corners,
                                       mark.get("points", "")[:3] if corners == 3 else "")
        self.assertEqual(set(looks), set(renderers))
        self.assertEqual(len({look[0] for look in looks.values()}), len(renderers))
        for name in ("speedup", "order", "speed-accuracy"):
            words = [e.text for e in xml.fromstring(self.figures[name]).iter(SVG + "text")]
            for renderer in renderers[1:]:
                self.assertEqual(words.count(f"{renderer} − point"), 1, name)
        papers = [e.text for e in xml.fromstring(self.figures["speedup"]).iter(SVG + "title")
                  if "Ho et al." in e.text]
        self.assertEqual(len(papers), 2, "cone and cube, beside ray minus point alone")

    def test_two_renderers_of_other_names(self):
        rows = study([f"P{i}" for i in range(10)], ["tip1", "ray2"])
        rows = [row[:4] + ("tip2" if row[4] == "ray2" else row[4],) +
                row[5:8] + (row[8] * (0.7 if row[4] == "ray2" else 1),) for row in rows]
        found, text = self.analyze(rows)
        self.assertEqual(found["paired_by_shape_of"], {"renderer": "tip2", "reference": "tip1"})
        self.check_pairs(comparisons_of(rows, "tip1", ["tip2"]), "tip2", found["paired_by_shape"])
        self.assertNotIn("further_comparisons", found)
        self.assertNotIn("contrasts_ray_minus_point", found["mixed_model"])
        contrasts = found["mixed_model"]["contrasts"]
        self.assertEqual([(one["renderer"], one["reference"]) for one in contrasts],
                         [("tip2", "tip1")])
        self.assertTrue(text.startswith("tip2 is faster than tip1 for "), text)
        page = re.sub(r"<(script|style)>.*?</\1>", "", self.page, flags=re.S)  # data stay
        for out in (text, page, *self.figures.values()):
            for word in ("with the ray", "the point", "Ho et al", "Ho, Basdogan & Srinivasan 2000",
                         "paper: "):
                self.assertFalse(word in out, word)
        # The same rows with the names of the paper's renderers: the same numbers.
        named, _ = self.analyze([row[:4] + ({"tip1": "point", "tip2": "ray"}[row[4]],) + row[5:]
                                 for row in rows])
        self.assertEqual(named["paired_by_shape"], found["paired_by_shape"])
        self.assertEqual(named["rm_anova"], found["rm_anova"])

    def test_one_renderer_of_another_name(self):
        found, text = self.analyze(study("ABC", ["tip"]))
        for shape in found["paired_by_shape"].values():
            self.assertEqual(shape["status"], "undefined")
            self.assertIn("only one renderer", shape["reason"])
        self.assertIsNone(found["paired_by_shape_of"])
        self.assertIn("cannot say", text)
        self.assertNotIn("point", text.replace("percentage point", ""))

    def test_who_lacks_a_renderer_is_named_and_left_out_there_alone(self):
        participants = [f"P{i}" for i in range(6)]
        rows = study(participants, ["point", "ray", "tube"],
                     keep=lambda who, renderer, shape: (who, renderer) != ("P3", "tube") and
                     (who, renderer, shape) != ("P4", "point", "cone"))
        found, text = self.analyze(rows)
        expected = comparisons_of(rows, "point", ["ray", "tube"])
        self.check_pairs(expected, "ray", found["paired_by_shape"])
        tube = found["further_comparisons"][0]["by_shape"]
        self.check_pairs(expected, "tube", tube)
        self.assertEqual([found["paired_by_shape"][s]["n_pairs"] for s in ("cone", "cube")], [5, 6])
        self.assertEqual([tube[s]["n_pairs"] for s in ("cone", "cube")], [4, 5])
        self.assertIn("P3 (tube: every shape) and P4 (point: cone)", " ".join(text.split()))
        self.assertEqual(found["rm_anova"]["dropped_participants"], ["P3", "P4"])

    def test_exclusions_that_differ_are_named_least_and_most(self):
        rows = [row[:6] + (("", 0, 60) if row[4] == "tube" and row[3] % 3 == 0 else
                           (row[5], 1, row[8])) for row in study("ABCD", ["point", "ray", "tube"])]
        _, text = self.analyze(rows)
        self.assertIn("differ between renderers (0.0 % with point, 3", " ".join(text.split()))

    def test_twenty_renderers_and_one_more(self):
        names = [f"r{i:02}" for i in range(21)]
        found, text = self.analyze(study("ABCD", names[:20], repetitions=2))
        self.assertEqual(len(found["further_comparisons"]), 18)
        self.assertIn("The tables have 13 more comparisons.", " ".join(text.split()))
        self.assertEqual(found["mixed_model"]["status"], "undefined")
        self.assertIn("The first 6 of 20 renderers", self.figures["figure15"])
        p = {(i, shape): test["t_test"]["p"] for i, by_shape in enumerate(
            [found["paired_by_shape"]] + [o["by_shape"] for o in found["further_comparisons"]])
            for shape, test in by_shape.items()}
        self.assertEqual(len(p), 76)
        self.assertAlmostEqual(found["paired_by_shape"]["cone"]["t_test"]["p_holm"],
                               holm(p)[0, "cone"], places=12)
        done = self.palpate("analyze", study("ABCD", names, repetitions=2))
        self.assertEqual(done.returncode, 2)
        self.assertIn("at most 20 different renderers", done.stderr)
        self.assertEqual(done.stderr.count("column renderer"), 1)

    def test_names_are_text_not_markup(self):
        names = ["</script><b>", "point first", 'var(--page)"\'&', "x" * 200, "]]>"]
        rows = study("ABCDEF", names)
        found, text = self.analyze(rows)
        self.assertEqual([one["renderer"] for one in found["further_comparisons"]], names[2:])
        self.assertEqual(self.page.count("<script"), self.page.count("</script>"))
        self.assertLessEqual(self.page.count("<script"), 3)
        self.assertFalse("</script><b>" in self.page)
        self.assertTrue("&lt;/script&gt;&lt;b&gt;" in self.page)
        for figure in self.figures.values():
            self.assertEqual([], [e.tag for e in xml.fromstring(figure).iter()
                                  if e.tag in (SVG + "script", SVG + "b")])
        for entry in self.figures["figure15"], self.figures["confusion"]:
            self.assertIn("&lt;/script&gt;&lt;b&gt;", entry)
        self.assertIn("</script><b>", text)

    def test_a_plan_from_a_pilot(self):
        quick = ("--studies", 100, "--trials", 10, "--participants", "4-8")
        three = study([f"P{i}" for i in range(8)], ["point", "ray", "tube"])
        done = self.palpate("plan", three, *quick)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("The pilot has 3 renderers: this plan covers ray − point only",
                      " ".join(done.stdout.split()))
        others = study([f"P{i}" for i in range(8)], ["tip1", "tip2"])
        done = self.palpate("plan", others, *quick)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("--effect", done.stderr)
        self.assertIn("tip2 against tip1", done.stderr)
        done = self.palpate("plan", others, *quick, "--effect", "cone=20")
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_lines_that_end_in_cr_alone(self):
        self.csv.write_bytes((HEADER + "A,1,1,1,tip,cone,cone,1,2\n").replace("\n", "\r").encode())
        done = subprocess.run([PALPATE, "analyze", "--csv", self.csv], capture_output=True,
                              text=True)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("expected lines that end in LF or CRLF", done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
