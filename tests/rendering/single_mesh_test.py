"""The paper's engine block and rocket as single meshes give the forces of their parts. Usage: single_mesh_test.py PALPATE PROTOCOLS

The files of the scenes name their convex parts as groups. Without the groups the same faces are shells that overlap and abut,
and the surface law renders them instead of the union of parts.
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

PALPATE, PROTOCOLS = sys.argv[1], pathlib.Path(sys.argv[2])


class SingleMesh(unittest.TestCase):
    def render(self, folder, name, scene, renderer, trajectory):
        path, out = folder / f"{name}.json", folder / f"{name}-{renderer}.csv"
        path.write_text(json.dumps(scene))
        subprocess.run([PALPATE, "render", "--scene", path, "--renderer", renderer, "--trajectory", trajectory, "--out", out],
                       check=True, capture_output=True)
        with open(out, newline="") as file:
            return list(csv.DictReader(file))

    def check(self, name):
        scenes = PROTOCOLS / "scenes"
        scene = json.loads((scenes / f"{name}.json").read_text())
        del scene["$schema"]
        source = (scenes / scene["objects"][0]["file"]).resolve()
        scene["objects"][0].pop("body", None)  # a fixed object, so that the path is the same
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            lines = source.read_text().splitlines(True)
            (folder / "single.obj").write_text("".join(line for line in lines if line[:2] not in ("o ", "g ")))
            self.assertLess(len((folder / "single.obj").read_text()), len(source.read_text()))
            for renderer in ("point", "ray"):
                scene["objects"][0]["file"] = str(source)
                parts = self.render(folder, "parts", scene, renderer, scenes / f"{name}.csv")
                scene["objects"][0]["file"] = "single.obj"
                single = self.render(folder, "single", scene, renderer, scenes / f"{name}.csv")
                self.assertEqual(len(parts), len(single))
                felt = 0
                for row, (a, b) in enumerate(zip(parts, single), 2):
                    for kind, unit in (("force", 1), ("torque", .1), ("ideal_tip", .01)):
                        for axis in "xyz":
                            x, y = float(a[f"{kind}_{axis}"]), float(b[f"{kind}_{axis}"])
                            self.assertAlmostEqual(x, y, delta=1e-6 * unit, msg=f"{name} {renderer} line {row} {kind}_{axis}")
                    felt += int(a["contacts"]) > 0
                self.assertGreater(felt, 50)

    def test_engine_block(self):
        self.check("fig17a-engine")

    def test_rocket(self):
        self.check("fig16-rocket")


if __name__ == "__main__":
    sys.exit(unittest.main(argv=sys.argv[:1]))
