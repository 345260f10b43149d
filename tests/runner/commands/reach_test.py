"""Studies of movements to targets, from validate to bundle. PROTOCOLS is the second argument."""

import collections
import csv
import hashlib
import io
import json
import pathlib
import sqlite3
import statistics
import subprocess
import sys
import unittest

import command_case

PROTOCOLS = pathlib.Path(sys.argv.pop(1))
CURL = {"name": "curl", "shape": "none", "fields": [{"kind": "curl", "axis": [0, 0, 1], "damping_ns_per_m": 13, "destabilising": True}]}
SMALL = {
    "version": 2, "name": "small", "renderers": ["point"], "seed": 3, "samples": True, "stimuli": [CURL],
    "home": {"rest_s": 0.1},
    "blocks": [{"name": "in", "task": "reach", "stimuli": ["curl"], "repetitions": 20, "targets_m": [[0, 0.08, 0]],
                "time_window_s": [0.3, 0.8], "time_out_s": 4, "clamp_share": 0.2}],
}

WITH_CATCHES = {**SMALL, "blocks": [{**SMALL["blocks"][0], "catch_share": 0.2}]}
ZERO_PLAN = ["--adaptation-effect", 0.4, "--contrast", "zero", "--trials", 4]
LEARNS = [{"id": "H1", "text": "It learns.", "corroborated": "adaptation.in.point.ci95_low > 0",
           "refuted": "adaptation.in.point.ci95_high < 0.1"}]


def changed(study, **keys):
    return {**study, **keys}


class Reach(command_case.CommandCase):
    def simulated(self, study, *options, name="study.db"):
        db = self.dir / name
        self.palpate("simulate", self.file("p.json", study), "--db", db, *options)
        return db

    def analyzed(self, *source):
        self.palpate("analyze", *source, "--json", self.dir / "found.json", "--force")
        return json.loads((self.dir / "found.json").read_text())

    def test_schedule_names_targets_and_what_is_felt(self):
        protocol = PROTOCOLS / "force-field.json"
        table = self.palpate("schedule", protocol, "--participant", 1).stdout
        self.assertIn("2 targets in 0.35 to 1 s; 10 % clamp trials; 4 % catch trials", table)
        self.assertRegex(table, r"\n +\d+ +1  point     1 clamp ")
        rows = self.palpate("schedule", protocol, "--participant", 1, "--format", "csv").stdout.splitlines()
        self.assertTrue(rows[0].endswith(",reach_kind"))
        kinds = collections.Counter(row.rsplit(",", 1)[1] for row in rows[1:] if ",learning," in row)
        self.assertEqual(kinds, {"field": 86, "clamp": 10, "catch": 4})
        listed = json.loads(self.palpate("schedule", protocol, "--participant", 1, "--format", "json").stdout)
        self.assertEqual({one["level"] for one in listed["trials"]}, {1, 2})

    def test_measures_are_in_every_export(self):
        db = self.simulated(SMALL, "--participants", 2)
        _, rows = self.exported(db)
        self.assertEqual(collections.Counter(row["reach_kind"] for row in rows), {"field": 32, "clamp": 8})
        for row in rows:
            self.assertIn(row["response"], ("in_time", "fast", "slow"))
            self.assertEqual(row["correct"], "1" if row["response"] == "in_time" else "0")
            self.assertTrue(0.3 < float(row["movement_duration"]) < 1.5, row["movement_duration"])
            self.assertTrue(0.15 < float(row["peak_speed"]) < 0.6)
            self.assertGreaterEqual(float(row["path_ratio"]), 1)
            self.assertLess(float(row["endpoint_error"]), 0.005)
            self.assertEqual(row["adaptation"] == "", row["reach_kind"] == "field")
        self.palpate("export", "--db", db, "--format", "csv", "--out", self.dir / "again.csv", "--codebook", self.dir / "codebook.csv")
        self.assertIn("reach: largest speed of the tip", (self.dir / "codebook.csv").read_text())
        self.palpate("export", "--db", db, "--format", "bids", "--out", self.dir / "bids")
        table = next((self.dir / "bids").glob("sub-*/ses-1/beh/*_beh.tsv"))
        self.assertIn("adaptation", table.read_text().splitlines()[0].split("\t"))
        self.palpate("export", "--db", db, "--format", "psych-ds", "--out", self.dir / "psychds")
        about = json.loads((self.dir / "psychds" / "dataset_description.json").read_text())
        self.assertIn("reach_kind", [one["name"] for one in about["variableMeasured"]])
        self.assertEqual(self.analyzed("--db", db)["cells"][0]["reaches"],
                         self.analyzed("--csv", self.dir / "study.csv")["cells"][0]["reaches"])

    def test_trials_are_rendered_again_bit_by_bit(self):
        db = self.simulated(changed(SMALL, blocks=[{**SMALL["blocks"][0], "catch_share": 0.2}]), "--participants", 1)
        _, rows = self.exported(db)
        for kind in ("field", "clamp", "catch"):
            trial = next(row["trial"] for row in rows if row["reach_kind"] == kind)
            said = self.palpate("replay", "--db", db, "--trial", f"S001/1/{trial}").stdout
            self.assertIn("equal the record, bit by bit", said, kind)
            self.palpate("watch", "--db", db, "--trial", f"S001/1/{trial}", "--out", self.dir / f"{kind}.html")

    def test_report_has_the_course_of_learning(self):
        db = self.simulated(SMALL, "--participants", 2)
        found = self.analyzed("--db", db)
        one = found["cells"][0]["reaches"][0]
        self.assertGreater(one["deviation_m"], 0.003)
        self.assertLess(one["deviations"][-1][1], one["deviations"][0][1])
        self.assertTrue(0 < one["adaptation"] < 1)
        self.assertEqual({group["measure"] for group in found["group_results"]} & {"deviation", "adaptation"},
                         {"deviation", "adaptation"})
        self.palpate("analyze", "--db", db, "--report", self.dir / "page.html", "--figures", self.dir / "figures")
        self.assertIn("Movements over the trials", (self.dir / "page.html").read_text())
        self.assertTrue((self.dir / "figures" / "reach1.svg").exists())

    def test_groups_and_factors_are_compared(self):
        weak = {**CURL, "fields": [{**CURL["fields"][0], "damping_ns_per_m": 6}]}
        study = changed(SMALL, groups={"names": ["strong", "weak"], "patch": {"weak": {"stimuli": [weak]}}})
        found = self.analyzed("--db", self.simulated(study, "--participants", 6))
        self.assertIn("group", found["effects"]["deviation"]["in"])
        means = {}
        for cell in found["cells"]:
            for one in cell["reaches"]:
                means.setdefault(int(one["participant_id"][1:]) % 2, []).append(one["deviation_m"])
        self.assertGreater(statistics.mean(means[1]), 1.5 * statistics.mean(means[0]))
        factors = [{"name": "field", "levels": [{"name": "weak", "set": {"/stimuli/*/fields/0/damping_ns_per_m": 6}},
                                                {"name": "strong", "set": {}}]}]
        crossed = changed(SMALL, name="crossed", factors=factors,
                          blocks=[{**SMALL["blocks"][0], "factors": ["field"], "mixing": "blocked"}])
        found = self.analyzed("--db", self.simulated(crossed, "--participants", 4, name="crossed.db"))
        self.assertIn("field", found["effects"]["deviation"]["in"])

    def test_study_of_the_manual_goes_to_its_archive(self):
        protocol = PROTOCOLS / "force-field.json"
        db = self.dir / "field.db"
        self.palpate("simulate", protocol, "--db", db, "--participants", 2)
        said = self.palpate("analyze", "--db", db).stdout
        self.assertIn("in catch trials", said)
        about = self.file("about.json", {"version": 1, "authors": [{"name": "Ada"}], "license": "CC0-1.0"})
        self.palpate("bundle", "--db", db, "--about", about, "--out", self.dir / "bundle")
        self.assertNotIn("DIFFERS", self.palpate("bundle", "--verify", self.dir / "bundle").stdout)

    def test_other_programs_are_told_to_use_run(self):
        said = self.palpate("serve", "--device", "simulated", "--protocol", self.file("p.json", SMALL), "--db",
                            self.dir / "s.db", "--participant", "A1", status=2).stderr
        self.assertIn("movements to targets", said)

    def test_bad_input_is_named_with_its_place(self):
        bad = changed(SMALL, samples=False, blocks=[{**SMALL["blocks"][0], "targets_m": [[0, 0.008, 0]], "clamp_share": 0.02}])
        said = self.palpate("validate", self.file("bad.json", bad), status=2).stderr
        for place in ("/samples", "/blocks/0/targets_m/0", "/blocks/0/clamp_share"):
            self.assertIn(f": {place}: expected", said)
        stiff = changed(SMALL, blocks=[{**SMALL["blocks"][0], "clamp_stiffness_n_per_m": 19000}])
        said = self.palpate("simulate", self.file("stiff.json", stiff), "--db", self.dir / "x.db", status=2).stderr
        self.assertIn("channel 1", said)


class Registered(command_case.CommandCase):
    """Studies with a plan, from register to bundle."""

    def registered(self, study, plan, hypotheses, *, participants=6, name="r", status=0):
        self.file("p.json", study)
        self.palpate("plan", *plan, "--participants", f"{participants}-{participants}", "--studies", 100, "--json",
                     self.dir / "plan.json", "--force")
        return self.palpate("register", self.dir / "p.json", "--plan", self.dir / "plan.json", "--hypotheses",
                            self.file("h.json", hypotheses), "--participants", participants, "--studies", 20, "--out",
                            self.dir / name, status=status)

    def points(self, db, status=0, name="r"):
        self.palpate("check", self.dir / name, "--db", db, "--json", self.dir / "check.json", "--force", status=status)
        check = json.loads((self.dir / "check.json").read_text())
        return check, {point["id"]: point for point in check["points"]}

    def simulated(self, study, participants=6, name="study.db"):
        self.palpate("simulate", self.file("simulated.json", study), "--db", self.dir / name, "--participants", participants)
        return self.dir / name

    def test_from_plan_to_archive(self):
        self.registered(WITH_CATCHES, ZERO_PLAN, LEARNS)
        folder = self.dir / "r"
        osf = json.loads((folder / "osf.json").read_text())
        for key in ("q6", "q7", "q11", "q12", "q14", "q15", "q16", "q17", "q18", "q19"):
            self.assertNotIn("FILL IN", osf[key], key)
        self.assertIn("the adaptation is 0.40 higher than 0", osf["q12"])
        self.assertIn("1 target in", osf["q6"])
        counts = json.loads((folder / "registration.json").read_text())["hypotheses"][0]
        self.assertGreater(counts["with_planned_effect"]["corroborated"], 15)
        self.assertLess(counts["with_no_effect"]["corroborated"], 5)
        both = json.loads((folder / "analysis-simulated.json").read_text())
        with_effect, none = (both[key]["adaptation"]["in"]["point"]["estimate"] for key in ("planned_effect", "no_effect"))
        self.assertAlmostEqual(with_effect, 0.4, delta=0.3)
        self.assertAlmostEqual(none, 0, delta=0.3)
        db = self.simulated(WITH_CATCHES)
        check, points = self.points(db)
        self.assertEqual(check["deviations"], 0)
        self.assertIn("in: 72 field, 24 catch, 24 clamp", points["movements"]["sentence"])
        numbers = check["hypotheses"][0]["numbers"]
        self.assertLess(numbers["adaptation.in.point.ci95_low"], numbers["adaptation.in.point.ci95_high"])
        self.palpate("analyze", "--db", db, "--json", self.dir / "a.json")
        found = json.loads((self.dir / "a.json").read_text())
        means = [one["catch_deviation_m"] for one in found["cells"][0]["reaches"]]
        self.assertAlmostEqual(found["aftereffect"]["in"]["point"]["estimate"], statistics.mean(means), places=12)
        about = self.file("about.json", {"version": 1, "authors": [{"name": "Ada"}], "license": "CC0-1.0"})
        for layout in ("psych-ds", "bids"):
            out = self.dir / layout
            self.palpate("bundle", "--db", db, "--registration", folder, "--about", about, "--out", out, "--format", layout)
            self.assertNotIn("DIFFERS", self.palpate("bundle", "--verify", out).stdout)
            bundled = json.loads((out / "check.json").read_text())
            self.assertEqual({p["id"]: p["finding"] for p in bundled["points"]}, {k: p["finding"] for k, p in points.items()})

    def test_groups_are_registered_with_their_difference(self):
        study = changed(SMALL, groups={"names": ["early", "late"]})
        self.registered(study, ["--adaptation-effect", 0.6, "--contrast", "groups", "--trials", 4], [
            {"id": "H1", "text": "The late group learns more.", "corroborated": "effects.adaptation.in.group.p < alpha",
             "refuted": "effects.adaptation.in.group.p > 0.5"}], participants=12)
        counts = json.loads((self.dir / "r" / "registration.json").read_text())["hypotheses"][0]
        self.assertGreater(counts["with_planned_effect"]["corroborated"], 14)
        self.assertLess(counts["with_no_effect"]["corroborated"], 5)
        self.assertIn("in group late the adaptation is 0.60 higher than in group early", (self.dir / "r/registration.md").read_text())
        check, _ = self.points(self.simulated(study, 12))
        self.assertEqual(check["deviations"], 0)

    def test_blocks_are_conditions(self):
        null = {**CURL, "name": "null", "fields": [{**CURL["fields"][0], "damping_ns_per_m": 0}]}
        before = {**SMALL["blocks"][0], "name": "before", "stimuli": ["null"]}
        study = changed(SMALL, stimuli=[null, CURL], blocks=[before, SMALL["blocks"][0]])
        self.registered(study, ["--deviation-effect", 12, "--trials", 16], [
            {"id": "H1", "text": "The field pushes.", "refuted": "between.deviation.before.in.ci95_high < 0.005",
             "corroborated": "between.deviation.before.in.p < alpha && between.deviation.before.in.difference > 0"}])
        both = json.loads((self.dir / "r" / "analysis-simulated.json").read_text())
        for key, effect in (("planned_effect", 0.012), ("no_effect", 0)):
            self.assertAlmostEqual(both[key]["between"]["deviation"]["before"]["in"]["difference"], effect, delta=0.006)
        said = self.registered(study, ["--adaptation-effect", 0.3, "--trials", 4], LEARNS, name="x", status=2).stderr
        self.assertIn("--contrast groups or zero", said)  # without a field nothing is learnt: one condition

    def test_what_does_not_fit_is_refused(self):
        for plan, hypotheses, words in (
                (["--rating-effect", 1, "--trials", 20], LEARNS, "(block 'in': deviation and adaptation)"),
                (["--aftereffect-effect", 5, "--contrast", "zero", "--trials", 4], LEARNS, "(block 'in': deviation and adaptation)"),
                (["--adaptation-effect", 0.3, "--contrast", "zero", "--trials", 5], LEARNS, "--trials 4"),
                (["--deviation-effect", 5, "--contrast", "zero", "--trials", 20], LEARNS, "--trials 16"),
                (["--adaptation-effect", 0.3, "--contrast", "groups", "--trials", 4], LEARNS, "found 0 groups"),
                (ZERO_PLAN, [{**LEARNS[0], "refuted": "adaptation.out.point.ci95_high < 0.1"}], "adaptation.in.point.ci95_high"),
                (ZERO_PLAN, [{**LEARNS[0], "refuted": "jnd.in.point.estimate < 1"}], "expected a name that the analysis has"),
                (ZERO_PLAN, [{**LEARNS[0], "refuted": "aftereffect.in.point.estimate > 0"}], "expected a name that the analysis has")):
            said = self.registered(SMALL, plan, hypotheses, status=2).stderr
            self.assertIn(words, said, (plan, hypotheses))
            self.assertFalse((self.dir / "r").exists())
        for wrong in (["--adaptation-effect", 3], ["--deviation-effect", 200], ["--adaptation-effect", 0.2, "--contrast", "people"],
                      ["--adaptation-effect", 0.2, "--movement-sd", -1], ["--jnd-effect", 20, "--contrast", "zero"],
                      ["--rating-effect", 1, "--movement-sd", 1],
                      ["--adaptation-effect", 0, "--equivalence", 0.1, "--contrast", "groups"]):
            self.palpate("plan", *wrong, status=2)

    def test_other_shares_are_deviations_and_changed_records_are_refused(self):
        self.registered(WITH_CATCHES, ZERO_PLAN, LEARNS)
        block = {**WITH_CATCHES["blocks"][0], "clamp_share": 0.1, "catch_share": 0.3}
        _, points = self.points(self.simulated(changed(WITH_CATCHES, blocks=[block]), name="other.db"), status=1)
        self.assertEqual({"protocol", "order", "movements"} - {k for k, p in points.items() if p["finding"] == "deviation"}, set())
        self.assertIn("S001, block in: 12 field, 6 catch, 2 clamp; registered 12 field, 4 catch, 4 clamp",
                      points["movements"]["evidence"])
        db = self.simulated(WITH_CATCHES)
        connection = sqlite3.connect(db)
        rows = connection.execute("SELECT rowid, task FROM attempts WHERE task IS NOT NULL ORDER BY rowid").fetchall()
        kinds = {json.loads(task)["reach"]["kind"]: (row, task) for row, task in reversed(rows[:20])}
        self.assertEqual(set(kinds), {"field", "catch", "clamp"})
        (field, of_field), (clamp, of_clamp) = kinds["field"], kinds["clamp"]
        for row, task, kind in ((field, of_field, "clamp"), (clamp, of_clamp, "field")):
            text = json.loads(task)
            text["reach"]["kind"] = kind
            connection.execute("UPDATE attempts SET task = ? WHERE rowid = ?", (json.dumps(text), row))
        connection.commit()
        connection.close()
        said = self.palpate("check", self.dir / "r", "--db", db, status=2).stderr
        self.assertIn("does not match its seal", said)

    def test_permuted_kinds_of_a_bundle_are_another_order(self):
        self.registered(WITH_CATCHES, ZERO_PLAN, LEARNS)
        about = self.file("about.json", {"version": 1, "authors": [{"name": "Ada"}], "license": "CC0-1.0"})
        out = self.dir / "out"
        self.palpate("bundle", "--db", self.simulated(WITH_CATCHES), "--registration", self.dir / "r", "--about", about, "--out", out)
        trials = out / "data" / "trials.csv"
        rows = list(csv.reader(io.StringIO(trials.read_text(), newline="")))
        kind = rows[0].index("reach_kind")
        field, clamp = (next(row for row in rows if row[kind] == one) for one in ("field", "clamp"))
        field[kind], clamp[kind] = clamp[kind], field[kind]
        text = io.StringIO(newline="")
        csv.writer(text).writerows(rows)
        trials.write_text(text.getvalue(), newline="")
        subprocess.run("find . -type f ! -name SHA256SUMS | sed 's#^./##' | LC_ALL=C sort | xargs -d '\\n' sha256sum > SHA256SUMS", shell=True,
                       cwd=out, check=True)
        said = self.palpate("bundle", "--verify", out, status=1).stdout
        for name in ("check.json", "analysis.json"):
            self.assertIn(f"DIFFERS  {name}", said)

    def test_orders_have_the_kinds(self):
        self.registered(WITH_CATCHES, ZERO_PLAN, LEARNS)
        made = json.loads((self.dir / "r" / "registration.json").read_text())
        lines = self.palpate("schedule", self.dir / "p.json", "--participant", 2, "--format", "order").stdout
        self.assertEqual(hashlib.sha256(lines.encode()).hexdigest(), made["orders"][1]["sha256"])
        kinds = collections.Counter(line.rsplit(",", 1)[1] for line in lines.splitlines())
        self.assertEqual(kinds, {"field": 12, "catch": 4, "clamp": 4})


if __name__ == "__main__":
    unittest.main()
