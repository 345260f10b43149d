"""What is exported: the same numbers in every format, times, samples, formulas."""

import csv
import datetime
import gzip
import json
import shutil
import subprocess
import sys

import bids_checks
from study import KEYS, PALPATE, Study, run_palpate, simulate


class Contents(Study):
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
        paths = list((self.dir / "plain-bids").glob("sub-*/ses-1/beh/*_beh.tsv"))
        self.assertEqual(len(paths), 3)
        for path in paths:
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
