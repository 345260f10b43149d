"""Meshes as CAD programs and scanners give them can all be touched. Usage: closed_meshes_test.py PALPATE

PALPATE_ROUNDS: how many times as many meshes. Memory is measured at 300,000 triangles and, with rounds, at a million.
"""

import json
import os
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "shared"))

try:
    import numpy as np

    import closed_meshes
except ModuleNotFoundError as missing:
    if missing.name != "numpy":
        raise
    print("skipped: numpy is not installed")
    sys.exit(77)

PALPATE, ROUNDS = sys.argv[1], int(os.environ.get("PALPATE_ROUNDS", "1"))


class ClosedMeshes(unittest.TestCase):
    def explained(self, folder, name):
        """Text of render --explain and the peak memory in MB."""
        scene = folder / "scene.json"
        scene.write_text(json.dumps({"objects": [{"shape": "mesh", "file": name}]}))
        with open(folder / "out.txt", "w") as out:
            child = os.posix_spawn(PALPATE, [PALPATE, "render", "--scene", str(scene), "--renderer", "point", "--explain"], os.environ,
                                   file_actions=[(os.POSIX_SPAWN_DUP2, out.fileno(), 1), (os.POSIX_SPAWN_DUP2, out.fileno(), 2)])
            _, status, usage = os.wait4(child, 0)
        text = (folder / "out.txt").read_text()
        self.assertEqual(status, 0, f"{name}: {text}")
        return text, usage.ru_maxrss / 1024

    def test_every_kind_in_every_format_is_taken(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            for n in range(20 * ROUNDS):
                kind, v, f = closed_meshes.mesh(n, 1)
                name = f"{n}-{kind}." + ("obj", "stl", "ply", "off", "3mf")[n // 4 % 5]
                closed_meshes.write(str(folder / name), v, f, (None, 6, 8, 9)[n % 4])
                text, _ = self.explained(folder, name)
                self.assertIn(f"{name}: ", text)
                self.assertIn(f" mm, {len(f)} faces", text)

    def test_large_meshes_take_little_memory(self):
        with tempfile.TemporaryDirectory() as scratch:
            seed = 3
            folder, rng = pathlib.Path(scratch), np.random.default_rng(seed)
            for n, most in ((2560, 300), (7900, 900))[:1 + (ROUNDS > 1)]:
                v, f = closed_meshes.knot(rng, n, 64)
                closed_meshes.write(str(folder / "large.stl"), v, f)
                self.assertLess(self.explained(folder, "large.stl")[1], most, f"MB for {len(f)} triangles")


if __name__ == "__main__":
    sys.exit(unittest.main(argv=sys.argv[:1]))
