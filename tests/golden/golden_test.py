"""Forces along a stored path stay what they were. Usage: golden_test.py PALPATE FOLDER

After a change that is meant to alter them, render the trajectory again into point.csv and ray.csv and say why.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
import unittest

PALPATE, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])


def rows(path):
    with open(path, newline="") as file:
        return list(csv.reader(file))


class Golden(unittest.TestCase):
    def test_forces_along_the_path(self):
        for renderer in ("point", "ray"):
            with tempfile.TemporaryDirectory() as scratch:
                out = pathlib.Path(scratch) / "out.csv"
                subprocess.run([PALPATE, "render", "--scene", FOLDER / "scene.json", "--renderer", renderer,
                                "--trajectory", FOLDER / "trajectory.csv", "--out", out], check=True)
                found, expected = rows(out), rows(FOLDER / f"{renderer}.csv")
            self.assertEqual(found[0], expected[0])
            self.assertEqual(len(found), len(expected))
            self.assertGreater(sum(int(row[23]) > 0 for row in expected[1:]), 60, "most of it in contact")
            for line, (f, e) in enumerate(zip(found[1:], expected[1:]), 2):
                for name, a, b in zip(expected[0], f, e):
                    place = f"{renderer}.csv line {line}, {name}"
                    if name in ("contacts", "contact_type", "object", "faults"):
                        self.assertEqual(a, b, place)
                    else:  # the shapes' sines may differ in the last bit between libraries
                        self.assertAlmostEqual(float(a), float(b), delta=1e-9 * max(1, abs(float(b))), msg=place)


if __name__ == "__main__":
    sys.exit(unittest.main(argv=sys.argv[:1]))
