"""Extreme designs and times: each value is defined, or undefined with a reason.

Usage: extreme_designs_test.py PALPATE
"""

import json
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import unittest

PALPATE = sys.argv[1]
HEADER = "participant_id,session,block,trial,renderer,shape,response,correct,response_time\n"
SHAPES = ["sphere", "cone", "cylinder", "cube"]
NO_NUMBER = re.compile(r"(?<![\w])-?(nan|inf|infinity|1e\+?30)(?![\w])", re.I)


def study(participants, repetitions, time, renderers=("point", "ray"), shapes=SHAPES,
          keep=lambda *cell: True, correct=lambda *cell: 1):
    """CSV of a study; time, keep and correct are functions of (participant, renderer, shape, repetition)."""
    rows = []
    for who in participants:
        number = 0
        for renderer in renderers:
            for shape in shapes:
                for i in range(repetitions):
                    number += 1
                    cell = (who, renderer, shape, i)
                    if not keep(*cell):
                        continue
                    right = correct(*cell)
                    rows.append(f"{who},1,1,{number},{renderer},{shape},"
                                f"{shape if right else 'other'},{right},{time(*cell)}\n")
    return HEADER + "".join(rows)


def log_normal(generator):
    return lambda *cell: f"{generator.lognormvariate(2, 0.4):.6f}"


SEED = 3
DRAW = random.Random(SEED)
SOME = log_normal(DRAW)
# name: (rows, status of mixed_model, of rm_anova, of its effects)
DESIGNS = {
    "one participant": (study("A", 5, SOME), "undefined", "undefined", "undefined"),
    "two participants": (study("AB", 5, SOME), None, "ok", "ok"),
    "one trial a cell": (study("ABCD", 1, SOME), None, "ok", "ok"),
    "one trial": (study("A", 1, SOME, ["ray"], ["cone"]), "undefined", "undefined", "undefined"),
    "two trials": (study("A", 1, SOME, shapes=["cone"]), "undefined", "undefined", "undefined"),
    "one renderer": (study("ABC", 3, SOME, ["ray"]), "undefined", "undefined", None),
    "one shape": (study("ABCDE", 5, SOME, shapes=["cone"]), None, "undefined", None),
    "sixty shapes": (study("ABCD", 2, SOME, shapes=[f"s{i}" for i in range(60)]), None, "ok", "ok"),
    "190 shapes": (study("ABCD", 2, SOME, shapes=[f"s{i}" for i in range(190)]), None, "ok", "ok"),
    "190 shapes with gaps": (study("ABCDEF", 2, SOME, shapes=[f"s{i}" for i in range(190)],
                                   keep=lambda who, renderer, shape, i: DRAW.random() < 0.7), None,
                             None, None),
    "constant": (study("ABCDE", 3, lambda *cell: 5), "undefined", "undefined", "undefined"),
    "constant by participant": (study("ABCDE", 3, lambda who, *cell: ord(who)), "undefined", "undefined",
                           "undefined"),
    "all at the least time": (study("ABC", 3, lambda *cell: 0.2), "undefined", "undefined", "undefined"),
    "constant up to rounding": (study("ABCDE", 3, lambda who, renderer, shape, i:
                                      5.000000000000001 if (who, renderer, i) == ("A", "ray", 0)
                                      else 5), "undefined", "undefined", "undefined"),
    "constant but one": (study("ABCDE", 3, lambda *cell: 6 if cell == ("A", "ray", "cube", 0)
                               else 5), "singular", "ok", None),
    "least against longest": (study("ABCDE", 3, lambda who, renderer, *cell:
                                    1000000 if renderer == "ray" else 0.2), "undefined", "undefined",
                              "undefined"),
    "least and longest mixed": (study("ABCDE", 5, lambda *cell:
                                      DRAW.choice([1000000, 0.2, 3])), None, "ok", None),
    "nearly no residual": (study("ABCDE", 5, lambda who, *cell:
                                 f"{ord(who) * (1 + 1e-7 * DRAW.random()):.17g}"), None, "ok",
                           None),
    "no correct answer": (study("ABC", 3, SOME, correct=lambda *cell: 0), "undefined", "undefined",
                     "undefined"),
    "ray never right": (study("ABC", 3, SOME, correct=lambda who, renderer, *cell:
                              int(renderer == "point")), "undefined", "undefined", "undefined"),
    "other participants with each renderer": (study("ABCDEF", 5, SOME, keep=lambda who, renderer, *cell:
                                              (ord(who) % 2 == 0) == (renderer == "ray")),
                                        "undefined", "undefined", "undefined"),
    "each participant a shape": (study("ABCDEFGH", 4, SOME, keep=lambda who, renderer, shape, i:
                                  SHAPES.index(shape) == ord(who) % 4), None, "undefined",
                            "undefined"),
    "each renderer other shapes": (study("ABCDEFGH", 4, SOME, keep=lambda who, renderer, shape, i:
                                         (SHAPES.index(shape) + (renderer == "ray")) % 2 == 0),
                                   None, "undefined", "undefined"),
}


class ExtremeDesigns(unittest.TestCase):
    def check_statuses(self, value, place="", told=False):
        """undefined and singular have a reason; null occurs only with one of them (`told`)."""
        if value is None:
            self.assertTrue(told, f"{place} is null, and nothing says why")
        elif isinstance(value, list):
            for i, each in enumerate(value):
                self.check_statuses(each, f"{place}/{i}", told)
        elif isinstance(value, dict):
            if value.get("status") in ("undefined", "singular"):
                self.assertTrue(value.get("reason"), place)
                told = True
            for key, each in value.items():
                self.check_statuses(each, f"{place}/{key}", told)

    def test_every_design(self):
        for name, (rows, mixed, anova, effects) in DESIGNS.items():
            with self.subTest(name), tempfile.TemporaryDirectory() as scratch:
                csv, out = pathlib.Path(scratch) / "t.csv", pathlib.Path(scratch) / "a.json"
                csv.write_text(rows, encoding="utf-8")
                done = subprocess.run([PALPATE, "analyze", "--csv", csv, "--json", out],
                                      capture_output=True, text=True, encoding="utf-8")
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                text = out.read_text("utf-8")
                self.assertIsNone(NO_NUMBER.search(done.stdout), name)
                self.assertIsNone(NO_NUMBER.search(text), name)
                found = json.loads(text)
                self.check_statuses({name: found[name] for name in found if name not in ("protocol", "observer_sha256")})
                if mixed:
                    self.assertEqual(found["mixed_model"]["status"], mixed)
                if anova:
                    self.assertEqual(found["rm_anova"]["status"], anova)
                if effects:
                    for effect in found["rm_anova"]["effects"].values():
                        self.assertEqual(effect["status"], effects)
                self.assertGreater(found["counts"]["n_trials"], 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
