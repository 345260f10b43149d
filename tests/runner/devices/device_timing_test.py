"""palpate devices --timing --device and --report on emulated devices: the delay follows the device's, validate uses it, and
the report holds no personal data.

Usage: device_timing_test.py PALPATE EMULATED_INVERSE_SERVICE STUB_LIBDRD STUB_LIBHD [EMULATED_FALCONS]
"""

import datetime
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from stub_state import StubState

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "shared"))
from sealed_json import sealed  # noqa: E402

PALPATE, SERVICE, DRD, HD, *FALCONS = sys.argv[1:6]
PATIENCE = 120  # s; only a hang reaches it
RATE = 100  # Hz, that a busy machine keeps


class Timing(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.calibration = self.folder / "lab.json"
        state = self.folder / "stub"
        self.stub = StubState(state)
        self.addCleanup(self.stub.close)
        self.stub.set(serial=4711, model=1, hand_stiffness=400, connected=1, power=1)
        self.environment = {**os.environ, "PALPATE_STUB_STATE": str(state)}

    def service(self):
        process = subprocess.Popen([SERVICE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

        def end():
            process.stdin.close()
            process.wait(PATIENCE)
            process.stdout.close()
        self.addCleanup(end)
        return "--service", process.stdout.readline().split()[1]

    def palpate(self, *arguments, status=0, under=()):
        done = subprocess.run([*map(str, under), PALPATE, *map(str, arguments)], capture_output=True, text=True,
                              timeout=PATIENCE, env=self.environment)
        self.assertEqual(done.returncode, status, done.stderr + done.stdout)
        return done.stderr if status else done.stdout

    def time(self, kind, *options, under=()):
        said = self.palpate("devices", "--timing", "--device", kind, "--rate", RATE, "--seconds", 1, "--calibration",
                            self.calibration, *options, under=under)
        print(said, file=sys.stderr)
        chains = json.loads((self.folder / "lab.timing.json").read_text())["chains"]
        chain, = [one for one in chains if one["device"] == kind]
        self.assertEqual((chain["rate_hz"], chain["ticks"]), (RATE, RATE))
        self.assertLess(chain["lost_readings"], RATE / 2)  # a busy machine holds the guard process up
        for name in ("reading_ns", "pose_age_ns", "force_wait_ns", "delay_ns"):
            values = list(chain[name].values())
            self.assertEqual(values, sorted(values))
            self.assertGreaterEqual(values[0], 0)
        # Each delay is an age and a wait.
        self.assertLessEqual(chain["delay_ns"]["max"], chain["pose_age_ns"]["max"] + chain["force_wait_ns"]["max"])
        self.assertGreaterEqual(chain["delay_ns"]["max"], max(chain["pose_age_ns"]["median"], chain["force_wait_ns"]["median"]))
        return chain

    def test_what_a_library_takes_is_measured(self):
        quick = self.time("forcedimension", "--library", DRD)
        self.stub.set(delay=0.003)  # s, of each pose
        slow = self.time("forcedimension", "--library", DRD)
        # A pose is as old as the library takes to give it.
        self.assertGreaterEqual(slow["pose_age_ns"]["median"], 3_000_000)
        self.assertGreaterEqual(slow["reading_ns"]["median"], 3_000_000)
        self.assertGreater(slow["delay_ns"]["median"], quick["delay_ns"]["median"])

    def test_validate_counts_what_was_measured(self):
        protocol = {"version": 1, "name": "stiff", "renderers": ["point"], "repetitions": 1, "servo": {"rate_hz": RATE},
                    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.01, "subdivisions": 1}],
                    "material": {"stiffness_n_per_m": 5000}, "response": {"keys": {"1": "ball"}}}
        file = self.folder / "stiff.json"
        file.write_text(json.dumps(protocol))
        self.assertIn("--timing", self.palpate("validate", file, "--calibration", self.calibration, status=2))
        service = self.service()
        chain = self.time("inverse3", *service)
        self.time("touch", "--library", HD)
        shows = r"'inverse3' shows up to ([0-9.e+]+) N/m"
        before = float(re.search(shows, self.palpate("validate", file)).group(1))
        said = self.palpate("validate", file, "--calibration", self.calibration)
        counted = float(re.search(shows, said).group(1))
        half, delay = 0.5 / RATE, chain["delay_ns"]["p99"] * 1e-9
        self.assertAlmostEqual(counted / before, half / (half + delay), places=3)
        self.assertEqual(said.count("with its delay of"), 2)
        # A second measurement replaces that of its kind alone.
        self.time("inverse3", *service)
        kept = json.loads((self.folder / "lab.timing.json").read_text())["chains"]
        self.assertEqual(sorted(one["device"] for one in kept), ["inverse3", "touch"])
        stored = (self.folder / "lab.timing.json").read_text()
        changed = json.loads(stored)
        changed["chains"][0]["delay_ns"] = dict.fromkeys(changed["chains"][0]["delay_ns"], 0)
        (self.folder / "lab.timing.json").write_text(json.dumps(changed))
        self.assertIn("/chains/0/sha256: expected the checksum",
                      self.palpate("validate", file, "--calibration", self.calibration, status=2))
        del changed["chains"][0]["sha256"]
        (self.folder / "lab.timing.json").write_text(json.dumps(changed))
        self.assertIn("/chains/0/sha256: missing", self.palpate("validate", file, "--calibration", self.calibration, status=2))
        (self.folder / "lab.timing.json").write_text('{"version": 1, "chains": [{"device": 3}]}')
        self.assertIn("/chains/0", self.palpate("validate", file, "--calibration", self.calibration, status=2))

    @unittest.skipUnless(FALCONS, "needs libumockdev")
    def test_a_falcon(self):
        made = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
        self.calibration.write_text(json.dumps({"version": 1, "forces": [
            sealed({"serial": "EMU1", "counts_per_newton_metre": -10000, "weights_kg": [0.1], "made_utc": made})]}))
        self.time("falcon", under=FALCONS)

    def test_wrong_use(self):
        for kind in ("mouse", "simulated"):
            self.palpate("devices", "--timing", "--device", kind, status=2)
        self.palpate("devices", "--timing", "--device", "forcedimension", "--seconds", 0, status=2)
        for option in (["--guarded"], ["--no-fifo"], ["--core", 0]):
            self.palpate("devices", "--timing", "--device", "forcedimension", "--library", DRD, *option, status=2)
        self.stub.set(connected=0)
        self.palpate("devices", "--timing", "--device", "forcedimension", "--library", DRD, status=1)
        self.palpate("devices", "--report", self.folder / "r.json", "--json", self.folder / "j.json", status=2)
        self.assertEqual([one.name for one in self.folder.iterdir()], ["stub"])

    def test_the_report_tells_all_of_the_device_and_nothing_of_the_person(self):
        library = self.folder / "anna" / "libdrd.so"
        library.parent.mkdir()
        library.symlink_to(DRD)
        self.stub.set(serial=47112)  # the library has 16 bits
        out = self.folder / "found.json"
        options = ("devices", "--device", "forcedimension", "--library", library, "--rate", RATE, "--report", out)
        self.palpate(*options)
        text = out.read_text()
        found = json.loads(text)
        row, = found["devices"]
        self.assertEqual(row["connected"], [{"serial": "...12", "trouble": ""}])
        self.assertEqual(row["limits"]["serial"], "...12")
        self.assertGreater(row["limits"]["max_force_n"], 0)
        self.assertIn("maker's", row["limits"]["calibration"])
        self.assertTrue(row["self_test"] and all(one["passed"] for one in row["self_test"]))
        self.assertLess(found["chain"]["lost_readings"], found["chain"]["ticks"] / 2)
        self.assertIn("lateness_ns", found["timing"])
        self.assertEqual(found["machine"]["processors"], os.cpu_count())
        self.assertTrue(found["program_version"] and found["machine"]["kernel"])
        for private in ("47112", "anna", str(self.folder), os.uname().nodename, str(pathlib.Path.home()) + "/"):
            self.assertNotIn(private, text)
        self.assertIn("exists", self.palpate(*options, "--force", status=2))
        self.assertEqual(out.read_text(), text)

    def test_a_library_that_cannot_be_loaded_is_named_in_lines_of_its_own_and_reported_without_its_folder(self):
        broken = self.folder / "anna" / "broken.so"
        broken.parent.mkdir()
        broken.write_text("no library")
        out = self.folder / "found.json"
        options = ("devices", "--device", "forcedimension", "--library", broken, "--report", out)
        done = subprocess.run([PALPATE, *map(str, options)], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, 1, done.stderr + done.stdout)
        self.assertRegex(done.stdout, r"Tried:\n +\S*broken\.so")
        self.assertIn("broken.so", out.read_text())
        self.assertNotIn("anna", out.read_text())


if __name__ == "__main__":
    del sys.argv[1:6]
    unittest.main()
