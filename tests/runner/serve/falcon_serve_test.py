"""palpate serve with an emulated Falcon in contact: what becomes of the force when the program that controls it is killed,
stops or says nothing, or when the server is killed. Judged by the packets that the Falcon has heard.

Usage: falcon_serve_test.py EMULATED_FALCONS PALPATE CLIENT.py
"""

import contextlib
import datetime
import json
import os
import pathlib
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "devices" / "falcon"))
EMULATED = sys.argv.pop(1)
PALPATE, CLIENT = sys.argv[1:3]
sys.argv.insert(2, str(pathlib.Path(__file__).resolve().parents[3] / "protocols"))
from emulator_control import EmulatorControl, read_record  # noqa: E402
from serve_case import PATIENCE, ServeCase, ServeError  # noqa: E402
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "shared"))
from sealed_json import sealed  # noqa: E402

RATE = 100  # Hz, that a busy machine keeps
RAMP = 20  # ticks: 0.2 s
BALL = {"objects": [{"shape": "sphere", "radius_m": 0.02, "subdivisions": 2, "stiffness_n_per_m": 100}]}
DEVICE_LOST, MISSED, STALLED = 32, 64, 1024  # fault bits
FELT = 150  # counts, of the hand in the ball at full force
# Keeps forces on, in a separate process, until it is killed or stopped.
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
    except ServeError as error:  # on a busy machine the guard is late
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
            sealed({"serial": "EMU1", "counts_per_newton_metre": -10000, "weights_kg": [0.1], "made_utc": made})]}))
        self.last, self.heard = self.dir / "last.json", self.dir / "heard.csv"
        self.emulator = self.run_server([
            EMULATED, "--last", self.last, "--record", self.heard, "--control", self.control.fifo, PALPATE, "serve",
            "--device", "falcon", "--scene", self.scene, "--rate", RATE, "--calibration", calibration])
        self.server, = self.children(self.emulator.pid)
        # Do this first: ending only the bus would leave the server and its pipes behind.
        self.addCleanup(self.kill_server)
        self.eye = self.client(role="watch")
        self.eye.subscribe(1000, ("faults",))

    @staticmethod
    def children(pid):
        said = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True).stdout
        return [int(word) for word in said.split()]

    def kill_server(self):
        if self.emulator.poll() is None:
            os.kill(self.server, signal.SIGKILL)

    def hand_at(self, x):
        self.control.tell(f"hand 1 {x} 0 0.125 400 10")

    def put_into_the_ball(self):
        """Until it is felt. Forces that went off on a starved machine begin anew with the hand in the ball, which then
        gives none before the hand has left it."""
        end = time.monotonic() + PATIENCE
        while True:
            self.hand_at(0.03)
            time.sleep(0.3)
            self.hand_at(0.012)
            time.sleep(0.6)  # the approach, and the ramp
            record = self.control.record()
            if min(counts for _, counts in record[-5:]) > FELT:
                return
            self.assertLess(time.monotonic(), end, f"nothing was felt: {record[-5:]}")

    def start_program(self):
        complaints = self.dir / "complaints.txt"
        with complaints.open("w") as file:
            program = subprocess.Popen([sys.executable, "-c", PROGRAM.format(
                folder=str(pathlib.Path(CLIENT).parent), **{k: self.said[k] for k in ("url", "token")})],
                stdout=subprocess.PIPE, stderr=file, text=True)
        self.addCleanup(lambda: (program.kill(), program.communicate()))
        if program.stdout.readline() != "on\n":
            self.fail(f"the program ends: {complaints.read_text()}; the server's end: {self.emulator.poll()}")
        return program

    def in_contact(self, act, event):
        """Does something to a program whose ball is felt.
        \\return when, the event that came of it, and the packets that the Falcon heard"""
        while True:
            program = self.start_program()
            self.put_into_the_ball()
            self.eye.events()
            self.eye.samples()
            act(program)
            at = time.monotonic_ns()
            said = self.one_of(self.eye, event, "forces_off")
            time.sleep(0.5)  # the ramp, and ticks after it
            record = self.control.record()
            before = [counts for t, counts in record if t <= said["t_ns"]]
            faded = event != "client_silent" or not self.was_starved()
            if said["event"] == event and before[-1] > FELT and faded:
                return at, said, record
            program.kill()  # on a busy machine the guard had ended forces
            program.wait()
            hand = None
            while hand is None:
                with contextlib.suppress(ServeError):  # until the server has noticed the end of the program
                    hand = self.client()
            with hand:
                self.wait_until_free(hand)

    def was_starved(self):
        """The machine was too busy for guard or servo, which switched forces off at once."""
        faults = [int(word) for word in self.eye.samples()["faults"]]
        return any(word & (DEVICE_LOST | STALLED) for word in faults) or sum(word & MISSED > 0 for word in faults) >= 5

    def wait_until_free(self, hand):
        """Waits until forces are allowed again."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                hand.stop()
                return hand.clear()
            except ServeError as error:
                self.assertLess(time.monotonic(), end, str(error))
                time.sleep(0.1)

    def refused_start(self, hand):
        with self.assertRaises(ServeError) as caught:
            hand.start(renderer="point")
        return caught.exception.code

    def test_after_a_kill_in_contact_the_force_is_zero_within_two_ticks(self):
        at, gone, record = self.in_contact(lambda program: program.kill(), "controller_gone")
        since = [(t, counts) for t, counts in record if t > gone["t_ns"]]
        with_force = [t for t, counts in since if counts > 0]
        zero = next(t for t, counts in record if t > at and counts == 0)
        print(f"killed: the server knew after {(gone['t_ns'] - at) / 1e6:.1f} ms, the Falcon heard zero "
              f"{(zero - at) / 1e6:.1f} ms after the kill; {len(with_force)} packets with force in between", file=sys.stderr)
        self.assertGreater(len(since), 2)
        self.assertLessEqual(len(with_force), 2)
        self.assertEqual(with_force, [t for t, _ in since[:len(with_force)]])  # it does not come back

    def assert_faded(self, at, silent, record):
        since = [(t, counts) for t, counts in record if t > silent["t_ns"]]
        ramp = [counts for _, counts in since if counts > 0]
        waited = [counts for t, counts in record if silent["since_ns"] < t <= silent["t_ns"]]
        zero = next(t for t, counts in since if counts == 0)
        print(f"silent {(silent['t_ns'] - silent['since_ns']) / 1e6:.0f} ms after its last word, zero "
              f"{(zero - silent['t_ns']) / 1e6:.0f} ms and {len(ramp)} ticks later", file=sys.stderr)
        self.assertGreaterEqual(silent["t_ns"] - silent["since_ns"], 500_000_000)
        self.assertGreater(min(waited), 0)
        # A late tick, and one that was in progress.
        self.assertLessEqual(len(ramp), RAMP + 2)
        self.assertGreaterEqual(len(ramp), RAMP // 2)
        self.assertEqual(ramp, [counts for _, counts in since[:len(ramp)]])  # it does not come back
        for one, next_one in zip(ramp, ramp[1:]):
            self.assertLessEqual(next_one, one + 5)  # the hand moves in while the force fades

    def test_after_a_stop_in_contact_the_force_fades(self):
        self.assert_faded(*self.in_contact(lambda program: os.kill(program.pid, signal.SIGSTOP), "client_silent"))

    def test_silence_holds_forces_off_until_clear(self):
        with self.client(keep_alive=False) as hand:
            while True:
                hand.stop()
                self.eye.events()
                try:
                    hand.clear()
                    hand.start(renderer="point")
                except ServeError as error:  # on a busy machine the guard is late
                    self.assertEqual(error.code, "forces-off")
                    continue
                if self.one_of(self.eye, "client_silent", "forces_off")["event"] == "client_silent":
                    break
            self.one_of(self.eye, "forces_off")
            hand.stop()
            with self.assertRaises(ServeError) as caught:
                hand.start(renderer="point")
            self.assertEqual(caught.exception.code, "forces-off")
            self.assertEqual(self.control.record()[-1][1], 0)
            self.wait_until_free(hand)

    def test_the_guard_ends_the_force_after_the_server_is_killed_in_contact(self):
        self.start_program()
        self.put_into_the_ball()
        os.kill(self.server, signal.SIGKILL)
        at = time.monotonic_ns()
        self.emulator.wait(PATIENCE)
        self.assertTrue(json.loads(self.last.read_text())[0]["torque_is_zero"])
        record = read_record(self.heard)
        with_force = [t for t, counts in record if t > at and counts > 0]
        zero = next(t for t, counts in record if t > at and counts == 0)
        print(f"the server killed: zero {(zero - at) / 1e6:.1f} ms later, {len(with_force)} packets with force", file=sys.stderr)
        self.assertLessEqual(len(with_force), 1)

    def test_a_stopped_guard_leaves_no_force(self):
        self.start_program()
        self.put_into_the_ball()
        guard, = self.children(self.server)
        os.kill(guard, signal.SIGSTOP)
        at = time.monotonic_ns()
        self.assertEqual(self.emulator.wait(PATIENCE), 1)
        self.assertTrue(json.loads(self.last.read_text())[0]["torque_is_zero"])
        record = read_record(self.heard)
        zero = next(t for t, counts in record if t > at and counts == 0)
        print(f"the guard stopped: zero {(zero - at) / 1e6:.1f} ms later", file=sys.stderr)
        self.assertFalse([t for t, counts in record if t > zero and counts > 0])

    def test_the_server_ends_if_its_guard_has_ended(self):
        self.start_program()
        self.put_into_the_ball()
        guard, = self.children(self.server)
        os.kill(guard, signal.SIGKILL)
        self.assertEqual(self.emulator.wait(PATIENCE), 1)
        self.assertIn("guard", self.emulator.stderr.read())


if __name__ == "__main__":
    unittest.main()
