"""Pictures drawn in software, by a driver whose threads are delayed at the critical place.

Usage: slow_fences_test.py PALPATE PROTOCOLS LIBRARY HARNESS     (LIBRARY: slow_fences.cpp)
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

from harnessed_windows import Windows  # takes HARNESS
from virtual_screen import VirtualScreen, skip_without_screen

LIBRARY = sys.argv.pop() if len(sys.argv) > 3 else None
SCENES = pathlib.Path(sys.argv.pop()) / "scenes" if LIBRARY else None
PALPATE = sys.argv.pop() if LIBRARY else None
HELD_UP = {"LIBGL_ALWAYS_SOFTWARE": "1", "LP_NUM_THREADS": "1", "LD_PRELOAD": LIBRARY}


class SlowFences(unittest.TestCase):
    def test_a_sessions_windows_survive_slow_fences(self):
        skip_without_screen()
        screen = VirtualScreen("1024x768")
        self.addCleanup(screen.close)
        screen.environment.update(HELD_UP)
        windows = Windows(screen)
        self.addCleanup(windows.close)
        windows.say("state cone 0")
        time.sleep(30)  # some hundred pictures
        self.assertIsNone(windows.program.poll())
        windows.say("end")
        self.assertEqual(windows.program.wait(60), 0)

    def test_pictures_without_a_display_survive_slow_fences(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = SCENES / "fig13-two-objects.json"
            done = subprocess.run(
                [PALPATE, "explore", scene, "--trajectory", scene.with_suffix(".csv"), "--frames", f"{folder}/frames",
                 "--size", "64x48", "--every", "10ms"], env=os.environ | HELD_UP, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertGreater(len(os.listdir(f"{folder}/frames")), 100)


if __name__ == "__main__":
    unittest.main()
