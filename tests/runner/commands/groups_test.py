"""A study of two groups, from validate to bundle. PROTOCOLS is the second argument."""

import csv
import json
import pathlib
import re
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
        self.assertNotIn("by_design", self.analyzed("--db", db))

    def test_database_and_table_compare_groups_alike(self):
        db = self.simulated(self.grouped(), "--groups", "young=4,old=3")
        self.exported(db)
        found = [self.analyzed(*source) for source in (["--db", db], ["--csv", self.dir / "study.csv"])]
        self.assertEqual(found[0]["by_design"], found[1]["by_design"])
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

    def test_groups_of_other_sizes_are_registered(self):
        protocol = self.grouped()
        self.palpate("plan", "--exponent-effect", 20, "--trials", 3, "--participants", "4-8", "--studies", 100, "--json", self.dir / "plan.json")
        hypotheses = self.file("h.json", [{"id": "H1", "text": "Older people say more.",
                                           "corroborated": "effects.exponent.a.group.p < alpha", "refuted": "effects.exponent.a.group.p > 0.5"}])
        out = self.dir / "registration"
        register = ["register", protocol, "--plan", self.dir / "plan.json", "--hypotheses", hypotheses, "--studies", 20, "--out"]
        for wrong, words in ((["--groups", "young=4", "--participants", 4], "leave out --participants"), (["--groups", "young=1"], "2 to 10000"),
                             (["--groups", "young=4,elder=1"], "elder"), (["--groups", "young=4,old=2", "--looks", "3,6"], "--looks")):
            self.assertIn(words, self.palpate(*register, self.dir / "wrong", *wrong, status=2).stderr)
        self.palpate(*register, out, "--groups", "young=4,old=2")
        orders = json.loads((out / "registration.json").read_text())["orders"]
        self.assertEqual([one["participant_number"] for one in orders], [1, 2, 3, 4, 5, 7])
        text = (out / "registration.md").read_text()
        for words in ("young 4, old 2", "6 participants with 72 trials in all"):
            self.assertIn(words, text)
        with open(out / "simulated" / "planned-effect.csv", newline="") as table:
            people = {row["participant_id"]: row["group"] for row in csv.DictReader(table)}
        self.assertEqual(sorted(people.values()), ["old"] * 2 + ["young"] * 4)

        def points(db, status=0):
            self.palpate("check", out, "--db", db, "--json", self.dir / "check.json", "--force", status=status)
            return {one["id"]: one for one in json.loads((self.dir / "check.json").read_text())["points"]}
        found = points(self.simulated(protocol, "--groups", "young=4,old=2"))
        self.assertNotIn("deviation", {one["finding"] for one in found.values()})
        self.assertIn("6 participants with the numbers 1 to 5, 7", found["participants"]["sentence"])
        # One more old participant, and one young one less.
        found = points(self.simulated(protocol, "--groups", "young=3,old=3", name="other.db"), status=1)
        self.assertEqual(found["participants"]["finding"], "deviation")
        self.assertEqual(len(found["participants"]["evidence"]), 2)
        self.assertIn("7", found["participants"]["evidence"][0])
        # The protocol's own assignment leaves no gaps.
        registered = out / "protocol.json"
        registered.write_text(registered.read_text().replace('"given"', '"balanced"'))
        points(self.dir / "study.db", status=1)
        self.assertIn("whose numbers the protocol gives in turn", (self.dir / "check.json").read_text())

    def masked(self, **changes):
        return self.grouped(assign="blocked", masked=True, **changes)

    def test_masked_groups_are_letters_until_unmasked(self):
        protocol = self.masked()
        db = self.simulated(protocol, "--participants", 8)
        letters = {row["participant_id"]: row["group"] for row in self.exported(db)[1]}
        self.assertEqual(sorted(letters.values()), ["A"] * 4 + ["B"] * 4)
        self.palpate("export", "--db", db, "--format", "bids", "--out", self.dir / "bids")
        self.palpate("export", "--db", db, "--format", "psych-ds", "--out", self.dir / "psychds")
        said = self.palpate("schedule", protocol, "--participant", 1).stdout + self.palpate("analyze", "--db", db, "--report", self.dir / "r.html").stdout
        self.assertIn("participant 1, group " + letters["S001"], said)
        self.assertIn("by group (A 4, B 4)", said)
        # Only copies of the protocol, of which sidecars have one, have the names.
        written = {"said": said, "report": (self.dir / "r.html").read_text().partition("<main")[2]}
        for file in [*(self.dir / "bids").rglob("*.tsv"), *(self.dir / "psychds").rglob("*.csv"), self.dir / "bids" / "participants.json"]:
            written[file] = file.read_text()
        self.assertGreater(len(written), 10)
        self.assertEqual([where for where, text in written.items() if re.search(r"\b(young|old)\b", text)], [])
        masked = self.analyzed("--db", db)
        self.assertEqual(masked["effects"], self.analyzed("--csv", self.dir / "study.csv", "--design", protocol)["effects"])

        self.palpate("run", protocol, "--db", self.dir / "none.db", "--participant", "P1", "--group", "A", "--device", "simulated", status=2)
        done = self.palpate("unmask", "--db", db, "--by", "M. Curie")
        self.assertRegex(done.stdout, "by M. Curie, when 8 participants had trials")
        self.assertEqual(self.palpate("unmask", "--db", db, "--by", "P. Curie").stdout, done.stdout, "the first one counts")
        names = {row["participant_id"]: row["group"] for row in self.exported(db)[1]}
        self.assertEqual(sorted(names.values()), ["old"] * 4 + ["young"] * 4)
        self.assertEqual(len(set(zip(letters.values(), names.values()))), 2, "a letter stands for a group")
        for letter, name in set(zip(letters.values(), names.values())):
            self.assertIn(f"  {letter}  {name}, 4 participants\n", done.stdout)
        open_ = self.analyzed("--db", db)
        self.assertEqual(open_["effects"], masked["effects"])
        self.assertEqual(open_["design"]["groups"], ["young", "old"])
        self.assertEqual(open_["effects"], self.analyzed("--csv", self.dir / "study.csv", "--design", protocol)["effects"])

    def test_parts_of_masked_studies_merge(self):
        protocol = self.masked()
        for part in ("1/2", "2/2"):
            self.simulated(protocol, "--participants", 4, "--shard", part, name=f"{part[0]}.db")
        merged = [self.dir / "m1.db", self.dir / "m2.db"]
        self.palpate("merge", "--out", merged[0], self.dir / "1.db", self.dir / "2.db")
        self.assertEqual({row["group"] for row in self.exported(merged[0])[1]}, {"A", "B"})
        self.palpate("unmask", "--db", self.dir / "2.db", "--by", "me")
        self.palpate("merge", "--out", merged[1], self.dir / "2.db", self.dir / "1.db")
        self.assertEqual({row["group"] for row in self.exported(merged[1])[1]}, {"young", "old"})
        self.assertIn("by me, when 2 participants had trials", self.palpate("unmask", "--db", merged[1]).stdout)

    def test_an_unmasking_counts_who_was_masked(self):
        db = self.simulated(self.file("pilot.json", SMALL | {"name": "pilot"}), "--groups", "young=3")
        self.palpate("simulate", self.masked(), "--db", db, "--participants", 2)
        self.assertIn("when 2 participants had trials", self.palpate("unmask", "--db", db).stdout)

    def test_unmasking_without_masks_is_refused(self):
        db = self.simulated(self.grouped(), "--groups", "young=1,old=1")
        self.assertIn("no protocol of it has masked groups", self.palpate("unmask", "--db", db, status=2).stderr)
        self.assertIn("there is no such file", self.palpate("unmask", "--db", self.dir / "none.db", status=2).stderr)
        self.assertFalse((self.dir / "none.db").exists())
        db = self.simulated(self.masked(), "--participants", 2, name="m.db")
        self.assertIn("expected the name of who unmasks", self.palpate("unmask", "--db", db, "--by", "a\nb", status=2).stderr)
        with sqlite3.connect(db) as changed:
            changed.execute("CREATE TABLE unmaskings (x)")
        self.assertIn("'unmaskings' is not defined as palpate defines it", self.palpate("unmask", "--db", db, status=2).stderr)

    def test_a_check_tells_who_unmasked(self):
        protocol = self.masked()
        self.palpate("plan", "--exponent-effect", 20, "--trials", 3, "--participants", "4-8", "--studies", 100, "--json", self.dir / "plan.json")
        hypotheses = self.file("h.json", [{"id": "H1", "text": "Older people say more.",
                                           "corroborated": "effects.exponent.a.group.p < alpha", "refuted": "effects.exponent.a.group.p > 0.5"}])
        out = self.dir / "registration"
        self.palpate("register", protocol, "--plan", self.dir / "plan.json", "--hypotheses", hypotheses, "--studies", 20, "--out", out, "--participants", 4)
        self.assertIn("young, old (masked as A, B)", (out / "registration.md").read_text())
        db = self.simulated(protocol, "--participants", 2)

        def masks(status):
            self.palpate("check", out, "--db", db, "--json", self.dir / "check.json", "--force", status=status)
            return next(one for one in json.loads((self.dir / "check.json").read_text())["points"] if one["id"] == "masks")
        self.assertEqual(masks(1)["sentence"], "The groups are masked.")
        for name, n, finding in (("late", 4, "as registered"), ("early", 2, "deviation")):
            db = self.simulated(protocol, "--participants", n, name=f"{name}.db")
            self.palpate("unmask", "--db", db, "--by", "me")
            self.simulated(protocol, "--participants", 4, name=f"{name}.db")
            found = masks(1 if n == 2 else 0)
            self.assertEqual(found["finding"].replace("_", " "), finding)
            self.assertIn(f"by me: {n} participants had trials, registered 4", found["evidence"][0])

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

    def test_whole_numbers_of_any_form_give_the_group_that_was_shown(self):
        other = {"blocks": [SMALL["blocks"][0] | {"name": "c"}]}
        for changes in ({"seed": 14.0}, {"seed": 14}, {"seed": 3, "block": 3.0}):
            groups = {"names": ["young", "old"], "assign": "blocked", "patch": {"old": other}}
            groups |= {key: value for key, value in changes.items() if key == "block"}
            protocol = self.file("p.json", SMALL | {"seed": changes["seed"], "groups": groups})
            _, rows = self.exported(self.simulated(protocol, "--participants", 8, name=f"{changes}.db"))
            self.assertEqual({(row["group"], row["block_name"]) for row in rows}, {("young", "a"), ("young", "b"), ("old", "c")})

    def test_each_group_is_analysed_by_its_own_protocol(self):
        stairs = {"name": "s", "task": "compare", "stimuli": ["plate"], "standard": "plate", "level": {"path": "/stiffness_n_per_m"},
                  "procedure": {"kind": "staircase", "start": 500, "min": 310, "max": 600, "steps": 50, "down": 2, "stop": {"trials": 30}}}
        slower = stairs | {"procedure": stairs["procedure"] | {"down": 3}}
        protocol = self.file("p.json", SMALL | {"blocks": [stairs], "groups": {"names": ["young", "old"], "patch": {"old": {"blocks": [slower]}}}})
        db = self.simulated(protocol, "--participants", 2)
        found = self.analyzed("--db", db)
        targets = {one["participant_id"]: one["tracks"][0]["procedure"]["converges_at"]
                   for one in found["cells"][0]["psychometric_functions"]}
        self.assertAlmostEqual(targets["S001"], 0.5 ** (1 / 2), places=3)
        self.assertAlmostEqual(targets["S002"], 0.5 ** (1 / 3), places=3)

    def test_groups_of_another_protocol_are_not_compared(self):
        db = self.simulated(self.grouped(), "--groups", "young=3,old=3")
        self.palpate("simulate", self.file("q.json", SMALL | {"name": "other", "groups": {"names": ["red", "blue"]}}), "--db", db,
                     "--participants", 4)
        self.palpate("simulate", self.file("r.json", {key: value for key, value in SMALL.items() if key != "groups"} | {"name": "none"}),
                     "--db", db, "--participants", 4)
        self.assertEqual(self.analyzed("--db", db, "--protocol", "small")["design"]["groups"], ["young", "old"])
        self.assertEqual(self.analyzed("--db", db, "--protocol", "other")["design"]["groups"], ["red", "blue"])
        self.assertNotIn("design", self.analyzed("--db", db, "--protocol", "none"))

    def test_a_participant_resumes_in_the_group_after_groups_were_removed(self):
        protocol = self.grouped()
        db = self.dir / "live.db"
        self.palpate("simulate", protocol, "--db", db, "--groups", "young=1,old=1")
        self.file("p.json", {key: value for key, value in SMALL.items() if key != "groups"})
        said = self.run_live(protocol, "S002").stderr
        self.assertNotIn("expected --group", said)
        self.assertNotIn("group young", said)

    def test_one_translation_is_for_all_groups(self):
        patch = {"texts": {"instructions": "For old people."}, "blocks": [block | {"question": "HOW?"} for block in SMALL["blocks"]]}
        protocol = self.grouped(patch={"old": patch})
        texts = json.loads(self.palpate("validate", protocol, "--texts").stdout)
        self.assertEqual((texts["texts.instructions"], texts["blocks.a.question"]), ("For old people.", "HOW?"))
        self.file("p.texts.de.json", {key: value + " (de)" for key, value in texts.items()})
        self.palpate("validate", protocol, "--language", "de")
        done = self.run_live(protocol, "P01", "--group", "old", "--language", "de")
        self.assertNotIn("expected", done.stderr)
        del texts["blocks.a.question"]
        self.file("p.texts.de.json", texts)
        self.assertIn("blocks.a.question", self.palpate("validate", protocol, "--language", "de", status=2).stderr)

    def test_validate_speaks_of_each_group(self):
        more = [block | {"procedure": block["procedure"] | {"repetitions": 50}} for block in SMALL["blocks"]]
        found = json.loads(self.palpate("validate", self.grouped(patch={"old": {"blocks": more}}), "--json").stdout)
        self.assertEqual([(one["name"], one["summary"]["trials"]) for one in found["groups"]], [("young", 12), ("old", 600)])
        self.assertEqual(found["duration_s"], found["groups"][1]["duration_s"])
        self.assertEqual({one["group"] for one in found["devices"]}, {"young", "old"})

    def test_tables_say_what_is_left_out(self):
        table = self.file("t.csv", "participant_id,group,task,renderer,shape,response\n" + "".join(
            f"{who},{group},rate,ray,plate,{i}\n" for i, (who, group) in enumerate(
                (("Z", "young"), ("Y", "young"), ("A", "old"), ("B", "old"), ("C", ""), ("D", "Old")))))
        found = self.analyzed("--csv", table)
        self.assertEqual(found["design"]["groups"], ["young", "old", "Old"])
        self.assertTrue(any("look alike" in text or "alike" in text for text in found["warnings"]), found["warnings"])
        self.assertTrue(any(text.startswith("Without a group") and text.endswith(": C.") for text in found["warnings"]))
        huge = self.file("huge.csv", "participant_id,group,task,renderer,shape,response\n" + "".join(
            f"{who},{group},rate,ray,plate,{i}e300\n" for i, (who, group) in enumerate(
                (("Z", "young"), ("Y", "young"), ("A", "old"), ("B", "old")))))
        self.analyzed("--csv", huge)

    def test_names_that_read_as_missing_are_refused(self):
        for name in ("NA", "nan", "null", "mixed", "-x"):
            self.assertIn("/groups/names/1", self.palpate("validate", self.grouped(names=["young", name], patch={}), status=2).stderr)

    def test_the_example_is_of_use(self):
        db = self.dir / "two.db"
        self.palpate("simulate", PROTOCOLS / "stiffness-two-groups.json", "--db", db, "--groups", "young=3,older=3")
        found = self.analyzed("--db", db)
        self.assertEqual({one["measure"] for one in found["by_design"]}, {"jnd", "w", "c"})


if __name__ == "__main__":
    unittest.main()
