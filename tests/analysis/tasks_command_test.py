"""palpate analyze of trials with tasks: a table with known functions, its text and JSON, and what is refused."""

import json
import math
import random
import re
import statistics
import unittest

from task_study import PEOPLE, TaskStudy, logistic, rows_of_a_study


def t_interval(values):
    """Mean and 95 % interval by Student's t for 3 to 5 degrees of freedom."""
    quantile = {3: 3.182446, 4: 2.776445, 5: 2.570582}[len(values) - 1]
    half = quantile * statistics.stdev(values) / math.sqrt(len(values))
    return statistics.mean(values), statistics.mean(values) - half, statistics.mean(values) + half


def figures_of(cell, measure):
    """Of each participant of a cell whose figure is determined."""
    if cell["task"] == "adjust":
        return {each["participant_id"]: each[measure] for each in cell["adjustments"]}
    if cell["task"] == "rate":
        return {each["participant_id"]: each["exponent"] for each in cell["magnitude_estimation"]["participants"]}
    return {each["participant_id"]: each["fit"][measure] for each in cell["psychometric_functions"]
            if each["fit"]["determined"]}


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
        seed = 7
        draw = random.Random(seed)
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

    def test_a_jnd_too_small_for_the_levels_is_counted(self):
        rows = rows_of_a_study(3)
        for row in rows:
            if row["task"] == "compare" and row["participant_id"] == "T2":  # knows at once
                row["success"] = int(row["level"] > 520)
        found = self.found(rows)
        functions = {one["participant_id"]: one["fit"] for cell in found["cells"]
                     if (cell["task"], cell["renderer"]) == ("compare", "point") for one in cell["psychometric_functions"]}
        self.assertTrue(functions["T2"]["slope_at_bound"])
        for group in found["group_results"]:
            if (group["task"], group["measure"]) in (("compare", "jnd"), ("compare", "weber_fraction")):
                for one in group["renderers"]:
                    # The group's model has a use for who makes no errors.
                    self.assertEqual((one["n_participants"], one["n_undetermined"]), (6, 1), group["measure"])
                    self.assertEqual(len(one["participants"]), 5)
        fits = [one["individual_fits"] for one in found["group_comparisons"] if one["measure"] == "jnd"]
        self.assertEqual([(one["n"], one["left_out"], one["left_out_participants"]) for one in fits], [(5, 2, ["T2"])])
        jnd, = [one for one in found["renderer_comparisons"] if (one["task"], one["measure"]) == ("compare", "jnd")]
        self.assertEqual((jnd["n_undetermined"], jnd["differences"][0]["n_pairs"]), (2, 5))

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
        seed = 8
        rows = self.forced(random.Random(seed), 350, 0.5)
        for row in rows:
            row["participant_id"] = row["participant_id"].replace("T1", "NA")
        cell, = self.found(rows)["cells"]
        self.assertIn("NA", [one["participant_id"] for one in cell["psychometric_functions"]])
        self.write(rows + rows[:3])
        done = self.analyze()
        self.assertEqual(done.returncode, 2)
        self.assertIn("expected each trial once", done.stderr)

    def test_several_protocols_are_distinguished(self):
        seed = 9
        rows = [{**row, "protocol_name": "one", "protocol_sha256": "ab12cd34ef"} for row in self.forced(random.Random(seed), 350, 0.5)]
        rows += [{**row, "protocol_name": "two", "protocol_sha256": "77aa55"} for row in self.forced(random.Random(seed), 390, 0.5)]
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
        self.assertFalse("\\u000a" in page)
        self.assertTrue("<div class=\"flag\" role=\"note\">SIMULATED PARTICIPANTS" in page)
        for link, words in re.findall(r'<li><a href="#([^"]*)">([^<]*)</a></li>', page):
            self.assertNotRegex(words, r"^[a-z]+[0-9]+$", link)
        self.assertIn("Results over participants", page)
        names = {file.name for file in (self.path / "figures").iterdir()}
        self.assertLessEqual({"group1.svg", "group2.svg"}, names)
        self.assertLessEqual({f"{kind}{i}.svg" for kind in ("function", "track") for i in (1, 2, 3)}, names)
        self.assertIn("figure15.svg", names)  # of identification, as in version 1
        drawn = (self.path / "figures" / "function1.svg").read_text()
        self.assertIn("of 30 trials", drawn)

    def test_means_over_participants_are_those_of_their_figures(self):
        for seed in (1, 6):
            found = self.found(rows_of_a_study(seed))
            groups = {(one["task"], one["measure"]): one for one in found["group_results"]}
            self.assertEqual(set(groups), {("compare", "pse"), ("compare", "jnd"), ("compare", "weber_fraction"),
                                           ("detect", "threshold"), ("rate", "exponent"), ("adjust", "pse"), ("adjust", "jnd")})
            text = self.analyze().stdout
            cells = {(cell["task"], cell["renderer"]): cell for cell in found["cells"]}
            for (task, measure), group in groups.items():
                geometric = measure not in ("exponent", "threshold") and (task, measure) != ("compare", "pse")
                self.assertEqual(group["mean_is"], "geometric" if geometric else "arithmetic")
                self.assertEqual([one["renderer"] for one in group["renderers"]], ["point", "ray"] if task == "compare" else ["ray"])
                for one in group["renderers"]:
                    values = figures_of(cells[task, one["renderer"]], measure)
                    self.assertEqual({each["participant_id"]: each["value"] for each in one["participants"]}, values)
                    modelled = task in ("compare", "detect")
                    self.assertEqual(one["from"], "hierarchical model" if modelled else "participants")
                    self.assertEqual(one["n_participants"] + (0 if modelled else one["n_undetermined"]), 6)
                    if modelled:
                        self.assertLess(one["ci95"][0], statistics.median(values.values()))
                        self.assertGreater(one["ci95"][1], statistics.median(values.values()))
                    else:
                        self.check_mean(one, values.values(), geometric, text)
            for one in found["renderer_comparisons"]:
                self.check_comparison(one, groups)

    def check_mean(self, one, values, geometric, text):
        numbers = [math.log(value) if geometric else value for value in values]
        if statistics.stdev(numbers) < 1e-6:  # the exponents are all 0.6
            return
        expected = [math.exp(x) if geometric else x for x in t_interval(numbers)]
        for got, wanted in zip((one["mean"], *one["ci95"]), expected):
            self.assertAlmostEqual(got / wanted, 1, delta=1e-5)
        self.assertAlmostEqual(one["sd_of_natural_logs" if geometric else "sd"], statistics.stdev(numbers), places=9)
        low, high = one["ci95"]
        self.assertRegex(text, rf"\n  {one['renderer']} +{one['mean']:.4g} \[{low:.4g}, {high:.4g}\] "
                               rf"\({one['n_participants']} participants")

    def check_comparison(self, one, groups):
        """Of point against ray, in pairs of the same figures."""
        point, ray = groups[one["task"], one["measure"]]["renderers"]
        ratios = [math.log(b["value"] / a["value"]) for a in point["participants"] for b in ray["participants"]
                  if a["participant_id"] == b["participant_id"]]
        difference, = one["differences"]
        self.assertEqual((one["reference"], difference["renderer"]), ("point", "ray"))
        for got, wanted in zip((difference["mean"], *difference["ci95"]), t_interval(ratios)):
            self.assertAlmostEqual(got, wanted, places=5)

    def test_the_reference_is_point_whichever_came_first(self):
        rows = [row for row in rows_of_a_study(2) if row["task"] == "compare"]
        rows.sort(key=lambda row: row["renderer"] != "ray")
        found = self.found(rows)
        self.assertEqual(found["cells"][0]["renderer"], "ray")
        self.assertEqual({one["reference"] for one in found["renderer_comparisons"]}, {"point"})

    def test_swapped_keys_are_said_and_left_out(self):
        for seed in (1, 2):
            # One standard on one side: farther ones are easier, whoever answers.
            rows = self.forced(random.Random(seed), 350, 0)
            for row in rows:
                if row["participant_id"] == "T2":
                    row["success"] = 1 - row["success"]
            cell, = self.found(rows)["cells"]
            self.assertEqual(cell["expected_easier"], "higher")
            for one in cell["psychometric_functions"]:
                swapped = one["participant_id"] == "T2"
                self.assertEqual((one["fit"]["reversed"], one["fit"]["easier"], one["fit"]["determined"]),
                                 (swapped, "lower" if swapped else "higher", not swapped))
            said, = [line for line in self.analyze().stdout.splitlines() if "FALL" in line]
            self.assertRegex(said, r"^  T2 .*NOT COMPARED: successes FALL as the level rises, although the task expects them to rise")
            group = self.found(rows)["group_results"][0]["renderers"][0]
            self.assertEqual((group["n_participants"], group["n_undetermined"]), (PEOPLE - 1, 1))
            # On both sides a table does not say what is asked: the others do.
            rows = [row for row in rows_of_a_study(seed) if row["task"] == "compare"]
            for row in rows:
                if row["participant_id"] == "T3" and row["renderer"] == "ray":
                    row["success"] = 1 - row["success"]
            for cell in self.found(rows)["cells"]:
                self.assertIsNone(cell["expected_easier"])
                for one in cell["psychometric_functions"]:
                    self.assertEqual(one["fit"]["reversed"], (one["participant_id"], cell["renderer"]) == ("T3", "ray"))
                    self.assertEqual(one["fit"]["guess"], one["fit"]["lapse"])
            self.assertIn("although those of the others rise", self.analyze().stdout)
            self.assertNotIn("successes fall as", self.analyze().stdout)
            # All alike: it may be what the task asked for.
            self.found([row | {"success": 1 - row["success"]} for row in rows_of_a_study(seed) if row["task"] == "compare"])
            self.assertEqual(self.analyze().stdout.count(
                "successes fall as the level rises; no protocol states which direction was asked for"), 2)

    def test_a_column_that_the_table_lacks_is_named_once(self):
        rows = [row for row in rows_of_a_study(1) if row["task"] == "compare"]
        self.write([{key: value for key, value in row.items() if key != "success"} for row in rows])
        refused = self.analyze()
        self.assertEqual(refused.returncode, 2)
        self.assertEqual(refused.stderr.count("expected a column success"), 1, refused.stderr)

    def test_answers_by_chance_are_not_called_swapped(self):
        called = 0
        for seed in range(6):
            draw = random.Random(seed)
            rows = [row | {"success": int(draw.random() < 0.5)} for row in self.forced(draw, 350, 0.5)]
            for one in self.found(rows)["cells"][0]["psychometric_functions"]:
                called += one["fit"]["reversed"]
        self.assertLessEqual(called, 4)  # of 30: at most some 2.5 % a side, and the likelihood's noise

    def test_the_last_answer_turns_a_staircase_too(self):
        # 1 up, 2 down, steps of 2: after each answer the level that follows.
        answers = [1, 1, 1, 1, 0, 1, 1, 0, 1, 1]
        for stop, turns in ((10, [5, 7, 8, 10]), (9, [5, 7, 8]), (8, [5, 7, 8]), (7, [5, 7])):
            level, alike, rows = 20, 0, []
            for i, success in enumerate(answers[:stop]):
                rows.append({"participant_id": "A", "task": "detect", "renderer": "ray", "shape": "bump", "response": "yes",
                             "track": 1, "level": level, "success": success})
                alike = alike + 1 if success else 0
                if not success or alike == 2:
                    level, alike = level + (-2 if success else 2), 0
            cell, = self.found(rows)["cells"]
            track, = cell["psychometric_functions"][0]["tracks"]
            self.assertEqual(track["reversal_trials"], turns, stop)

    def test_columns_that_look_like_others_are_named(self):
        seed = 4
        rows = self.forced(random.Random(seed), 350, 0.5)
        plain = self.found(rows)
        self.assertEqual(plain["warnings"], [])
        for found, meant in (("Level", "level"), (" level", "level"), ("Catch Trial", "catch_trial"), ("sucess", "success"),
                             ("standardLevel", "standard_level"), ("practise", "practice")):
            renamed = [{found if name == meant else name: value for name, value in row.items()} for row in rows]
            self.write(renamed)
            done = self.analyze("--json", self.path / "found.json", "--force")
            wanted = f"'{meant}'"
            if meant == "success":  # needed here
                self.assertEqual(done.returncode, 2)
                self.assertIn("(is 'sucess' meant?)", done.stderr)
                continue
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            warning, = json.loads((self.path / "found.json").read_text())["warnings"]
            self.assertEqual(warning, f"Column '{found}' is not known and was not read; is {wanted} meant?")
            self.assertIn(warning, done.stdout)
        self.write([row | {"colour": "red", "remark": 1} for row in rows])
        self.assertNotIn("not known", self.analyze().stdout)
        self.write([{"Shape" if name == "shape" else name: value for name, value in row.items()} for row in rows])
        self.assertIn("expected a column shape (is 'Shape' meant?)", self.analyze().stderr)
        # Of times: the table of trials, also where it is one of tasks.
        nine = ("participant_id", "session", "block", "trial", "renderer", "shape", "response", "correct", "response_time")
        times = [{name: row[name] for name in nine} | {"Practice": 1, "Task": "compare"} for row in rows]
        self.write(times)
        said = self.analyze().stdout
        self.assertIn("is 'practice' meant?", said)
        self.assertIn("is 'task' meant?", said)
        self.write([{"Response Time" if name == "response_time" else name: value for name, value in row.items()} for row in times])
        self.assertIn("expected a column 'response_time' (is 'Response Time' meant?)", self.analyze().stderr)

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
