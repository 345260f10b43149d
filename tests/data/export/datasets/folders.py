"""Folders appear complete or not at all; withdrawal and merge from outside."""

import os
import random
import shutil
import signal
import sqlite3
import subprocess
import time

import bids_checks
import psychds_checks
from study import PALPATE, Study, run_palpate, simulate


class Folders(Study):
    def test_what_is_there_is_replaced_only_if_it_is_an_export_and_only_with_force(self):
        for form in ("bids", "psych-ds"):
            folder = self.dir / f"force-{form}"
            folder.mkdir()
            self.export(form, folder)  # empty: nothing to lose
            before = sorted(path.name for path in folder.rglob("*"))
            self.assertIn("--force", self.export(form, folder, status=2).stderr)
            self.export(form, folder, "--force")
            self.assertEqual(sorted(path.name for path in folder.rglob("*")), before)
            self.export(form, str(folder) + "/", "--force")
            (folder / "my-notes.txt").write_text("mine")
            self.assertIn("my-notes.txt", self.export(form, folder, "--force", status=2).stderr)
            self.assertEqual((folder / "my-notes.txt").read_text(), "mine")
            (folder / "my-notes.txt").unlink()
            (folder / "link").symlink_to(self.plain)
            self.assertIn("link", self.export(form, folder, "--force", status=2).stderr)
            (folder / "link").unlink()
            for text in ("{}", "[]", "", '{"GeneratedBy": [{"Name": "another"}]}', '{"GeneratedBy": "palpate"}',
                         '{"measurementTechnique": 7}', '{"measurementTechnique": "by hand"}'):
                (folder / "dataset_description.json").write_text(text)
                self.assertIn("is not an export of palpate", self.export(form, folder, "--force", status=2).stderr)
        mine = self.dir / "mine"
        mine.mkdir()
        (mine / "thesis.txt").write_text("mine")
        for more in ((), ("--force",)):
            for form in ("bids", "psych-ds"):
                self.export(form, mine, *more, status=2)
                self.export(form, mine / "thesis.txt", *more, status=2)
                self.export(form, self.plain, *more, status=2)
                self.export(form, "", *more, status=2)
                self.export(form, "/", *more, status=2)
        self.assertEqual([path.name for path in mine.iterdir()], ["thesis.txt"])
        link = self.dir / "a-link"
        link.symlink_to(self.dir / "force-bids")
        self.assertIn("not a folder", self.export("bids", link, "--force", status=2).stderr)
        self.export("bids", self.dir / "no" / "such" / "folder", status=1)
        self.assertEqual(list(self.dir.glob(".*")), [])

    def test_another_kind_of_export_is_not_taken_for_ones_own(self):
        folder = self.dir / "kinds"
        self.export("bids", folder)
        self.assertIn("which is not part of such an export", self.export("psych-ds", folder, "--force", status=2).stderr)
        self.assertEqual(bids_checks.bids_faults(folder), [])

    def test_nothing_to_export_is_said(self):
        db = shutil.copy(self.plain, self.dir / "none.db")
        connection = sqlite3.connect(db)
        connection.execute("DELETE FROM attempts")
        connection.commit()
        connection.close()
        for form in ("bids", "psych-ds"):
            self.assertIn("no completed trials", self.export(form, self.dir / "none", status=2, database=db).stderr)
        self.assertFalse((self.dir / "none").exists())

    def test_stopped_at_any_moment_nothing_or_all_is_there(self):
        seed = 5
        random.seed(seed)
        db = shutil.copy(self.sampled, self.dir / "kill.db")
        outcomes = set()
        for round in range(24):
            form = ("bids", "psych-ds", "csv")[round % 3]
            out = self.dir / "killed"
            process = subprocess.Popen([PALPATE, "export", "--db", db, "--format", form, "--out", str(out)],
                                       stderr=subprocess.PIPE)
            time.sleep(random.uniform(0, 0.25))
            process.send_signal(signal.SIGINT if round % 2 else signal.SIGKILL)
            message = process.communicate()[1]
            there = out.exists()
            outcomes.add((round % 2, there))
            if round % 2:
                self.assertEqual([path for path in self.dir.glob(".killed*")], [], message)
                self.assertEqual(list(self.dir.glob("killed.*")), [], message)
            if there and form != "csv":
                faults = {"bids": bids_checks.bids_faults, "psych-ds": psychds_checks.psychds_faults}[form](out)
                self.assertEqual(faults, [])
            if there:
                shutil.rmtree(out) if out.is_dir() else out.unlink()
            if form != "csv":  # and what a kill left is removed by the next one
                self.export(form, out, database=db)
                self.assertEqual(list(self.dir.glob(".killed*")), [])
                shutil.rmtree(out)
            # Otherwise the next round may be interrupted before it removes them.
            for path in [*self.dir.glob("killed.??????"), *self.dir.glob(".killed*")]:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
            (self.dir / "killed_attempts.csv").unlink(missing_ok=True)
        self.assertGreater(len(outcomes), 1)


class WithdrawalAndMerge(Study):
    def test_forget_lists_the_exports_and_the_next_export_is_without(self):
        db = shutil.copy(self.plain, self.dir / "forget.db")
        self.export("bids", self.dir / "forget-bids", database=db)
        (self.dir / "forget").mkdir()
        self.export("csv", self.dir / "forget" / "trials.csv", database=db)
        refused = run_palpate("forget", "--db", db, "--participant", "S002", status=2)
        self.assertIn("--yes", refused.stderr)
        done = run_palpate("forget", "--db", db, "--participant", "S002", "--yes")
        self.assertIn(str(self.dir / "forget-bids"), done.stdout)
        self.assertIn(str(self.dir / "forget" / "trials.csv"), done.stdout)
        self.assertIn("24 trials and 1 attempts", done.stdout)
        run_palpate("forget", "--db", db, "--participant", "S009", "--yes", status=2)
        self.export("bids", self.dir / "forget-bids", "--force", database=db)
        self.assertEqual(sorted(p.name for p in (self.dir / "forget-bids").glob("sub-*")), ["sub-S001", "sub-S003"])
        again = run_palpate("forget", "--db", db, "--participant", "S002", "--yes")
        self.assertNotIn("forget-bids", again.stdout)
        self.assertIn("trials.csv", again.stdout)

    def test_forget_asks_on_a_terminal(self):
        db = shutil.copy(self.plain, self.dir / "ask.db")
        for answer, status, left in (("no", 1, 3), ("S003", 0, 2)):
            main, terminal = os.openpty()
            process = subprocess.Popen([PALPATE, "forget", "--db", db, "--participant", "S003"], stdin=terminal,
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            os.write(main, (answer + "\n").encode())
            _, messages = process.communicate(timeout=60)
            os.close(main)
            os.close(terminal)
            self.assertEqual(process.returncode, status, messages)
            self.assertIn("cannot be undone", messages)
            connection = sqlite3.connect(db)
            self.assertEqual(connection.execute("SELECT count(*) FROM participants").fetchone(), (left,))
            connection.close()

    def test_merge_from_outside(self):
        other = simulate(self.dir, "other", 2, name="other")
        done = run_palpate("merge", "--out", self.dir / "all.db", self.plain, other)
        self.assertIn("5 participants, 5 sessions, 120 trials, 3 attempts", done.stdout)
        run_palpate("merge", "--out", self.dir / "all.db", self.plain, other, status=2)
        run_palpate("merge", "--out", self.dir / "all3.db", status=2)
        run_palpate("merge", self.plain, other, status=2)
        rows = []
        for name, db in (("a", self.plain), ("b", other), ("all", self.dir / "all.db")):
            folder = self.dir / f"merged-{name}"
            folder.mkdir()
            self.export("csv", folder / "trials.csv", database=db)
            rows.append(sorted((folder / "trials.csv").read_bytes().splitlines()[1:]))
        self.assertEqual(rows[2], sorted(rows[0] + rows[1]))
