"""Trials with tasks whose psychometric functions are known, as a table to analyze; PALPATE is a test's first argument."""

import csv
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
PALPATE = sys.argv.pop(1)
PEOPLE = 5  # of a forced choice
COLUMNS = ["participant_id", "session", "block", "trial", "renderer", "shape", "response", "correct",
           "response_time", "practice", "timed_out", "simulated", "task", "block_name", "track", "level",
           "standard_level", "catch_trial", "success", "number", "confidence"]


def logistic(x):
    return 1 / (1 + math.exp(-x))


def rows_of_a_study(seed):
    """Six participants, two renderers: compare about 500 N/m, detect, rate, adjust, identify."""
    draw = random.Random(seed)
    rows = []

    def add(participant, task, block, renderer, shape, response, success, **more):
        rows.append({"participant_id": participant, "session": 1, "block": 1, "trial": len(rows) + 1,
                     "renderer": renderer, "shape": shape, "response": response, "correct": int(success),
                     "response_time": 1.5, "practice": 0, "timed_out": 0, "simulated": 1, "task": task,
                     "block_name": block, "track": 1, "success": int(success), "catch_trial": 0, **more})

    for person in range(6):
        name = f"T{person}"
        shift = draw.gauss(0, 10)
        for renderer, pse in (("point", 540 + shift), ("ray", 500 + shift)):
            for _ in range(30):
                for level in range(300, 701, 50):
                    success = draw.random() < logistic((level - pse) / 40)
                    add(name, "compare", "stiffness", renderer, "ball", "2" if success else "1", success,
                        level=level, standard_level=500, confidence=draw.randint(1, 3) + 2 * int(success))
        for _ in range(40):
            for level in (0, 1, 2, 3, 4):
                success = draw.random() < 0.1 + 0.88 * logistic(3 * (level - 2)) if level else draw.random() < 0.1
                add(name, "detect", "bump", "ray", "bump", "yes" if success else "no", success,
                    level=level or "", catch_trial=int(level == 0))
        for level in (1, 10, 100):
            for _ in range(3):
                add(name, "rate", "roughness", "ray", "plate", "", False, correct="", level=level,
                    number=round((person + 1) * level ** 0.6, 6))
        for above in (True, False):
            for _ in range(4):
                add(name, "adjust", "match", "ray", "ball", "", False, correct="", level=700 if above else 300,
                    standard_level=500, number=round(505 + (5 if above else -5) + draw.gauss(0, 4), 3))
        for shape in ("sphere", "cube"):
            for _ in range(20):
                right = draw.random() < 0.9
                add(name, "identify", "shapes", "ray", shape, shape if right else {"sphere": "cube", "cube": "sphere"}[shape], right)
    return rows


class TaskStudy(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)

    def write(self, rows):
        with open(self.path / "trials.csv", "w", newline="") as file:
            there = {name: None for row in rows for name in row}
            columns = [name for name in COLUMNS if name in there] + [name for name in there if name not in COLUMNS]
            writer = csv.DictWriter(file, columns, extrasaction="raise", restval="")
            writer.writeheader()
            writer.writerows(rows)

    def analyze(self, *more):
        return subprocess.run([PALPATE, "analyze", "--csv", self.path / "trials.csv", *more], capture_output=True,
                              text=True)

    def forced(self, draw, level, guess, **more):
        """40 trials at six levels above a standard of 300; the threshold is 350, the slope 0.06 per N/m."""
        return [{"participant_id": f"T{person}", "session": 1, "block": 1, "trial": person * 1000 + i + 1, "renderer": "point",
                 "shape": "ball", "response": "1", "correct": 0, "response_time": 1, "practice": 0, "timed_out": 0, "simulated": 1,
                 "task": "compare", "block_name": "b", "track": 1, "level": x, "standard_level": 300, "catch_trial": 0,
                 "success": int(draw.random() < guess + (1 - guess) * logistic(0.06 * (x - level))), **more}
                for person in range(PEOPLE) for i, x in enumerate(list(range(310, 420, 18)) * 40)]

    def found(self, rows):
        self.write(rows)
        self.assertEqual(self.analyze("--json", self.path / "found.json", "--force").returncode, 0)
        return json.loads((self.path / "found.json").read_text())
