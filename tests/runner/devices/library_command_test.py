"""palpate with an emulated device behind a maker's library: listed, tested, and a whole session with its faults.

Usage: library_command_test.py PALPATE forcedimension|touch STUB_LIBRARY
"""

import contextlib
import json
import os
import pathlib
import re
import sqlite3
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "session"))
from stub_state import StubState  # noqa: E402
from terminal import Terminal  # noqa: E402

PALPATE, KIND, STUB = sys.argv[1:4]
PATIENCE = 120  # s; only a hang reaches it
PROTOCOL = {
    "version": 1, "name": "touch", "renderers": ["ray"], "torque": "left_out", "seed": 3, "samples": True,
    "servo": {"rate_hz": 100}, "material": {"stiffness_n_per_m": 50},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "repetitions": 1, "home": {"rest_s": 0.1, "margin_m": 0.005},
    "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 600},
}


EXPECTED = {
    "forcedimension": {"right": "y", "limits": "up to 12 N, 5000 N/m", "calibration": "maker's: omega.6"},
    "touch": {"right": "x", "limits": "up to 3.3 N, 500 N/m", "calibration": "maker's: Touch"},
}[KIND]


class Stub(StubState):
    def __init__(self, path):
        super().__init__(path)
        self.set(serial=4711, model=0, hand_stiffness=400, connected=1, power=1)

    def hand_to_the_right(self, metres):
        self.set(**{"hand_" + EXPECTED["right"]: metres})

    def force_to_the_right(self):
        return self.get("force_" + EXPECTED["right"])


class DeviceBehindALibrary(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.database = self.folder / "study.db"
        (self.folder / "protocol.json").write_text(json.dumps(PROTOCOL))
        self.stub = Stub(self.folder / "stub")
        self.addCleanup(self.stub.close)
        self.environment = {**os.environ, "PALPATE_STUB_STATE": str(self.folder / "stub")}

    def palpate(self, *arguments):
        return subprocess.run([PALPATE, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE,
                              env=self.environment)

    def run_session(self, *options):
        with unittest.mock.patch.dict(os.environ, self.environment):
            terminal = Terminal([PALPATE, "run", self.folder / "protocol.json", "--db", self.database,
                                 "--participant", "P01", "--device", KIND, "--library", STUB,
                                 "--no-window", *options], patience=PATIENCE)
        self.addCleanup(terminal.__exit__)
        return terminal

    def wait(self, holds):
        end = time.monotonic() + PATIENCE
        while not holds():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.005)

    def rows(self, query):
        with contextlib.closing(sqlite3.connect(self.database)) as db:
            return db.execute(query).fetchall()

    def test_it_is_listed_and_tested_with_zero_force(self):
        found = self.palpate("devices", "--device", KIND, "--library", STUB, "--json",
                             self.folder / "found.json")
        lost = re.search(r"readings arrive: (\d+) of 1000 readings were lost", found.stdout)
        self.assertTrue(lost, found.stdout + found.stderr)
        self.assertLess(int(lost[1]), 500)  # a busy machine holds the guard process up
        self.assertIn("4711", found.stdout)
        self.assertIn("senses 5 degrees of freedom, drives 3; " + EXPECTED["limits"], found.stdout)
        self.assertIn(EXPECTED["calibration"], found.stdout)
        limits = json.loads((self.folder / "found.json").read_text())["devices"][0]["limits"]
        self.assertEqual((limits["sensed_freedom"], limits["actuated_freedom"]), (5, 3))
        self.assertEqual(self.stub.get("open"), 0, "it is let go")
        missing = self.palpate("devices", "--device", KIND, "--library", self.folder / "none.so")
        self.assertEqual(missing.returncode, 1)
        self.assertIn("--library", missing.stdout + missing.stderr)

    def calibrate(self, said):
        return subprocess.run([PALPATE, "devices", "--calibrate", "--device", KIND, "--library", STUB], input=said,
                              capture_output=True, text=True, timeout=PATIENCE, env=self.environment)

    @unittest.skipUnless(KIND == "forcedimension", "it cannot move its arm by itself")
    def test_it_moves_its_arm_to_calibrate_only_after_yes(self):
        self.stub.set(reset=1)
        for said in ("", "no\n", "y\n"):
            refused = self.calibrate(said)
            self.assertEqual((refused.returncode, self.stub.get("moved")), (1, 0), refused.stderr)
            self.assertIn("Nothing was moved", refused.stderr)
        done = self.calibrate("yes\n")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("omega.6, serial number 4711: is calibrated", done.stdout)
        self.assertEqual((self.stub.get("moved"), self.stub.get("reset"), self.stub.force()), (1, 0, 0))
        self.assertIn("already", self.calibrate("yes\n").stdout)
        self.assertEqual((self.stub.get("moved"), self.stub.get("open")), (1, 0))

    @unittest.skipUnless(KIND == "forcedimension", "it cannot move its arm by itself")
    def test_ending_the_program_ends_the_movement(self):
        self.stub.set(reset=1, delay=PATIENCE)
        program = subprocess.Popen([PALPATE, "devices", "--calibrate", "--device", KIND, "--library", STUB],
                                   stdin=subprocess.PIPE, text=True, env=self.environment)
        self.addCleanup(lambda: (program.kill(), program.communicate()))
        program.stdin.write("yes\n")
        program.stdin.flush()
        self.wait(lambda: self.stub.get("moved") > 0)
        self.assertEqual(self.stub.get("watchdog"), 200, "25 ms after the last command the firmware ends forces")
        mover, = subprocess.run(["pgrep", "-P", str(program.pid)], capture_output=True, text=True).stdout.split()
        program.kill()
        program.wait()
        self.wait(lambda: not pathlib.Path(f"/proc/{mover}").exists())

    def test_a_protocol_that_needs_torque_is_refused(self):
        required = {key: value for key, value in PROTOCOL.items() if key != "torque"}
        (self.folder / "protocol.json").write_text(json.dumps(required))
        terminal = self.run_session("--new-participant")
        self.assertEqual(terminal.finish(), 2, terminal.text)
        self.assertIn("/torque", terminal.text)
        self.assertFalse(self.database.exists())

    def begin(self):
        """A session after its pre-flight, which begins with the device in its calibration pit."""
        self.stub.set(reset=1)
        terminal = self.run_session("--new-participant")
        terminal.wait_for("calibration pit")
        self.assertEqual(self.stub.force(), 0)
        self.stub.set(reset=0)
        terminal.wait_for("(':go': push)")
        while True:  # on a busy machine the guard ends the push
            terminal.type(":go\n")
            self.wait(lambda: self.stub.force_to_the_right() > 0.5)
            self.assertEqual(self.stub.force(), self.stub.force_to_the_right())
            self.assertLessEqual(self.stub.force(), 1 + 1e-9, "one push, not two")
            if terminal.wait_for("was a weak push to the right felt?", "the force direction check failed").startswith(
                    "was"):
                break
        terminal.type(":go\n")
        terminal.wait_for("move the stylus")
        terminal.type(":go\n")
        return terminal

    def unplug_once_in_contact_and_answer_all(self, terminal):
        cut_off = False
        # The home zone is to the right; the stylus points away from the user.
        for _ in terminal.trials(lambda: self.stub.hand_to_the_right(0.04)):
            self.stub.hand_to_the_right(0.012)
            self.wait(lambda: self.stub.force() > 0.01 or terminal.text.count("[fault, "))
            if not cut_off and self.stub.force() > 0.01:
                self.stub.set(connected=0)
                terminal.wait_for("[fault, ")
                self.wait(lambda: "unplugged" in terminal.text)
                self.stub.set(connected=1)
                cut_off = True
                terminal.type(":clear\n:go\n")
                continue
            terminal.type("1")
        self.assertEqual(terminal.finish(), 0, terminal.text)

    def test_a_session_with_faults_is_complete_in_the_end(self):
        self.unplug_once_in_contact_and_answer_all(self.begin())
        self.assertEqual(self.rows("SELECT count(*) FROM attempts WHERE state = 'completed'"), [(2,)])
        self.assertGreaterEqual(self.rows("SELECT count(*) FROM attempts WHERE state <> 'completed'")[0][0], 1)
        notes = [text for (text,) in self.rows("SELECT text FROM notes")]
        self.assertIn('{"torque":"left out"}', notes)
        self.assertIn(EXPECTED["calibration"], self.rows("SELECT device_calibration FROM runs")[0][0])
        self.assertEqual(self.stub.get("open"), 0)
        self.assertEqual(self.stub.force(), 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:])
