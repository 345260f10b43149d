"""Judges layers of `palpate render` on closed meshes from the definition alone, by brute force. Needs numpy.

Usage: layer_oracle.py PALPATE FOLDER [--seed N] [--first N] [--count N] [--presses N] [--rows N] [--faces N] [--tool point|ray]

A layer holds all points of the solid (winding number above 0) that are at least a depth d away from every triangle. Its
surface is all that is felt here (stiffness 0 outside, one layer of K N/m). A tip is pressed along straight lines into each
mesh, and held against the definition in every row:
* without a force it is no deeper than d, unless it has not left the layer since it broke off;
* with one, the ideal tip (tip + force / K) is d deep, and no farther from the tip than the place where the tip came in;
* the force is at least K times what the tip is deeper than d: no point of the layer's surface is nearer.
All within 1.1 times the error that `palpate validate` states for the layer. With the stylus (ray) the ideal tip is not in the
layer.
"""

import argparse
import csv
import json
import pathlib
import re
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "shared"))

try:
    import numpy as np

    import closed_meshes
except ModuleNotFoundError as missing:
    if missing.name != "numpy":
        raise
    print("skipped: numpy is not installed")
    sys.exit(77)

STIFFNESS = 800.0


OVERLAP = {"gear_on_shaft", "lattice", "boxes"}  # kinds whose shells hide parts of each other's triangles
COARSEST, FINEST = 60, 500  # of the size: pieces of their triangles, and those on the border of what is hidden


def dot(x, y):
    return np.einsum("...i,...i->...", x, y)


def shells(v, f):
    """Of each triangle, the least corner of those that hang together with it; corners at one place are one."""
    corner = np.unique(v, axis=0, return_inverse=True)[1].ravel()[f]
    least = np.arange(corner.max() + 1)
    while True:
        before = least.copy()
        low = least[corner].min(axis=1)
        for k in range(3):
            np.minimum.at(least, corner[:, k], low)
        least = least[least]
        if (least == before).all():
            return least[corner[:, 0]]


class Solid:
    """Signed depth by brute force: the nearest of all triangles that bound the union, and the winding number."""

    def __init__(self, v, f, divide):
        shell = shells(v, f)
        self.shells = [[v[f[shell == s, k]] for k in range(3)] for s in np.unique(shell)]
        self.size = np.linalg.norm(np.ptp(v, axis=0))
        self.low, self.high = v.min(axis=0), v.max(axis=0)
        pieces = v[f]
        self.slack = self.size / FINEST if divide else 0
        if divide:
            pieces = self.seen(pieces)
        self.a, self.b, self.c = (pieces[:, k] for k in range(3))

    def seen(self, pieces):
        """The pieces of triangles that no shell hides. Where one is hidden in part, it is divided down to the slack."""
        out = []
        while len(pieces):
            sides = np.linalg.norm(pieces - np.roll(pieces, -1, axis=1), axis=2)
            longest = sides.max(axis=1)
            small, last = longest < self.size / COARSEST, longest < self.size / FINEST
            few = pieces[small]
            n = np.cross(few[:, 1] - few[:, 0], few[:, 2] - few[:, 0])
            middle = few.mean(axis=1)
            at = middle[:, None] + .98 * np.concatenate([0 * middle[:, None], few - middle[:, None]], axis=1)
            at += 1e-6 * self.size * (n / np.linalg.norm(n, axis=1)[:, None])[:, None]
            clear = self.winding(at.reshape(-1, 3)).reshape(-1, 4) <= 0
            out.append(few[np.where(last[small], clear[:, 0], clear.all(axis=1))])
            left = ~small
            left[small] = clear.any(axis=1) & ~clear.all(axis=1) & ~last[small]
            few, k = pieces[left], np.argmax(sides[left], axis=1)
            p, q, r = (few[np.arange(len(few)), (k + i) % 3] for i in range(3))
            pieces = np.concatenate([np.stack([p, (p + q) / 2, r], axis=1), np.stack([(p + q) / 2, q, r], axis=1)])
        return np.concatenate(out)

    def winding(self, p):
        """van Oosterom & Strackee 1983, of the shells whose box holds a place: it is outside the others."""
        out = np.zeros(len(p))
        for corners in self.shells:
            flat = np.concatenate(corners)
            some = np.flatnonzero(np.all((p >= flat.min(axis=0)) & (p <= flat.max(axis=0)), axis=1))
            for i in range(0, len(some), 64):
                a, b, c = (x[None] - p[some[i:i + 64], None] for x in corners)
                la, lb, lc = (np.sqrt(dot(x, x)) for x in (a, b, c))
                top = dot(a, np.cross(b, c))
                turns = np.arctan2(top, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
                out[some[i:i + 64]] += turns.sum(axis=1) / (2 * np.pi)
        return np.rint(out)

    def distances(self, p):
        """m, to the nearest triangle: to the foot on its plane, or to its sides."""
        n = np.cross(self.b - self.a, self.c - self.a)
        n2 = np.maximum(np.einsum("ij,ij->i", n, n), 1e-300)
        foot = p - (np.einsum("ij,ij->i", n, p - self.a) / n2)[:, None] * n
        inside, least2 = np.ones(len(n), bool), np.full(len(n), np.inf)
        for q, r in ((self.a, self.b), (self.b, self.c), (self.c, self.a)):
            way = r - q
            inside &= np.einsum("ij,ij->i", np.cross(way, foot - q), n) >= 0
            t = np.clip(np.einsum("ij,ij->i", p - q, way) / np.maximum(np.einsum("ij,ij->i", way, way), 1e-300), 0, 1)
            off = q + t[:, None] * way - p
            least2 = np.minimum(least2, np.einsum("ij,ij->i", off, off))
        off = foot - p
        return np.sqrt(np.where(inside, np.einsum("ij,ij->i", off, off), least2).min())

    def depth(self, p):
        """m, within `slack`."""
        winding = self.winding(p)
        return np.array([self.distances(q) * (1 if w > 0 else -1) for q, w in zip(p, winding)])


def presses(rng, solid, count, rows, reach):
    """Straight ways of a tip, from outside of the box to inside, and out again."""
    centre, radius = (solid.low + solid.high) / 2, solid.size / 2
    out, ends = [], []
    for _ in range(count):
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        aim = centre + rng.uniform(-.4, .4, 3) * (solid.high - solid.low)
        start, stop = aim - way * 1.3 * radius, aim + way * reach * rng.uniform(0, 2)
        across = np.cross(way, rng.normal(size=3))
        across /= np.linalg.norm(across)
        tip = start + np.linspace(0, 1, rows)[:, None] * (stop - start)
        out.append(np.hstack([tip, tip - .12 * (way + .3 * across) / np.sqrt(1.09)]))
    return out


def check(args, folder, n):
    name, v, f = closed_meshes.mesh(n, args.seed)
    if len(f) > (args.faces // 5 if name in OVERLAP else args.faces):
        return None
    rng = np.random.default_rng([args.seed, n, 1])
    solid = Solid(v, f, name in OVERLAP)
    probes = v.mean(axis=0) + rng.uniform(-.5, .5, (300, 3)) * (solid.high - solid.low)
    deepest = max(solid.depth(probes).max(), 1e-5)
    d = float(deepest * rng.uniform(.1, .6))
    mesh, scene = folder / f"{n}.obj", folder / f"{n}.json"
    closed_meshes.write(str(mesh), v, f)
    scene.write_text(json.dumps({"objects": [{"shape": "mesh", "file": mesh.name, "stiffness_n_per_m": 0,
                                              "layers": [{"depth_m": d, "stiffness_n_per_m": STIFFNESS}]}]}))
    began = time.monotonic()
    told = subprocess.run([args.palpate, "validate", scene], capture_output=True, text=True)
    load = time.monotonic() - began
    if told.returncode:
        return {"name": name, "refused": (told.stdout + told.stderr).strip(), "load": load}
    stated = re.search(r"wrong by up to ([\d.e+-]+) mm", told.stdout)
    told_error = float(stated[1]) * 1e-3 if stated else 0
    error = 1.1 * told_error + 1e-5 * solid.size + solid.slack
    faults, felt, fields = [], 0, "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z"
    paths = presses(rng, solid, args.presses, args.rows, solid.size / 4)
    path, out = folder / f"{n}.csv", folder / f"{n}-out.csv"
    # One path, with ways between the presses far outside.
    lines, where = [], []
    for k, rows in enumerate(paths):
        for j, row in enumerate(rows):
            where.append((k, j))
            lines.append(row)
        for row in (rows[::-1][::8][1:] if args.rows > 8 else rows[::-1]):
            where.append((k, -1))
            lines.append(row)
        where.append((k, -1))
        lines.append(rows[0])
        far = (solid.low + solid.high) / 2
        for share in np.linspace(0, 1, 6)[1:-1]:
            a, b = rows[0], paths[(k + 1) % len(paths)][0]
            mid = (1 - share) * a + share * b
            for part in (slice(0, 3), slice(3, 6)):
                r = mid[part] - far
                mid[part] = far + r / max(np.linalg.norm(r), 1e-9) * (.7 * solid.size + (.12 if part.start else 0))
            where.append((k, -1))
            lines.append(mid)
    path.write_text(fields + "\n" + "\n".join(f"{i * .01!r}," + ",".join(map(repr, map(float, row))) for i, row in enumerate(lines)) + "\n")
    told = subprocess.run([args.palpate, "render", "--scene", scene, "--renderer", args.tool, "--trajectory", path, "--out", out, "--force"],
                          capture_output=True, text=True)
    if told.returncode:
        return {"name": name, "refused": told.stderr.strip(), "load": load}
    with open(out, newline="") as file:
        rows = list(csv.DictReader(file))
    last, entered = -1, None
    for (k, j), row, pose in zip(where, rows, lines):
        if k != last:
            last, entered, off = k, None, False
        if j < 0:
            continue
        off = off or row["faults"] not in ("", "none")
        if off:
            continue
        tip, force = pose[:3], np.array([float(row[f"force_{x}"]) for x in "xyz"])
        size = np.linalg.norm(force)
        if size == 0 and args.tool == "point":
            if np.all(tip > solid.low + d) and np.all(tip < solid.high - d):
                deep = solid.depth(tip[None])[0]
                if deep > d + error:
                    faults.append(f"press {k} row {j}: no force {deep - d:.3g} m below the layer's surface")
            entered = tip
            continue
        if size == 0:
            continue
        felt += 1
        ideal = tip + force / STIFFNESS if args.tool == "point" else np.array([float(row[f"ideal_tip_{x}"]) for x in "xyz"])
        deep = solid.depth(np.array([ideal, tip]))
        if args.tool == "ray":
            if deep[0] > d + error:
                faults.append(f"press {k} row {j}: the ideal tip is {deep[0] - d:.3g} m inside the layer")
            continue
        if abs(deep[0] - d) > error:
            faults.append(f"press {k} row {j}: the ideal tip is {deep[0] - d:.3g} m off the layer's surface")
        if size / STIFFNESS < deep[1] - d - error:
            faults.append(f"press {k} row {j}: force {size:.3g} N, and the tip is {deep[1] - d:.3g} m in the layer")
        if entered is not None and size / STIFFNESS > np.linalg.norm(tip - entered) + error:
            faults.append(f"press {k} row {j}: the ideal tip is {size / STIFFNESS:.3g} m away, farther than the way in")
    return {"name": name, "faults": faults, "felt": felt, "load": load, "error": told_error / d, "faces": len(f), "depth": d}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("palpate")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--presses", type=int, default=10)
    parser.add_argument("--rows", type=int, default=40)
    parser.add_argument("--faces", type=int, default=3000, help="larger meshes are left out, a fifth for shells that overlap")
    parser.add_argument("--tool", choices=("point", "ray"), default="point")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    meshes = refused = wrong = felt = faulty = 0
    loads, errors = [], []
    for n in range(args.first, args.first + args.count):
        result = check(args, args.folder, n)
        if result is None:
            continue
        meshes += 1
        loads.append(result["load"])
        if "refused" in result:
            refused += 1
            print(f"mesh {n} ({result['name']}): refused: {result['refused']}", flush=True)
            continue
        errors.append(result["error"])
        felt += result["felt"]
        wrong += len(result["faults"])
        faulty += bool(result["faults"])
        for fault in result["faults"][:3]:
            print(f"mesh {n} ({result['name']}, {result['faces']} faces, {result['depth']:.4g} m): {fault}", flush=True)
    loads, errors = np.sort(loads or [0]), errors or [0]
    print(f"{meshes} meshes, {refused} refused, {felt} rows with force, {wrong} wrong in {faulty} meshes; load median "
          f"{np.median(loads):.2f} s, p99 {np.quantile(loads, .99):.2f} s, worst {loads[-1]:.2f} s; stated error of the depth median "
          f"{100 * np.median(errors):.1f} %, worst {100 * max(errors):.1f} %")
    sys.exit(1 if wrong or refused or not felt else 0)


if __name__ == "__main__":
    main()
