"""A small protocol, a space of settings and sweeps over it, in a folder of their own.

PALPATE and the folder of protocols are the arguments of a test.
"""

import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
PALPATE, PROTOCOLS = (pathlib.Path(argument).resolve() for argument in (sys.argv.pop(1), sys.argv.pop(1)))

SPACE = {"version": 1, "parameters": [
    {"name": "noise", "of": "participant", "path": "/percept/direction_sd_deg", "distribution": "normal",
     "mean": 15, "sd": 4, "low": 5, "high": 30},
    {"name": "size", "of": "protocol", "path": ["/stimuli/0/radius_m", "/stimuli/1/radius_m"],
     "distribution": "log_uniform", "low": 0.025, "high": 0.035},
    {"name": "order", "of": "protocol", "path": "/renderer_order", "distribution": "choice",
     "values": ["counterbalanced", "interleaved"]}]}
PROTOCOL = {"version": 1, "name": "two", "renderers": ["point", "ray"], "repetitions": 4, "blocks_per_renderer": 2,
            "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03},
                        {"name": "hat", "shape": "cone", "radius_m": 0.03, "height_m": 0.06}],
            "response": {"keys": {"1": "ball", "2": "hat"}, "time_out_s": 20}, "seed": 5}
COLUMNS = ("point,status,reason,noise,size,order,gain_ball,gain_hat,gain_se_ball,gain_se_hat,time_point_ball,time_point_hat,"
           "time_ray_ball,time_ray_hat,accuracy_point_ball,accuracy_point_hat,accuracy_ray_ball,accuracy_ray_hat,"
           "time_outs_point_ball,time_outs_point_hat,time_outs_ray_ball,time_outs_ray_hat,contact_share_point_ball,"
           "contact_share_point_hat,contact_share_ray_ball,contact_share_ray_hat")


class SweepCase(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.write("p.json", PROTOCOL)
        self.write("s.json", SPACE)

    def write(self, name, value):
        (self.folder / name).write_text(value if isinstance(value, str) else json.dumps(value))

    def palpate(self, *arguments, status=0, env=None):
        done = subprocess.run([PALPATE, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True, timeout=600,
                              env={**os.environ, **(env or {})})
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.stdout}{done.stderr}")
        return done.stdout if status == 0 else done.stderr

    def command(self, file, *more, points=6):
        return ["sweep", "p.json", "--space", "s.json", "--points", points, "--participants", 2, "--repetitions", 2,
                "--db", file, *more]

    def sweep(self, file, *more, points=6, status=0, env=None):
        return self.palpate(*self.command(file, *more, points=points), status=status, env=env)

    def bytes(self, name):
        return (self.folder / name).read_bytes()

    def rows(self, file):
        self.palpate("export", "--db", file, "--format", "csv", "--out", file + ".csv")
        with open(self.folder / (file + ".csv"), newline="") as text:
            return list(csv.DictReader(text))
