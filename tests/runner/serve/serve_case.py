"""A server of palpate serve on the simulated device, for the tests of this folder.

Their first arguments are PALPATE PROTOCOLS CLIENT.py.
"""

import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

PALPATE, PROTOCOLS, CLIENT = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
del sys.argv[1:4]
spec = importlib.util.spec_from_file_location("client", CLIENT)
client = importlib.util.module_from_spec(spec)
sys.modules["client"] = client
spec.loader.exec_module(client)
Client, ServeError = client.Client, client.ServeError

PATIENCE = 120  # s; only a hang reaches it
BALL = {"objects": [{"shape": "sphere", "radius_m": 0.03, "subdivisions": 2, "stiffness_n_per_m": 50}]}


class ServeCase(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        self.scene = self.dir / "scene.json"
        self.scene.write_text(json.dumps(BALL))
        self.path = self.dir / "socket"

    def serve(self, *options, scene=True, rate=100):
        """At a rate that a busy machine can keep: forces go off if ticks are missed."""
        command = [PALPATE, "serve", "--device", "simulated", "--socket", self.path, "--rate", rate, *options]
        if scene:
            command += ["--scene", self.scene]
        return self.run_server(command)

    def run_server(self, command):
        process = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

        def end():
            process.kill()
            process.communicate()
        self.addCleanup(end)
        line = process.stdout.readline()
        if not line:
            process.wait(PATIENCE)
            self.fail(f"it does not serve, and ends with {process.returncode}: {process.stderr.read()}")
        self.said = json.loads(line)
        return process

    def client(self, **more):
        made = Client(self.said["url"], self.said["token"], time_out=PATIENCE, **more)
        self.addCleanup(made.close)
        return made

    def one_of(self, who, *names):
        """The next event of one of these names."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            for number, event in enumerate(events := who.events()):
                if event["event"] in names:
                    who._events.extendleft(reversed(events[number + 1:]))
                    return event
            time.sleep(0.01)
        raise AssertionError(f"none of {names} came")

    def know_the_clock(self, hand):
        """Repeats `clock` until the server knows the client's clock: on a busy machine answers may take long."""
        end = time.monotonic() + PATIENCE
        while not (hand.clock() and hand.ask("clock")["known"]):
            self.assertLess(time.monotonic(), end, "the clock stays unknown")

    def touch(self, hand, **more):
        """Starts until there was contact: on a busy machine forces may go off before. \return zero, the contact"""
        while True:
            zero = hand.start(**more)
            contact = self.one_of(hand, "first_contact", "forces_off")
            if contact["event"] == "first_contact":
                return zero, contact
            hand.stop()
            hand.clear()

    def refused(self, code, ask, *args, **more):
        with self.assertRaises(ServeError) as caught:
            ask(*args, **more)
        self.assertEqual(caught.exception.code, code, str(caught.exception))
        return caught.exception
