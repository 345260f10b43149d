"""Studies of movements to targets, from validate to bundle. PROTOCOLS is the second argument."""

import collections
import json
import pathlib
import statistics
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

    def test_no_plan_is_of_the_task(self):
        self.palpate("plan", "--accuracy-effect", 10, "--accuracy", 0.7, "--trials", 20, "--participants", "3-9", "--studies", 100,
                     "--json", self.dir / "plan.json")
        hypotheses = self.file("h.json", [{"id": "H1", "text": "It learns.", "refuted": "deviation.in.point.estimate > 1",
                                           "corroborated": "adaptation.in.point.estimate > 0"}])
        said = self.palpate("register", self.file("p.json", SMALL), "--plan", self.dir / "plan.json", "--hypotheses", hypotheses,
                            "--out", self.dir / "r", status=2).stderr
        self.assertIn("(block 'in': none)", said)

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


if __name__ == "__main__":
    unittest.main()
