"""Judges `palpate render` on closed meshes from the definition alone, by brute force. Needs numpy.

Usage: surface_oracle.py PALPATE FOLDER [--seed N] [--first N] [--count N] [--tool point|ray|bent] [--rows N] [--faces N]
                         [--relations]
Writes meshes, paths and results to FOLDER and prints each fault. Exit status 1 when something is wrong.

Held against the surface, tick by tick: no part of the ideal tool lies in the solid (winding number); the force is k times
the way from the virtual tool to the ideal one; it is a sum >= 0 of outward normals of patches that the ideal tool touches
(a facet touched by an end; a convex edge, seen on its silhouette, crossed by a segment), and the torque is what those
forces give at the places where they touch. With --relations instead: the same surface turned, ten times as large, with its
triangles divided, with other diagonals in its flat faces or with a shell buried in it gives the same forces.
"""

import argparse
import csv
import json
import os
import pathlib
import subprocess
import sys

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
TOOLS = {"point": None, "ray": None,
         "bent": [[(0, 0, 0), (0, 0, .12)], [(0, 0, 0), (.02, 0, .01)], [(.02, 0, .01), (.02, .02, .01)]]}
NEARLY_PARALLEL = np.sin(np.radians(1)) * (1 + 1e-9)  # equation (2) holds within one degree


def dot(a, b):
    return np.einsum("...i,...i->...", a, b)


def unit(a):
    length = np.linalg.norm(a, axis=1)
    return a / np.where(length > 0, length, 1)[:, None]


class Surface:
    """Triangles, and what follows of them by definition."""

    def __init__(self, v, f):
        self.v, self.f = v, f
        self.size = np.linalg.norm(np.ptp(v, axis=0))
        self.a, self.b, self.c = (v[f[:, k]] for k in range(3))
        n = np.cross(self.b - self.a, self.c - self.a)
        self.low, self.high = (least(least(self.a, self.b), self.c) for least in (np.minimum, np.maximum))
        self.area = np.linalg.norm(n, axis=1)
        self.n = n / np.where(self.area > 0, self.area, 1)[:, None]
        self.inward = [unit(np.cross(self.n, y - x)) for x, y in ((self.a, self.b), (self.b, self.c), (self.c, self.a))]
        self.edges()

    def edges(self):
        """All pairs of triangles that run along an edge opposite ways: with more than two, every such pair."""
        sides = {}
        for t, (i, j, k) in enumerate(self.f.tolist()):
            for p, q, r in ((i, j, k), (j, k, i), (k, i, j)):
                sides.setdefault((p, q), []).append((t, r))
        rows = []
        for (p, q), there in sides.items():
            for t, _ in there:
                for s, r in sides.get((q, p), []):
                    if p < q:
                        rows.append((p, q, t, s, r))
        rows = np.array(rows)
        self.beyond = [[] for _ in self.f]  # of each triangle, those across its sides
        for t, s in rows[:, 2:4].tolist():
            self.beyond[t].append(s)
            self.beyond[s].append(t)
        self.e0, self.e1 = self.v[rows[:, 0]], self.v[rows[:, 1]]
        self.left, self.right = self.n[rows[:, 2]], self.n[rows[:, 3]]
        height = dot(self.left, self.v[rows[:, 4]] - self.e0)  # the other triangle's far corner over this one's plane
        keep = height < 1e-9 * self.size  # convex, or flat within rounding
        self.e0, self.e1, self.left, self.right = (x[keep] for x in (self.e0, self.e1, self.left, self.right))

    def winding(self, points):
        """van Oosterom & Strackee 1983."""
        out = []
        for p in points:
            a, b, c = self.a - p, self.b - p, self.c - p
            la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
            out.append(np.arctan2(dot(a, np.cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb).sum()
                       / (2 * np.pi))
        return np.array(out)

    def near(self, p, tolerance):
        """The triangles that a point is closer to than the tolerance."""
        some = np.flatnonzero(((p > self.low - tolerance) & (p < self.high + tolerance)).all(1))
        a, b, c, n = (x[some] for x in (self.a, self.b, self.c, self.n))
        h = dot(p - a, n)
        best = np.full(len(some), np.inf)
        over = np.ones(len(some), bool)
        for x, y in ((a, b), (b, c), (c, a)):
            d = y - x
            over &= dot(np.cross(d, p - x), n) >= 0
            t = np.clip(dot(p - x, d) / dot(d, d), 0, 1)
            best = np.minimum(best, np.linalg.norm(p - x - t[:, None] * d, axis=1))
        return some[np.where(over, np.abs(h), best) < tolerance]

    def crossings(self, p, q):
        """Where the segment from p to q passes through triangles, as parts of its length."""
        d = q - p
        hp, hq = dot(p - self.a, self.n), dot(q - self.a, self.n)
        some = np.flatnonzero((hp > 0) != (hq > 0))
        t = hp[some] / (hp[some] - hq[some])
        x = p + t[:, None] * d
        inside = np.ones(len(some), bool)
        for u, w in ((self.a, self.b), (self.b, self.c), (self.c, self.a)):
            inside &= dot(np.cross(w[some] - u[some], x - u[some]), self.n[some]) >= -1e-9 * self.area[some]
        return t[inside]


def sum_of(generators, wanted, steps=200):
    """Least residual of a sum >= 0 of the generators' rows (Lawson & Hanson 1974)."""
    a = generators.T
    x = np.zeros(a.shape[1])
    active = np.zeros(a.shape[1], bool)
    residual = wanted - a @ x
    for _ in range(steps):
        gain = a.T @ residual
        gain[active] = -1
        if gain.size == 0 or gain.max() <= 1e-13 * np.linalg.norm(wanted):
            break
        active[gain.argmax()] = True
        for _ in range(steps):
            z = np.zeros_like(x)
            z[active] = np.linalg.lstsq(a[:, active], wanted, rcond=1e-12)[0]
            if (z[active] > 0).all():
                break
            bad = active & (z <= 0)
            step = (x[bad] / np.maximum(x[bad] - z[bad], 1e-300)).min()
            x += step * (z - x)
            active &= x > 1e-15 * max(x.max(), 1e-300)
            x[~active] = 0
        x = z
        residual = wanted - a @ x
    return np.linalg.norm(residual)


class Judge:
    def __init__(self, surface, tolerance):
        self.s, self.tolerance = surface, tolerance

    def inside(self, p, q):
        """Whether some of the segment is inside by more than the tolerance."""
        t = np.concatenate([[0, 1], self.s.crossings(p, q)]) if (p != q).any() else np.zeros(1)
        t.sort()
        middle = np.concatenate([t, (t[1:] + t[:-1]) / 2])
        points = p + middle[:, None] * (q - p)
        off = [x for x in points if not len(self.s.near(x, self.tolerance))]
        return (self.s.winding(off) > .5).any()

    def generators(self, segments, reference):
        """(normal, place) of all patches that segments touch."""
        out = []
        for p, q in segments:
            is_point = (p == q).all()
            d = q - p
            slope = np.zeros(len(self.s.f)) if is_point else self.s.n @ d / np.linalg.norm(d)
            out += self.at_ends(p, q, slope, is_point)
            if is_point:
                continue
            out += self.at_edges(p, d)
            # Equation (2): somewhere on the portion that lies along a facet, with the touched patch's own normal.
            flat = np.abs(slope) <= NEARLY_PARALLEL
            for n_touched, place in list(out):
                along = np.flatnonzero(flat & (self.s.n @ n_touched > 0))
                if len(along):
                    near = np.intersect1d(along, self.s.near(place, self.tolerance))
                    out += [(n_touched, p + k * d) for k in self.portions(near, flat, p, q)]
        return out

    def portions(self, near, flat, p, q):
        """The outermost ends of what lies over triangles, one after the other from `near` on, within one degree of the segment."""
        found, seen, left, known = [], set(near), list(near), {}
        while left:
            t = left.pop()
            if t not in known:
                plane, over = self.portion(t, p, q)
                known.update(dict.fromkeys(plane, over))
            over = known[t]
            found += over
            if over:
                left += [s for s in self.s.beyond[t] if flat[s] and s not in seen]
                seen.update(self.s.beyond[t])
        return [min(found), max(found)] if found else []  # all between are sums of these

    def at_ends(self, p, q, slope, is_point):
        """Facets that an end touches: the end that points into the facet; both where the segment lies along it."""
        out = []
        for end, sign in ((p, 1),) if is_point else ((p, 1), (q, -1)):
            out += [(self.s.n[t], end) for t in self.s.near(end, self.tolerance) if sign * slope[t] > -NEARLY_PARALLEL]
        return out

    def at_edges(self, p, d):
        """Convex edges, seen on their silhouette, that the segment from p to p + d crosses."""
        s, length = self.s, np.linalg.norm(d)
        e = s.e1 - s.e0
        cross = np.cross(e, d)
        norm = np.linalg.norm(cross, axis=1)
        n = cross / np.where(norm > 0, norm, 1)[:, None]
        silhouette = (s.left @ d) * (s.right @ d) <= 1e-12 * length ** 2
        # Nearest places of line and segment.
        w = p - s.e0
        ee, ed, dd, ew, dw = dot(e, e), e @ d, d @ d, dot(e, w), w @ d
        det = ee * dd - ed ** 2
        u = np.where(det > 0, (dd * ew - ed * dw) / np.where(det > 0, det, 1), 0)
        u = np.clip(u, 0, 1)
        t = np.clip((u * ed - dw) / dd, 0, 1)
        u = np.clip((t * ed + ew) / ee, 0, 1)
        gap = np.linalg.norm(s.e0 + u[:, None] * e - p - t[:, None] * d, axis=1)
        out = []
        for i in np.flatnonzero(silhouette & (norm > 1e-9 * np.sqrt(ee) * length) & (gap < self.tolerance)):
            outward = n[i] if n[i] @ (s.left[i] + s.right[i]) > 0 else -n[i]
            out.append((outward, p + t[i] * d))
        return out

    def portion(self, t, p, q):
        """The triangles in t's plane, and the outermost ends of what lies over them."""
        s = self.s
        plane = np.flatnonzero((s.n @ s.n[t] > 1 - 1e-8) & (np.abs((s.a - s.a[t]) @ s.n[t]) < self.tolerance))
        low, high = np.zeros(len(plane)), np.ones(len(plane))
        for x, inward in zip((s.a, s.b, s.c), s.inward):
            hp, hq = (dot(end - x[plane], inward[plane]) + self.tolerance for end in (p, q))
            cut = hp / np.where(hp == hq, 1, hp - hq)
            high[(hp < 0) & (hq < 0)] = -1
            low = np.where((hp < 0) & (hq >= 0), np.maximum(low, cut), low)
            high = np.where((hp >= 0) & (hq < 0), np.minimum(high, cut), high)
        over = low <= high
        return plane.tolist(), [low[over].min(), high[over].max()] if over.any() else []

    def pushed(self, segments, tip, force, torque):
        """What is wrong with force and torque, or nothing."""
        touched = self.generators(segments, tip)
        if not touched:
            return "force, but nothing is touched"
        f, scale = np.linalg.norm(force), .05
        normals = np.unique(np.round([n for n, _ in touched], 9), axis=0)
        if sum_of(normals, force) > 1e-3 * f:
            return "force of no touched patch"
        wrenches = np.array([np.concatenate([n, np.cross(x - tip, n) / scale]) for n, x in touched])
        if len(segments) > 1 or (segments[0][0] != segments[0][1]).any():
            wrong = sum_of(wrenches, np.concatenate([force, torque / scale]))
            if wrong > 2e-3 * f + 10 * f * self.tolerance / scale:
                return f"torque of no touched place ({wrong / f:.2g} of the force)"
        return ""


def path(surface, rng, rows):
    """Presses in from outside at random places, slides along, comes out; the stylus leans."""
    way = []
    for _ in range(rows):
        t = rng.choice(len(surface.f), p=surface.area / surface.area.sum())
        at = rng.dirichlet([1, 1, 1]) @ surface.v[surface.f[t]]
        n = surface.n[t]
        along = np.cross(n, rng.normal(size=3))
        along /= np.linalg.norm(along)
        lean = n + rng.uniform(0, 1.5) * rng.normal(size=3)
        lean /= np.linalg.norm(lean)
        turned = lean + .3 * rng.normal(size=3)
        turned /= np.linalg.norm(turned)
        press, slide, far = rng.uniform(.0002, .004), rng.uniform(.005, .03), 2 * surface.size + .2
        outside = at + n * far
        tips = [outside + (at - n * press - outside) * s for s in np.linspace(0, 1, 200)]
        tips += [at - n * press + along * s for s in np.linspace(0, slide, 300)]
        end = tips[-1]
        tips += [end + n * s for s in np.linspace(0, far, 150)]
        mix = np.clip((np.arange(len(tips)) - 200) / 300, 0, 1)[:, None]
        axis = lean * (1 - mix) + turned * mix
        if way:  # round the object, not through it
            middle = (surface.v.max(0) + surface.v.min(0)) / 2
            p, q = way[-1][-1, :3] - middle, outside - middle
            s = np.linspace(0, 1, 60)[1:-1, None]
            round_it = p * (1 - s) + q * s + np.cross(p, q) * (s * (1 - s) / np.linalg.norm(p))
            round_it *= max(np.linalg.norm(p), np.linalg.norm(q)) / np.linalg.norm(round_it, axis=1)[:, None]
            tips = list(middle + round_it) + tips
            axis = np.vstack([np.linspace(way[-1][-1, 3:] - way[-1][-1, :3], axis[0], len(s)), axis])
        way.append(np.hstack([tips, tips + .12 * axis / np.linalg.norm(axis, axis=1)[:, None]]))
    return np.vstack(way)


def column(rows, name):
    return np.array([[float(r[f"{name}_{k}"]) for k in "xyz"] for r in rows])


def segments_of(tool, tip, tail, side):
    if tool is None:
        return [(tip, tail)]
    z = tail - tip
    z = z / np.linalg.norm(z)
    x = side - (side @ z) * z
    x /= np.linalg.norm(x)
    frame = np.stack([x, np.cross(z, x), z], 1)
    return [(tip + frame @ np.array(a), tip + frame @ np.array(b)) for a, b in tool]


def render(o, scene, trajectory, out):
    renderer = "point" if o.tool == "point" else "ray"
    return subprocess.run([o.palpate, "render", "--scene", scene, "--renderer", renderer, "--trajectory", trajectory, "--out", out,
                           "--force"], capture_output=True, text=True)


def judge(o, name, v, f, rng):
    """Faults of one mesh as text; None: refused."""
    surface = Surface(v, f)
    stem = f"{name}-{o.tool}"
    json.dump(scene_of(o, name), open(stem + ".json", "w"))
    way = path(surface, rng, o.presses)
    np.savetxt(stem + ".csv", np.hstack([np.arange(len(way))[:, None] / 1000, way]), "%.17g", ",",
               header="t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z", comments="")
    run = render(o, stem + ".json", stem + ".csv", stem + "-out.csv")
    if run.returncode:
        print(f"{stem}: exit {run.returncode} {run.stderr.strip()[:200]}")
        return None
    rows = list(csv.DictReader(open(stem + "-out.csv")))
    force, torque, tip, tail = (column(rows, x) for x in ("force", "torque", "ideal_tip", "ideal_tail"))
    side = column(rows, "ideal_side") if TOOLS[o.tool] else tip
    judged = Judge(surface, 1e-6 * surface.size)
    felt = np.flatnonzero(np.linalg.norm(force, axis=1) > 1e-3)
    faults = {}
    for k in felt[::max(1, len(felt) // o.rows)]:
        segments = [(tip[k], tip[k])] if o.tool == "point" else segments_of(TOOLS[o.tool], tip[k], tail[k], side[k])
        said = []
        if any(judged.inside(p, q) for p, q in segments):
            said.append("inside")
        turned = np.linalg.norm((tail[k] - tip[k]) - (way[k, 3:] - way[k, :3])) > 1e-9
        lag = STIFFNESS * (tip[k] - way[k, :3])
        if (o.tool == "point" or not turned) and not TOOLS[o.tool] and np.linalg.norm(force[k] - lag) > 1e-6 * np.linalg.norm(lag) + 1e-9:
            said.append("force is not k times the way from the virtual tool to the ideal one")
        if wrong := judged.pushed(segments, tip[k], force[k], torque[k]):
            said.append(wrong)
        for what in said:
            faults.setdefault(what.split(" (")[0], []).append((int(k), what))
    if not len(felt):
        faults["never in contact"] = [(0, "")]
    text = "; ".join(f"{what}: {len(at)} of {len(felt[::max(1, len(felt) // o.rows)])}, first row {at[0][0]} {at[0][1][len(what):]}"
                     for what, at in faults.items())
    capped = sum("capped" in r.get("faults", "") for r in rows)
    return text + (f" [{capped} ticks capped]" if capped else "")


def scene_of(o, name):
    scene = {"objects": [{"shape": "mesh", "file": os.path.basename(name), "stiffness_n_per_m": STIFFNESS}]}
    if TOOLS[o.tool]:
        scene["tool"] = {"segments": [{"from_m": a, "to_m": b} for a, b in TOOLS[o.tool]]}
    return scene


def forces(o, stem, v, f, way):
    """Rendered along the way, or None where it is refused."""
    closed_meshes.write(stem + ".obj", v, f)
    json.dump(scene_of(o, stem + ".obj"), open(stem + ".json", "w"))
    np.savetxt(stem + ".csv", np.hstack([np.arange(len(way))[:, None] / 1000, way]), "%.17g", ",",
               header="t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z", comments="")
    run = render(o, stem + ".json", stem + ".csv", stem + "-out.csv")
    if run.returncode:
        print(f"{stem}: exit {run.returncode} {run.stderr.strip()[:200]}")
        return None
    return column(list(csv.DictReader(open(stem + "-out.csv"))), "force")


def divided(v, f):
    """Each triangle in four."""
    e = np.sort(np.vstack([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), 1)
    edges, index = np.unique(e, axis=0, return_inverse=True)
    a, b, c = (index[k * len(f):(k + 1) * len(f)] + len(v) for k in range(3))
    return (np.vstack([v, (v[edges[:, 0]] + v[edges[:, 1]]) / 2]),
            np.vstack([np.stack(t, 1) for t in ((f[:, 0], a, c), (f[:, 1], b, a), (f[:, 2], c, b), (a, b, c))]))


def other_diagonals(v, f, rng):
    """Flips the edge between some pairs of triangles that lie in one plane and together are convex."""
    f = f.copy()
    n = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
    n /= np.linalg.norm(n, axis=1)[:, None]
    side = {}
    for t, (i, j, k) in enumerate(f.tolist()):
        for p, q, r in ((i, j, k), (j, k, i), (k, i, j)):
            side.setdefault((p, q), []).append((t, r))
    done = set()
    for (p, q), there in list(side.items()):
        back = side.get((q, p), [])
        if p > q or len(there) != 1 or len(back) != 1 or rng.random() < .3:
            continue
        (t, r), (u, w) = there[0], back[0]
        if t in done or u in done or n[t] @ n[u] < 1 - 1e-14 or (r, w) in side or (w, r) in side:
            continue
        turns = [np.cross(v[x] - v[w], v[r] - v[x]) @ n[t] for x in (q, p)]
        if turns[0] > 1e-9 * np.linalg.norm(v[p] - v[q]) ** 2 and turns[1] < -1e-9 * np.linalg.norm(v[p] - v[q]) ** 2:
            f[t], f[u] = (w, q, r), (r, p, w)
            done |= {t, u}
            side[(r, w)] = side[(w, r)] = []
    return v, f


def relations(o, name, v, f, rng):
    """Relations that do not hold, as text; None: refused."""
    way = path(Surface(v, f), rng, o.presses)
    first = forces(o, name, v, f, way)
    if first is None:
        return None
    r = closed_meshes.rotation(rng)
    deepest = v[f].mean(1).mean(0)
    inner = closed_meshes.box(np.full(3, 1e-5), deepest)
    variants = {"turned": (v @ r.T, f, np.hstack([way[:, :3] @ r.T, way[:, 3:] @ r.T]), r, 1),
                "divided": (*divided(v, f), way, np.eye(3), 1),
                "other diagonals": (*other_diagonals(v, f, rng), way, np.eye(3), 1),
                "twice": (*closed_meshes.joined((v, f), (v, f)), way, np.eye(3), 1)}
    if TOOLS[o.tool] is None:
        variants["ten times as large"] = (10 * v, f, 10 * way, np.eye(3), 10)
    else:
        del variants["turned"]  # the tool's +x begins along an axis of the world
    if Surface(v, f).winding(deepest[None])[0] > .5:
        variants["with a shell inside"] = (*closed_meshes.joined((v, f), inner), way, np.eye(3), 1)
    text = []
    for what, (w, g, other_way, turn, scale) in variants.items():
        second = forces(o, f"{name}-{what.replace(' ', '-')}", w, g, other_way)
        if second is None:
            text.append(f"{what}: refused")
            continue
        apart = np.linalg.norm(second @ turn / scale - first, axis=1)
        off = np.flatnonzero(apart > 1e-6 * np.maximum(1, np.linalg.norm(first, axis=1)))
        # At a corner the way may fork by rounding, and what follows of that press is another one.
        if len(off) > .01 * len(way):
            text.append(f"{what}: {len(off)} of {len(way)} ticks differ, first row {off[0]} by {apart[off[0]]:.2g} N")
    return "; ".join(text)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("palpate")
    p.add_argument("folder")
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--first", type=int, default=0)
    p.add_argument("--count", type=int, default=20)
    p.add_argument("--tool", choices=TOOLS, default="ray")
    p.add_argument("--rows", type=int, default=60, help="of those in contact, looked at")
    p.add_argument("--presses", type=int, default=4)
    p.add_argument("--relations", action="store_true")
    p.add_argument("--faces", type=int, default=6000, help="larger meshes are left out")
    o = p.parse_args()
    os.makedirs(o.folder, exist_ok=True)
    wrong = refused = seen = 0
    for n in range(o.first, o.first + o.count):
        kind, v, f = closed_meshes.mesh(n, o.seed)
        if len(f) > o.faces:
            continue
        seen += 1
        digits = [None, "float32", 8, 9][n % 4]
        v = v.astype(np.float32).astype(float) if digits == "float32" else v if digits is None else np.round(v, digits)
        stem, rng = f"{o.folder}/{o.seed}-{n}-{kind}", np.random.default_rng([o.seed, n, 1])
        name = stem + ".obj"
        closed_meshes.write(name, v, f)
        text = relations(o, f"{stem}-{o.tool}", v, f, rng) if o.relations else judge(o, name, v, f, rng)
        if text is None:
            refused += 1
        elif text:
            wrong += not text.startswith(" [")
            print(f"{name} ({digits}, {len(f)} triangles, {o.tool}): {text}", flush=True)
    print(f"{seen} meshes with {o.tool}: {wrong} wrong, {refused} refused")
    return 1 if wrong or refused else 0


if __name__ == "__main__":
    sys.exit(main())
