"""palpate run with soft stimuli: their steps have threads of their own, and what was felt can be replayed.

Usage: run_soft_test.py PALPATE
"""

import subprocess
import time
import unittest

from live_case import PALPATE, Live


class Soft(Live):
    def test_a_live_session_on_soft_blocks_is_replayed_bit_by_bit(self):
        def block(name, young):
            return {"name": name, "shape": "cube", "edge_m": 0.05, "stiffness_n_per_m": 300,
                    "soft": {"young_pa": young, "resolution": 3}}
        terminal = self.begin(stimuli=[block("pulp", 5000), block("hide", 80000)], samples=True, repetitions=1,
                              blocks_per_renderer=1, orientation="fixed", servo={"rate_hz": 400},
                              response={"keys": {"1": "pulp", "2": "hide"}, "time_out_s": 30})
        time.sleep(2)  # the simulated hand finds the block
        terminal.type("1")
        self.finish(terminal)
        self.assertIn("2 of 2 trials on record; done", terminal.text)
        for trial in (1, 2):
            done = subprocess.run([PALPATE, "replay", "--db", self.db, "--trial", f"P01/1/{trial}"],
                                  capture_output=True, text=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
