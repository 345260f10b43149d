"""palpate run with an emulated Falcon: what is asked and checked before the first trial, and refused.

Usage: preflight_command_test.py EMULATED_FALCONS PALPATE
"""

import contextlib
import json
import re
import sqlite3
import subprocess
import sys
import time
import unittest

from falcon_session import AWAY, FalconSession


class Preflight(FalconSession):
    def home(self, terminal):
        """Up to the offer of a push; forces are limited to the lesser of 6 N and the device's own limit."""
        terminal.wait_for("home the device: pull the grip fully out")
        self.assertFalse(self.state()["torque_before_homing"])
        self.control.tell("shake 1 0.035")
        terminal.wait_for("limits: forces of up to ")
        limits = re.search(r"up to ([\d.]+) N at the grip \(the device's own limit: ([\d.]+) N\)", terminal.text)
        terminal.wait_for("(':go': push)")
        limits = limits or re.search(r"up to ([\d.]+) N at the grip \(the device's own limit: ([\d.]+) N\)",
                                     terminal.text)
        self.assertEqual(float(limits[1]), min(6.0, float(limits[2])))

    def reach_every_side(self):
        for place in ((-0.03, 0, 0), (0.03, 0, 0), (0, -0.03, 0), (0, 0.03, 0), (0, 0, -0.03), (0, 0, 0.03)):
            self.hand(*place)
            self.control.wait_until(lambda: all(abs(is_at - wanted) < 0.002 for is_at, wanted in zip(
                self.state()["position_m"], (place[0], place[1], 0.125 + place[2]))))
            time.sleep(0.1)  # some ticks

    def answer_by_button_2(self, terminal):
        while True:
            came = terminal.wait_for("[space bar: go on]", "[trial, ", "[fault, ", "[paused, ", "on record; ",
                                      "press button")
            if came == "on record; ":
                break
            if came in ("[trial, ", "press button"):
                self.press(2)
            else:
                terminal.type(":clear\n:go\n" if came in ("[fault, ", "[paused, ") else " ")
        self.assertEqual(terminal.finish(), 0, terminal.text)

    def test_from_homing_to_the_first_answer(self):
        terminal = self.run_session("--calibration", self.calibration(1), "--buttons", emulator=["--unhomed"])
        self.home(terminal)
        farthest = self.pushed_and_felt(terminal)
        # 1 N against 400 N/m; the scale of force is the emulator's own.
        self.assertAlmostEqual(farthest, 0.0025, delta=0.0015)
        terminal.type(":go\n")
        terminal.wait_for("move the stylus 26 mm from the centre")
        terminal.type("\x1b")
        terminal.wait_for("EMERGENCY by the key Escape: forces are off until the fault is cleared")
        terminal.wait_for("orces are off: zero force was asked for by the key Escape; next: ':clear'")
        terminal.type(":go\n")  # it has no effect before the fault is cleared
        self.reach_every_side()
        terminal.type(":clear\n")
        terminal.wait_for("press button 1 of the device")
        self.hand(*AWAY)
        self.press(1)
        self.press(2)
        self.answer_by_button_2(terminal)
        found = next(note for note in self.notes() if note.startswith("pre-flight: "))
        for part in ("device homed", "a push of 1.0 N to the right was felt; limits: forces of up to",
                     "range of 26 mm to each side", "buttons 1 to 2 work", "EMERGENCY by the key Escape",
                     "calibration stored"):
            self.assertIn(part, found)
        with contextlib.closing(sqlite3.connect(self.database)) as db:
            (calibration,) = db.execute("SELECT device_calibration FROM runs").fetchone()
            self.assertEqual(db.execute("SELECT DISTINCT response FROM attempts WHERE state = 'completed'").fetchall(),
                             [("box",)])
        self.assertIn("EMU1", calibration)
        self.assertIn("1 days ago", calibration)

    def test_a_push_that_is_not_confirmed_ends_the_session_unrecorded(self):
        terminal = self.run_session("--calibration", self.calibration(0))
        terminal.wait_for("(':go': push)")
        self.pushed_and_felt(terminal)
        terminal.type(":quit\n")
        self.assertEqual(terminal.finish(), 0, terminal.text)
        self.assertIn("ended by the experimenter", terminal.text)
        self.assertEqual(self.notes(), [])

    def ends(self):
        with contextlib.closing(sqlite3.connect(self.database)) as db:
            return db.execute("SELECT end_reason FROM runs ORDER BY id").fetchall()

    def test_a_withdrawal_in_the_pre_flight_is_recorded_with_its_notes(self):
        terminal = self.run_session("--calibration", self.calibration(0))
        terminal.wait_for("(':go': push)")
        terminal.type(":note the grip is cold\n")
        terminal.wait_for("note: the grip is cold")
        terminal.type(":quit WITHDRAWN, is cold\n")
        self.assertEqual(terminal.finish(), 0, terminal.text)
        self.assertIn("0 of 2 trials on record; withdrawn", terminal.text)
        self.assertEqual(self.ends(), [("withdrawn",)])
        self.assertEqual(self.notes(), ["the grip is cold", "ended: the participant withdrew: WITHDRAWN, is cold"])
        refused = self.run_session("--calibration", self.calibration(0))
        self.assertEqual(refused.finish(), 2, refused.text)
        self.assertIn("--after-withdrawal", refused.text)

    def test_ending_in_the_pre_flight_counts_the_recorded_trials(self):
        terminal = self.run_session("--calibration", self.calibration(0))
        terminal.wait_for("(':go': push)")
        self.pushed_and_felt(terminal)
        terminal.type(":note a note\n:go\n")
        terminal.wait_for("move the stylus")
        terminal.type(":go\n")  # left unchecked
        self.hand(*AWAY)
        terminal.wait_for("[homing, ")
        terminal.type(":stop\n")
        while True:
            came = terminal.wait_for("[trial, ", "[fault, ", "[paused, ", "on record; ")
            if came == "on record; ":
                break
            terminal.type("1" if came == "[trial, " else ":clear\n:go\n")
        self.assertEqual(terminal.finish(), 0, terminal.text)
        self.assertIn("a note", self.notes())
        again = self.run_session("--calibration", self.calibration(0))
        again.wait_for("1 of 2 trials done, last run ")
        again.wait_for("(':go': push)")
        again.type(":note another\n:quit\n")
        self.assertEqual(again.finish(), 0, again.text)
        self.assertIn("1 of 2 trials on record; aborted", again.text)
        self.assertIn("another", self.notes())

    def test_a_full_disk_in_contact_leaves_no_force(self):
        disk = self.folder / "disk"
        disk.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=400k", "none", disk], capture_output=True).returncode:
            self.skipTest("nothing can be mounted here")
        self.addCleanup(subprocess.run, ["umount", "-l", disk], check=True)
        self.database = disk / "study.db"
        last = self.folder / "last.json"
        terminal = self.run_session("--calibration", self.calibration(0), emulator=["--last", last])
        terminal.wait_for("(':go': push)")
        self.pushed_and_felt(terminal)
        terminal.type(":go\n")
        terminal.wait_for("move the stylus")
        terminal.type(":go\n")  # left unchecked
        while True:  # on a busy machine the guard ends forces and cuts the trial off
            self.hand(*AWAY)
            came = terminal.wait_for("[trial, ", "[fault, ", "[paused, ")
            if came != "[trial, ":
                terminal.type(":clear\n:go\n")
                continue
            self.hand(0.01, 0, 0)  # within the shape
            self.control.wait_until(lambda: not self.state()["torque_is_zero"] or terminal.text.count("[fault, ") > 0)
            if not self.state()["torque_is_zero"]:
                break
        ballast = disk / "ballast"
        with open(ballast, "wb", buffering=0) as file, contextlib.suppress(OSError):
            while True:
                file.write(bytes(512))
        terminal.type("2")
        terminal.wait_for("disk", "space")
        self.assertEqual(terminal.finish(), 1, terminal.text)
        self.assertTrue(json.loads(last.read_text())[0]["torque_is_zero"])
        ballast.unlink()
        with contextlib.closing(sqlite3.connect(self.database)) as db:
            self.assertEqual(db.execute("PRAGMA integrity_check").fetchone(), ("ok",))
            self.assertEqual(db.execute("SELECT count(*) FROM attempts WHERE state = 'completed'").fetchone(), (0,))

    def test_a_missing_or_stale_calibration_is_refused_unless_allowed(self):
        for options, word in ([(), "is missing"],
                              [("--calibration", self.folder / "none.json"), "is missing"],
                              [("--calibration", self.calibration(1, serial="OTHER")), "is missing"]):
            terminal = self.run_session(*options)
            self.assertEqual(terminal.finish(), 2, terminal.text)
            self.assertIn("the calibration of 'falcon' " + word, terminal.text)
            self.assertIn("--without-calibration", terminal.text)
            self.assertFalse(self.database.exists())
        terminal = self.run_session("--calibration", self.calibration(1, counts=-100000))
        self.assertEqual(terminal.finish(), 2, terminal.text)
        self.assertIn("is implausible: force of the Falcon EMU1", terminal.text)
        self.assertIn("10 times weaker", terminal.text)
        open_to_all = self.calibration(1)
        open_to_all.chmod(0o666)
        terminal = self.run_session("--calibration", open_to_all)
        self.assertEqual(terminal.finish(), 2, terminal.text)
        self.assertIn("chmod go-w", terminal.text)
        open_to_all.unlink()
        stale = self.calibration(91)
        terminal = self.run_session("--calibration", stale)
        self.assertEqual(terminal.finish(), 2, terminal.text)
        self.assertIn("is stale: force of the Falcon EMU1", terminal.text)
        self.assertIn("91 days ago", terminal.text)
        self.assertFalse(self.database.exists())
        for options in (("--calibration", stale), ()):
            terminal = self.run_session("--without-calibration", *options)
            terminal.wait_for("(':go': push)")
            self.pushed_and_felt(terminal)
            terminal.type(":go\n")
            terminal.wait_for("move the stylus")
            terminal.type(":go\n")  # left unchecked
            terminal.wait_for("[homing", "[trial, ")  # only then there is a record
            terminal.type(":quit\n")
            self.assertEqual(terminal.finish(), 0, terminal.text)
        texts = [note for note in self.notes() if note.startswith("pre-flight: ")]
        self.assertEqual(len(texts), 2)
        for text in texts:
            self.assertIn("range NOT checked", text)
            self.assertIn("WITHOUT calibration", text)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
