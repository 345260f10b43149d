"""palpate run from outside, on a terminal: a session, and what breaks one.

Usage: run_test.py PALPATE FOLDER_OF_FAKE_LIBLSL
"""

import array
import contextlib
import csv
import json
import math
import os
import pathlib
import pty
import re
import signal
import socket
import sqlite3
import stat
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock

from terminal import Terminal, end_if_it_hangs

PALPATE, FAKE_LSL = sys.argv.pop(1), sys.argv.pop(1)

PROTOCOL = {
    "version": 1, "name": "two", "renderers": ["ray"], "seed": 7,
    # Slow and soft: five ticks must not be missed in a row where many tests share a processor.
    "servo": {"rate_hz": 100}, "material": {"stiffness_n_per_m": 100},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "repetitions": 2, "blocks_per_renderer": 2, "home": {"rest_s": 0.1},
    "texts": {"instructions": "Welcome, \u00dcbung", "break": "have a rest", "end": "good bye"},
    "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 30},
}
FEELING = "[trial, "


class Live(unittest.TestCase):
    def setUp(self):
        end_if_it_hangs(self)
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        self.db = self.dir / "live.db"

    def protocol(self, **changes):
        path = self.dir / "protocol.json"
        path.write_text(json.dumps(PROTOCOL | changes))
        return path

    def run_session(self, *options, db=None, code="P01", sure=True, columns=0, **changes):
        """`sure`: the code is meant, nobody asks."""
        new = ["--new-participant"] if sure and code not in self.codes(db or self.db) else []
        return Terminal([PALPATE, "run", self.protocol(**changes), "--db", db or self.db, "--participant", code,
                         "--device", "simulated", "--no-window", *new, *options], columns=columns)

    def run_piped(self, *options, code="P01", typed=b"", **changes):
        """As a script would: no terminal."""
        return subprocess.run([PALPATE, "run", self.protocol(**changes), "--db", self.db, "--participant", code,
                               "--device", "simulated", "--no-window", *options], input=typed, capture_output=True,
                              timeout=60)

    @staticmethod
    def codes(db):
        if not os.path.exists(db):
            return []
        with contextlib.closing(sqlite3.connect(db)) as opened:
            return [code for (code,) in opened.execute("SELECT code FROM participants ORDER BY id")]

    def begin(self, *options, **changes):
        """A session whose first trial is being felt."""
        terminal = self.run_session(*options, **changes)
        self.addCleanup(terminal.__exit__)
        while terminal.wait_for(FEELING, "[space bar: go on]") != FEELING:
            terminal.type(" ")
        return terminal

    def finish(self, terminal, key="1", status=0):
        """Answers whatever trial comes from now on, until the session is over."""
        while True:
            came = terminal.wait_for(FEELING, "[space bar: go on]", "[fault, ", "on record; ")
            if came == "on record; ":
                break
            terminal.type({FEELING: key, "[fault, ": ":clear\n:go\n"}.get(came, " "))
        self.assertEqual(terminal.finish(), status, terminal.text)

    def sql(self, query):
        with contextlib.closing(sqlite3.connect(self.db)) as db:
            self.assertEqual(db.execute("PRAGMA integrity_check").fetchone()[0], "ok")
            self.assertEqual(db.execute("PRAGMA foreign_key_check").fetchall(), [])
            return db.execute(query).fetchall()

    def export(self):
        out = self.dir / "trials.csv"
        subprocess.run([PALPATE, "export", "--db", self.db, "--format", "csv", "--out", out, "--force"], check=True,
                       capture_output=True)
        with open(out, newline="", encoding="utf-8") as table:
            return list(csv.DictReader(table))

    def attempts(self):
        return self.sql("SELECT trial, attempt, state FROM attempts ORDER BY trial, attempt")

    def ends(self):
        return [end for (end,) in self.sql("SELECT end_reason FROM runs ORDER BY id")]

    def notes(self):
        """The experimenter's; the program's own are JSON."""
        return [text for (text,) in self.sql("SELECT text FROM notes ORDER BY id") if not text.startswith("{")]


class Whole(Live):
    def test_a_session_from_welcome_to_good_bye(self):
        terminal = self.begin("--consent", "v2 2026-01", "--hand", "left", "--response-latency", "0.012")
        self.assertIn("participant P01 has number 1; session 1 of 1", terminal.text)
        self.assertIn("Welcome, \u00dcbung", terminal.text)
        terminal.type("x1")  # a key without a meaning is none
        self.finish(terminal, "2")
        self.assertIn("have a rest", terminal.text)
        self.assertIn("good bye", terminal.text)
        self.assertIn("4 of 4 trials on record; done", terminal.text)
        rows = self.export()
        self.assertEqual([row["trial"] for row in rows], ["1", "2", "3", "4"])
        self.assertEqual([row["response"] for row in rows], ["ball", "box", "box", "box"])
        for row in rows:
            self.assertEqual(row["correct"], str(int(row["shape"] == row["response"])))
            self.assertEqual((row["device"], row["simulated"], row["response_device"]), ("simulated", "1", "keyboard"))
            self.assertGreater(float(row["response_time"]), 0)
        (consent, at, hand, latency, started, protocol), = self.sql(
            "SELECT consent_version, consent_utc_ns, hand, response_latency, started_utc_ns, protocols.text "
            "FROM runs, protocols")
        self.assertEqual((consent, hand, latency), ("v2 2026-01", "left", 0.012))
        self.assertEqual(at, started)
        self.assertEqual(json.loads(protocol), PROTOCOL)
        self.assertEqual(stat.S_IMODE(os.stat(self.db).st_mode), 0o600)

    def test_the_terminal_never_names_the_shape(self):
        terminal = self.begin(stimuli=[{"name": "SECRET1", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1}],
                              response={"keys": {"1": "SECRET1"}})
        shown = terminal.text.count("SECRET1")
        trials = terminal.text.count("1 SECRET1")
        self.assertEqual(shown, trials, "only the key map says it")
        terminal.type("1")
        self.finish(terminal)

    def test_numbers_orders_and_sessions(self):
        sessions = {"sessions": {"count": 2}}
        with self.run_session("--number", "5", **sessions) as terminal:
            terminal.wait_for("participant P01 has number 5; session 1 of 2")
            self.finish(terminal)
        with self.run_session(code="P02", **sessions) as terminal:
            terminal.wait_for("participant P02 has number 1; session 1 of 2")
            terminal.type(":quit\n")
            self.finish(terminal)
            self.assertIn("participant P02 (not enrolled)", terminal.text)
        with self.run_session(**sessions) as terminal:
            terminal.wait_for("session 1 was also today", "has number 5; session 2 of 2")
            self.finish(terminal)
        with self.run_session(**sessions) as terminal:
            self.assertEqual(terminal.finish(), 2)
            self.assertIn("participant P01 has completed every session", terminal.text)
        with self.run_session("--number", "4", **sessions) as terminal:
            self.assertEqual(terminal.finish(), 2)
            self.assertIn("has number 5, not 4", terminal.text)
        schedule = subprocess.run([PALPATE, "schedule", self.protocol(**sessions), "--participant", "5", "--format",
                                   "csv"], check=True, capture_output=True, text=True).stdout
        planned = [(row["session"], row["trial"], row["shape"], float(row["orientation_w"]))
                   for row in csv.DictReader(schedule.splitlines())]
        done = [(row["session"], row["trial"], row["shape"], float(row["orientation_w"]))
                for row in self.export() if row["participant_id"] == "P01"]
        self.assertEqual(done, planned)

    def test_practice_goes_on_until_the_criterion_and_says_what_was_right(self):
        practice = {"repetitions": 1, "criterion": 1.0, "max_rounds": 2}
        terminal = self.begin(practice=practice, repetitions=1, blocks_per_renderer=1,
                              texts={"instructions": "go", "practice": "try it"})
        terminal.type("1")
        self.finish(terminal)
        rows = self.export()
        self.assertEqual([row["practice"] for row in rows], list("111100"))
        self.assertEqual(terminal.text.count("\u2713"), 2)
        self.assertEqual(terminal.text.count("\u2717"), 2)

    def test_lines_break_between_words_and_no_status_is_empty(self):
        terminal = self.begin(columns=40)
        terminal.type(":note " + "abcdefgh " * 12 + "\n")
        terminal.wait_for("* note:")
        terminal.type("1")
        self.finish(terminal)
        said = terminal.text[terminal.text.index("* note:"):]
        note = re.split(r"\n[*\[]", said)[0]
        self.assertLessEqual(max(map(len, note.splitlines())), 40)
        self.assertEqual(note.replace("\n", " ").split(), ["*", "note:"] + ["abcdefgh"] * 12)
        self.assertNotIn("[]", terminal.text)

    def test_a_page_says_in_the_protocols_words_when_to_go_and_what_a_key_stands_for(self):
        texts = {"ready": "Bereit", "go": "Los", "other_key": "Diese Taste gilt nicht"}
        terminal = self.begin(texts=texts, response={"keys": {
            "1": {"stimulus": "ball", "label": "Kugel"}, "2": {"stimulus": "box", "label": "W\u00fcrfel"}}})
        self.assertIn("1 Kugel   2 W\u00fcrfel", terminal.text)
        self.assertLess(terminal.text.index("Bereit"), terminal.text.index("Los   1 Kugel"))
        terminal.type("7")
        terminal.wait_for("Diese Taste gilt nicht")
        terminal.type("1")
        self.finish(terminal)
        self.assertEqual({row["response"] for row in self.export()}, {"ball"})

    def test_time_out(self):
        terminal = self.begin(response={"keys": {"1": "ball", "2": "box"}, "time_out_s": 1}, repetitions=1,
                              blocks_per_renderer=1)
        terminal.wait_for("trial 2 of 2")
        self.finish(terminal)
        row = self.export()[0]
        self.assertEqual((row["timed_out"], row["response"], row["response_time"], row["before_contact"]),
                         ("1", "", "1", "0"))

    def test_an_answer_before_contact_is_kept_and_flagged(self):
        terminal = self.begin()
        terminal.type("1")
        self.finish(terminal)
        rows = self.export()
        self.assertEqual([row["before_contact"] for row in rows],
                         [str(int(row["first_contact_time"] == "")) for row in rows])
        self.assertEqual(terminal.text.count("answered before the first contact"),
                         sum(row["before_contact"] == "1" for row in rows))


class Commands(Live):
    def test_repeat_cuts_the_trial_off_and_shows_it_again(self):
        terminal = self.begin()
        terminal.type(":repeat\n")
        terminal.wait_for("trial 1 was cut off: repeated by the experimenter")
        self.finish(terminal)
        self.assertEqual(self.attempts(), [(1, 1, "cut_off"), (1, 2, "completed"), (2, 1, "completed"),
                                           (3, 1, "completed"), (4, 1, "completed")])
        self.assertEqual([row["attempt"] for row in self.export()], ["2", "1", "1", "1"])

    def test_pause_holds_the_next_trial_and_keys_do_nothing_meanwhile(self):
        terminal = self.begin()
        terminal.type(":pause\n")
        terminal.wait_for("pause after this trial")
        terminal.type("1")
        terminal.wait_for("[paused, ")
        terminal.type("1 2:note she asked for water\n")
        terminal.wait_for("note: she asked for water")
        terminal.type(":go\n")
        self.finish(terminal)
        self.assertEqual(len(self.export()), 4)
        self.assertEqual(self.notes(), ["she asked for water"])

    def test_stop_after_the_trial_and_go_on_another_day(self):
        terminal = self.begin()
        terminal.type(":stop\n1")
        self.finish(terminal)
        self.assertIn("1 of 4 trials on record; paused", terminal.text)
        with self.run_session() as again:
            self.finish(again)
        self.assertEqual(self.ends(), ["paused", "done"])
        self.assertEqual(len(self.export()), 4)

    def test_stop_after_the_block(self):
        terminal = self.begin()
        terminal.type(":stop block\n1")
        terminal.wait_for(FEELING)
        terminal.type("1")
        self.finish(terminal)
        self.assertIn("2 of 4 trials on record; paused", terminal.text)

    def test_quit_and_withdrawal_are_recorded_with_their_reason(self):
        terminal = self.begin()
        terminal.type(":quit feels unwell\n")
        self.finish(terminal)
        self.assertEqual(self.ends(), ["aborted"])
        self.assertEqual(self.notes(), ["ended: ended by the experimenter: feels unwell"])
        self.assertEqual(self.attempts(), [(1, 1, "cut_off")])
        terminal = self.begin()
        terminal.type(":quit withdrawn\n")
        self.finish(terminal)
        self.assertEqual(self.ends(), ["aborted", "withdrawn"])
        with self.run_session() as refused:
            self.assertEqual(refused.finish(), 2)
            self.assertIn("--after-withdrawal", refused.text)

    def test_who_withdrew_is_begun_again_only_where_that_is_said(self):
        terminal = self.begin()
        terminal.type(":QUIT Withdrawn.\n")
        self.finish(terminal)
        self.assertIn("; withdrawn", terminal.text)
        for changes in ({}, {"texts": {"instructions": "other words"}}):
            with self.run_session(**changes) as refused:
                self.assertEqual(refused.finish(), 2)
                self.assertIn("--after-withdrawal", refused.text)
        with self.run_session("--after-withdrawal") as again:
            again.wait_for("[space bar: go on]")
            again.type(":stop\n ")
            self.finish(again)
        self.assertEqual(self.ends(), ["withdrawn", "paused"])
        self.assertIn("begun again after a withdrawal", self.notes())
        with self.run_session("--after-withdrawal") as mistaken:
            self.assertEqual(mistaken.finish(), 2)
            self.assertIn("has not withdrawn", mistaken.text)
        with self.run_session() as on:
            self.finish(on)
        self.assertEqual(self.ends()[-1], "done")

    def test_a_session_that_goes_on_begins_by_saying_so(self):
        terminal = self.begin()
        self.assertNotIn("continues with trial", terminal.text)
        terminal.type(":stop\n1")
        self.finish(terminal)
        with self.run_session() as again:
            again.wait_for("1 of 4 trials done, last run today ", " (paused), continues with trial 2")
            self.finish(again)

    def test_a_stop_can_be_taken_back(self):
        terminal = self.begin()
        terminal.type(":stop\n:stop\n1")
        self.finish(terminal)
        self.assertIn("the stop is cancelled", terminal.text)
        self.assertEqual(self.ends(), ["done"])

    def test_after_an_abort_nobody_reads_that_it_is_over(self):
        terminal = self.begin()
        terminal.type(":quit\n")
        self.finish(terminal)
        self.assertNotIn("good bye", terminal.text)

    def test_the_end_is_no_trial(self):
        terminal = self.begin()
        self.finish(terminal)
        self.assertRegex(terminal.text, r"\[end, [^\n]*trial 4 of 4")

    def test_emergency_holds_until_it_is_cleared(self):
        terminal = self.begin()
        terminal.type("\x1b")
        terminal.wait_for("trial 1 was cut off: zero force was asked for")
        terminal.wait_for("[fault, ")
        terminal.type(":go\n")
        terminal.wait_for("clear the fault first")
        terminal.type(":clear\n")
        terminal.wait_for("fault cleared")
        terminal.type(":go\n")
        self.finish(terminal)
        self.assertEqual(self.attempts()[:2], [(1, 1, "cut_off"), (1, 2, "completed")])
        self.assertEqual(self.notes(), ["emergency zero: the key Escape", "fault cleared"])

    def test_alt_with_a_key_is_an_emergency_that_says_so_and_answers_nothing(self):
        terminal = self.begin()
        terminal.type("\x1b1")
        terminal.wait_for("EMERGENCY by the key Alt+1: forces are off")
        self.finish(terminal)
        self.assertEqual(self.attempts()[:2], [(1, 1, "cut_off"), (1, 2, "completed")])
        self.assertEqual(self.notes()[0], "emergency zero: the key Alt+1")

    def test_a_wrong_command_gets_the_list(self):
        terminal = self.begin()
        before = terminal.text.count(":pause ")
        terminal.type(":nonsense\n")
        terminal.wait_for(":pause ")
        self.assertEqual(terminal.text.count(":pause "), before + 1)
        terminal.type("1")
        self.finish(terminal)


class Enrolment(Live):
    def test_a_number_is_taken_when_the_first_trial_begins(self):
        for end in (":quit\n", ":note came late\n:quit feels unwell\n"):
            with self.run_session(code="P01") as terminal:
                terminal.wait_for("participant P01 has number 1", "[space bar: go on]")
                terminal.wait_for("[space bar: go on]")
                terminal.type(end)
                self.finish(terminal)
                self.assertIn("participant P01 (not enrolled), session 1: 0 of 4 trials on record", terminal.text)
        self.assertIn("not on record, as nobody was enrolled: came late", terminal.text)
        self.assertEqual(self.codes(self.db), [])
        self.assertEqual(self.sql("SELECT count(*) FROM protocols"), [(0,)])
        terminal = self.begin(code="P02")
        self.assertEqual(self.codes(self.db), ["P02"])
        terminal.type(":quit\n")
        self.finish(terminal)
        self.assertIn("participant P02 (number 1)", terminal.text)

    def test_notes_of_before_the_first_trial_are_kept_when_it_begins(self):
        terminal = self.run_session()
        self.addCleanup(terminal.__exit__)
        terminal.wait_for("[space bar: go on]")
        terminal.type(":note wears a ring\n")
        terminal.wait_for("note: wears a ring")
        self.assertEqual(self.codes(self.db), [])
        terminal.type(" ")
        self.finish(terminal)
        self.assertEqual(self.notes(), ["wears a ring"])

    def test_who_withdraws_before_the_first_trial_is_on_record(self):
        with self.run_session() as terminal:
            terminal.wait_for("[space bar: go on]")
            terminal.type(":quit withdrawn\n")
            self.finish(terminal)
        self.assertEqual(self.ends(), ["withdrawn"])
        with self.run_session() as refused:
            self.assertEqual(refused.finish(), 2)
            self.assertRegex(refused.text, r"P01 has withdrawn \(today \d\d:\d\d\) and is not started again")

    def test_what_fails_before_the_first_trial_enrols_nobody(self):
        without_display = {name: value for name, value in os.environ.items() if "DISPLAY" not in name}
        done = subprocess.run([PALPATE, "run", self.protocol(), "--db", self.db, "--participant", "P01", "--device",
                               "mouse"], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60,
                              env=without_display)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(self.run_piped(code="P02").returncode, 1)
        self.assertEqual(self.codes(self.db), [])

    def test_a_code_never_seen_before_is_asked_about(self):
        with self.run_session(sure=False) as terminal:
            terminal.wait_for("holds no participants yet", "Is P01 a new participant? [y/N]")
            terminal.type("y\n")
            self.finish(terminal)
        with self.run_session(code="PO1", sure=False) as terminal:
            terminal.wait_for("P01 is there: a typing error?")
            terminal.wait_for("Is PO1 a new participant? [y/N]")
            terminal.type("\n")
            self.assertEqual(terminal.finish(), 2)
            self.assertIn("nobody was enrolled", terminal.text)
        with self.run_session(code="P02", sure=False) as terminal:
            terminal.wait_for("others (P01)")
            terminal.wait_for("Is P02 a new participant? [y/N]")
            terminal.type("yes\n")
            self.finish(terminal)
        self.assertEqual(self.codes(self.db), ["P01", "P02"])
        with self.run_session(sure=False) as known:
            self.assertEqual(known.finish(), 2)
            self.assertIn("has completed every session", known.text)
            self.assertNotIn("[y/N]", known.text)

    def test_a_script_takes_new_codes_but_none_that_looks_like_another(self):
        one = {"repetitions": 1, "blocks_per_renderer": 1, "texts": {}, "stimuli": PROTOCOL["stimuli"][:1],
               "response": {"keys": {"1": "ball"}, "time_out_s": 0.3}}
        def piped(code, *options):
            process = subprocess.Popen([PALPATE, "run", self.protocol(**one), "--db", self.db, "--participant", code,
                                        "--device", "simulated", "--no-window", *options], stdin=subprocess.PIPE,
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            self.addCleanup(process.kill)
            err = process.stderr.read()  # its input stays open until the time-out has ended the only trial
            process.stdin.close()
            process.stdout.close()
            process.stderr.close()
            return process.wait(60), err.decode()

        status, err = piped("P01")
        self.assertEqual(status, 0, err)
        status, err = piped("P02")
        self.assertEqual(status, 0, err)
        self.assertIn(f"P02 is new in {self.db}", err)
        for slip in ("p01", "P1", "PO1", "PP01"):
            status, err = piped(slip)
            self.assertEqual(status, 2, err)
            self.assertIn(f"--participant {slip}: is not in {self.db}, but P01 is there", err)
            self.assertIn("--new-participant", err)
        self.assertEqual(piped("p01", "--new-participant")[0], 0)
        status, err = piped("P02", "--new-participant")
        self.assertEqual(status, 2)
        self.assertIn("P02 is in", err)
        self.assertEqual(self.codes(self.db), ["P01", "P02", "p01"])

    def test_a_code_need_not_stand_in_the_command_line(self):
        terminal = self.run_session(code="-", sure=False)
        self.addCleanup(terminal.__exit__)
        terminal.wait_for("participant code: ")
        terminal.type("SECRET7\n")
        terminal.wait_for("Is SECRET7 a new participant?")
        terminal.type("y\n")
        while terminal.wait_for(FEELING, "[space bar: go on]") != FEELING:
            terminal.type(" ")
        command = pathlib.Path(f"/proc/{terminal.process.pid}/cmdline").read_bytes()
        self.assertNotIn(b"SECRET7", command)
        terminal.type("1")
        self.finish(terminal)
        self.assertEqual({row["participant_id"] for row in self.export()}, {"SECRET7"})
        done = self.run_piped(code="-", typed=b"P09\r\n")  # then the input ends
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"participant P09 has number 2", done.stdout)
        for typed in (b"", b"\n", b"Jane Doe\n", b"x" * 1000):
            self.assertEqual(self.run_piped(code="-", typed=typed).returncode, 2, typed)
        self.assertEqual(self.codes(self.db), ["SECRET7"])
        forgotten = subprocess.run([PALPATE, "forget", "--db", self.db, "--participant", "-", "--yes"],
                                   input=b"SECRET7\n", capture_output=True)
        self.assertEqual(forgotten.returncode, 0, forgotten.stderr)
        self.assertEqual(self.codes(self.db), [])

    def test_a_clock_that_is_years_behind_is_told_and_on_record(self):
        protocol = self.protocol()
        later = time.time() + 5 * 365.25 * 86400
        with unittest.mock.patch.object(self, "protocol", lambda **_: protocol):
            os.utime(protocol, (later, later))
            terminal = self.begin()
        self.assertIn("CLOCK: the computer's clock says", terminal.text)
        terminal.type("1")
        self.finish(terminal)
        (note,) = self.sql("SELECT text FROM notes WHERE text LIKE '%clock_warning%'")
        self.assertIn("5 years before the protocol or the program was written", json.loads(note[0])["clock_warning"])


class Changed(Live):
    """The protocol's file is edited while somebody is half way through it."""

    TEXTS = {"texts": PROTOCOL["texts"] | {"break": "sit down"}}
    DESIGN = TEXTS | {"seed": 8}

    def setUp(self):
        super().setUp()
        terminal = self.begin(code="K1")
        terminal.type(":stop\n1")
        self.finish(terminal)

    def changes(self):
        return [json.loads(text)["protocol_change"] for (text,) in
                self.sql("SELECT text FROM notes WHERE text LIKE '{\"protocol_change%' ORDER BY id")]

    def shown_texts(self):
        """Of every run, where it was not the participant's own protocol."""
        return [text and json.loads(text)["texts"]["break"] for (text,) in self.sql(
            "SELECT p.text FROM runs r LEFT JOIN protocols p ON p.id = r.protocol_id ORDER BY r.id")]

    def test_the_stored_protocol_goes_on_unless_told_otherwise(self):
        with self.run_session(code="K1", **self.TEXTS) as terminal:
            terminal.wait_for("K1 began with another text of protocol two (1 trial on record, last run on ")
            terminal.wait_for("has changed since (only texts: /texts/break)")
            terminal.wait_for("t  use the new texts", "which? ")
            terminal.wait_for("which? ")
            terminal.type("\n")
            terminal.wait_for("participant K1 has number 1; session 1 of 1")
            self.finish(terminal)
            self.assertIn("have a rest", terminal.text)
            self.assertNotIn("sit down", terminal.text)
            self.assertIn("4 of 4 trials on record; done", terminal.text)
        self.assertEqual(self.codes(self.db), ["K1"])
        self.assertEqual(self.sql("SELECT count(*) FROM protocols"), [(1,)])
        (change,) = self.changes()
        self.assertEqual((change["shown"], change["texts"], change["stimuli_and_order"]),
                         ("stored", ["/texts/break"], []))
        with self.run_session(code="K1", **self.DESIGN) as terminal:
            terminal.wait_for("which? ")
            terminal.type("s\n")
            self.assertEqual(terminal.finish(), 2)
            self.assertIn("K1 has completed every session", terminal.text)

    def test_new_texts_where_only_texts_differ(self):
        with self.run_session(code="K1", **self.TEXTS) as terminal:
            terminal.wait_for("which? ")
            terminal.type("t\n")
            terminal.wait_for("[space bar: go on]")
            terminal.type(" ")
            terminal.wait_for(FEELING)
            terminal.type(":stop\n1")
            self.finish(terminal)
            self.assertIn("2 of 4 trials on record", terminal.text)
        with self.run_session(code="K1", **self.TEXTS) as terminal:  # that has been answered
            terminal.wait_for("resuming with these texts, as in the last run")
            self.finish(terminal)
            self.assertIn("sit down", terminal.text)
            self.assertNotIn("which?", terminal.text)
        self.assertEqual(self.shown_texts(), [None, "sit down", "sit down"])
        self.assertEqual(self.codes(self.db), ["K1"])
        self.assertEqual([change["shown"] for change in self.changes()], ["new texts"] * 2)
        schedule = subprocess.run([PALPATE, "schedule", self.protocol(), "--participant", "1", "--format", "csv"],
                                  check=True, capture_output=True, text=True).stdout
        self.assertEqual([row["shape"] for row in self.export()],
                         [row["shape"] for row in csv.DictReader(schedule.splitlines())])

    def test_another_order_is_no_new_text(self):
        with self.run_session(code="K1", **self.DESIGN) as terminal:
            terminal.wait_for("(stimuli and order: /seed; texts: /texts/break)")
            terminal.wait_for("which? ")
            self.assertNotIn("t  use the new texts", terminal.text)
            terminal.type("t\n")
            terminal.wait_for("which? ")
            terminal.type("q\n")
            self.assertEqual(terminal.finish(), 2)
            self.assertIn("nothing was started", terminal.text)
        done = self.run_piped("--changed-protocol", "texts", code="K1", **self.DESIGN)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"--changed-protocol texts: K1 began with another text", done.stderr)
        self.assertEqual(self.run_piped("--changed-protocol", "new", code="K1").returncode, 2)
        self.assertEqual(self.ends(), ["paused"])

    def test_begun_anew_under_a_new_code(self):
        with self.run_session(code="K1", **self.DESIGN) as terminal:
            terminal.wait_for("which? ")
            terminal.type("n\n")
            terminal.wait_for("The new code: ")
            terminal.type("M1\n")
            terminal.wait_for("Is M1 a new participant? [y/N]")
            terminal.type("y\n")
            terminal.wait_for("participant M1 has number 1; session 1 of 1")
            self.finish(terminal)
            self.assertIn("4 of 4 trials on record; done", terminal.text)
        self.assertEqual(self.codes(self.db), ["K1", "M1"])
        (change,) = self.changes()
        self.assertEqual((change["shown"], change["earlier_code"]), ("begun anew", "K1"))

    def test_a_script_goes_on_with_the_stored_protocol_and_is_told(self):
        def piped(*options):
            """Up to the trial that is due; then the input ends."""
            process = subprocess.Popen([PALPATE, "run", self.protocol(**self.TEXTS), "--db", self.db, "--participant",
                                        "K1", "--device", "simulated", "--no-window", *options], stdin=subprocess.PIPE,
                                       stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.addCleanup(process.kill)
            said = ""
            while FEELING not in said:
                said += (line := process.stdout.readline())
                self.assertTrue(line, said)
                if "[space bar: go on]" in line:
                    process.stdin.write(" ")
                    process.stdin.flush()
            said += process.communicate(timeout=60)[0]
            self.assertIn("1 of 4 trials on record; aborted", said)
            return said

        self.assertIn("resuming with the protocol as it is stored. --changed-protocol texts shows", piped())
        self.assertIn("resuming with the new texts", piped("--changed-protocol", "texts"))
        self.assertIn("resuming with the protocol as it is stored\n", piped("--changed-protocol", "stored"))
        self.assertEqual(self.shown_texts(), [None, None, "sit down", None])
        self.assertEqual(self.codes(self.db), ["K1"])

    def test_layout_alone_asks_nobody(self):
        path = self.protocol()
        path.write_text(json.dumps(PROTOCOL, indent=3, sort_keys=True))
        with unittest.mock.patch.object(self, "protocol", lambda **_: path):
            with self.run_session(code="K1") as terminal:
                terminal.wait_for("(only its layout); resuming with the protocol as it is stored")
                self.finish(terminal)
        self.assertEqual(self.codes(self.db), ["K1"])

    def test_others_who_come_new_to_other_texts_get_the_next_number(self):
        terminal = self.begin(code="K2", **self.TEXTS)
        self.assertIn("participant K2 has number 2; session 1 of 1", terminal.text)
        self.assertIn("with another text of this protocol (only texts: /texts/break); numbers count on", terminal.text)
        terminal.type(":quit\n")
        self.finish(terminal)
        done = self.run_piped("--number", "1", code="K3", **self.TEXTS)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"--number: 1 is taken by participant K1", done.stderr)
        done = self.run_piped(code="K3", **self.DESIGN)
        self.assertIn(b"participant K3 has number 1", done.stdout)
        self.assertIn(b"(stimuli and order: /seed; texts: /texts/break)", done.stderr)


class Broken(Live):
    def test_killed_in_mid_trial_it_goes_on_with_that_trial(self):
        terminal = self.begin()
        terminal.type("1")
        terminal.wait_for("trial 2 of 4]\n")
        terminal.wait_for(FEELING)
        terminal.kill()
        self.assertEqual(self.attempts(), [(1, 1, "completed"), (2, 1, "running")])
        with self.run_session() as again:
            self.finish(again)
        self.assertEqual(self.attempts(), [(1, 1, "completed"), (2, 1, "cut_off"), (2, 2, "completed"),
                                           (3, 1, "completed"), (4, 1, "completed")])
        self.assertEqual(self.ends(), ["interrupted", "done"])
        self.assertEqual([row["trial"] for row in self.export()], ["1", "2", "3", "4"])
        attempts = (self.dir / "attempts.csv").read_text()
        self.assertEqual(attempts.count("\n"), 2, attempts)

    def test_an_index_that_is_cut_short_meanwhile_costs_nothing(self):
        terminal = self.begin()
        for trial in (1, 2, 3):
            os.truncate(f"{self.db}-shm", 0 if trial < 3 else 100)
            terminal.type("1")
            while terminal.wait_for(FEELING, "[space bar: go on]") != FEELING:
                terminal.type(" ")
        os.truncate(f"{self.db}-shm", 0)
        terminal.type("1")
        self.finish(terminal)
        self.assertEqual(self.attempts(), [(trial, 1, "completed") for trial in (1, 2, 3, 4)])

    def test_a_replay_writes_over_no_mesh_that_it_reads(self):
        (self.dir / "solid.obj").write_text(
            "v 0 0 0\nv 0.04 0 0\nv 0 0.04 0\nv 0 0 0.04\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        before = (self.dir / "solid.obj").read_bytes()
        stimuli = [{"name": name, "shape": "mesh", "file": "solid.obj"} for name in ("ball", "box")]
        with self.run_session(samples=True, stimuli=stimuli) as terminal:
            self.finish(terminal)
        replay = [PALPATE, "replay", "--db", self.db, "--trial", "P01/1/2", "--meshes", self.dir, "--out"]
        done = subprocess.run([*replay, self.dir / "solid.obj", "--force"], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
        self.assertIn("mesh", done.stderr)
        self.assertEqual((self.dir / "solid.obj").read_bytes(), before)
        done = subprocess.run([*replay, self.dir / "ticks.csv"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_mesh_is_kept_with_the_data_and_replayed_and_exported_from_there(self):
        solid = "v 0 0 0\nv .04 0 0\nv 0 .04 0\nv 0 0 .04\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        (self.dir / "solid.obj").write_text(solid)
        stimuli = [{"name": "ball", "shape": "mesh", "file": "solid.obj"}, PROTOCOL["stimuli"][1]]
        session = self.begin(stimuli=stimuli, repetitions=1, blocks_per_renderer=1, samples=True)
        time.sleep(0.5)
        session.type("1")
        self.finish(session)
        (trial,) = [t["trial"] for t in self.export() if t["shape"] == "ball"]

        # Half the size, and then gone: the record knows better.
        mesh = self.dir / "solid.obj"
        mesh.write_text(solid.replace(".04", ".02"))
        replay = [PALPATE, "replay", "--db", self.db, "--trial", f"P01/1/{trial}"]
        for _ in range(2):
            done = subprocess.run(replay, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertIn("equal the record, bit by bit", done.stdout)
            mesh.unlink(missing_ok=True)
        for form, place in [("bids", "stimuli"), ("psych-ds", "materials")]:
            out = self.dir / form
            subprocess.run([PALPATE, "export", "--db", self.db, "--format", form, "--out", out], check=True,
                           capture_output=True)
            (kept,) = (out / place).rglob("solid.obj")
            self.assertEqual(kept.read_text(), solid)

    def test_signals_end_it_with_everything_on_record(self):
        for which, word in ((signal.SIGINT, "Interrupt"), (signal.SIGTERM, "Terminated")):
            terminal = self.begin(code=f"P{int(which)}")
            terminal.send_signal(which)
            self.finish(terminal, status=1)
            self.assertIn(f"signal: {word}", terminal.text)
        self.assertEqual(self.ends(), ["aborted", "aborted"])
        with self.run_session(code=f"P{int(signal.SIGINT)}") as again:
            self.finish(again)

    def test_a_terminal_that_hangs_up_ends_it(self):
        terminal = self.begin()
        terminal.hang_up()
        self.assertEqual(terminal.process.wait(30), 1)
        self.assertEqual(self.ends(), ["aborted"])
        self.assertEqual(self.attempts(), [(1, 1, "cut_off")])

    def test_the_end_of_the_input_ends_it(self):
        done = subprocess.run([PALPATE, "run", self.protocol(), "--db", self.db, "--participant", "P01", "--device",
                               "simulated", "--no-window"], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=60)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("screen was closed", done.stderr)

    def test_pipes_serve_as_well(self):
        process = subprocess.Popen([PALPATE, "run", self.protocol(repetitions=1, blocks_per_renderer=1, texts={}), "--db",
                                    self.db, "--participant", "P01", "--device", "simulated", "--no-window"],
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(process.kill)
        for _ in range(2):
            while FEELING.encode() not in process.stderr.readline():
                pass
            process.stdin.write(b"1\n")
            process.stdin.flush()
        out, err = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 0, err)
        self.assertIn(b"2 of 2 trials on record; done", out)

    def test_a_full_disk_is_told_and_the_trial_in_hand_is_not_said_to_be_saved(self):
        disk = self.dir / "disk"
        disk.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=400k", "none", disk], capture_output=True).returncode:
            self.skipTest("nothing can be mounted here")
        try:
            self.db = disk / "live.db"
            terminal = self.begin(samples=True)
            with open(disk / "ballast", "wb", buffering=0) as ballast, contextlib.suppress(OSError):
                while True:
                    ballast.write(bytes(512))
            terminal.type("1")
            self.assertEqual(terminal.finish(), 1, terminal.text)
            self.assertRegex(terminal.text, "disk|space")
            os.remove(disk / "ballast")
            self.assertEqual([state for _, _, state in self.attempts()], ["running"])
            with self.run_session(samples=True) as again:
                self.finish(again)
            self.assertIn((1, 2, "completed"), self.attempts())
        finally:
            subprocess.run(["umount", "-l", disk], check=True)

    def test_a_database_in_use_is_refused(self):
        self.begin()
        with self.run_session(code="P02") as second:
            self.assertEqual(second.finish(), 2)
            self.assertIn("open", second.text)


class Usage(Live):
    def test_wrong_usage_is_status_2_and_leaves_nothing(self):
        good = {"--db": self.db, "--participant": "P01", "--device": "simulated"}
        too_fast = {"servo": {"rate_hz": 1000}, "workspace": {"centre_m": [1, 0, 0]}}
        for changes, word, protocol in (
                ({"--participant": "Jane Doe"}, "pseudonym", {}), ({"--device": "phantom"}, "there are: falcon", {}),
                ({"--hand": "both"}, "left or right", {}), ({"--number": "0"}, "1 or more", {}),
                ({"--session": "0"}, "1 or more", {}), ({"--response-latency": "-1"}, "0 or more", {}),
                ({"--markers": "smoke"}, "udp:HOST:PORT", {}), ({"--markers": "udp:localhost"}, "udp:HOST:PORT", {}),
                ({"--device": "mouse"}, "needs the window", {}), ({}, "which reaches", too_fast)):
            options = [str(part) for pair in (good | changes).items() for part in pair]
            done = subprocess.run([PALPATE, "run", self.protocol(**protocol), *options, "--no-window"],
                                  stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(word, done.stderr)
            self.assertEqual(done.stdout, "")
        for missing in good:
            options = [str(part) for pair in good.items() if pair[0] != missing for part in pair]
            done = subprocess.run([PALPATE, "run", self.protocol(), *options], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(missing[2:], done.stderr)
        self.assertEqual([path.name for path in self.dir.iterdir()], ["protocol.json"])


class Noise(Live):
    NOISE = {"masking_noise": {"kind": "pink", "level_db": -24}}

    def setUp(self):
        super().setUp()
        done = subprocess.run([PALPATE, "run", self.protocol(**self.NOISE), "--db", self.db, "--participant", "P01",
                               "--device", "simulated", "--no-window", "--sound-device", "none such"],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
        if "built without" in done.stderr:
            self.skipTest("no ALSA")
        self.refusal = done

    def events(self):
        texts = [text for (text,) in self.sql("SELECT text FROM notes ORDER BY id")]
        return [json.loads(text) for text in texts if text.startswith('{"masking_noise"')]

    def test_without_a_sound_device_the_session_is_refused_before_it_starts(self):
        self.assertEqual(self.refusal.returncode, 1, self.refusal.stderr)
        self.assertIn("no sound from 'none such'", self.refusal.stderr)
        self.assertIn("--without-noise", self.refusal.stderr)
        self.assertIn("--sound-device", self.refusal.stderr)
        self.assertFalse(self.db.exists())

    def test_told_so_it_runs_without_and_that_is_on_record(self):
        terminal = self.begin("--without-noise", "--sound-device", "none such", **self.NOISE)
        terminal.type("1")
        self.finish(terminal)
        self.assertEqual(self.events(), [{"masking_noise": "left out"}])

    def test_a_protocol_without_noise_asks_for_no_sound_device(self):
        terminal = self.begin("--sound-device", "none such")
        terminal.type("1")
        self.finish(terminal)
        self.assertEqual(self.events(), [])

    def test_noise_is_heard_in_trials_and_faded_out_for_pages(self):
        sound = self.dir / "sound.raw"
        terminal = self.begin("--sound-device", f"file:{sound},raw", breaks={"min_seconds": 1}, **self.NOISE)
        rate = 48000
        while sound.stat().st_size < 4 * 4 * rate:  # seconds of two channels of two bytes
            time.sleep(0.05)
        terminal.type("1")
        self.finish(terminal)
        left = array.array("h", sound.read_bytes())
        right = left[1::2]
        left = left[0::2]
        self.assertEqual(left, right)
        runs, start = [], 0  # of sound, in samples
        parts = [left[i:i + 480] for i in range(0, len(left), 480)]
        loud = [any(part) for part in parts] + [False]  # nothing follows: whatever sounds must have faded out
        for i in range(1, len(loud)):
            if loud[i] and not loud[i - 1]:
                start = i
            if loud[i - 1] and not loud[i]:
                runs.append((start * 480, i * 480))
        self.assertFalse(loud[0], "silence at first")
        self.assertEqual(len(runs), 2, "one for each block: the break is a page to read")
        first, last = runs[0]
        fade = int(0.2 * rate)
        steady = left[first + fade + 480:last - fade - 480]
        level = 10 * math.log10(sum(x * x for x in steady) / len(steady) / 32767 ** 2)
        self.assertAlmostEqual(level, -24, delta=0.5)
        largest = max(map(abs, steady))
        for edge in (left[first:first + 960], left[last - 960:last]):
            self.assertLess(max(map(abs, edge)), 0.05 * largest, "no click")
        on, off, again, end = self.events()
        self.assertEqual((on["masking_noise"], on["kind"], on["level_db"], on["device"], on["seed"]),
                         ("on", "pink", -24, f"file:{sound},raw", PROTOCOL["seed"]))
        self.assertEqual((off["masking_noise"], again["masking_noise"], end["masking_noise"]), ("off", "on", "off"))
        self.assertAlmostEqual(off["seconds"], (last - first) / rate - 0.2, delta=0.1)
        self.assertEqual(off["underruns"], 0)


class Marks(Live):
    def test_udp_serial_port_and_a_receiver_that_takes_nothing(self):
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(receiver.close)
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(30)
        master, slave = pty.openpty()
        self.addCleanup(os.close, master)
        self.addCleanup(os.close, slave)
        nobody = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        nobody.bind(("127.0.0.1", 0))
        closed = nobody.getsockname()[1]
        nobody.close()
        terminal = self.begin("--markers", f"udp:127.0.0.1:{receiver.getsockname()[1]}", "--markers",
                              f"serial:{os.ttyname(slave)}:115200", "--markers", f"udp:127.0.0.1:{closed}",
                              repetitions=1, blocks_per_renderer=1)
        lines = []

        def until(kind):
            """The first contact is certain where it was waited for only: the hand strokes by itself."""
            while True:
                line = json.loads(receiver.recv(4096))
                if kind == line["marker"] or line["marker"] != "first_contact":
                    lines.append(line)
                if kind == line["marker"]:
                    return

        until("first_contact")
        terminal.type("1")
        until("response")
        terminal.wait_for(FEELING)
        terminal.type(":repeat\n")
        until("cut_off")
        self.finish(terminal, "2")
        until("response")
        kinds = [line["marker"] for line in lines]
        self.assertEqual(kinds, ["trial_start", "first_contact", "response", "trial_start", "cut_off", "trial_start",
                                 "response"])
        sent = os.read(master, 100)
        self.assertEqual(sent[:2] + sent[2:].replace(b"\2", b""), bytes([1, 2, 3, 1, 5, 1, 3]))
        rows = self.export()
        start, contact, response = lines[:3]
        self.assertEqual({key: response[key] for key in ("participant_id", "session", "block", "trial", "attempt",
                                                         "renderer", "shape", "response")},
                         {"participant_id": "P01", "session": 1, "block": 1, "trial": 1, "attempt": 1,
                          "renderer": "ray", "shape": rows[0]["shape"], "response": "ball"})
        self.assertAlmostEqual((response["time_ns"] - start["time_ns"]) / 1e9, float(rows[0]["response_time"]), 9)
        self.assertAlmostEqual((contact["time_ns"] - start["time_ns"]) / 1e9, float(rows[0]["first_contact_time"]), 9)
        self.assertEqual(rows[0]["before_contact"], "0")
        self.assertGreater(float(rows[0]["max_force"]), 0)
        self.assertEqual(lines[-1]["attempt"], 2)
        for line in lines:
            self.assertGreaterEqual(line["sent_ns"], line["time_ns"])
        self.assertIn("markers were not taken", terminal.text)

    def test_the_code_does_not_leave_this_computer_unless_asked_to(self):
        other, listener = "10.98.7.6", self.dir / "listen.py"
        network = ("ip link add here type veth peer name there && ip addr add 10.98.7.1/24 dev here && "
                   "ip link set lo up && ip link set here up && ip link set there up && "
                   f"ip neigh add {other} lladdr 02:00:00:00:00:06 dev here")
        alone = ["unshare", "--map-root-user", "--net", "sh", "-c"]
        if subprocess.run([*alone, network], capture_output=True).returncode:
            self.skipTest("no network of one's own can be made here")
        listener.write_text("""
import os, socket, sys
runner, wire = os.getppid(), socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
wire.bind((sys.argv[1], 0))
wire.settimeout(0.2)
print("listening", flush=True)
while os.getppid() == runner:
    try:
        frame = wire.recv(4096)
    except TimeoutError:
        continue
    if b'{"marker"' in frame:
        open(sys.argv[2], "ab").write(frame[frame.index(b'{"marker"'):])
""")
        def heard(wire, host, code, *options):
            said = self.dir / f"heard-{code}"
            run = [PALPATE, "run", self.protocol(repetitions=1, blocks_per_renderer=1, texts={}), "--db", self.db,
                   "--participant", code, "--new-participant", "--device", "simulated", "--no-window", "--markers",
                   f"udp:{host}:4000", *options]
            listen = f"'{sys.executable}' '{listener}' {wire} '{said}' & sleep 1"
            terminal = Terminal([*alone, f'{network}; {listen}; exec "$@"', "sh", *run])
            self.addCleanup(terminal.__exit__)
            terminal.wait_for("listening")
            terminal.wait_for(FEELING)
            terminal.type("1")
            self.finish(terminal)
            return {json.loads(line)["participant_id"] for line in said.read_text().splitlines()}

        self.assertEqual(heard("there", other, "CODEA"), {None})
        self.assertEqual(heard("there", other, "CODEB", "--marker-codes"), {"CODEB"})
        self.assertEqual(heard("lo", "10.98.7.1", "CODEC"), {"CODEC"})

    def test_lab_streaming_layer(self):
        said = self.dir / "lsl.txt"
        here = {"LD_LIBRARY_PATH": FAKE_LSL, "PALPATE_FAKE_LSL": str(said)}
        with unittest.mock.patch.dict(os.environ, here):
            terminal = self.begin("--markers", "lsl:touch", repetitions=1, blocks_per_renderer=1)
        terminal.type("1")
        self.finish(terminal)
        stream, *samples, outlet, info = said.read_text().splitlines()
        self.assertEqual(stream, "stream touch Markers 1 0 3 palpate-touch")
        self.assertEqual((outlet, info), ("outlet gone", "info gone"))
        kinds = []
        for sample in samples:
            at, text = sample.split(" ", 1)
            marker = json.loads(text)
            kinds.append(marker["marker"])
            self.assertIsNone(marker["participant_id"], "whoever is on the network may listen")
            self.assertAlmostEqual(float(at), marker["time_ns"] / 1e9, delta=0.05)
        self.assertEqual([kind for kind in kinds if kind != "first_contact"], ["trial_start", "response"] * 2)

    def test_what_cannot_be_opened_is_said_before_anything_else(self):
        for where in ("serial:/dev/null", "serial:" + str(self.dir / "none"), "udp:no.such.host.invalid:9"):
            with self.run_session("--markers", where) as terminal:
                self.assertEqual(terminal.finish(), 1)
                self.assertIn("markers to", terminal.text)
        self.assertFalse(self.db.exists())


if __name__ == "__main__":
    unittest.main()
