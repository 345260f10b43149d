"""On which monitor the windows of a session are.

Usage: monitors_test.py PALPATE
"""

import json
import subprocess
import unittest

from virtual_screen import PATIENCE
from window_case import PALPATE, WindowCase

PROTOCOL = {"version": 1, "name": "windows", "renderers": ["ray"],
            "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03}, {"name": "die", "shape": "cube", "edge_m": 0.05}],
            "repetitions": 1, "response": {"keys": {"1": "ball", "2": "die"}}, "servo": {"rate_hz": 200}}


class Monitors(WindowCase):
    """The screen of these tests is one monitor."""

    def run_on(self, *options):
        protocol = self.folder / "protocol.json"
        protocol.write_text(json.dumps(PROTOCOL))
        return subprocess.Popen([PALPATE, "run", protocol, "--db", self.database, "--participant", "P01", "--device", "mouse",
                                 *options], env=self.screen.environment, text=True, stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def test_missing_monitors_are_refused_for_either_window(self):
        for option in ("--participant-monitor", "--console-monitor"):
            program = self.run_on(option, "3")
            _, messages = program.communicate(timeout=PATIENCE)
            self.assertEqual(program.returncode, 1, messages)
            self.assertIn("monitor 3 is not connected; there are 1", messages, option)

    def test_a_single_monitor_takes_both_windows(self):
        program = self.run_on("--participant-monitor", "1", "--console-monitor", "1")
        try:
            boxes = [self.screen.box(self.screen.window(title)) for title in ("windows, P01", "windows, P01 - console")]
        finally:
            program.kill()
            program.communicate()
        boxes.sort()
        self.assertLessEqual(boxes[0][2], boxes[1][0], "side by side")


if __name__ == "__main__":
    unittest.main()
