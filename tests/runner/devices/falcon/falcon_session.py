"""A session of palpate run with an emulated Falcon, for tests: EMULATED_FALCONS and PALPATE are the first arguments."""

import contextlib
import datetime
import json
import pathlib
import sqlite3
import sys
import tempfile
import time
import unittest

from emulator_control import EmulatorControl

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "session"))
from terminal import Terminal  # noqa: E402
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "shared"))
from sealed_json import sealed  # noqa: E402

EMULATED, PALPATE = sys.argv[1:3]
PATIENCE = 120  # s; only a hang reaches it

PROTOCOL = {
    "version": 1, "name": "touch", "renderers": ["point"], "seed": 3,
    "servo": {"rate_hz": 100}, "material": {"stiffness_n_per_m": 100},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "repetitions": 1, "home": {"rest_s": 0.1, "margin_m": 0.005},
    "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 600},
}
AWAY = (0.036, 0, 0)  # m, in the home zone of every stimulus


class FalconSession(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.database = self.folder / "study.db"
        (self.folder / "protocol.json").write_text(json.dumps(PROTOCOL))
        self.control = EmulatorControl(self.folder, PATIENCE)
        self.addCleanup(self.control.close)

    def calibration(self, days_ago, serial="EMU1", counts=-10000):
        made = datetime.datetime.now(datetime.timezone.utc) - datetime.timedelta(days=days_ago)
        path = self.folder / "lab.json"
        path.write_text(json.dumps({"version": 1, "forces": [
            sealed({"serial": serial, "counts_per_newton_metre": counts, "weights_kg": [0.1],
                    "made_utc": made.strftime("%Y-%m-%dT%H:%M:%SZ")})]}))
        return path

    def run_session(self, *options, emulator=()):
        new = [] if self.participants() else ["--new-participant"]
        terminal = Terminal([EMULATED, *emulator, "--control", self.control.fifo, PALPATE, "run",
                             self.folder / "protocol.json", "--db", self.database, "--participant", "P01",
                             "--device", "falcon", "--no-window", *new, *options], patience=PATIENCE)
        self.addCleanup(terminal.__exit__)
        return terminal

    def hand(self, x, y, z):
        """Moves the hand with the grip: m from the centre, in the Falcon's own frame."""
        self.control.tell(f"hand 1 {x} {y} {0.125 + z} 400 10")

    def state(self):
        return self.control.states()[0]

    def press(self, bit):
        """Down and up, each for many ticks."""
        for bits in (bit, 0):
            self.control.tell(f"buttons 1 {bits}")
            time.sleep(0.3)

    def pushed_and_felt(self, terminal):
        """Requests the push until it was complete: on a busy machine the guard ends it."""
        self.hand(0, 0, 0)
        self.control.wait_until(lambda: abs(self.state()["position_m"][0]) < 0.001)
        while True:
            self.assertTrue(self.state()["torque_is_zero"], "no force before somebody says so")
            terminal.type(":go\n")
            farthest, torque = 0, False
            end = time.monotonic() + PATIENCE
            while True:
                state = self.state()
                farthest = max(farthest, state["position_m"][0])
                torque = torque or not state["torque_is_zero"]
                if torque and state["torque_is_zero"]:
                    break
                self.assertLess(time.monotonic(), end, "no push came\n" + terminal.text)
            came = terminal.wait_for("was a weak push to the right felt?", "the force direction check failed")
            if came.startswith("was"):
                return farthest
            terminal.wait_for("(':go': push)")

    def participants(self):
        if not self.database.exists():
            return []
        with contextlib.closing(sqlite3.connect(self.database)) as db:
            return db.execute("SELECT code FROM participants").fetchall()

    def notes(self):
        with contextlib.closing(sqlite3.connect(self.database)) as db:
            return [text for (text,) in db.execute("SELECT text FROM notes ORDER BY id")]
