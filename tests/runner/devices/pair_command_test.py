"""Two devices that are not there as the ends of one stylus: registered, listed, and a session in which one is lost.

Usage: pair_command_test.py PALPATE forcedimension2 STUB_LIBRARY
       pair_command_test.py PALPATE touch2 STUB_LIBRARY
       pair_command_test.py PALPATE inverse3x2 EMULATED_INVERSE_SERVICE
"""

import contextlib
import json
import os
import pathlib
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

PALPATE, KIND, MAKERS = sys.argv[1:4]
PATIENCE = 120  # s; only a hang reaches it
LENGTH = 0.12  # m, of the stylus
PROTOCOL = {
    "version": 1, "name": "touch", "renderers": ["ray"], "seed": 3, "servo": {"rate_hz": 100},
    "material": {"stiffness_n_per_m": 50},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "repetitions": 1, "home": {"rest_s": 0.1, "margin_m": 0.005},
    "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 600},
}


def in_tail_frame(at):
    """The tail's device faces the tip's: half a turn about z, 0.2 m nearer to the user."""
    return -at[0], -(at[1] + 0.2), at[2]


class StubEnds:
    serials = ("4711", "4712")
    options = ("--library", MAKERS)

    def __init__(self, folder):
        path = folder / "stub"
        self.environment = {"PALPATE_STUB_STATE": str(path)}
        self._state = StubState(path, 2)
        for end in (0, 1):
            self._state.set(end, serial=4711 + end, model=1, hand_stiffness=400, connected=1, power=1)

    def hand(self, end, x, y, z):
        if KIND == "touch2":  # x right, y up, z to the user
            self._state.set(end, hand_x=x, hand_y=z, hand_z=-y)
        else:  # x to the user, y right
            self._state.set(end, hand_x=-y, hand_y=x, hand_z=z)

    def plug(self, end, there):
        self._state.set(end, connected=int(there))

    def pushes(self, end):
        return self._state.force(end) > 0.005

    def close(self):
        self._state.close()


class Inverse3Ends:
    serials = ("049D", "04A1")
    environment = {}

    def __init__(self, _folder):
        self._process = subprocess.Popen([MAKERS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.options = ("--service", self._process.stdout.readline().split()[1])
        self.plug(1, True)

    def _tell(self, end, line):
        self._process.stdin.write(("second " if end else "") + line + "\n")
        self._process.stdin.flush()

    def hand(self, end, x, y, z):
        self._tell(end, f"hand {x} {y} {z}")

    def plug(self, end, there):
        self._tell(end, f"set present {int(there)}")

    def pushes(self, end):
        self._tell(end, "state")
        return max(map(abs, json.loads(self._process.stdout.readline())["force_n"])) > 0.005

    def close(self):
        self._process.stdin.close()
        self._process.wait(PATIENCE)
        self._process.stdout.close()


class Pair(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.database = self.folder / "study.db"
        self.calibration = self.folder / "lab.json"
        (self.folder / "protocol.json").write_text(json.dumps(PROTOCOL))
        self.ends = (Inverse3Ends if KIND == "inverse3x2" else StubEnds)(self.folder)
        self.addCleanup(self.ends.close)
        change = unittest.mock.patch.dict(os.environ, self.ends.environment)
        change.start()
        self.addCleanup(change.stop)
        self.options = ["--device", KIND, *self.ends.options, "--serial", self.ends.serials[0], "--serial",
                        self.ends.serials[1], "--calibration", self.calibration]
        self.at = [(0, 0, 0), (0, 0, 0)]  # of both ends, in the tip's frame

    def move(self, tip, tail):
        """As hands do: slowly, and in small steps."""
        begin = list(self.at)
        self.at = [tip, tail]
        steps = 1 + int(max(abs(b - a) for old, new in zip(begin, self.at) for a, b in zip(old, new)) / 0.0005)
        for step in range(1, steps + 1):
            now = [tuple(a + (b - a) * step / steps for a, b in zip(old, new)) for old, new in zip(begin, self.at)]
            self.ends.hand(0, *now[0])
            self.ends.hand(1, *in_tail_frame(now[1]))
            time.sleep(0.001)

    def hold(self, x):
        """The stylus points away from the user."""
        self.move((x, 0.06, 0), (x, 0.06 - LENGTH, 0))

    def wait(self, holds):
        end = time.monotonic() + PATIENCE
        while not holds():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.005)

    def terminal(self, *arguments):
        terminal = Terminal([PALPATE, *arguments], patience=PATIENCE)
        self.addCleanup(terminal.__exit__)
        return terminal

    def pushed(self):
        return [self.ends.pushes(end) for end in (0, 1)]

    def take_points(self):
        """False: a busy machine kept a device silent."""
        self.move((0, 0, 0), (0, 0, 0))
        terminal = self.terminal("devices", "--calibrate", *self.options, "--points", 4)
        for point in ((0, 0, 0), (0.03, 0, 0), (0, 0.03, 0), (0, 0, 0.03)):
            if terminal.wait_for("press ENTER", "gives no answer") != "press ENTER":
                return False
            self.move(point, point)
            terminal.type("\n")
        return terminal.wait_for("mm over 4 points", "gives no answer") != "gives no answer"

    def register(self):
        while not self.take_points():
            pass
        pair = json.loads(self.calibration.read_text())["pairs"][0]
        self.assertEqual((pair["tip_serial"], pair["tail_serial"]), self.ends.serials)
        for found, true in zip(pair["tail_position_m"], (0, -0.2, 0)):
            self.assertAlmostEqual(found, true, places=4)
        self.assertAlmostEqual(abs(pair["tail_orientation_wxyz"][3]), 1, places=4)

    def lose(self, end, terminal):
        self.ends.plug(end, False)
        terminal.wait_for("the device is unplugged")
        self.wait(lambda: not self.ends.pushes(1 - end))  # the other one receives none
        self.ends.plug(end, True)
        terminal.type(":clear\n:go\n")

    def lose_each_end_once_in_contact_and_answer_all(self, terminal):
        lost = 0
        for _ in terminal.trials(lambda: self.hold(0.04)):
            self.hold(0.012)
            before = terminal.hear().count("[fault, ")
            self.wait(lambda: all(self.pushed()) or terminal.hear().count("[fault, ") > before)
            if lost < 2 and all(self.pushed()):
                self.lose(lost, terminal)
                lost += 1
            else:
                terminal.type("1")
        self.assertEqual(terminal.finish(), 0, terminal.text)

    def test_a_session_in_which_one_end_is_lost(self):
        run = ["run", self.folder / "protocol.json", "--db", self.database, "--participant", "P01", "--new-participant",
               "--no-window", *self.options]
        refused = subprocess.run([PALPATE, *map(str, run)], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(refused.returncode, 2)
        self.assertIn(f"palpate devices --calibrate --device {KIND}", refused.stderr)
        self.register()
        self.hold(0.04)
        terminal = self.terminal(*run)
        while True:
            came = terminal.wait_for("(':go': push)", "felt?", "move the stylus")
            terminal.type(":go\n")
            if came == "move the stylus":
                break
        self.lose_each_end_once_in_contact_and_answer_all(terminal)
        with contextlib.closing(sqlite3.connect(self.database)) as db:
            rows = db.execute("SELECT state, count(*) FROM attempts GROUP BY state").fetchall()
            self.assertEqual(dict(rows)["completed"], 2)
            self.assertGreaterEqual(dict(rows)["cut_off"], 2)
            self.assertIn("registration of the devices {} (tip) and {} (tail)".format(*self.ends.serials),
                          db.execute("SELECT device_calibration FROM runs").fetchone()[0])
            self.assertEqual(db.execute("SELECT count(*) FROM notes WHERE text LIKE '%torque%'").fetchone(), (0,))
        self.assertFalse(any(self.pushed()))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:])
