"""Exports from outside: what the formats demand, the same numbers in all of them, whole or not at all.

Usage: datasets_test.py PALPATE PROTOCOLS
"""

import csv
import datetime
import gzip
import io
import json
import os
import pathlib
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "store"))
import bids_checks
import psychds_checks
import seals

PALPATE, PROTOCOLS = sys.argv[1], pathlib.Path(sys.argv[2])
KEYS = {"1": "sphere", "2": "cone", "3": "cylinder", "4": "cube"}


def run_palpate(*args, status=0):
    done = subprocess.run([PALPATE, *map(str, args)], capture_output=True, text=True, timeout=600)
    assert done.returncode == status, (args, done.returncode, done.stdout + done.stderr)
    return done


def simulate(folder, name, participants, /, **changes):
    """A database of simulated participants; `changes` to protocols/quick.json."""
    protocol = json.loads((PROTOCOLS / "quick.json").read_text())
    protocol.pop("$schema")
    protocol.update(changes)
    path = folder / f"{name}.json"
    path.write_text(json.dumps(protocol))
    run_palpate("simulate", path, "--db", folder / f"{name}.db", "--participants", participants)
    return folder / f"{name}.db"


def cut_off_some(database):
    """Attempts that were cut off, as a live session leaves them."""
    db = sqlite3.connect(database)
    db.execute(
        "INSERT INTO attempts (session_id, run_id, trial, attempt, block, renderer, shape, practice, orientation_w, "
        "orientation_x, orientation_y, orientation_z, began_ns, state, cut_off_reason) SELECT session_id, run_id, trial, "
        "2, block, renderer, shape, practice, orientation_w, orientation_x, orientation_y, orientation_z, onset_ns - 5, "
        "'cut_off', 'said \"stop\", then left' FROM attempts WHERE trial = 3"
    )
    seals.seal_again(db)
    db.close()


class Datasets(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.dir = pathlib.Path(scratch.name)
        cls.plain = simulate(cls.dir, "plain", 3)
        cls.sampled = simulate(cls.dir, "sampled", 2, name="with-samples", repetitions=1, samples=True,
                               sessions={"count": 2}, response={"keys": KEYS, "time_out_s": 1.5})
        cut_off_some(cls.plain)
        cut_off_some(cls.sampled)
        for name in ("plain", "sampled"):
            for form, out in (("csv", f"{name}-csv/trials.csv"), ("bids", f"{name}-bids"), ("psych-ds", f"{name}-psychds")):
                (cls.dir / out).parent.mkdir(exist_ok=True)
                run_palpate("export", "--db", cls.dir / f"{name}.db", "--format", form, "--out", cls.dir / out)
            (cls.dir / f"{name}-relative").mkdir()
            run_palpate("export", "--db", cls.dir / f"{name}.db", "--format", "csv", "--times", "relative",
                        "--out", cls.dir / f"{name}-relative" / "trials.csv")

    def test_analysis_of_the_csv_is_that_of_the_database_to_the_last_digit(self):
        for name in ("plain", "sampled"):
            results = []
            for source in (("--db", self.dir / f"{name}.db"), ("--csv", self.dir / f"{name}-csv" / "trials.csv")):
                out = self.dir / "analysis.json"
                run_palpate("analyze", *source, "--json", out, "--force")
                text = out.read_text()
                result = json.loads(text, parse_float=str)  # digit by digit
                for origin in ("source", "protocol", "observer_sha256"):
                    result.pop(origin, None)
                results.append(result)
            self.assertEqual(results[0], results[1])
            self.assertGreater(len(results[0]), 5)

    def test_bids_tables_hold_the_text_of_the_csv(self):
        for name, trials in (("plain", 3 * 24), ("sampled", 2 * 8)):
            rows = bids_checks.read_csv(self.dir / f"{name}-relative" / "trials.csv")
            tables = bids_checks.tables(self.dir / f"{name}-bids")
            self.assertEqual(len(rows), trials)
            self.assertEqual(len(tables), trials)
            for row in rows:
                beh = tables[row["participant_id"], row["session"], row["trial"]]
                for column in row.keys() - {"participant_id"}:
                    self.assertEqual(beh[column], row[column], column)
                self.assertEqual(beh["duration"], row["response_time"])

    def test_bids_onsets_are_seconds_from_the_first_trial(self):
        for path in (self.dir / "plain-bids").glob("sub-*/ses-1/beh/*_beh.tsv"):
            header, rows = bids_checks.read_tsv(path)
            trials = [dict(zip(header, row)) for row in rows]
            def seconds(text):
                clock = text[text.index("T") + 1 : -1].split(":")
                return int(clock[0]) * 3600 + int(clock[1]) * 60 + float(clock[2])
            for trial in trials:
                since = seconds(trial["onset_utc"]) - seconds(trials[0]["onset_utc"])
                self.assertAlmostEqual(float(trial["onset"]), since, delta=2e-6)
            self.assertGreater(float(trials[-1]["onset"]), 100)

    def test_psychds_tables_are_the_csv(self):
        for name in ("plain", "sampled"):
            whole = (self.dir / f"{name}-relative" / "trials.csv").read_bytes()
            header = whole[: whole.index(b"\n") + 1]
            parts = b""
            for path in sorted((self.dir / f"{name}-psychds" / "data").glob("subject-*/*_subject-S???_data.csv")):
                data = path.read_bytes()
                self.assertTrue(data.startswith(header))
                parts += data[len(header) :]
            self.assertEqual(header + parts, whole)
            attempts = (self.dir / f"{name}-relative" / "attempts.csv").read_bytes()
            self.assertEqual(next((self.dir / f"{name}-psychds" / "data").glob("*attempts_data.csv")).read_bytes(), attempts)
            self.assertEqual((self.dir / f"{name}-bids" / "sourcedata" / "attempts.csv").read_bytes(), attempts)
            self.assertIn(b'"said ""stop"", then left"', attempts)

    def test_samples_are_the_same_in_both_datasets_and_all_there(self):
        ticks = {}
        for row in bids_checks.read_csv(self.dir / "sampled-csv" / "trials.csv"):
            ticks[row["participant_id"], int(row["session"]), int(row["trial"])] = int(row["ticks"])
        self.assertEqual(len(ticks), 16)
        felt = 0
        for who, session in {key[:2] for key in ticks}:
            of_session = {key[2]: count for key, count in ticks.items() if key[:2] == (who, session)}
            beh = self.dir / "sampled-bids" / f"sub-{who}" / f"ses-{session}" / "beh"
            bids, trials = [], []
            for path in sorted(beh.glob("*_physio.tsv.gz")):
                sidecar = json.loads(path.with_name(path.name[: -len(".tsv.gz")] + ".json").read_text())
                with gzip.open(path, "rt", newline="") as file:
                    rows = [dict(zip(sidecar["Columns"], line[:-1].split("\t"))) for line in file]
                self.assertEqual((sidecar["SamplingFrequency"], sidecar["StartTime"]), (1000, 0))
                for trial in sidecar["Trials"]:
                    part = rows[trial["first_row"] : trial["first_row"] + trial["rows"]]
                    self.assertEqual({row["trial"] for row in part}, {str(trial["trial"])})
                    self.assertEqual(len(part), of_session[trial["trial"]])
                    trials.append(trial["trial"])
                bids += [row for row in rows if row["trial"] != "n/a"]
            self.assertEqual(trials, sorted(of_session))
            psychds = bids_checks.read_csv(
                self.dir / "sampled-psychds" / "data" / f"subject-{who}"
                / f"study-withsamples_subject-{who}_session-{session}_description-haptic_data.csv")
            self.assertEqual(len(bids), sum(of_session.values()))
            self.assertEqual(len(psychds), len(bids))
            for a, b in zip(bids, psychds):
                self.assertEqual(b.pop("participant_id"), who)
                self.assertEqual(int(b.pop("session")), session)
                self.assertAlmostEqual(float(b.pop("time")), int(b["tick"]) / 1000, places=12)
                self.assertEqual(a, b)
            felt += any(float(row["force_x"]) != 0 for row in bids)
        self.assertGreater(felt, 0)

    def test_a_session_has_one_table_and_one_recording(self):
        names = sorted(path.name for path in (self.dir / "sampled-bids").glob("sub-S001/ses-1/beh/*"))
        stem = "sub-S001_ses-1_task-withsamples_run-1"
        self.assertEqual(names, [f"{stem}_beh.json", f"{stem}_beh.tsv", f"{stem}_recording-haptic_physio.json",
                                 f"{stem}_recording-haptic_physio.tsv.gz"])

    def changed_copy(self, name, *changes):
        db = shutil.copy(self.sampled, self.dir / f"{name}.db")
        connection = sqlite3.connect(db)
        for change in changes:
            connection.execute(*(change if isinstance(change, tuple) else (change,)))
        seals.seal_again(connection)
        connection.close()
        return db

    def test_another_start_a_long_break_and_a_clock_set_back_begin_another_run(self):
        def runs_after(*changes):
            db = self.changed_copy("runs", *changes)
            out = self.dir / "runs-bids"
            shutil.rmtree(out, ignore_errors=True)
            self.export("bids", out, database=db)
            self.assertEqual(bids_checks.bids_faults(out), [])
            return len(list(out.glob("sub-S001/ses-1/beh/*_physio.tsv.gz")))

        where = "WHERE session_id = 1 AND state = 'completed' AND trial"
        columns = ("session_id, started_utc_ns, started_ns, program_version, build, device, device_calibration, "
                   "response_device, response_latency, consent_version, consent_utc_ns, hand, end_reason, ended_ns")
        self.assertEqual(runs_after(), 1)
        self.assertEqual(runs_after(f"UPDATE attempts SET onset_ns = onset_ns + 30000000000 {where} >= 3"), 1)
        self.assertEqual(runs_after(f"UPDATE attempts SET onset_ns = onset_ns + 70000000000 {where} >= 3"), 2)
        self.assertEqual(runs_after(f"UPDATE attempts SET onset_ns = onset_ns - 3000000000 {where} = 3"), 2)
        self.assertEqual(runs_after(
            f"INSERT INTO runs (id, {columns}) SELECT 99, {columns} FROM runs WHERE id = 1",
            "UPDATE runs SET started_utc_ns = started_utc_ns + 5000 WHERE id = 99",
            f"UPDATE attempts SET run_id = 99 {where} >= 3"), 2)

    def test_no_date_leaves_unless_it_is_asked_for(self):
        db = self.changed_copy("dates", "UPDATE runs SET device_calibration = 'lab.json, made 2000-01-01T08:00:00Z, good'")
        for form in ("csv", "bids", "psych-ds"):
            for times in ("relative", "absolute"):
                out = self.dir / f"dates-{form}-{times}"
                out.mkdir()
                self.export(form, out / "trials.csv" if form == "csv" else out, "--times", times, database=db)
                text = b"".join(gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
                                for path in sorted(out.rglob("*")) if path.is_file())
                self.assertEqual(b"2000-01-" in text, times == "absolute", (form, times))
                self.assertEqual(b"1900-01-01T00:00:00.000000Z" in text, times == "relative", (form, times))
        self.assertIn("no times", self.export("csv", self.dir / "no.csv", "--times", "local", status=2).stderr)
        self.assertFalse((self.dir / "no.csv").exists())

    def test_elapsed_is_counted_from_the_participants_first_trial(self):
        absolute = bids_checks.read_csv(self.dir / "sampled-csv" / "trials.csv")
        relative = bids_checks.read_csv(self.dir / "sampled-relative" / "trials.csv")

        def moment(row):
            return datetime.datetime.strptime(row["onset_utc"], "%Y-%m-%dT%H:%M:%S.%fZ")

        for who in {row["participant_id"] for row in absolute}:
            pairs = [(a, r) for a, r in zip(absolute, relative) if a["participant_id"] == who]
            first = min(moment(a) for a, _ in pairs)
            for a, r in pairs:
                self.assertAlmostEqual(float(r["elapsed"]), (moment(a) - first).total_seconds(), delta=2e-6)
                self.assertAlmostEqual(float(r["elapsed"]),
                                       (moment(r) - datetime.datetime(1900, 1, 1)).total_seconds(), delta=2e-6)

    def test_memory_does_not_grow_with_the_number_of_trials(self):
        measure = ("import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True); "
                   "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)")
        peaks = {}
        for repetitions in (1, 6):
            db = simulate(self.dir, f"memory{repetitions}", 1, name="memory", repetitions=repetitions, samples=True,
                          response={"keys": KEYS, "time_out_s": 3})
            for form in ("bids", "psych-ds"):
                done = subprocess.run([sys.executable, "-c", measure, PALPATE, "export", "--db", db, "--format", form, "--out",
                                       self.dir / f"memory-{form}-{repetitions}"], capture_output=True, text=True)
                peaks[form, repetitions] = int(done.stdout)  # kB
        for form in ("bids", "psych-ds"):
            self.assertLess(peaks[form, 6] - peaks[form, 1], 4000, peaks)

    def test_formulas_from_a_database_do_not_run_and_come_back(self):
        db = self.changed_copy(
            "formulas", *[(f"UPDATE attempts SET {column} = ? WHERE {column} = ?", (new, old))
                          for column in ("shape", "response") for new, old in (("=1+1", "cube"), ("'-x", "cone"))],
            "UPDATE runs SET device = '@SUM(A1)'")
        (self.dir / "formulas").mkdir()
        for form, out in (("csv", "trials.csv"), ("bids", "bids"), ("psych-ds", "psychds")):
            self.export(form, self.dir / "formulas" / out, database=db)
        seen = set()
        for path in sorted((self.dir / "formulas").rglob("*.?sv")):
            with open(path, newline="") as file:
                for row in csv.reader(file, delimiter="\t" if path.suffix == ".tsv" else ","):
                    for cell in row:
                        if cell[:1] in tuple("=+-@\t\r"):
                            float(cell)  # numbers stay numbers
                    seen.update(row)
        self.assertLessEqual({"'=1+1", "''-x", "'@SUM(A1)"}, seen)
        self.assertTrue(any(cell.startswith("-0.") for cell in seen))
        results = []
        for source in (("--db", db), ("--csv", self.dir / "formulas" / "trials.csv")):
            run_palpate("analyze", *source, "--json", self.dir / "formulas" / "a.json", "--force")
            results.append(json.loads((self.dir / "formulas" / "a.json").read_text())["accuracy"])
        self.assertEqual(*results)
        self.assertIn('"=1+1"', json.dumps(results[1]))

    def test_a_codebook_goes_with_the_csv(self):
        self.export("csv", self.dir / "with-book.csv", "--codebook", self.dir / "book.csv", "--force")
        book = bids_checks.read_csv(self.dir / "book.csv")
        header = (self.dir / "with-book.csv").read_text().split("\n")[0].strip().split(",")
        self.assertEqual([row["column"] for row in book if row["table"] == "trials" and not row["value"]], header)
        bits = {int(row["value"]): row["meaning"] for row in book
                if row["table"] == "trials" and row["column"] == "faults" and row["value"]}
        self.assertEqual(sorted(bits), [1 << i for i in range(len(bits))])
        seen = 0
        for row in bids_checks.read_csv(self.dir / "with-book.csv"):
            seen |= int(row["faults"])
        self.assertTrue(seen & 16)
        self.assertIn("slips off an edge", bits[16])
        self.assertIn("--codebook is for csv",
                      self.export("bids", self.dir / "no", "--codebook", self.dir / "no.csv", status=2).stderr)

    def test_protocols_come_with_the_data(self):
        text = (self.dir / "sampled.json").read_bytes()
        self.assertEqual((self.dir / "sampled-bids" / "sourcedata" / "withsamples_protocol.json").read_bytes(), text)
        self.assertEqual((self.dir / "sampled-psychds" / "materials" / "withsamples_protocol.json").read_bytes(), text)

    def test_simulated_data_say_so(self):
        for name in ("plain", "sampled"):
            for form, key, readme in (("bids", "Name", "README"), ("psychds", "name", "README.md")):
                folder = self.dir / f"{name}-{form}"
                self.assertIn("SIMULATED", json.loads((folder / "dataset_description.json").read_text())[key])
                self.assertIn("SIMULATED", (folder / readme).read_text())
            _, rows = bids_checks.read_tsv(self.dir / f"{name}-bids" / "participants.tsv")
            self.assertTrue(all(row[1] == "1" for row in rows))
            self.assertTrue(all(beh["simulated"] == "1" for beh in bids_checks.tables(self.dir / f"{name}-bids").values()))

    def test_only_the_owner_may_read_an_export(self):
        for path in (self.dir / "sampled-bids").rglob("*"):
            self.assertEqual(path.stat().st_mode & 0o077 if path.is_file() else 0, 0, path)
        self.assertEqual((self.dir / "sampled-bids").stat().st_mode & 0o077, 0)

    # --- the rules of the formats, and that each check of them can fail -------------------------

    def copy(self, name):
        target = self.dir / "broken"
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(self.dir / name, target)
        return target

    def change(self, path, old, new, count=1):
        text = path.read_bytes()
        self.assertIn(old.encode(), text, path)
        path.write_bytes(text.replace(old.encode(), new.encode(), count))

    def test_bids_keeps_the_rules_that_the_validator_does_not_look_at(self):
        for name in ("plain", "sampled"):
            self.assertEqual(bids_checks.bids_faults(self.dir / f"{name}-bids"), [])

    def test_every_bids_check_can_fail(self):
        beh = "sub-S001/ses-1/beh/sub-S001_ses-1_task-quick_beh"
        for old, new, fault in (
            ("\nsub-S001", "\nsub-S009", "participants.tsv lists"),
        ):
            folder = self.copy("plain-bids")
            self.change(folder / "participants.tsv", old, new)
            self.assertIn(fault, " ".join(bids_checks.bids_faults(folder)))
        folder = self.copy("plain-bids")
        header, rows = bids_checks.read_tsv(folder / f"{beh}.tsv")
        def write(changed):
            (folder / f"{beh}.tsv").write_text("".join("\t".join(row) + "\n" for row in [header] + changed))
            return " ".join(bids_checks.bids_faults(folder))
        self.assertIn("not sorted", write([rows[0], *rows[:0:-1]]))
        self.assertIn("onset is not 0", write(rows[1:]))
        self.assertIn("no number: soon", write([["0", "soon", *rows[0][2:]]]))
        self.assertIn("no number: nan", write([["0", "nan", *rows[0][2:]]]))
        self.assertIn("duration is missing", write([["0", "n/a", *rows[0][2:]]]))
        self.assertIn("fields for", write([rows[0][:-1]]))
        self.assertIn("is empty", write([["0", "", *rows[0][2:]]]))
        self.assertIn("no level", write([[x.replace("point", "pin").replace("ray", "pin") for x in rows[0]]]))
        folder = self.copy("plain-bids")
        self.change(folder / f"{beh}.json", '"max_force"', '"mux_force"')
        self.assertIn("max_force is not described", " ".join(bids_checks.bids_faults(folder)))
        (folder / f"{beh}.json").unlink()
        self.assertIn("no sidecar", " ".join(bids_checks.bids_faults(folder)))
        folder = self.copy("sampled-bids")
        physio = folder / "sub-S001/ses-1/beh/sub-S001_ses-1_task-withsamples_run-1_recording-haptic_physio.tsv.gz"
        lines = gzip.open(physio, "rt").read().splitlines(keepends=True)
        twice = lines[-1].split("\t")
        twice[1] = "999999"
        for changed, fault in ((lines[:5] + lines[6:], "does not stand"), (lines[:5] + [lines[4]] + lines[6:], "order"),
                               (["\t".join(twice)] * 2 + lines, "not stand at its onset"),
                               (lines + ["\t".join(twice)], "more samples"),
                               (["x\t" + lines[0]] + lines[1:], "fields"),
                               ([lines[0].replace("\t0", "\tnull")] + lines[1:], "no number")):
            with gzip.open(physio, "wt") as file:
                file.writelines(changed)
            self.assertIn(fault, " ".join(bids_checks.bids_faults(folder)))
        self.change(physio.with_name(physio.name[: -len(".tsv.gz")] + ".json"), '"SamplingFrequency"', '"Rate"')
        self.assertIn("no SamplingFrequency", " ".join(bids_checks.bids_faults(folder)))

    def test_psychds_keeps_its_rules(self):
        for name in ("plain", "sampled"):
            self.assertEqual(psychds_checks.psychds_faults(self.dir / f"{name}-psychds"), [])

    def test_every_psychds_check_can_fail(self):
        table = "data/subject-S001/study-quick_subject-S001_data.csv"
        for path, old, new, fault in (
            ("dataset_description.json", '"https://schema.org/"', '"schema"', "@context"),
            ("dataset_description.json", '"Dataset"', '"Thing"', "@type"),
            ("dataset_description.json", '"description"', '"about"', "no description"),
            ("dataset_description.json", '"name": "block"', '"name": "blocks"', "column block is not in"),
            ("dataset_description.json", '"name": "block"', '"name": "trial"', "twice"),
            ("dataset_description.json", "{", "\ufeff{", "BOM"),
            (table, "participant_id", "\ufeffparticipant_id", "BOM"),
            (table, ",block", ",trial", "a header that is empty or twice"),
            (table, ",max_force", "", "other lengths"),
            (table, "S001,", "S002,", "another participant"),
        ):
            folder = self.copy("plain-psychds")
            self.change(folder / path, old, new)
            self.assertIn(fault, " ".join(psychds_checks.psychds_faults(folder)))
        folder = self.copy("plain-psychds")
        (folder / table).rename(folder / "data" / "quick.csv")
        self.assertIn("no Psych-DS name", " ".join(psychds_checks.psychds_faults(folder)))

    # --- whole or not at all ---------------------------------------------------------------------

    def export(self, form, out, *more, status=0, database=None):
        return run_palpate("export", "--db", database or self.plain, "--format", form, "--out", out, *more, status=status)

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
        self.assertIn("which such an export does not make", self.export("psych-ds", folder, "--force", status=2).stderr)
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
        random.seed(5)
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
            for path in self.dir.glob("killed.??????"):
                path.unlink()
            (self.dir / "attempts.csv").unlink(missing_ok=True)
        self.assertGreater(len(outcomes), 1)

    # --- withdrawal ------------------------------------------------------------------------------

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


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
