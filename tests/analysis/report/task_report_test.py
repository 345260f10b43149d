"""Text, figures and page of an analysis of tasks say the numbers of its JSON, each with its name.

Usage: task_report_test.py PALPATE
"""

import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from task_study import COLUMNS, PALPATE, rows_of_a_study  # takes PALPATE from the command line

SVG = "{http://www.w3.org/2000/svg}"


def short(value):
    """Four significant digits."""
    return f"{value:.4g}" if math.isfinite(value) else "inf" if value > 0 else "-inf"


def with_interval(value, ends):
    """JSON has null for an end that is not finite."""
    if not ends:
        return short(value)
    low, high = (far if end is None else end for end, far in zip(ends, (-math.inf, math.inf)))
    return f"{short(value)} [{short(low)}, {short(high)}]"


def p_text(p):
    return "<0.001" if p < 0.001 else f"{p:.3f}"


class TaskReport(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.path = pathlib.Path(folder.name)
        # All trials of one participant at the same level: nothing can be fitted.
        rows = rows_of_a_study(4)
        for row in rows:
            if row["task"] == "detect" and row["participant_id"] == "T5":
                row["level"], row["catch_trial"] = 2, 0
        rows += [{**row, "renderer": "point", "trial": row["trial"] + len(rows)} for row in rows if row["task"] == "identify"]
        (cls.path / "trials.csv").write_text("\n".join(
            [",".join(COLUMNS)] + [",".join(str(row.get(name, "")) for name in COLUMNS) for row in rows]) + "\n")
        done = subprocess.run([PALPATE, "analyze", "--csv", cls.path / "trials.csv", "--json", cls.path / "a.json",
                               "--figures", cls.path / "figures"], capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
        cls.text = done.stdout
        cls.json = json.loads((cls.path / "a.json").read_text())

    def lines_of(self, cell):
        """Lines of a cell; the first names it and counts its trials."""
        named = ", ".join(filter(None, (cell[k] for k in ("task", "block_name", "shape", "renderer"))))
        (found,) = re.findall(rf"^{re.escape(named)}: (.*\n(?:  .*\n)*)\n", self.text, re.MULTILINE)
        return found.splitlines()

    def line_of(self, lines, participant):
        (line,) = [one for one in lines if one.startswith(f"  {participant} ")]
        return line

    def says(self, line, name, value, ends=None, present=True):
        """The value with its interval stands behind its name, up to the next comma outside of brackets."""
        if not present:
            self.assertNotRegex(line, rf"\b{re.escape(name)} ")
            return
        self.assertRegex(line, rf"(^| ){re.escape(name)} {re.escape(with_interval(value, ends))}([,;( ]|$)")

    def test_each_cell_counts_its_trials_and_participants(self):
        for cell in self.json["cells"]:
            self.assertEqual(self.lines_of(cell)[0], f"{cell['n_trials']} trials of 6 participants, {cell['n_answered']} answered")

    def test_functions(self):
        kinds = set()
        for cell in self.json["cells"]:
            lines = self.lines_of(cell)
            for one in cell.get("psychometric_functions", ()):
                line, fit = self.line_of(lines, one["participant_id"]), one["fit"]
                if fit["status"] == "undefined":
                    self.assertIn("no function: " + fit["reason"], line)
                    self.assertNotIn("slope", line)
                    kinds.add("undefined")
                    continue
                kinds.add("PSE" if fit["pse"] is not None else "threshold")
                self.says(line, "PSE", fit["pse"], fit["pse_ci95"], fit["pse"] is not None)
                if fit["pse"] is None:
                    self.assertRegex(line, rf"^  {one['participant_id']} +threshold "
                                     + re.escape(with_interval(fit["threshold"], fit["threshold_ci95"])) + ",")
                self.says(line, "JND", fit["jnd"], fit["jnd_ci95"], fit["jnd"] is not None)
                self.says(line, "Weber fraction", fit["weber_fraction"], None, fit["weber_fraction"] is not None)
                if fit["slope_at_bound"]:
                    self.assertIn("slope not determined", line)
                else:
                    self.says(line, "slope", fit["slope"], fit["slope_ci95"])
                self.assertEqual("NOT DETERMINED" in line, not fit["determined"])
                if fit["deviance_p"] is not None:
                    self.assertIn(", fit p " + p_text(fit["deviance_p"]), line)
                if one["bayes"]["status"] == "ok":
                    self.says(line, "Bayes", one["bayes"]["threshold"], one["bayes"]["threshold_ci95"])
                seen = one["detectability"].get("d_prime") is not None
                self.says(line, "d'", one["detectability"].get("d_prime"), one["detectability"].get("d_prime_ci95"), seen)
                self.says(line, "criterion", one["detectability"].get("criterion"), one["detectability"].get("criterion_ci95"), seen)
        self.assertEqual(kinds, {"PSE", "threshold", "undefined"})

    def test_numbers_settings_answers_and_confidence(self):
        cells = {(cell["task"], cell["renderer"]): cell for cell in self.json["cells"]}
        cell = cells["rate", "ray"]
        lines, rated = self.lines_of(cell), cell["magnitude_estimation"]
        for one in rated["participants"]:
            line = self.line_of(lines, one["participant_id"])
            self.says(line, "exponent", one["exponent"])
            self.says(line, "r2", one["r_squared"])
        self.assertIn("  exponent over participants " + with_interval(rated["exponent"], rated["exponent_ci95"]), lines)
        for level in rated["levels"]:
            self.assertIn(f"  level {short(level['level'])}: geometric mean " +
                          with_interval(level["geometric_mean"], level["ci95"]), lines)
        cell = cells["adjust", "ray"]
        lines = self.lines_of(cell)
        self.assertEqual(len(cell["adjustments"]), 6)
        for one in cell["adjustments"]:
            line = self.line_of(lines, one["participant_id"])
            self.says(line, "PSE", one["pse"], one["pse_ci95"])
            self.says(line, "constant error", one["constant_error"])
            self.says(line, "JND", one["jnd"])
            self.says(line, "settings from above minus from below", one["start_effect"])
        cell = cells["identify", "ray"]
        bits = cell["information_transfer"]
        (line,) = [one for one in self.lines_of(cell) if "information transfer" in one]
        self.says(line, "information transfer", bits["bits"])
        self.assertIn(f"bit of {short(bits['stimulus_entropy_bits'])};", line)
        self.says(line, "corrected for the bias of few trials", bits["bits_corrected"])
        self.assertIn(f" {short(bits['categories'])} categories", line)
        self.says(line, "mean of the participants'", bits["mean_of_participants_bits_corrected"],
                  bits["mean_of_participants_ci95"])
        cell = cells["compare", "ray"]
        self.assertIn("  confidence: area under the type 2 ROC " +
                      with_interval(cell["confidence"]["type2_roc_area"], cell["confidence"]["ci95"]), self.lines_of(cell))

    def test_comparisons_of_renderers(self):
        self.assertTrue(self.json["renderer_comparisons"])
        for one in self.json["renderer_comparisons"]:
            measure = {"pse": "PSEs", "jnd": "JNDs", "threshold": "Thresholds", "exponent": "Exponents"}[one["measure"]]
            kind = "ratios" if one["natural_logarithms"] else "differences"
            head = f"{measure} by renderer, {one['task']}, {one['block_name']}, {one['shape']} ({kind})\n"
            self.assertIn(head, self.text)
            below = self.text.split(head)[1].split("\n\n")[0]
            self.assertEqual("left out" in below, one["n_undetermined"] > 0)
            number = math.exp if one["natural_logarithms"] else float
            for difference in one["differences"]:
                sign = "/" if one["natural_logarithms"] else "-"
                ends = [number(end) for end in difference["ci95"]]
                (line,) = [x for x in below.splitlines() if x.startswith(f"  {difference['renderer']} {sign} {one['reference']}: ")]
                p = "p < 0.001" if difference["p"] < 0.001 else f"p = {difference['p']:.3f}"
                t = f"t({difference['df']:.0f}) = {difference['t']:.2f}".replace("-", "\u2212")
                self.assertIn(": " + with_interval(number(difference["mean"]), ends) + f", {t}, {p}", line)
                self.assertIn(f", dz = {difference['dz']:.2f}".replace("-", "\u2212"), line)
                self.assertEqual(one["n_tests"], 1)
                self.assertNotIn("Holm", line)
                self.assertIn("mixed model " + short(number(difference["mixed_estimate"])), line)
                self.assertTrue(line.endswith(f"({difference['n_pairs']} pairs)"), line)

    def test_figures_over_participants_draw_everybody_and_every_mean(self):
        stimuli = []
        for group in self.json["group_results"]:
            place = [group[k] for k in ("task", "block_name", "shape")]
            if place not in stimuli:
                stimuli.append(place)
        self.assertEqual(len(stimuli), 4)
        for number, place in enumerate(stimuli, 1):
            root = xml.fromstring((self.path / "figures" / f"group{number}.svg").read_text("utf-8"))
            texts = [text.text for text in root.iter(SVG + "text")]
            titles = [title.text for title in root.iter(SVG + "title")]
            self.assertIn("Over participants: " + ", ".join(place), texts)
            for group in self.json["group_results"]:
                if [group[k] for k in ("task", "block_name", "shape")] != place:
                    continue
                name = {"pse": "PSE", "jnd": "JND", "threshold": "Threshold", "exponent": "Exponent",
                        "weber_fraction": "Weber fraction"}[group["measure"]]
                self.assertIn(name, texts, "the axis says what is measured")
                for one in group["renderers"]:
                    mean = f"{one['renderer']}: mean {short(one['mean'])}"
                    if one["ci95"]:
                        mean += f", 95 % interval {short(one['ci95'][0])} to {short(one['ci95'][1])}"
                    self.assertIn(mean, titles)
                    for each in one["participants"]:
                        self.assertIn(f"{each['participant_id']}, {one['renderer']}: {short(each['value'])}", titles)
            compared = [one for one in self.json["renderer_comparisons"] if [one[k] for k in ("task", "block_name", "shape")] == place]
            modelled = {one["measure"] for one in self.json["group_comparisons"]
                        if [one["task"], one["block"], one["shape"]] == place}
            for one in compared:
                if one["measure"] not in modelled:
                    difference, = one["differences"]
                    self.assertIn(short(math.exp(difference["mean"])) + " [", " ".join(texts))
            for one in self.json["group_comparisons"]:
                if [one["task"], one["block"], one["shape"]] == place:
                    self.assertIn(short(one["estimate"]) + " [", " ".join(texts))

    def test_group_comparisons_stand_in_the_text_and_are_quoted(self):
        self.assertTrue(self.json["group_comparisons"])
        for one in self.json["group_comparisons"]:
            sign = "/" if one["scale"] == "ratio" else "\u2212"
            low, high = map(short, one["ci95"])
            sentence = f"{one['compared']} {sign} {one['reference']}: {short(one['estimate'])}, 95 % CI [{low}, {high}]"
            unwrapped = self.text.replace("\n", " ")
            self.assertGreaterEqual(unwrapped.count(sentence), 2, sentence)

    def test_group_values_come_from_the_model_and_have_names(self):
        compared = [group for group in self.json["group_results"] if group["task"] == "compare"]
        for group in compared:
            for one in group["renderers"]:
                self.assertEqual(one["from"], "hierarchical model")
                named = self.json[group["measure"]][group["block_name"]][one["renderer"]]
                self.assertEqual((named["estimate"], [named["ci95_low"], named["ci95_high"]]), (one["mean"], one["ci95"]))
        for one in self.json["group_comparisons"]:
            named = self.json[one["measure"]][one["block"]]
            self.assertEqual(named[one["scale"]], one["estimate"])
            bound = self.json["equivalence"][one["measure"]][one["block"]]["least_bound"]
            self.assertAlmostEqual(bound, max(abs(math.log(end) if one["scale"] == "ratio" else end) for end in one["ci90"]))

    def test_figures_name_every_participant_and_draw_every_level(self):
        drawn = [cell for cell in self.json["cells"] if "psychometric_functions" in cell]
        self.assertGreater(len(drawn), 2)
        for number, cell in enumerate(drawn, 1):
            named = ", ".join(filter(None, (cell[k] for k in ("task", "block_name", "shape", "renderer"))))
            for kind, what in (("function", "Psychometric functions"), ("track", "Levels over the trials")):
                root = xml.fromstring((self.path / "figures" / f"{kind}{number}.svg").read_text("utf-8"))
                texts = [text.text for text in root.iter(SVG + "text")]
                self.assertIn(f"{what}: {named}", texts)
                self.assertIn(f"6 participants, {cell['n_trials']} trials", " ".join(texts))
                titles = [title.text for title in root.iter(SVG + "title")]
                described = root.find(SVG + "desc").text
                for one in cell["psychometric_functions"]:
                    self.assertEqual(texts.count(one["participant_id"]), 1, "each panel has its participant's name")
                    self.assertIn(f"{one['participant_id']}: " + (one["fit"]["reason"] if one["fit"]["status"] == "undefined" else
                                                                  f"threshold {one['fit']['threshold']:.4f}"), described)
                if kind == "function":
                    wanted = sorted(f"{level['successes']} of {level['trials']} trial{'s' * (level['trials'] != 1)}"
                                    for one in cell["psychometric_functions"] for level in one["levels"])
                    self.assertEqual(sorted(t for t in titles if re.fullmatch(r"\d+ of \d+ trials?", t)), wanted)
                else:
                    wanted = sorted(f"trial {i}: {'success' if success else 'no success'}"
                                    for one in cell["psychometric_functions"] for track in one["tracks"]
                                    for i, success in enumerate(track["successes"], 1))
                    self.assertEqual(sorted(t for t in titles if t.startswith("trial ")), wanted)


if __name__ == "__main__":
    unittest.main()
