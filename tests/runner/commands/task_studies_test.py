"""Studies of version 2 from end to end: simulate, analyze, export, replay, merge; identification as in version 1.
Usage: task_studies_test.py PALPATE PROTOCOLS"""

import csv
import gzip
import hashlib
import io
import json
import math
import pathlib
import sys
import unittest

from command_case import CommandCase

PROTOCOLS = pathlib.Path(sys.argv.pop(1))
SHIPPED = ("stiffness-2afc", "size-questplus", "roughness-magnitude", "grating-roughness", "spacing-2afc", "tap-hardness", "force-field")
SHAPES = [{"name": "sphere", "shape": "sphere", "radius_m": 0.03}, {"name": "cube", "shape": "cube", "edge_m": 0.05}]
KEYS = {"1": "sphere", "2": "cube"}


class TaskStudies(CommandCase):
    def simulated(self, protocol, name, *more, participants=2, seed=1):
        db = self.dir / f"{name}.db"
        self.palpate("simulate", protocol, "--db", db, "--participants", participants, "--seed", seed, *more)
        return db

    def numbers(self, *source):
        out = self.dir / "numbers.json"
        self.palpate("analyze", *source, "--json", out, "--force")
        return json.loads(out.read_text())

    def test_shipped_protocols_go_from_simulation_to_report_and_exports(self):
        for name in SHIPPED:
            with self.subTest(name):
                db = self.simulated(PROTOCOLS / f"{name}.json", name)
                page = self.dir / f"{name}.html"
                out = self.dir / f"{name}.numbers.json"
                said = self.palpate("analyze", "--db", db, "--report", page, "--json", out,
                                    "--figures", self.dir / f"{name}-figures").stdout
                self.assertTrue(said.startswith("SIMULATED PARTICIPANTS"))
                self.assertIn("SIMULATED PARTICIPANTS", page.read_text())
                found = json.loads(out.read_text())
                text, rows = self.exported(db)
                self.assertEqual(found["n_trials"] + found["n_practice"], len(rows))
                self.check_analysis_of_the_export(name, found["cells"])
                for kind in ("bids", "psych-ds"):
                    folder = self.dir / f"{name}-{kind}"
                    self.palpate("export", "--db", db, "--format", kind, "--out", folder)
                    self.assertTrue(any(folder.rglob("*.tsv")) or any(folder.rglob("*.csv")))
                    self.palpate("export", "--db", db, "--format", kind, "--out", folder, "--force")
                self.check_repeated(name, db, text)

    def test_a_table_of_several_protocols_is_told_apart_by_their_checksums(self):
        db = self.simulated(PROTOCOLS / "roughness-magnitude.json", "both", participants=1)
        self.simulated(PROTOCOLS / "stiffness-2afc.json", "both", participants=1)
        sums = sorted({row["protocol_sha256"][:12] for row in self.exported(db)[1]})
        said = self.palpate("analyze", "--csv", self.dir / "both.csv", status=2).stderr
        listed = said[said.index("(") + 1:said.index(")")]
        self.assertEqual(sorted(listed.split(", ")), sums)
        self.assertIn("--protocol and the beginning of its checksum", said)
        self.palpate("analyze", "--csv", self.dir / "both.csv", "--protocol", sums[0])

    def check_analysis_of_the_export(self, name, cells):
        """It gives the same cells as that of the database; only the database has the procedures and their scale."""
        scales = set()
        for cell in cells:
            for one in cell.get("psychometric_functions", []):
                scales.add(one["fit"]["scale"])
                for track in one.get("tracks", []):
                    kind = track.pop("procedure", {"kind": "constant"})["kind"]
                    if kind != "staircase":  # unknown to the export, where each could be one
                        self.assertEqual(track.pop("reversal_trials"), [], kind)
        self.assertLessEqual(len(scales), 1)
        known = ["--scale", *scales] if scales else []
        exported = self.numbers("--csv", self.dir / f"{name}.csv", *known)["cells"]
        for cell in (*exported, *cells):  # known from the protocol only
            for name_of_protocol in ("level_unit", "expected_easier"):
                cell.pop(name_of_protocol)
        for cell, own in zip(exported, cells):
            for one, same in zip(cell.get("psychometric_functions", []), own.get("psychometric_functions", [])):
                for track, as_stored in zip(one.get("tracks", []), same.get("tracks", [])):
                    if "reversal_trials" not in as_stored:
                        track.pop("reversal_trials")
        self.assertEqual(exported, cells)
        self.assertEqual(scales, {"log"} if name == "size-questplus" else scales - {"log"})

    def check_repeated(self, name, db, text):
        """Repeating changes nothing, resuming in parts gives the same, another seed does not."""
        protocol = PROTOCOLS / f"{name}.json"
        self.palpate("simulate", protocol, "--db", db, "--participants", 2)
        self.assertEqual(self.exported(db)[0], text)
        parts = self.simulated(protocol, f"{name}-parts", participants=1)
        self.palpate("simulate", protocol, "--db", parts, "--participants", 2)
        self.assertEqual(self.exported(parts)[0], text)
        self.assertNotEqual(self.exported(self.simulated(protocol, f"{name}-7", seed=7))[0], text)

    def protocol_with_columns(self, hand="handedness", age="age"):
        protocol = json.loads((PROTOCOLS / "roughness-magnitude.json").read_text())
        for item, column in zip(protocol["pages"][1]["items"], (hand, age), strict=True):
            item["column"] = column
        del protocol["$schema"]
        return self.file("columns.json", protocol)

    def test_questions_with_a_column_describe_the_participants(self):
        db = self.simulated(self.protocol_with_columns(), "columns", participants=4)
        self.palpate("export", "--db", db, "--format", "bids", "--out", self.dir / "without")
        self.assertEqual((self.dir / "without/participants.tsv").read_text().splitlines()[0], "participant_id\tsimulated")
        self.palpate("export", "--db", db, "--format", "bids", "--out", self.dir / "with", "--pages")
        with open(self.dir / "with/sourcedata/pages.csv", newline="") as file:
            answers = {(row["participant_id"], row["item"]): row["answer"] for row in csv.DictReader(file)}
        with open(self.dir / "with/participants.tsv", newline="") as file:
            rows = list(csv.DictReader(file, delimiter="\t"))
        self.assertEqual(len(rows), 4)
        for row in rows:
            code = row["participant_id"].removeprefix("sub-")
            self.assertEqual(row["handedness"], answers[code, "hand"])
            self.assertEqual(row["age"], answers[code, "age"] or "n/a")
        about = json.loads((self.dir / "with/participants.json").read_text())
        self.assertEqual(about["handedness"]["Description"], "Which hand do you write with?")
        self.assertEqual(list(about["handedness"]["Levels"]), ["left", "right", "both"])
        self.assertEqual(about["age"], {"Description": "How old are you?", "Units": "year"})
        self.palpate("analyze", "--db", db, "--report", self.dir / "report.html")
        page = (self.dir / "report.html").read_text()
        counts = [sum(answers[f"S00{n}", "hand"] == hand for n in (1, 2, 3, 4)) for hand in ("left", "right", "both")]
        self.assertIn("left {}, right {}, both {}".format(*counts), page)
        self.assertIn("Which hand do you write with?", page)

    def test_a_column_of_participants_has_a_name_of_its_own(self):
        self.palpate("validate", self.protocol_with_columns())
        for hand, age in (("age", "age"), ("simulated", "age"), ("participant_id", "age"), ("Age", "age"), ("", "age"), ("a-b", "age")):
            with self.subTest(hand=hand):
                said = self.palpate("validate", self.protocol_with_columns(hand, age), status=2)
                self.assertIn("/column", said.stdout + said.stderr)

    def test_answers_to_pages_are_exported_on_request(self):
        db = self.simulated(PROTOCOLS / "roughness-magnitude.json", "pages", participants=3)
        expected = [(f"S00{n}", page, item) for n in (1, 2, 3)
                    for page, item in (("consent", "consent"), ("about-you", "hand"), ("about-you", "age"))]
        consent = json.loads((PROTOCOLS / "roughness-magnitude.json").read_text())["pages"][0]
        for kind, place in (("bids", "sourcedata/pages.csv"),
                            ("psych-ds", "data/study-roughnessmagnitude_description-pages_data.csv")):
            with self.subTest(kind):
                without = self.dir / f"{kind}-without"
                self.palpate("export", "--db", db, "--format", kind, "--out", without)
                self.assertEqual([path.name for path in without.rglob("*pages*")], [])
                folder = self.dir / kind
                said = self.palpate("export", "--db", db, "--format", kind, "--out", folder, "--pages")
                self.assertIn("9 answers to pages: personal data", said.stdout + said.stderr)
                with open(folder / place, newline="") as file:
                    rows = list(csv.DictReader(file))
                self.assertEqual([(row["participant_id"], row["page"], row["item"]) for row in rows], expected)
                for row in rows:
                    self.assertEqual(row["simulated"], "1")
                    self.assertRegex(row["answered_utc"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d")
                    if row["page"] == "consent":
                        self.assertEqual((row["answer"], row["consent_version"]), ("agree", "1"))
                        self.assertEqual(row["text_sha256"], hashlib.sha256(consent["text"].encode()).hexdigest())
                    if row["item"] == "hand":
                        self.assertIn(row["answer"], ("left", "right", "both"))
                    if row["item"] == "age" and row["answer"]:
                        self.assertTrue(18 <= float(row["answer"]) <= 120)
                if kind == "bids":  # every column is described beside it
                    described = json.loads((folder / place).with_suffix(".json").read_text())
                    self.assertEqual(set(rows[0]) - set(described), set())
                else:
                    description = json.loads((folder / "dataset_description.json").read_text())
                    measured = {one["name"] for one in description["variableMeasured"]}
                    headers = {column for path in folder.rglob("*_data.csv")
                               for column in path.read_text().splitlines()[0].split(",")}
                    self.assertEqual(measured, headers)

    def test_adaptive_estimates_are_reported_beside_the_fit(self):
        db = self.simulated(PROTOCOLS / "stiffness-2afc.json", "stairs", participants=3)
        said = self.palpate("analyze", "--db", db, "--report", self.dir / "stairs.html").stdout
        self.assertIn("mean of its reversals, converging to 70.7 % successes", said)
        page = (self.dir / "stairs.html").read_text()
        self.assertTrue(">converges at</th>" in page)
        self.assertEqual(page.count('<td class="name">staircase</td>'), 6, "three participants, two renderers")
        self.assertTrue("<td>70.7 %</td>" in page)
        title = json.loads((PROTOCOLS / "stiffness-2afc.json").read_text())["title"]
        self.assertTrue(f'<p class="study">{title}' in page, "the study's title heads its report")
        for axis in ("level (N/m)", "JND (N/m)", "PSE (N/m)", "Weber fraction"):
            self.assertTrue(f">{axis}</text>" in page, axis)
        self.assertFalse(">level</text>" in page)
        found = self.numbers("--db", db)
        self.assertEqual(found["title"], title)
        self.assertEqual({one["unit"] for one in found["group_results"] if one["measure"] == "jnd"}, {"N/m"})
        for cell in found["cells"]:
            self.assertEqual((cell["level_unit"], cell["expected_easier"]), ("N/m", "higher"))
        compared = 0
        for cell in self.numbers("--db", db)["cells"]:
            for one in cell["psychometric_functions"]:
                for track in one["tracks"]:
                    if cell["block_name"] == "constant":
                        self.assertNotIn("procedure", track)
                        continue
                    found = track["procedure"]
                    self.assertEqual(found["kind"], "staircase")
                    down = {"1": 2, "2": 3}[track["track"]]
                    self.assertAlmostEqual(found["converges_at"], 0.5 ** (1 / down), places=9)
                    # By definition: the track's levels at reversals, the first two discarded, an even number.
                    turns = [track["levels"][trial - 1] for trial in track["reversal_trials"]]
                    kept = turns[2 + (len(turns) - 2) % 2:]
                    self.assertEqual(found["n_reversals"], len(turns))
                    self.assertAlmostEqual(found["threshold"], sum(kept) / len(kept), places=6)
                    fit = one["fit"]
                    at = fit["guess"] + (1 - fit["guess"] - fit["lapse"]) / (
                        1 + math.exp(-fit["slope"] * (found["fit_level_there"] - fit["threshold"])))
                    self.assertAlmostEqual(at, found["converges_at"], places=9)
                    compared += 1
        self.assertEqual(compared, 6)

    def test_quest_plus_estimates_are_those_of_its_posterior(self):
        db = self.simulated(PROTOCOLS / "size-questplus.json", "quest", participants=2)
        spec = json.loads((PROTOCOLS / "size-questplus.json").read_text())["blocks"][1]["procedure"]
        self.assertIn("QUEST+: threshold", self.palpate("analyze", "--db", db, "--function", "weibull").stdout)
        for cell in self.numbers("--db", db, "--function", "weibull")["cells"]:
            for one in cell["psychometric_functions"]:
                track, = one["tracks"]
                posterior = {(t, s): 1.0 for t in spec["threshold"] for s in spec["slope"]}
                for level, success in zip(track["levels"], track["successes"]):
                    for t, s in posterior:
                        p = 0.5 + 0.48 * (1 - math.exp(-(level / t) ** s))
                        posterior[t, s] *= p if success else 1 - p
                whole = sum(posterior.values())
                log_threshold = sum(w * math.log10(t) for (t, _), w in posterior.items()) / whole
                found = track["procedure"]
                self.assertEqual((found["kind"], found["function"], found["scale"]), ("quest_plus", "weibull", "log"))
                self.assertAlmostEqual(found["threshold"] / 10 ** log_threshold, 1, places=9)
                self.assertAlmostEqual(found["slope"], sum(w * s for (_, s), w in posterior.items()) / whole, places=6)
                self.assertEqual(found["n_trials"], 32)

    def test_the_analysis_recovers_the_simulated_abilities(self):
        db = self.simulated(PROTOCOLS / "stiffness-2afc.json", "a", participants=4)
        found = self.numbers("--db", db)
        constant = next(cell for cell in found["cells"] if cell["block_name"] == "constant")
        self.assertFalse(constant["forced_choice"])
        for one in constant["psychometric_functions"]:
            # Weber fraction 0.15 of 300 N/m is the sd of the difference: 30 N/m between 50 and 75 %.
            self.assertAlmostEqual(one["fit"]["pse"], 300, delta=40)
            self.assertAlmostEqual(one["bayes"]["threshold"], one["fit"]["threshold"], delta=15)
        self.assertEqual({one["measure"] for one in found["condition_comparisons"]} & {"jnd"}, {"jnd"})
        stairs = next(cell for cell in found["cells"] if cell["block_name"] == "staircases")
        for one in stairs["psychometric_functions"]:
            self.assertEqual(sorted(track["track"] for track in one["tracks"]), ["1", "2"])
            for track in one["tracks"]:
                # The trials counted as reversals by the procedure, including the last of the track.
                self.assertEqual(len(track["reversal_trials"]), track["procedure"]["n_reversals"])
                self.assertGreaterEqual(len(track["reversal_trials"]), 5)
                levels = track["levels"]
                for trial in track["reversal_trials"]:
                    if trial == len(levels):
                        continue
                    before = [x for x in levels[:trial] if x != levels[trial - 1]][-1]
                    after = levels[trial]
                    self.assertGreater((levels[trial - 1] - before) * (levels[trial - 1] - after), 0)

    def identification(self):
        """The same study in version 1 and in version 2."""
        base = {"renderers": ["point", "ray"], "stimuli": SHAPES, "seed": 3}
        one = {**base, "version": 1, "name": "one", "repetitions": 5, "response": {"keys": KEYS, "time_out_s": 20}}
        block = {"task": "identify", "stimuli": ["sphere", "cube"], "repetitions": 5, "keys": KEYS, "time_out_s": 20}
        two = {**base, "version": 2, "name": "two", "block_order": "counterbalanced",
               "blocks": [{**block, "name": kind, "renderers": [kind]} for kind in ("point", "ray")]}
        for protocol in (one, two):
            (self.dir / f"{protocol['name']}.json").write_text(json.dumps(protocol))
        return self.dir / "one.json", self.dir / "two.json"

    def test_identification_gives_the_trials_and_figures_of_version_1(self):
        one, two = self.identification()
        for seed in (1, 4):
            with self.subTest(seed=seed):
                databases = [self.simulated(path, f"{path.stem}{seed}", participants=4, seed=seed) for path in (one, two)]
                (_, expected), (_, found) = (self.exported(db) for db in databases)
                own = {"protocol_name", "protocol_sha256"}
                self.assertEqual(len(found), 4 * 20)
                for a, b in zip(expected, found):
                    self.assertEqual({key: b[key] for key in a if key not in own}, {key: a[key] for key in a if key not in own})
                    self.assertEqual((b["task"], b["success"]), ("identify", b["correct"]))
                plain = self.numbers("--db", databases[0])
                tasks = self.numbers("--db", databases[1])
                again = tasks["identification"]
                for key in ("counts", "accuracy", "confusion", "times", "paired_by_shape", "rm_anova", "mixed_model",
                            "speed_accuracy", "practice", "exclusions"):
                    self.assertEqual(again[key], plain[key], key)
                from_csv = self.numbers("--csv", self.dir / f"two{seed}.csv")
                self.assertEqual(from_csv["identification"]["times"], plain["times"])
                self.assertEqual(from_csv["group_model"], tasks["group_model"])

    def test_shards_merge_to_the_whole_study(self):
        _, two = self.identification()
        whole = self.exported(self.simulated(two, "whole", participants=3))[0]
        parts = [self.simulated(two, f"part{i}", "--shard", f"{i}/3", participants=3) for i in (1, 2, 3)]
        merged = self.dir / "merged.db"
        self.palpate("merge", "--out", merged, *parts)
        self.assertEqual(self.exported(merged)[0], whole)

    def test_every_interval_is_replayed_to_the_bit(self):
        protocol = json.loads((PROTOCOLS / "stiffness-2afc.json").read_text())
        protocol["samples"] = True
        protocol["blocks"] = [protocol["blocks"][0]]
        protocol["blocks"][0]["practice"] = False
        path = self.dir / "kept.json"
        path.write_text(json.dumps(protocol))
        db = self.simulated(path, "kept", participants=1)
        out = self.dir / "replay.json"
        for trial in (1, 4):
            table = self.dir / f"ticks{trial}.csv"
            done = self.palpate("replay", "--db", db, "--trial", f"S001/1/{trial}", "--compare", "--json", out, "--force",
                                "--out", table)
            self.assertIn("equal the record, bit by bit", done.stdout)
            self.assertIn("interval 2:", done.stdout)
            found = json.loads(out.read_text())
            self.assertEqual(found["task"], "compare")
            self.assertEqual([one["ticks"] for one in found["intervals"]], [one["equal_ticks"] for one in found["intervals"]])
            self.assertEqual(sum(one["ticks"] for one in found["intervals"]), found["ticks"])
            self.assertEqual(sorted(one["standard"] for one in found["intervals"]), [False, True])
            rows = list(csv.DictReader(io.StringIO(table.read_text())))
            self.assertEqual({row["interval"] for row in rows}, {"1", "2"})
            self.assertEqual([row["t"] for row in rows if row["tick"] == "0"], ["0", "0"])

    def test_samples_of_an_adjustment_are_exported_in_all_its_intervals(self):
        """After a turn an interval begins at the time at which the one before has ended."""
        protocol = self.file("turned.json", {
            "version": 2, "name": "turned", "renderers": ["point"], "orientation": "fixed", "home": {"rest_s": 0.1},
            "samples": True, "servo": {"rate_hz": 500},
            "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 2, "stiffness_n_per_m": 200}],
            "blocks": [{"name": "equal", "task": "adjust", "stimuli": ["ball"], "standard": "ball",
                        "level": {"path": "/stiffness_n_per_m"}, "min": 100, "max": 500, "turn": 20,
                        "starts": [120, 480], "repetitions": 3}]})
        db = self.simulated(protocol, "turned", participants=1)
        rows = self.exported(db)[1]
        ends = [row["interval_ends"].split(";") for row in rows]
        onsets = [row["interval_onsets"].split(";") for row in rows]
        self.assertTrue(any(begin == end for some, others in zip(onsets, ends) for begin, end in zip(some[1:], others)),
                        (onsets, ends))
        ticks = [int(row["ticks"]) for row in rows]
        self.palpate("export", "--db", db, "--format", "bids", "--out", self.dir / "bids")
        motion, = (self.dir / "bids").rglob("*_physio.tsv.gz")
        lines = [line.split("\t") for line in gzip.decompress(motion.read_bytes()).decode().splitlines()]
        felt = [line for line in lines if line[0] != "n/a"]
        self.assertEqual([sum(line[0] == str(trial + 1) for line in felt) for trial in range(len(rows))], ticks)
        for trial, some in enumerate(onsets):
            self.assertEqual({line[1] for line in felt if line[0] == str(trial + 1)},
                             {str(one + 1) for one in range(len(some))})
        self.palpate("export", "--db", db, "--format", "psych-ds", "--out", self.dir / "psych")
        samples = sum(text.count("\n") - 1 for path in (self.dir / "psych").rglob("*haptic_data.csv")
                      for text in [path.read_text()])
        self.assertEqual(samples, sum(ticks))


if __name__ == "__main__":
    unittest.main()
