"""A study of two crossed factors, from validate to bundle. PROTOCOLS is the second argument."""

import collections
import csv
import json
import math
import pathlib
import statistics
import sys
import unittest

import command_case

PROTOCOLS = pathlib.Path(sys.argv.pop(1))
STUDY = PROTOCOLS / "stiffness-surface-size.json"
LEVEL = {"level": {"path": "/stiffness_n_per_m"}, "procedure": {"kind": "constant", "levels": [100, 300, 900], "repetitions": 2}}
SMALL = {
    "version": 2, "name": "small", "renderers": ["point"], "seed": 3, "orientation": "fixed",
    "stimuli": [{"name": "plate", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 300}],
    "factors": [{"name": "surface", "levels": [{"name": "smooth", "set": {}}, {"name": "rough", "set": {"/stimuli/*/friction_static": 0.5}}]},
                {"name": "size", "levels": [{"name": "large", "set": {}}, {"name": "small", "set": {"/stimuli/*/radius_m": 0.02}}]}],
    "blocks": [{"name": "a", "task": "rate", "stimuli": ["plate"], "min": 0.001, "factors": ["surface", "size"], **LEVEL},
               {"name": "b", "task": "rate", "stimuli": ["plate"], "min": 0.001, **LEVEL}],
}


class Factors(command_case.CommandCase):
    def analyzed(self, *source):
        self.palpate("analyze", *source, "--json", self.dir / "found.json", "--force")
        return json.loads((self.dir / "found.json").read_text())

    def simulated(self, study, *options, name="study.db"):
        db = self.dir / name
        self.palpate("simulate", self.file("p.json", study), "--db", db, *options)
        return db

    def scheduled(self, study, participant):
        return list(csv.DictReader(self.palpate("schedule", self.file("p.json", study), "--participant", participant,
                                                "--format", "csv").stdout.splitlines()))

    def test_exports_have_a_column_for_each_factor(self):
        db = self.simulated(SMALL, "--participants", 2)
        text, rows = self.exported(db)
        header = text.splitlines()[0].split(",")
        self.assertEqual(header[header.index("practice"):][:4], ["practice", "surface", "size", "timed_out"])
        count = collections.Counter((row["block_name"], row["surface"], row["size"]) for row in rows)
        self.assertEqual(count, {("a", "smooth", "large"): 12, ("a", "smooth", "small"): 12, ("a", "rough", "large"): 12,
                                 ("a", "rough", "small"): 12, ("b", "", ""): 12})
        self.assertEqual({row["shape"] for row in rows}, {"plate"})
        self.palpate("export", "--db", db, "--format", "bids", "--out", self.dir / "bids")
        table = next((self.dir / "bids").glob("sub-*/ses-1/beh/*_beh.tsv"))
        self.assertIn("surface", table.read_text().splitlines()[0].split("\t"))
        about = json.loads(table.with_suffix(".json").read_text())["surface"]["Levels"]
        self.assertEqual(about["rough"], 'sets {"/stimuli/*/friction_static":0.5}')
        self.palpate("export", "--db", db, "--format", "psych-ds", "--out", self.dir / "psychds")
        about = json.loads((self.dir / "psychds" / "dataset_description.json").read_text())
        self.assertIn("size", [one["name"] for one in about["variableMeasured"]])

    def test_columns_may_stand_anywhere_with_the_protocol(self):
        db = self.simulated(SMALL, "--participants", 4)
        text, rows = self.exported(db)
        header = text.splitlines()[0].split(",")
        moved = [name for name in header if name not in ("surface", "size")] + ["size", "surface"]
        known = [name for name in header if name not in ("level", "success")]
        at = known.index("practice") + 1
        for name, columns in (("moved", moved), ("known", known[:at] + ["level", "success"] + known[at:]),
                              ("sorted", sorted(header))):
            with open(self.dir / f"{name}.csv", "w", newline="") as out:
                table = csv.DictWriter(out, columns)
                table.writeheader()
                table.writerows(rows)
        effects = self.analyzed("--db", db)["effects"]
        design = self.dir / "p.json"
        for name in ("moved", "known", "sorted"):
            self.assertEqual(self.analyzed("--csv", self.dir / f"{name}.csv", "--design", design)["effects"], effects, name)
        without = self.analyzed("--csv", self.dir / "known.csv")["effects"]  # levels by name
        for name, effect in effects["exponent"]["a"].items():
            self.assertAlmostEqual(without["exponent"]["a"][name]["f"] / effect["f"], 1, places=9)
        alone = self.analyzed("--csv", self.dir / "moved.csv")
        self.assertIn("Not read: 'size' and 'surface'", " ".join(alone["warnings"]))

    def test_incomplete_cells_are_told(self):
        _, rows = self.exported(self.simulated(SMALL, "--participants", 4))
        for row in rows:
            row["surface"] = "ruogh" if (row["participant_id"], row["surface"], row["size"]) == ("S001", "rough", "small") \
                else row["surface"]
        with open(self.dir / "wrong.csv", "w", newline="") as out:
            table = csv.DictWriter(out, list(rows[0]))
            table.writeheader()
            table.writerows(rows)
        found = self.palpate("analyze", "--csv", self.dir / "wrong.csv").stdout
        self.assertIn("do not cross the levels of its factors completely", found)

    def test_a_bundle_of_groups_verifies_as_bids(self):
        study = {**SMALL, "groups": {"names": ["young", "old"]}}
        db = self.simulated(study, "--participants", 4)
        about = self.file("about.json", {"version": 1, "authors": [{"name": "Ada"}], "license": "CC0-1.0"})
        out = self.dir / "bundle"
        self.palpate("bundle", "--db", db, "--about", about, "--out", out, "--format", "bids")
        self.assertNotIn("DIFFERS", self.palpate("bundle", "--verify", out).stdout)
        people = out / "data/bids/participants.tsv"
        people.write_text(people.read_text().replace("young", "old"))
        self.assertIn("other participants", self.palpate("bundle", "--verify", out, status=1).stdout)
        table = next((out / "data/bids").glob("sub-*/ses-1/beh/*_beh.tsv"))
        lines = table.read_text().splitlines(keepends=True)
        at = lines[0].split("\t").index("duration")
        fields = lines[3].split("\t")
        fields[at] = str(float(fields[at]) + 5)
        table.write_text("".join([*lines[:3], "\t".join(fields), *lines[4:]]))
        self.assertIn("duration is", self.palpate("bundle", "--verify", out, status=1).stdout)

    def test_effects_are_those_of_paired_differences(self):
        db = self.simulated(SMALL, "--participants", 7)
        found = self.analyzed("--db", db)
        self.assertEqual(found["design"], {"between": [], "within": ["renderer", "surface", "size"], "groups": [], "cells": 4,
                                           "factors": {"surface": ["smooth", "rough"], "size": ["large", "small"]}})
        exponents = collections.defaultdict(dict)
        for cell in found["cells"]:
            for one in cell["magnitude_estimation"]["participants"]:
                if "[" in cell["shape"]:
                    exponents[one["participant_id"]][cell["shape"]] = one["exponent"]
        self.assertEqual({len(own) for own in exponents.values()}, {4})

        def f_of(sign):
            scores = [sum(sign(cell) * value for cell, value in own.items()) for own in exponents.values()]
            return (statistics.mean(scores) / (statistics.stdev(scores) / math.sqrt(len(scores)))) ** 2

        signs = {"surface": lambda cell: 1 if "rough" in cell else -1, "size": lambda cell: 1 if "small" in cell else -1}
        signs["surface:size"] = lambda cell: signs["surface"](cell) * signs["size"](cell)
        effects = found["effects"]["exponent"]["a"]
        self.assertEqual(set(effects), set(signs))
        for name, sign in signs.items():
            self.assertAlmostEqual(effects[name]["f"] / f_of(sign), 1, places=9)
            self.assertEqual((effects[name]["num_df"], effects[name]["den_df"]), (1, 6))

        def holm(names):
            adjusted, least = {}, 0
            for i, name in enumerate(sorted(names, key=lambda one: effects[one]["p"])):
                least = max(least, min(1, (len(names) - i) * effects[name]["p"]))
                adjusted[name] = least
            return adjusted

        self.assertEqual({name: one["p_holm"] for name, one in effects.items()}, holm(effects))
        named = ["size", "surface:size"]
        found = self.analyzed("--db", self.simulated({**SMALL, "tests": named}, "--participants", 7, name="named.db"))
        self.assertEqual({name: one["p_holm"] for name, one in found["effects"]["exponent"]["a"].items()},
                         {**holm(named), "surface": None})

    def test_a_factor_equals_two_blocks(self):
        block = {"name": "a", "task": "compare", "stimuli": ["plate"], "standard": "plate", "factors": ["surface"], **LEVEL,
                 "procedure": {"kind": "constant", "levels": [200, 250, 350, 400], "repetitions": 8}}
        one = {**SMALL, "factors": SMALL["factors"][:1], "blocks": [block]}
        _, rows = self.exported(self.simulated(one, "--participants", 8))
        effect = self.analyzed("--csv", self.dir / "study.csv")["effects"]["jnd"]["a"]["surface"]
        with open(self.dir / "blocks.csv", "w", newline="") as out:
            names = [name for name in rows[0] if name != "surface"]
            table = csv.DictWriter(out, names)
            table.writeheader()
            for row in rows:
                table.writerow({**{name: row[name] for name in names}, "block_name": row["surface"]})
        pairs = [one for one in self.analyzed("--csv", self.dir / "blocks.csv")["condition_comparisons"]
                 if one["measure"] == "jnd"]
        self.assertEqual(len(pairs), 1)
        difference = pairs[0]["differences"][0]
        self.assertAlmostEqual(difference["t"] ** 2 / effect["f"], 1, places=9)
        self.assertAlmostEqual(difference["p"], effect["p"], places=9)

    def test_groups_and_factors_cross(self):
        study = {**SMALL, "groups": {"names": ["young", "old"], "assign": "given"}}
        found = self.analyzed("--db", self.simulated(study, "--groups", "young=4,old=3"))
        names = {"group", "surface", "size", "surface:size", "group:surface", "group:size", "group:surface:size"}
        self.assertEqual(set(found["effects"]["exponent"]["a"]), names)
        self.assertEqual(set(found["effects"]["exponent"]["b"]), {"group"})

    def test_a_schedule_names_the_cell(self):
        rows = [row for row in self.scheduled(SMALL, 1) if row["block_name"] == "a"]
        self.assertEqual({(row["shape"], row["surface"], row["size"]) for row in rows},
                         {("plate", s, z) for s in ("smooth", "rough") for z in ("large", "small")})
        apart = {**SMALL, "blocks": [{**SMALL["blocks"][0], "mixing": "blocked"}, SMALL["blocks"][1]]}
        orders = []
        for participant in range(1, 5):
            rows = [row for row in self.scheduled(apart, participant) if row["block_name"] == "a"]
            orders.append(list(dict.fromkeys((row["block"], row["surface"], row["size"]) for row in rows)))
            self.assertEqual(len(orders[-1]), 4)
        for place in range(4):
            self.assertEqual(len({order[place][1:] for order in orders}), 4)

    def test_identified_stimuli_are_plain(self):
        study = {**SMALL, "stimuli": [*SMALL["stimuli"], {"name": "cube", "shape": "cube", "edge_m": 0.04, "stiffness_n_per_m": 300}],
                 "factors": SMALL["factors"][:1], "renderers": ["point", "ray"],
                 "blocks": [{"name": "which", "task": "identify", "stimuli": ["plate", "cube"], "repetitions": 2, "factors": ["surface"]}]}
        db = self.simulated(study, "--participants", 4)
        _, rows = self.exported(db)
        self.assertEqual({row["response"] for row in rows if row["response"]} - {"plate", "cube"}, set())
        self.assertTrue(all(row["correct"] == str(int(row["response"] == row["shape"])) for row in rows))
        self.assertGreater(sum(row["correct"] == "1" for row in rows), len(rows) / 2)
        found = self.analyzed("--db", db)
        self.assertEqual(set(found["effects"]["time"]), {":".join(name for name, there in zip(("renderer", "surface", "shape"), bits) if there)
                                                         for bits in [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1)]})
        model = next(one for one in found["by_design"] if one["measure"] == "time")["mixed_model"]
        self.assertTrue(model["formula"].startswith("log(response_time) ~ renderer * surface * shape + (1"), model["formula"])
        self.assertEqual(set(model["effects"]), set(found["effects"]["time"]))
        self.assertEqual(model["effects"], found["model_effects"]["time"])
        self.assertEqual({(one["renderer"], one["factor"], one["level"]) for one in model["means"]},
                         {(None, None, None), ("point", None, None), ("ray", None, None), (None, "surface", "smooth"), (None, "surface", "rough")})
        said = self.palpate("analyze", "--db", db, "--report", self.dir / "r.html").stdout
        self.assertIn(model["formula"], said)
        for slope in model["slopes_taken_out"]:
            self.assertIn(slope, said)
        self.assertIn("linear mixed model of single trials", (self.dir / "r.html").read_text())

    def test_interrupted_studies_go_on_in_their_cells(self):
        whole = self.exported(self.simulated(SMALL, "--participants", 3, name="whole.db"))[1]
        db = self.simulated(SMALL, "--participants", 1, name="part.db")
        self.palpate("simulate", self.dir / "p.json", "--db", db, "--participants", 3)
        part = self.exported(db)[1]
        columns = ("participant_id", "trial", "block_name", "surface", "size", "level", "response")
        self.assertEqual([[row[c] for c in columns] for row in whole], [[row[c] for c in columns] for row in part])

    def test_every_cell_is_replayed_bit_by_bit(self):
        db = self.simulated({**SMALL, "samples": True}, "--participants", 1)
        self.assertEqual(len({(row["surface"], row["size"]) for row in self.exported(db)[1]}), 5)
        for trial in range(1, 25, 3):
            self.palpate("replay", "--db", db, "--trial", f"S001/1/{trial}")

    def test_the_study_of_the_manual_runs_to_its_report(self):
        db = self.dir / "study.db"
        self.palpate("validate", STUDY)
        self.palpate("simulate", STUDY, "--db", db, "--participants", 2)
        report = self.dir / "report.html"
        self.palpate("analyze", "--db", db, "--report", report)
        self.assertIn("Factors: compare, stiffness, comparison", report.read_text())

    def test_registered_checked_and_bundled(self):
        first, second = ({**block, "procedure": {**LEVEL["procedure"], "repetitions": 1}} for block in SMALL["blocks"])
        study = {**SMALL, "blocks": [first, {**first, "name": "c", "factors": ["surface"], "mixing": "blocked"}, second]}
        protocol = self.file("p.json", study)
        self.palpate("plan", "--exponent-effect", 30, "--trials", 3, "--participants", "3-9", "--studies", 100,
                     "--json", self.dir / "plan.json")
        name = "effects.exponent.a.surface:size.p"
        hypotheses = self.file("h.json", [{"id": "H1", "text": "It depends.", "corroborated": f"{name} < alpha",
                                           "refuted": f"{name} > 0.5"}])
        out = self.dir / "registration"
        self.palpate("register", protocol, "--plan", self.dir / "plan.json", "--hypotheses", hypotheses, "--out", out,
                     "--participants", 4, "--studies", 20)
        text = (out / "registration.md").read_text()
        for words in ("factor surface (smooth and rough); trials mixed in block a; one cell after the other, in the order of a "
                      "Williams' square, in block c", "3 blocks of trials", "between the first level of the factor surface"):
            self.assertIn(words, text)
        self.assertNotRegex(text, r"\| H1 \| no effect \|[^|]*\|[^|]*\| 20 of 20 \|")  # it finds the effect's p
        db = self.simulated(study, "--participants", 4)
        self.palpate("check", out, "--db", db, "--json", self.dir / "check.json")
        found = {one["id"]: one["finding"] for one in json.loads((self.dir / "check.json").read_text())["points"]}
        self.assertEqual(found["order"], "as registered")
        self.assertNotIn("deviation", found.values())
        about = self.file("about.json", {"version": 1, "authors": [{"name": "Ada"}], "license": "CC0-1.0"})
        for form in ("bids", "psych-ds"):
            bundle = self.dir / form
            self.palpate("bundle", "--db", db, "--registration", out, "--about", about, "--out", bundle, "--format", form)
            said = self.palpate("bundle", "--verify", bundle).stdout
            self.assertNotIn("DIFFERS", said)
            self.assertIn("Run as registered", said)


if __name__ == "__main__":
    unittest.main()
