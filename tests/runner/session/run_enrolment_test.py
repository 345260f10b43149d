"""palpate run from outside: whose session it is, and which protocol goes on.

Usage: run_enrolment_test.py PALPATE
"""

import csv
import json
import os
import pathlib
import subprocess
import time
import unittest
import unittest.mock

from live_case import FEELING, PALPATE, PROTOCOL, Live


class Enrolment(Live):
    def test_a_number_is_taken_when_the_first_trial_begins(self):
        with self.run_session(code="P01") as terminal:
            terminal.wait_for("participant P01 has number 1", "[space bar: go on]")
            terminal.wait_for("[space bar: go on]")
            terminal.type(":quit\n")
            self.finish(terminal)
            self.assertIn("participant P01 (not enrolled), session 1: 0 of 4 trials on record", terminal.text)
        self.assertEqual(self.codes(self.db), [])
        self.assertEqual(self.sql("SELECT count(*) FROM protocols"), [(0,)])
        terminal = self.begin(code="P02")
        self.assertEqual(self.codes(self.db), ["P02"])
        terminal.type(":quit\n")
        self.finish(terminal)
        self.assertIn("participant P02 (number 1)", terminal.text)

    def test_a_note_before_the_first_trial_survives_a_kill(self):
        with self.run_session() as terminal:
            terminal.wait_for("[space bar: go on]")
            terminal.type(":note wears a ring\n")
            terminal.wait_for("note: wears a ring")
            terminal.kill()
        self.assertEqual(self.codes(self.db), ["P01"])
        self.assertEqual(self.notes(), ["wears a ring"])
        terminal = self.begin(sure=False)
        terminal.type(":quit\n")
        self.finish(terminal)
        self.assertEqual(self.notes()[0], "wears a ring")

    def test_a_withdrawal_before_the_first_trial_is_recorded(self):
        with self.run_session() as terminal:
            terminal.wait_for("[space bar: go on]")
            terminal.type(":quit withdrawn\n")
            self.finish(terminal)
        self.assertEqual(self.ends(), ["withdrawn"])
        with self.run_session() as refused:
            self.assertEqual(refused.finish(), 2)
            self.assertRegex(refused.text, r"P01 has withdrawn \(today \d\d:\d\d\) and cannot resume")

    def test_a_failure_before_the_first_trial_enrols_no_participant(self):
        without_display = {name: value for name, value in os.environ.items() if "DISPLAY" not in name}
        done = subprocess.run([PALPATE, "run", self.protocol(), "--db", self.db, "--participant", "P01", "--device",
                               "mouse"], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60,
                              env=without_display)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(self.run_piped(code="P02").returncode, 1)
        self.assertEqual(self.codes(self.db), [])

    def test_an_unknown_code_must_be_confirmed(self):
        with self.run_session(sure=False) as terminal:
            terminal.wait_for("holds no participants yet", "Is P01 a new participant? [y/N]")
            terminal.type("y\n")
            self.finish(terminal)
        with self.run_session(code="PO1", sure=False) as terminal:
            terminal.wait_for("P01 is there: a typing error?")
            terminal.wait_for("Is PO1 a new participant? [y/N]")
            terminal.type("\n")
            self.assertEqual(terminal.finish(), 2)
            self.assertIn("no participant was enrolled", terminal.text)
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

    def test_a_script_accepts_new_codes_unless_similar_to_known_ones(self):
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

    def test_a_code_can_be_read_from_standard_input(self):
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

    def test_a_clock_years_behind_is_reported_and_recorded(self):
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
        """Texts shown in every run; None: the participant's own protocol."""
        return [text and json.loads(text)["texts"]["break"] for (text,) in self.sql(
            "SELECT p.text FROM runs r LEFT JOIN protocols p ON p.id = r.protocol_id ORDER BY r.id")]

    def test_the_stored_protocol_is_kept_unless_requested_otherwise(self):
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

    def test_new_texts_can_be_chosen_if_only_texts_differ(self):
        with self.run_session(code="K1", **self.TEXTS) as terminal:
            terminal.wait_for("which? ")
            terminal.type("t\n")
            terminal.wait_for("[space bar: go on]")
            terminal.type(" ")
            terminal.wait_for(FEELING)
            terminal.type(":stop\n1")
            self.finish(terminal)
            self.assertIn("2 of 4 trials on record", terminal.text)
        with self.run_session(code="K1", **self.TEXTS) as terminal:  # that question was answered before
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

    def test_another_order_does_not_count_as_new_texts(self):
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

    def test_a_participant_can_begin_anew_under_a_new_code(self):
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

    def test_a_script_keeps_the_stored_protocol_and_is_informed(self):
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

        self.assertIn("resuming with the stored protocol. --changed-protocol texts shows", piped())
        self.assertIn("resuming with the new texts", piped("--changed-protocol", "texts"))
        self.assertIn("resuming with the stored protocol\n", piped("--changed-protocol", "stored"))
        self.assertEqual(self.shown_texts(), [None, None, "sit down", None])
        self.assertEqual(self.codes(self.db), ["K1"])

    def test_a_change_of_layout_asks_no_question(self):
        path = self.protocol()
        path.write_text(json.dumps(PROTOCOL, indent=3, sort_keys=True))
        with unittest.mock.patch.object(self, "protocol", lambda **_: path):
            with self.run_session(code="K1") as terminal:
                terminal.wait_for("(only its layout); resuming with the stored protocol")
                self.finish(terminal)
        self.assertEqual(self.codes(self.db), ["K1"])

    def test_new_participants_with_new_texts_get_the_next_number(self):
        terminal = self.begin(code="K2", **self.TEXTS)
        self.assertIn("participant K2 has number 2; session 1 of 1", terminal.text)
        self.assertIn("with another text of this protocol (only texts: /texts/break); if only texts differ, participant numbers continue", terminal.text)
        terminal.type(":quit\n")
        self.finish(terminal)
        done = self.run_piped("--number", "1", code="K3", **self.TEXTS)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"--number: 1 is taken by participant K1", done.stderr)
        done = self.run_piped(code="K3", **self.DESIGN)
        self.assertIn(b"participant K3 has number 1", done.stdout)
        self.assertIn(b"(stimuli and order: /seed; texts: /texts/break)", done.stderr)


if __name__ == "__main__":
    unittest.main()
