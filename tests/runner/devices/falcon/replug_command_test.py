"""palpate run with an emulated Falcon that comes and goes: what it is told, and that the session goes on.

Usage: replug_command_test.py EMULATED_FALCONS PALPATE
"""

import contextlib
import json
import sqlite3
import sys
import unittest

from falcon_session import AWAY, FalconSession


class Replug(FalconSession):
    def begin(self):
        """A session after its pre-flight."""
        terminal = self.run_session("--calibration", self.calibration(0), emulator=["--last", self.folder / "last.json"])
        terminal.wait_for("(':go': push)")
        self.pushed_and_felt(terminal)
        terminal.type(":go\n")
        terminal.wait_for("move the stylus")
        terminal.type(":go\n")  # left unchecked
        return terminal

    def go_on(self, terminal):
        terminal.type(":clear\n:go\n")

    def touch(self, terminal):
        """Waits for a force on the grip; on a busy machine the guard may end forces before."""
        while True:
            self.hand(*AWAY)
            if terminal.wait_for("[trial, ", "[fault, ", "[paused, ") != "[trial, ":
                self.go_on(terminal)
                continue
            self.hand(0.01, 0, 0)  # within the shape
            before = terminal.hear().count("was cut off")
            self.control.wait_until(lambda: not self.state()["torque_is_zero"]
                                    or terminal.hear().count("was cut off") > before)
            if not self.state()["torque_is_zero"]:
                return

    def attempts(self):
        with contextlib.closing(sqlite3.connect(self.database)) as db:
            return db.execute("SELECT state, count(*) FROM attempts GROUP BY state").fetchall()

    def test_the_session_survives_ten_disconnections_in_contact(self):
        terminal = self.begin()
        for time in range(10):
            self.touch(terminal)
            self.control.tell("unplug 1")
            terminal.wait_for("forces are off: the device was lost: the device is unplugged: plug it in again")
            terminal.wait_for("[fault, ")
            if time % 3 == 0:  # too early
                terminal.type(":clear\n:go\n")
                terminal.wait_for("not cleared, forces stay off: no Falcon EMU1 is plugged in")
                terminal.wait_for("clear the fault first")
            self.control.tell("plug 1")
            self.go_on(terminal)
            terminal.wait_for("fault cleared")
            terminal.wait_for("going on")
            self.assertTrue(self.state()["torque_is_zero"])
        self.hand(*AWAY)
        while True:
            came = terminal.wait_for("[trial, ", "[fault, ", "[paused, ", "on record; ")
            if came == "on record; ":
                break
            terminal.type("1" if came == "[trial, " else ":clear\n:go\n")
        self.assertEqual(terminal.finish(), 0, terminal.text)
        self.assertIn("2 of 2 trials on record; done", terminal.text)
        counts = dict(self.attempts())
        self.assertEqual(counts["completed"], 2)
        self.assertGreaterEqual(counts["cut_off"], 10)
        self.assertTrue(json.loads((self.folder / "last.json").read_text())[0]["torque_is_zero"])

    def test_a_lost_homing_can_be_cleared_only_after_homing(self):
        terminal = self.begin()
        self.touch(terminal)
        self.control.tell("lose_homing 1")
        terminal.wait_for("the device has lost its homing")
        terminal.wait_for("[fault, ")
        terminal.type(":clear\n")
        terminal.wait_for("not cleared, forces stay off: the device has lost its homing: pull the grip fully out")
        self.control.tell("shake 1 0.035")
        self.control.wait_until(lambda: self.state()["homed"] == 7)
        self.hand(*AWAY)
        terminal.type(":clear\n")
        terminal.wait_for("fault cleared")
        terminal.type(":quit\n")
        self.assertEqual(terminal.finish(), 0, terminal.text)

    def test_unplugged_in_the_pre_flight(self):
        terminal = self.run_session("--calibration", self.calibration(0))
        terminal.wait_for("(':go': push)")
        self.control.tell("unplug 1")
        terminal.wait_for("the device is unplugged: plug it in again; after that ':clear'")
        self.control.tell("plug 1")
        terminal.type(":clear\n")
        terminal.wait_for("(':go': push)")
        self.pushed_and_felt(terminal)
        terminal.type(":quit\n")
        self.assertEqual(terminal.finish(), 0, terminal.text)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
