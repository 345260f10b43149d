"""Forces along stored paths stay what they were. Usage: golden_test.py PALPATE FOLDER

Each folder holds a scene, a trajectory and what the renderers made of it. After a change that is meant to alter forces,
render the trajectory again into point.csv and ray.csv and say why.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
import unittest

PALPATE, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])
EXACT = ("contacts", "contact_type", "object", "segment", "faults")


def rows(path):
    with open(path, newline="") as file:
        return list(csv.reader(file))


class Golden(unittest.TestCase):
    def check(self, folder, renderer):
        with tempfile.TemporaryDirectory() as scratch:
            out = pathlib.Path(scratch) / "out.csv"
            subprocess.run([PALPATE, "render", "--scene", folder / "scene.json", "--renderer", renderer,
                            "--trajectory", folder / "trajectory.csv", "--out", out], check=True)
            found, expected = rows(out), rows(folder / f"{renderer}.csv")
        self.assertEqual(found[0], expected[0])
        self.assertEqual(len(found), len(expected))
        contacts = expected[0].index("contacts")
        self.assertGreater(sum(int(row[contacts]) > 0 for row in expected[1:]), 60, "much of it in contact")
        for line, (f, e) in enumerate(zip(found[1:], expected[1:]), 2):
            for name, a, b in zip(expected[0], f, e):
                place = f"{folder.name}/{renderer}.csv line {line}, {name}"
                if name in EXACT:
                    self.assertEqual(a, b, place)
                else:  # the shapes' sines may differ in the last bit between libraries
                    self.assertAlmostEqual(float(a), float(b), delta=1e-9 * max(1, abs(float(b))), msg=place)

    def test_forces_along_the_paths(self):
        seen = 0
        for stored in sorted(FOLDER.glob("*/*.csv")):
            if stored.stem in ("point", "ray"):
                self.check(stored.parent, stored.stem)
                seen += 1
        self.assertGreaterEqual(seen, 5)


if __name__ == "__main__":
    sys.exit(unittest.main(argv=sys.argv[:1]))
