"""palpate serve with an emulated Falcon in contact: what becomes of the force when the program is killed, stops, or
everything is asked to end.

Usage: falcon_serve_test.py EMULATED_FALCONS PALPATE CLIENT.py
"""

import datetime
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "devices" / "falcon"))
EMULATED = sys.argv.pop(1)
PALPATE, CLIENT = sys.argv[1:3]
sys.argv.insert(2, str(pathlib.Path(__file__).resolve().parents[3] / "protocols"))
from emulator_control import EmulatorControl  # noqa: E402
from serve_case import PATIENCE, ServeCase, ServeError  # noqa: E402

RATE = 100  # Hz, that a busy machine keeps
TICK_NS = 1_000_000_000 // RATE
BALL = {"objects": [{"shape": "sphere", "radius_m": 0.02, "subdivisions": 2, "stiffness_n_per_m": 100}]}
# Holds the forces on, in a process of its own, until something is done to it.
PROGRAM = """
import sys, time
sys.path.insert(0, {folder!r})
from client import Client, ServeError
hand = Client({url!r}, {token!r}, time_out=100)
while True:
    try:
        hand.start(renderer="point")
        print("on", flush=True)
        hand.wait_for("forces_off", 1000)
    except ServeError:
        pass
    try:
        hand.stop()
        hand.clear()
    except ServeError as error:  # the guard of a starved machine is late
        if error.code == "closed":
            raise
        time.sleep(0.2)
"""


class Falcon(ServeCase):
    def setUp(self):
        super().setUp()
        self.scene.write_text(json.dumps(BALL))
        self.control = EmulatorControl(self.dir, PATIENCE)
        self.addCleanup(self.control.close)
        made = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
        calibration = self.dir / "lab.json"
        calibration.write_text(json.dumps({"version": 1, "forces": [
            {"serial": "EMU1", "counts_per_newton_metre": -10000, "weights_kg": [0.1], "made_utc": made}]}))
        self.last = self.dir / "last.json"
        self.server = self.run_server([EMULATED, "--last", self.last, "--control", self.control.fifo, PALPATE, "serve",
                                       "--device", "falcon", "--scene", self.scene, "--rate", RATE, "--calibration", calibration])
        # First of all: what killed the bus alone would leave the server, and its pipes, behind.
        self.addCleanup(lambda: [os.kill(pid, signal.SIGKILL) for pid in self.children(self.server.pid)])
        self.eye = self.client(role="watch")
        self.eye.subscribe(RATE, ("force", "faults"))

    @staticmethod
    def children(pid):
        said = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True).stdout
        return [int(word) for word in said.split()]

    def hand_at(self, x, y, z):
        self.control.tell(f"hand 1 {x} {y} {0.125 + z} 400 10")

    def torque(self):
        return not self.control.states()[0]["torque_is_zero"]

    def program_in_contact(self):
        """Another process whose scene pushes at the hand."""
        self.hand_at(0.03, 0, 0)
        program = subprocess.Popen([sys.executable, "-c", PROGRAM.format(
            folder=str(pathlib.Path(CLIENT).parent), **{k: self.said[k] for k in ("url", "token")})],
            stdout=subprocess.PIPE, text=True)
        self.addCleanup(lambda: (program.kill(), program.communicate()))
        self.assertEqual(program.stdout.readline(), "on\n")
        # Forces that went off on a starved machine begin anew with the hand in the ball, which then gives none.
        end = time.monotonic() + PATIENCE
        while not self.torque():
            self.assertLess(time.monotonic(), end, "nothing was felt")
            self.hand_at(0.03, 0, 0)
            time.sleep(0.3)
            self.hand_at(0.012, 0, 0)  # in the ball
            time.sleep(0.3)
        time.sleep(0.4)  # until the ramp is over
        return program

    def rows(self):
        time.sleep(0.2)
        got = self.eye.samples()
        return got["t_ns"], abs(got["force"]).max(axis=1)


    def attempt(self, act, event):
        """\\return the event, and the times and forces around it, once forces were on when it came."""
        while True:
            program = self.program_in_contact()
            self.eye.events()
            self.eye.samples()
            act(program)
            said = self.eye.wait_for(event, PATIENCE)
            times, force = self.rows()
            before = force[times < said["t_ns"]]
            if len(before) and before[-1] > 0.1:
                return program, said, times, force
            program.kill()  # the guard of a starved machine had taken them off
            program.wait()
            with self.client() as hand:
                hand.stop()
                hand.clear()

    def test_killed_in_contact_the_force_is_zero_within_two_ticks(self):
        killed_ns = []

        def kill(program):
            killed_ns.append(time.monotonic_ns())
            program.kill()
        _, gone, times, force = self.attempt(kill, "controller_gone")
        ticks = (times[times > gone["t_ns"]] - gone["t_ns"]) / TICK_NS
        felt = force[times > gone["t_ns"]]
        print(f"killed: the server knew after {(gone['t_ns'] - killed_ns[-1]) / 1e6:.1f} ms, forces {felt[:3]} N at ticks {ticks[:3]}",
              file=sys.stderr)
        self.assertFalse(felt[2:].any(), felt[:10])
        self.assertFalse(self.torque())
        self.refuses_until_cleared()

    def test_stopped_in_contact_the_force_ramps_to_zero(self):
        stopped_ns = []

        def stop(program):
            stopped_ns.append(time.monotonic_ns())
            os.kill(program.pid, signal.SIGSTOP)
        program, silent, times, force = self.attempt(stop, "client_silent")
        off = self.eye.wait_for("forces_off", PATIENCE)
        self.assertEqual(off["reason"], "the client was silent")
        more_times, more = self.rows()
        times = [*times, *more_times]
        force = [*force, *more]
        waited = (silent["t_ns"] - silent["since_ns"]) / 1e9
        ramp = [(t, f) for t, f in zip(times, force) if silent["t_ns"] < t < off["t_ns"]]
        took = (off["t_ns"] - silent["t_ns"]) / 1e9
        print(f"stopped: silent after {waited:.3f} s, zero {took:.3f} s later, {len(ramp)} ticks of ramp", file=sys.stderr)
        self.assertGreaterEqual(waited, 0.5)
        self.assertGreaterEqual(took, 0.15)  # not at once
        self.assertTrue(all(b <= a + 0.02 for (_, a), (_, b) in zip(ramp, ramp[1:])), ramp)
        self.assertGreater(len([f for _, f in ramp if f > 0]), 10)
        self.assertFalse(any(f for t, f in zip(times, force) if t >= off["t_ns"]))
        self.assertFalse(self.torque())
        os.kill(program.pid, signal.SIGCONT)
        program.kill()

    def refuses_until_cleared(self):
        with self.client() as hand:
            try:
                hand.start(renderer="point")
                self.fail("forces came back by themselves")
            except ServeError as error:
                self.assertIn(error.code, ("forces-off", "running"))

    def test_killed_itself_in_contact_the_guard_ends_the_force(self):
        self.program_in_contact()
        server = int(subprocess.run(["pgrep", "-P", str(self.server.pid), "-x", "palpate"], capture_output=True, text=True,
                                    check=True).stdout.split()[0])
        os.kill(server, signal.SIGKILL)
        self.server.wait(PATIENCE)
        self.assertTrue(json.loads(self.last.read_text())[0]["torque_is_zero"])

    def test_without_its_guard_the_server_ends(self):
        self.program_in_contact()
        server = subprocess.run(["pgrep", "-P", str(self.server.pid), "-x", "palpate"], capture_output=True, text=True,
                                check=True).stdout.split()[0]
        guard = subprocess.run(["pgrep", "-P", server], capture_output=True, text=True, check=True).stdout.split()[0]
        os.kill(int(guard), signal.SIGKILL)
        self.assertEqual(self.server.wait(PATIENCE), 1)
        self.assertIn("guard", self.server.stderr.read())
        self.assertTrue(json.loads(self.last.read_text())[0]["torque_is_zero"])


if __name__ == "__main__":
    unittest.main()
