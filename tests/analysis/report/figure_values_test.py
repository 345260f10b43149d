"""Reads the SVG of the figures: positions of marks, axis ranges, labels, rows of panels and notes against the numbers
of the analysis (JSON) and against means computed here from the trials.

Usage: figure_values_test.py PALPATE
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

from figure_svg import SVG, Drawing, box, centre, number

PALPATE = sys.argv[1]
HEADER = "participant_id,session,block,trial,renderer,shape,response,correct,response_time,timed_out\n"
SHAPES = ["sphere", "cone", "cylinder", "cube"]
LIMIT = 12  # s
PARTICIPANTS = 8
T_975 = 2.364624  # quantile of Student's t with 7 degrees of freedom
PAPER = {"cone": 22, "cube": 11}  # percent reduction, Ho, Basdogan & Srinivasan (2000), fig. 15


def trials(renderers, shapes=SHAPES, repetitions=8, seed=5):
    """Rows (participant, block, trial, renderer, shape, response, correct, time, timed_out). Cones gain with the second
    renderer; some answers are wrong; times above LIMIT are time-outs."""
    draw, rows = random.Random(seed), []
    for p in range(PARTICIPANTS):
        own, number = draw.gauss(0, 0.2), 0
        order = renderers[p % len(renderers):] + renderers[:p % len(renderers)]
        for block, renderer in enumerate(order, 1):
            gain = draw.gauss(0, 0.1)
            for shape in shapes * repetitions:
                number += 1
                log_time = (1.7 + own + 0.15 * shapes.index(shape) + gain - 0.002 * number + draw.gauss(0, 0.3) -
                            0.3 * renderers.index(renderer) * (shape == "cone"))
                time, wrong = round(math.exp(log_time), 4), draw.random() < 0.12
                if time > LIMIT:
                    rows.append((f"P{p}", block, number, renderer, shape, "", 0, LIMIT, 1))
                else:
                    answer = shapes[(shapes.index(shape) + 1) % len(shapes)] if wrong else shape
                    rows.append((f"P{p}", block, number, renderer, shape, answer, int(not wrong), time, 0))
    return rows


class FigureValues(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.rows = trials(["point", "ray"])
        cls.json, cls.figures = cls.analyze(cls.rows)
        cls.two = ("point", "ray")

    @classmethod
    def analyze(cls, rows):
        with tempfile.TemporaryDirectory() as scratch:
            scratch = pathlib.Path(scratch)
            (scratch / "trials.csv").write_text(HEADER + "".join(
                f"{who},1,{block},{trial},{renderer},{shape},{answer},{correct},{time},{out}\n"
                for who, block, trial, renderer, shape, answer, correct, time, out in rows))
            done = subprocess.run([PALPATE, "analyze", "--csv", scratch / "trials.csv", "--json", scratch / "a.json",
                                   "--figures", scratch / "figures"], capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
            return (json.loads((scratch / "a.json").read_text("utf-8")),
                    {path.stem: path.read_text("utf-8") for path in (scratch / "figures").glob("*.svg")})

    def participant_means(self, renderer, shape):
        """{participant: mean time of correct answers}."""
        times = {}
        for who, _, _, r, s, _, correct, time, out in self.rows:
            if (r, s) == (renderer, shape) and correct and not out:
                times.setdefault(who, []).append(time)
        return {who: statistics.fmean(own) for who, own in times.items()}

    def check_y(self, panel, y, value):
        """Coordinates have two decimals."""
        self.assertAlmostEqual(y, panel.pixel(value), delta=0.03)

    def check_layout(self, name, drawing):
        """Nothing is outside the drawing; rows of panels do not overlap; panels of a row have the same top."""
        lowest = 0
        for text in drawing.texts:
            self.assertGreater(float(text.get("y")), 0, name)
            self.assertLess(float(text.get("y")), drawing.height, f"{name}: {text.text}")
            self.assertGreaterEqual(float(text.get("x")), 0, name)
            self.assertLessEqual(float(text.get("x")), drawing.width, name)
        rows = {}
        for panel in drawing.panels:
            self.assertLess(panel.top, panel.bottom)
            self.assertLessEqual(panel.right, drawing.width, name)
            rows.setdefault(round(panel.top, 1), []).append(panel)
        for top in sorted(rows):
            self.assertGreater(top, lowest, f"{name}: a row of panels begins above the end of the one before")
            row = sorted(rows[top], key=lambda panel: panel.left)
            for one, other in zip(row, row[1:]):
                self.assertLess(one.right, other.left, name)
            lowest = max(panel.bottom for panel in row) + 20  # the labels of the lower axis
        return rows

    def test_figure15_draws_means_intervals_and_participants(self):
        drawing = Drawing(self.figures["figure15"])
        self.check_layout("figure15", drawing)
        (panel,) = drawing.panels
        names = drawing.names()
        self.assertEqual(list(names), SHAPES)
        self.assertEqual(min(panel.ticks), 0)
        self.check_y(panel, panel.bottom, 0)
        for shape in SHAPES:
            x = {}
            for renderer, tag in zip(self.two, ("circle", "rect")):
                own = self.participant_means(renderer, shape)
                mean, half = statistics.fmean(own.values()), T_975 * statistics.stdev(own.values()) / math.sqrt(PARTICIPANTS)
                self.assertLessEqual(max(own.values()), max(panel.ticks))
                marks = drawing.marks(rf"{shape}, {renderer}: mean ([\d.]+) s, 95 % interval ([\d.]+) to ([\d.]+) s")
                for match, _ in marks:
                    for text, value in zip(match.groups(), (mean, mean - half, mean + half)):
                        self.assertAlmostEqual(float(text), value, delta=0.0051 if value < 10 else 0.051)
                (symbol,) = [element for _, element in marks if element.tag == SVG + tag]
                x[renderer], y = centre(symbol)
                self.check_y(panel, y, mean)
                (bar,) = [e for _, e in marks if e.tag == SVG + "line" and e.get("x1") == e.get("x2")]
                self.assertAlmostEqual(float(bar.get("x1")), x[renderer], delta=0.02)
                ends = sorted(map(float, (bar.get("y1"), bar.get("y2"))))
                self.check_y(panel, ends[1], mean - half)
                self.check_y(panel, ends[0], min(mean + half, max(panel.ticks)))
                single = [(g.get("data-person"), centre(e)[1]) for g in drawing.root.findall(SVG + "g") for e in g
                          if g.get("data-person") and e.tag == SVG + tag and
                          g.find(SVG + "title").text.startswith(f"{g.get('data-person')}, {shape}:")]
                self.assertEqual(sorted(who for who, _ in single), sorted(own))
                for who, y in single:
                    self.check_y(panel, y, own[who])
            slot = (panel.right - panel.left) / len(SHAPES)
            self.assertLess(names[shape] - slot / 2, x["point"])
            self.assertLess(x["point"], names[shape])
            self.assertLess(names[shape], x["ray"])
            self.assertLess(x["ray"], names[shape] + slot / 2)

    def test_speedup_draws_reductions_censored_estimates_and_the_paper(self):
        drawing = Drawing(self.figures["speedup"])
        self.check_layout("speedup", drawing)
        (panel,) = drawing.panels
        names = drawing.names()
        texts = {(round(float(t.get("x")), 1), t.text): t for t in drawing.texts}
        censored = 0
        for shape in SHAPES:
            result = self.json["paired_by_shape"][shape]
            test, reduction = result["t_test"], result["percent_reduction_geometric"]
            marks = drawing.marks(rf"{shape}: ([−\d.]+) %, 95 % interval ([−\d.]+) to ([−\d.]+) %")
            (circle,) = [e for _, e in marks if e.tag == SVG + "circle"]
            self.check_y(panel, centre(circle)[1], reduction)
            (bar,) = [e for _, e in marks if e.tag == SVG + "line" and e.get("x1") == e.get("x2")]
            ends = sorted(map(float, (bar.get("y1"), bar.get("y2"))))
            self.check_y(panel, ends[1], test["percent_reduction_ci95_low"])
            self.check_y(panel, ends[0], test["percent_reduction_ci95_high"])
            self.assertEqual([number(text) for text in marks[0][0].groups()],
                             [round(x, 1) for x in (reduction, test["percent_reduction_ci95_low"],
                                                    test["percent_reduction_ci95_high"])])
            self.assertLessEqual(min(panel.ticks), test["percent_reduction_ci95_low"])
            self.assertGreaterEqual(max(panel.ticks), test["percent_reduction_ci95_high"])
            p = test["p_holm"]
            label = texts[round(names[shape], 1), "p <0.001" if p < 0.001 else f"p = {p:.3f}"]
            self.assertEqual(label.get("font-weight"), "700" if p < 0.05 else None)
            if result["censored"]["n_censored"] > 0:
                estimate = result["censored"]["percent_reduction"]
                slot = (panel.right - panel.left) / len(SHAPES)
                squares = [e for _, e in drawing.marks(rf"time-outs as censored: {estimate:.1f} %.*".replace("-", "[-−]"))
                           if e.tag == SVG + "rect" and abs(centre(e)[0] - names[shape]) < slot / 2]
                self.assertEqual(len(squares), 1, shape)
                self.check_y(panel, centre(squares[0])[1], estimate)
                censored += 1
            if shape in PAPER:
                ((_, diamond),) = drawing.marks(rf"{shape}, Ho et al. 2000: {PAPER[shape]} %")
                self.check_y(panel, centre(diamond)[1], PAPER[shape])
        self.assertGreater(censored, 0)
        self.assertEqual(sum(t.text == "n.s." for t in drawing.texts), len(SHAPES) - len(PAPER))
        self.assertLessEqual({"this data", "time-outs as censored", "Ho et al. 2000"}, {t.text for t in drawing.texts})

    def test_confusion_draws_every_count_in_its_row_and_column(self):
        drawing = Drawing(self.figures["confusion"])
        shown = {r: {} for r in self.two}
        for row in self.rows:
            answers = shown[row[3]].setdefault(row[4], {})
            answers[row[5] or "none"] = answers.get(row[5] or "none", 0) + 1
        labels = [(t.text, float(t.get("x")), float(t.get("y")) - 4) for t in drawing.texts if t.get("text-anchor") == "end"]
        for renderer in self.two:
            heights = set()
            for shape in SHAPES:
                total = sum(shown[renderer][shape].values())
                for answer in SHAPES + ["none"]:
                    n = shown[renderer][shape].get(answer, 0)
                    ((match, cell),) = drawing.marks(
                        rf"{renderer}: {shape} answered as {answer} (\d+) times? of {total} \(([\d.]+) %\)")
                    self.assertEqual(int(match[1]), n)
                    self.assertAlmostEqual(float(match[2]), 100 * n / total, delta=0.051 if n / total < 0.0995 else 0.51)
                    left, right, top, bottom = box(cell)
                    heights.add(round(bottom - top, 1))
                    inside = [t for t in drawing.texts if left < float(t.get("x")) < right and top < float(t.get("y")) < bottom]
                    self.assertEqual([t.text for t in inside], [match[2] + " %"] if n else [])
                    if n:
                        self.assertEqual(inside[0].get("font-weight"), "700" if answer == shape else None)
                    row = [name for name, x, y in labels if x < left and abs(y - (top + bottom) / 2) < 1]
                    self.assertIn(shape, row)
                    column = [t.text for t in drawing.texts if t.get("font-size") == "13.00" and
                              t.get("text-anchor") == "middle" and abs(float(t.get("x")) - (left + right) / 2) < 1]
                    self.assertIn(answer, column)
            self.assertEqual(len(heights), 1, "rows have the same height")
            self.assertGreater(heights.pop(), 30, "px: a row holds a line of text")

    def test_exclusions_are_bars_of_percent(self):
        drawing = Drawing(self.figures["exclusions"])
        self.check_layout("exclusions", drawing)
        (panel,) = drawing.panels
        for renderer in self.two:
            own = [row for row in self.rows if row[3] == renderer]
            wrong = sum(not row[6] and not row[8] for row in own)
            late = sum(row[8] for row in own)
            for reason, n in (("wrong", wrong), ("no response", late), ("too fast", 0), ("all", wrong + late)):
                percent = 100 * n / len(own)
                ((match, bar),) = drawing.marks(rf"{renderer}, {reason}: (\d+) trials? of {len(own)} \(([\d.]+) %\)")
                self.assertEqual((int(match[1]), match[2]), (n, f"{percent:.1f}"))
                left, right, top, bottom = box(bar)
                self.check_y(panel, bottom, 0)
                self.check_y(panel, top, percent)
                self.assertIn(match[2], [t.text for t in drawing.texts
                                         if abs(float(t.get("x")) - (left + right) / 2) < 0.6 and float(t.get("y")) < top])
        self.assertGreaterEqual(max(panel.ticks), percent)

    def test_changes_of_accuracy_and_time_are_those_of_the_analysis(self):
        drawing = Drawing(self.figures["speed-accuracy"])
        self.check_layout("speed-accuracy", drawing)
        (panel,) = drawing.panels
        for shape in SHAPES:
            one = self.json["speed_accuracy"][shape]
            marks = drawing.marks(rf"{shape}: time ([−\d.]+) %.*, accuracy ([−\d.]+) points.*")
            (circle,) = [e for _, e in marks if e.tag == SVG + "circle"]
            self.check_y(panel, centre(circle)[1], 100 * one["accuracy_change"])
            self.assertAlmostEqual(number(marks[0][0][1]), one["percent_change_time"], delta=0.051)
            self.assertEqual(sum(t.text == shape for t in drawing.texts), 1)
        by_time = sorted(SHAPES, key=lambda shape: self.json["speed_accuracy"][shape]["percent_change_time"])
        by_x = sorted(SHAPES, key=lambda shape: [centre(e)[0] for _, e in drawing.marks(rf"{shape}: time .*")
                                                 if e.tag == SVG + "circle"])
        self.assertEqual(by_x, by_time)

    def test_reductions_by_the_order_of_renderers_are_those_of_the_analysis(self):
        drawing = Drawing(self.figures["order"])
        self.check_layout("order", drawing)
        (panel,) = drawing.panels
        for shape in SHAPES:
            one = self.json["practice"]["renderer_order"]["shapes"][shape]
            for renderer in self.two:
                ratio = one[renderer + "_first"]["mean_log_ratio"]
                ((_, symbol),) = drawing.marks(rf"{shape}, {renderer} first: .* participants")
                self.check_y(panel, centre(symbol)[1], 100 * (1 - math.exp(ratio)))
            (diamond,) = [e for _, e in drawing.marks(rf"{shape}, orders balanced: .*") if e.tag == SVG + "polygon"]
            self.check_y(panel, centre(diamond)[1], one["balanced_percent_reduction"])

    def test_times_of_learning_and_their_intervals_are_those_of_the_analysis(self):
        drawing = Drawing(self.figures["learning"], log=True)
        (panel,) = drawing.panels
        for renderer in self.two:
            bins = self.json["practice"]["learning"][renderer]["bins"]
            for b, one in enumerate(bins, 1):
                marks = drawing.marks(rf"{renderer}, part {b}: ([\d.]+) s, {one['n_trials']} trials?")
                (symbol,) = [e for _, e in marks if e.tag in (SVG + "circle", SVG + "rect")]
                self.check_y(panel, centre(symbol)[1], one["mean_log"] / math.log(10))
                (bar,) = [e for _, e in marks if e.tag == SVG + "line" and e.get("x1") == e.get("x2")]
                half = T_975 * one["se_mean_log"] / math.log(10)
                ends = sorted(map(float, (bar.get("y1"), bar.get("y2"))))
                self.check_y(panel, ends[1], one["mean_log"] / math.log(10) - half)
                self.check_y(panel, ends[0], one["mean_log"] / math.log(10) + half)

    def test_times_draw_the_median_and_the_limit(self):
        drawing = Drawing(self.figures["times"], log=True)
        self.check_layout("times", drawing)
        (panel,) = drawing.panels
        for renderer, tag in zip(self.two, ("circle", "rect")):
            for shape in SHAPES:
                own = [r for r in self.rows if (r[3], r[4]) == (renderer, shape)]
                used = [math.log10(r[7]) for r in own if r[6] and not r[8]]
                marks = drawing.marks(rf"{shape}, {renderer}: median ([\d.]+) s, .*, {len(used)} times")
                for element in [e for _, e in marks if e.tag == SVG + tag]:
                    self.check_y(panel, centre(element)[1], statistics.median(used))
                self.assertEqual(sum(e.tag == SVG + tag for _, e in marks), 2)
                late = sum(r[8] for r in own)
                if late:
                    percent = 100 * late / len(own)
                    percent = f"{percent:.1f} %" if percent < 9.95 else f"{percent:.0f} %"
                    self.assertIn(f"{late} ({percent})", [t.text for t in drawing.texts])
        ((_, limit),) = drawing.marks(f"limit of {LIMIT:.2f} s|limit of {LIMIT} s")
        self.check_y(panel, float(limit.get("points").split()[0].split(",")[1]), math.log10(LIMIT))

    def test_notes_are_below_the_panels_and_whole(self):
        for name, svg in self.figures.items():
            drawing = Drawing(svg)
            below = max([panel.bottom for panel in drawing.panels] or [0])
            notes = [t for t in drawing.texts if t.get("font-size") == "12.00" and t.get("text-anchor") == "start" and
                     t.get("x") == "26.00" and float(t.get("y")) > below]
            self.assertTrue(notes, name)
            lines = [float(t.get("y")) for t in notes]
            self.assertEqual(lines, sorted(set(lines)), "one below the other")
            self.assertTrue(notes[-1].text.endswith((".", ". ")), notes[-1].text)
        text = " ".join(t.text for t in Drawing(self.figures["speedup"]).texts)
        self.assertIn("Above 0 the ray is faster", text)
        self.assertIn("n.s.: the paper found no significant difference.", text)

    def test_several_comparisons_stand_in_rows_with_one_axis(self):
        names = ["point", "ray", "tube", "glove", "pen", "ring", "rod"]
        shapes = SHAPES[:3]
        analysis, figures = self.analyze(trials(names, shapes, 3))
        drawing = Drawing(figures["speedup"])
        rows = self.check_layout("speedup", drawing)
        drawn = names[1:6]  # six renderers of seven: five comparisons
        self.assertEqual(len(drawing.panels), len(drawn))
        self.assertGreater(len(rows), 1)
        order = sorted(drawing.panels, key=lambda panel: (round(panel.top), panel.left))
        self.assertEqual(len({tuple(sorted(panel.ticks)) for panel in order}), 1)
        self.assertEqual(len({round(panel.bottom - panel.top, 1) for panel in order}), 1)
        results = {"ray": analysis["paired_by_shape"]}
        results.update({one["renderer"]: one["by_shape"] for one in analysis["further_comparisons"]})
        for renderer, panel in zip(drawn, order):
            title = f"{renderer} − point"
            self.assertEqual([(float(t.get("x")), float(t.get("y")) < panel.top) for t in drawing.texts if t.text == title],
                             [(panel.left, True)])
            for shape in shapes:
                (circle,) = [e for _, e in drawing.marks(rf"{re.escape(title)}, {shape}: .*") if e.tag == SVG + "circle"]
                x, y = centre(circle)
                self.assertTrue(panel.left < x < panel.right and panel.top <= y <= panel.bottom)
                self.check_y(panel, y, results[renderer][shape]["percent_reduction_geometric"])
        text = " ".join(t.text for t in drawing.texts)
        self.assertIn("The first 6 of 7 renderers", text)
        self.assertIn("Above 0 the renderer is faster than the point", text)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
