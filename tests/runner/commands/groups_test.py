"""A study of two groups, from validate to bundle. PROTOCOLS is the second argument."""

import csv
import json
import pathlib
import sqlite3
import subprocess
import sys
import unittest

import command_case

PROTOCOLS = pathlib.Path(sys.argv.pop(1))
SMALL = {
    "version": 2, "name": "small", "renderers": ["point", "ray"], "seed": 3, "orientation": "fixed",
    "stimuli": [{"name": "plate", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 300}],
    "blocks": [{"name": name, "task": "rate", "stimuli": ["plate"], "level": {"path": "/stiffness_n_per_m"}, "min": 0.001,
                "procedure": {"kind": "constant", "levels": [100, 300, 900], "repetitions": 1}} for name in ("a", "b")],
    "block_order": "counterbalanced",
    "groups": {"names": ["young", "old"], "assign": "given", "patch": {"old": {"breaks": {"every_trials": 5}}}},
}


class Groups(command_case.CommandCase):
    def grouped(self, **changes):
        return self.file("p.json", SMALL | {"groups": SMALL["groups"] | changes})

    def analyzed(self, *source):
        self.palpate("analyze", *source, "--json", self.dir / "found.json", "--force")
        return json.loads((self.dir / "found.json").read_text())

    def simulated(self, protocol, *options, name="study.db"):
        db = self.dir / name
        self.palpate("simulate", protocol, "--db", db, *options)
        return db

    def test_numbers_say_the_group(self):
        db = self.simulated(self.grouped(), "--groups", "young=3,old=2")
        rows = sqlite3.connect(db).execute("SELECT code, number FROM participants ORDER BY number").fetchall()
        self.assertEqual(rows, [("S001", 1), ("S002", 2), ("S003", 3), ("S004", 4), ("S005", 5)])
        db = self.simulated(self.grouped(), "--groups", "old=2", name="old.db")
        self.assertEqual([row for row, in sqlite3.connect(db).execute("SELECT number FROM participants ORDER BY number")], [2, 4])

    def test_exports_have_the_group(self):
        db = self.simulated(self.grouped(), "--groups", "young=2,old=1")
        text, rows = self.exported(db)
        self.assertTrue(text.startswith("participant_id,group,session,"))
        self.assertEqual({row["participant_id"]: row["group"] for row in rows}, {"S001": "young", "S002": "old", "S003": "young"})
        self.palpate("export", "--db", db, "--format", "bids", "--out", self.dir / "bids")
        people = list(csv.DictReader((self.dir / "bids" / "participants.tsv").read_text().splitlines(), delimiter="\t"))
        self.assertEqual([one["group"] for one in people], ["young", "old", "young"])
        self.assertIn("group", json.loads((self.dir / "bids" / "participants.json").read_text()))
        for table in (self.dir / "bids").glob("sub-*/ses-1/beh/*_beh.tsv"):
            self.assertNotIn("group", table.read_text().splitlines()[0].split("\t"))
        self.palpate("export", "--db", db, "--format", "psych-ds", "--out", self.dir / "psychds")
        about = json.loads((self.dir / "psychds" / "dataset_description.json").read_text())
        self.assertIn("group", [one["name"] for one in about["variableMeasured"]])

    def test_without_groups_nothing_is_added(self):
        plain = {key: value for key, value in SMALL.items() if key != "groups"}
        text, _ = self.exported(self.simulated(self.file("p.json", plain), "--participants", 2))
        self.assertTrue(text.startswith("participant_id,session,"))
        db = self.dir / "study.db"
        self.assertNotIn("between_groups", self.analyzed("--db", db))

    def test_database_and_table_compare_groups_alike(self):
        db = self.simulated(self.grouped(), "--groups", "young=4,old=3")
        self.exported(db)
        found = [self.analyzed(*source) for source in (["--db", db], ["--csv", self.dir / "study.csv"])]
        self.assertEqual(found[0]["between_groups"], found[1]["between_groups"])
        self.assertEqual(found[0]["effects"], found[1]["effects"])
        effects = found[0]["effects"]["exponent"]["a"]
        self.assertEqual(set(effects), {"group", "renderer", "group:renderer"})
        self.assertEqual(effects["group"]["den_df"], 5)
        self.assertEqual(found[0]["design"], {"between": ["group"], "within": ["renderer"], "groups": ["young", "old"]})
        self.assertIn("by group (young 4, old 3)", self.palpate("analyze", "--db", db).stdout)
        self.palpate("analyze", "--db", db, "--report", self.dir / "r.html")
        page = (self.dir / "r.html").read_text()
        for words in ("Groups of participants", "mixed analysis of variance", "SIMULATED PARTICIPANTS"):
            self.assertIn(words, page)

    def test_interrupted_studies_keep_their_groups(self):
        protocol = self.grouped()
        whole = self.exported(self.simulated(protocol, "--groups", "young=2,old=2"))[0]
        parts = self.simulated(protocol, "--groups", "young=1,old=1", name="parts.db")
        self.palpate("simulate", protocol, "--db", parts, "--groups", "young=2,old=2", "--jobs", 2)
        self.assertEqual(self.exported(parts)[0], whole)

    def test_merged_parts_are_the_whole(self):
        protocol = self.grouped()
        whole = self.exported(self.simulated(protocol, "--groups", "young=2,old=1"))[0]
        for part in ("1/2", "2/2"):
            self.simulated(protocol, "--groups", "young=2,old=1", "--shard", part, name=f"{part[0]}.db")
        self.palpate("merge", "--out", self.dir / "merged.db", self.dir / "1.db", self.dir / "2.db")
        self.assertEqual(self.exported(self.dir / "merged.db")[0], whole)

    def test_schedules_name_the_group(self):
        protocol = self.grouped()
        self.assertIn("participant 4, group old", self.palpate("schedule", protocol, "--participant", 2, "--group", "old").stdout)
        self.assertEqual(self.palpate("schedule", protocol, "--participant", 2, "--group", "old", "--format", "csv").stdout,
                         self.palpate("schedule", protocol, "--participant", 4, "--format", "csv").stdout)
        self.assertIn("expected young and old", self.palpate("schedule", protocol, "--participant", 1, "--group", "x", status=2).stderr)

    def test_a_live_participant_joins_a_group(self):
        protocol = self.grouped()
        self.assertIn("expected --group with one of young and old", self.run_live(protocol, "P01", status=2).stderr)
        self.assertFalse((self.dir / "live.db").exists())
        done = self.run_live(protocol, "P01", "--group", "old")
        self.assertIn("group old", done.stderr)
        self.assertIn("P01 has number 2", done.stdout)
        self.assertIn("found 'elderly'", self.run_live(protocol, "P02", "--group", "elderly", status=2).stderr)
        balanced = self.grouped(assign="balanced")
        self.assertIn("assigns groups itself", self.run_live(balanced, "P03", "--group", "old", status=2).stderr)

    def run_live(self, protocol, code, *options, status=0):
        """Its input has ended: the session ends at once."""
        done = subprocess.run([command_case.PALPATE, "run", protocol, "--db", self.dir / "live.db", "--participant", code,
                               "--device", "simulated", "--no-window", "--new-participant", *options],
                              capture_output=True, text=True, timeout=100, stdin=subprocess.DEVNULL)
        if status:
            self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def test_settings_of_a_group_change_that_group_alone(self):
        protocol = self.grouped()
        plain = self.exported(self.simulated(protocol, "--groups", "young=2,old=2"))[1]
        slow = self.file("slow.json", {"groups": {"old": {"motor": {"slide_speed_m_per_s": 0.02}}}})
        other = self.exported(self.simulated(protocol, "--groups", "young=2,old=2", "--settings", slow, name="slow.db"))[1]
        times = [{group: [row["response_time"] for row in rows if row["group"] == group] for group in ("young", "old")}
                 for rows in (plain, other)]
        self.assertEqual(times[0]["young"], times[1]["young"])
        self.assertNotEqual(times[0]["old"], times[1]["old"])
        wrong = self.file("wrong.json", {"groups": {"older": {}}})
        self.assertIn("group 'older'", self.palpate("simulate", protocol, "--db", self.dir / "w.db", "--settings", wrong, status=2).stderr)
        bad = self.file("bad.json", {"groups": {"old": {"motor": {"speed": 1}}}})
        self.assertIn("/groups/old/motor/speed: no such setting",
                      self.palpate("simulate", protocol, "--db", self.dir / "w.db", "--settings", bad, status=2).stderr)

    def test_options_that_contradict_are_refused(self):
        protocol = self.grouped()
        for text in ("young", "young=", "young=x", "middle=3", "young=1,young=2", "young=0,old=0"):
            self.assertIn("--groups: expected NAME=N", self.palpate("simulate", protocol, "--db", self.dir / "x.db", "--groups", text, status=2).stderr)
        both = self.palpate("simulate", protocol, "--db", self.dir / "x.db", "--groups", "young=1", "--participants", 3, status=2)
        self.assertIn("leave out --participants", both.stderr)
        self.assertIn("assigns groups itself",
                      self.palpate("simulate", self.grouped(assign="blocked"), "--db", self.dir / "x.db", "--groups", "young=1", status=2).stderr)
        self.assertFalse((self.dir / "x.db").exists())

    def test_a_table_with_two_groups_of_one_person_is_refused(self):
        table = self.file("t.csv", "participant_id,group,task,renderer,shape,response,level\n"
                                   "A,young,rate,ray,plate,3,1\nA,old,rate,ray,plate,3,2\n")
        self.assertIn("line 3", self.palpate("analyze", "--csv", table, status=2).stderr)

    def test_the_example_is_of_use(self):
        db = self.dir / "two.db"
        self.palpate("simulate", PROTOCOLS / "stiffness-two-groups.json", "--db", db, "--groups", "young=3,older=3")
        found = self.analyzed("--db", db)
        self.assertEqual({one["measure"] for one in found["between_groups"]}, {"pse", "jnd"})


if __name__ == "__main__":
    unittest.main()
