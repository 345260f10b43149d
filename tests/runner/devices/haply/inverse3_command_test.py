"""palpate run with a Haply device that is not there: a whole session with its faults, and services that cannot be used.

Usage: inverse3_command_test.py PALPATE EMULATED_INVERSE_SERVICE
"""

import contextlib
import json
import os
import pathlib
import signal
import socketserver
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "session"))
from terminal import Terminal  # noqa: E402

PALPATE, SERVICE = sys.argv[1:3]
PATIENCE = 120  # s; only a hang reaches it
PROTOCOL = {
    "version": 1, "name": "touch", "renderers": ["ray"], "torque": "left_out", "seed": 3,
    "servo": {"rate_hz": 100}, "material": {"stiffness_n_per_m": 100},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "repetitions": 2, "home": {"rest_s": 0.1, "margin_m": 0.005},
    "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 600},
}
AWAY, INSIDE = "hand 0.04 0 0", "hand 0.012 0 0"


class Service:
    def __init__(self):
        self._process = subprocess.Popen([SERVICE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.address = self._process.stdout.readline().split()[1]

    def tell(self, *lines):
        self._process.stdin.writelines(f"{line}\n" for line in lines)
        self._process.stdin.flush()

    def force(self):
        """N, along x, y, z."""
        self.tell("state")
        return json.loads(self._process.stdout.readline())["force_n"]

    def pushes(self):
        return max(map(abs, self.force())) > 0.01

    def close(self):
        self._process.stdin.close()
        self._process.wait(PATIENCE)
        self._process.stdout.close()


class Foreign(socketserver.BaseRequestHandler):
    """Another program that occupies Haply's port."""

    def handle(self):
        self.request.recv(4096)
        self.request.sendall(b"HTTP/1.0 200 OK\r\nContent-Length: 17\r\n\r\n<html>hello</html")


class Inverse3(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.database = self.folder / "study.db"
        (self.folder / "protocol.json").write_text(json.dumps(PROTOCOL))
        self.service = Service()
        self.addCleanup(self.service.close)

    def run_session(self, *options):
        terminal = Terminal([PALPATE, "run", self.folder / "protocol.json", "--db", self.database, "--participant", "P01",
                             "--device", "inverse3", "--service", self.service.address, "--no-window", *options],
                            patience=PATIENCE)
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

    def begin(self, *options):
        """A session after its pre-flight."""
        self.service.tell(AWAY)
        terminal = self.run_session(*options)
        terminal.wait_for("(':go': push)")
        while True:  # on a busy machine the guard ends the push
            terminal.type(":go\n")
            self.wait(lambda: self.service.force()[0] > 0.5 or "check failed" in terminal.hear()[terminal.read_to:])
            self.assertLess(self.service.force()[0], 1 + 1e-6, "one push, not two")
            if terminal.wait_for("was a weak push to the right felt?", "the force direction check failed").startswith(
                    "was"):
                break
        terminal.type(":go\n")
        terminal.wait_for("move the stylus")
        terminal.type(":go\n")
        return terminal

    def touch(self, terminal):
        """Waits for a force on the hand. On a busy machine the guard may end forces before."""
        while True:
            self.service.tell(AWAY)
            if terminal.wait_for("[trial, ", "[fault, ", "[paused, ") != "[trial, ":
                terminal.type(":clear\n:go\n")
                continue
            self.service.tell(INSIDE)
            before = terminal.hear().count("was cut off")
            self.wait(lambda: self.service.pushes() or terminal.hear().count("was cut off") > before)
            if self.service.pushes():
                return

    def meet_faults(self, terminal):
        """Each ends forces until it is mended and cleared."""
        for fault, words, mend in (
                ("set present 0", "the device is unplugged: plug it in again", "set present 1"),
                ("set calibrated 0", "the device asks for its maker's calibration", "set calibrated 1"),
                ("service 0", "the maker's service through which the device is reached has ended", "service 1")):
            self.touch(terminal)
            self.service.tell(fault)
            terminal.wait_for(words)
            terminal.wait_for("[fault, ")
            self.assertFalse(self.service.pushes(), fault)
            terminal.type(":clear\n")
            terminal.wait_for("not cleared, forces stay off")
            self.service.tell(mend, AWAY)
            terminal.type(":clear\n:go\n")
            terminal.wait_for("fault cleared")
        self.touch(terminal)
        terminal.type(":zero\n")
        terminal.wait_for("EMERGENCY", "emergency")
        self.wait(lambda: not self.service.pushes())
        self.service.tell(AWAY)
        terminal.type(":clear\n:go\n")

    def lose_the_guard(self, terminal):
        self.touch(terminal)
        guards = pathlib.Path(f"/proc/{terminal.process.pid}/task/{terminal.process.pid}/children").read_text().split()
        self.assertEqual(len(guards), 1)
        os.kill(int(guards[0]), signal.SIGKILL)
        terminal.wait_for("the guard process has ended")
        self.wait(lambda: not self.service.pushes())
        terminal.type(":quit\n")
        terminal.finish()

    def answer_all(self, terminal):
        for _ in terminal.trials(lambda: self.service.tell(AWAY)):
            terminal.type("1")
        self.assertEqual(terminal.finish(), 0, terminal.text)

    def test_a_session_with_faults_is_resumed_and_complete_in_the_end(self):
        terminal = self.begin("--new-participant")
        self.meet_faults(terminal)
        self.lose_the_guard(terminal)
        self.assertEqual(self.rows("SELECT count(*) FROM attempts WHERE state = 'completed'"), [(0,)])

        self.answer_all(self.begin())
        self.assertEqual(self.rows("SELECT count(*) FROM attempts WHERE state = 'completed'"), [(4,)])
        self.assertGreaterEqual(self.rows("SELECT count(*) FROM attempts WHERE state = 'cut_off'")[0][0], 5)
        self.assertEqual(self.rows("SELECT count(*) FROM runs"), [(2,)])
        self.assertEqual(self.rows("SELECT DISTINCT text FROM notes WHERE text LIKE '%torque%'"),
                         [('{"torque":"left out"}',)])
        self.assertIn("maker's: Inverse3 049D, Inverse Service 3.5.0.0",
                      self.rows("SELECT device_calibration FROM runs")[0][0])
        self.assertFalse(self.service.pushes())
        self.check_that_torque_is_said_to_be_left_out()

    def check_that_torque_is_said_to_be_left_out(self):
        exported = subprocess.run([PALPATE, "export", "--db", self.database, "--format", "csv", "--out",
                                   self.folder / "trials.csv"], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(exported.returncode, 0, exported.stderr)
        header, *lines = (self.folder / "trials.csv").read_text().splitlines()
        self.assertEqual(header.rsplit(",", 1)[1], "torque_driven")
        self.assertEqual([line.rsplit(",", 1)[1] for line in lines], ["0"] * 4)
        told = subprocess.run([PALPATE, "analyze", "--csv", self.folder / "trials.csv"], capture_output=True, text=True,
                              timeout=PATIENCE)
        self.assertIn("In 4 of 4 trials with ray torque was left out", " ".join(told.stdout.split()), told.stderr)

    def test_services_that_cannot_be_used_say_why(self):
        with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Foreign) as foreign:
            threading.Thread(target=foreign.serve_forever, daemon=True).start()
            strange = f"127.0.0.1:{foreign.server_address[1]}"
            for lines, options, words in (
                    (["version 3.0.2"], [], "palpate needs 3.1 or newer"),
                    (["version 3.4.0", "set in_use 1"], [], "end that program"),
                    (["set in_use 0", "set present 0"], [], "check cable and power supply"),
                    (["set present 1"], ["--serial", "4711"], "there are: 049D"),
                    ([], ["--service", strange], "is it running?"),
                    (["service 0"], [], "is it running?")):
                self.service.tell(*lines)
                time.sleep(0.05)
                said = subprocess.run([PALPATE, "run", self.folder / "protocol.json", "--db", self.database,
                                       "--participant", "P01", "--new-participant", "--no-window", "--device", "inverse3",
                                       *(options if "--service" in options else
                                         ["--service", self.service.address, *options])],
                                      capture_output=True, text=True, timeout=PATIENCE, stdin=subprocess.DEVNULL)
                self.assertIn(words, said.stdout + said.stderr)
                self.assertNotEqual(said.returncode, 0)
                self.assertFalse(self.database.exists(), words)
            foreign.shutdown()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
