#!/usr/bin/env python3
"""Writes the scenes of the paper's figures and a short path for each beside this file. SI units, z up."""

import json
import math
import pathlib

FOLDER = pathlib.Path(__file__).resolve().parent
STEP = 0.005  # s, between the rows of a path


def write_scene(name, scene):
    objects = ",\n    ".join(json.dumps(o) for o in scene.pop("objects"))
    more = "".join(f',\n  "{key}": {json.dumps(value)}' for key, value in scene.items())
    (FOLDER / f"{name}.json").write_text(f'{{\n  "$schema": "../scene.schema.json",\n  "objects": [\n    {objects}\n  ]{more}\n}}\n')


def write_path(name, seconds, pose, sides=False):
    """pose(t) gives tip and tail, and with `sides` the tool's +x."""
    header = "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z" + (",side_x,side_y,side_z" if sides else "")
    rows = [header]
    for k in range(round(seconds / STEP) + 1):
        t = k * STEP
        rows.append(",".join(f"{v + 0.0:.6g}" for v in [t, *(x for point in pose(t) for x in point)]))
    (FOLDER / f"{name}.csv").write_text("\n".join(rows) + "\n")


def along(t, *keys):
    """Between (time, values) from one to the next, at rest at each."""
    for (t0, a), (t1, b) in zip(keys, keys[1:]):
        if t <= t1:
            f = min(max((t - t0) / (t1 - t0), 0), 1)
            f = f * f * (3 - 2 * f)
            return tuple(x + f * (y - x) for x, y in zip(a, b))
    return keys[-1][1]


def add(a, b, factor=1):
    return tuple(x + factor * y for x, y in zip(a, b))


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v)


def turned(angle):
    """About +z, rad."""
    return [math.cos(angle / 2), 0, 0, math.sin(angle / 2)]


def lying(angle):
    """A thing's own +z becomes -y, and is then turned about the world's +z, rad."""
    c, s = math.sqrt(0.5) * math.cos(angle / 2), math.sqrt(0.5) * math.sin(angle / 2)
    return [c, c, s, s]


def extended_probe():
    """Fig. 3b: distant objects, felt with a stylus that reaches five times as far."""
    write_scene("fig3b-extended-probe", {
        "objects": [
            {"shape": "sphere", "radius_m": 0.045, "position_m": [-0.07, 0.2, 0.045]},
            {"shape": "cube", "edge_m": 0.08, "position_m": [0.07, 0.2, 0.04], "orientation_wxyz": turned(0.5)}],
        "reach": {"factor": 4, "pivot": "tail"}})

    def pose(t):
        aim = along(t, (0, (-0.09, 0.13, 0.12)), (0.8, (-0.065, 0.162, 0.072)), (1.5, (-0.05, 0.166, 0.066)), (2, (0.01, 0.15, 0.12)),
                    (2.6, (0.06, 0.18, 0.0765)), (3.2, (0.085, 0.2, 0.0765)), (3.6, (0.08, 0.17, 0.12)))
        tail = (-0.02, -0.17, 0.16)
        return add(tail, add(aim, tail, -1), 0.25), tail

    write_path("fig3b-extended-probe", 3.6, pose)


def two_objects():
    """Fig. 13: the probe rests on two objects; their forces add up to one force and torque."""
    write_scene("fig13-two-objects", {"objects": [
        {"shape": "sphere", "radius_m": 0.026, "position_m": [-0.05, 0, 0.026]},
        {"shape": "cube", "edge_m": 0.046, "position_m": [0.05, 0, 0.023], "orientation_wxyz": turned(0.6)}]})

    def pose(t):
        left, right, y = along(t, (0, (0.075, 0.070, -0.010)), (0.6, (0.049, 0.043, -0.010)), (1.2, (0.048, 0.044, 0.012)),
                               (1.8, (0.051, 0.041, -0.012)), (2.4, (0.047, 0.048, 0)), (3, (0.07, 0.08, 0)))
        return (-0.085, y, left), (0.115, y, right)

    write_path("fig13-two-objects", 3, pose)


class Parts:
    """A mesh of convex parts, each a group of its own."""

    def __init__(self, title):
        self.lines, self.count, self.groups = [f"# {title}; written by make_scenes.py; m"], 0, 0

    def prism(self, outline, low, high):
        """An outline in x and y, from z = low to high."""
        area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(outline, outline[1:] + outline[:1]))
        if area < 0:  # clockwise seen from above
            outline = outline[::-1]
        n = len(outline)
        self.groups += 1
        self.lines.append(f"g part{self.groups}")
        self.lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for z in (low, high) for x, y in outline]
        faces = [list(range(n - 1, -1, -1)), list(range(n, 2 * n))]
        faces += [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
        self.lines += ["f " + " ".join(str(self.count + k + 1) for k in face) for face in faces]
        self.count += 2 * n

    def write(self, name):
        (FOLDER / name).write_text("\n".join(self.lines) + "\n")


def circle(x, y, radius, sides, turn=0.0):
    return [(x + radius * math.cos(turn + 2 * math.pi * k / sides), y + radius * math.sin(turn + 2 * math.pi * k / sides)) for k in range(sides)]


BORES, PITCH, BORE = [-0.039, -0.013, 0.013, 0.039], 0.026, 0.0095  # m


def engine():
    """Fig. 17a: an engine block of convex parts and a tool of two segments."""
    mesh = Parts("an engine block, 120 mm long, four bores: convex parts as groups")
    mesh.prism([(-0.058, -0.024), (0.058, -0.024), (0.058, 0.024), (-0.058, 0.024)], 0.006, 0.022)
    mesh.prism([(-0.064, -0.032), (0.064, -0.032), (0.064, 0.032), (-0.064, 0.032)], 0, 0.006)
    half = PITCH / 2
    for x in BORES:
        # Each piece lies between two corners of the bore and the square about it.
        ring = circle(x, 0, BORE, 16, math.pi / 16)
        for k in range(16):
            a, b = ring[k], ring[(k + 1) % 16]
            out = [(x + (p[0] - x) * half / max(abs(p[0] - x), abs(p[1])), p[1] * half / max(abs(p[0] - x), abs(p[1]))) for p in (a, b)]
            corner = []
            if k in (1, 5, 9, 13):  # a corner of the square lies between
                corner = [(x + math.copysign(half, out[0][0] - x), math.copysign(half, out[0][1]))]
            mesh.prism([a, out[0], *corner, out[1], b], 0.022, 0.056)
    for side in (-1, 1):
        mesh.prism([(-0.052, side * half), (0.052, side * half), (0.052, side * (half + 0.005)), (-0.052, side * (half + 0.005))], 0.022, 0.05)
        for x in (-0.026, 0, 0.026):
            mesh.prism(circle(x, side * (half + 0.0022), 0.0032, 6), 0.05, 0.0545)
            mesh.prism([(x - 0.003, side * half), (x + 0.003, side * half), (x + 0.003, side * (half + 0.013)), (x - 0.003, side * (half + 0.013))], 0.006, 0.03)
    mesh.write("engine.obj")
    write_scene("fig17a-engine", {
        "objects": [{"shape": "mesh", "file": "engine.obj"}],
        "tool": {"segments": [{"from_m": [0, 0, 0], "to_m": [0, 0, 0.13]}, {"from_m": [0, 0, 0], "to_m": [0.014, 0, 0.003]}]}})

    def pose(t):
        # The hooked end goes into the second bore, turns under a finger's pressure, and comes out to the deck.
        x, y, z, turn, lean = along(
            t, (0, (-0.02, -0.012, 0.10, 0.4, 0)), (0.8, (-0.0165, -0.001, 0.046, 0.4, 0)), (1.2, (-0.0128, -0.001, 0.044, 0.4, 0.06)),
            (2.2, (-0.0140, -0.002, 0.042, 2.2, 0.1)), (2.8, (-0.0140, -0.001, 0.07, 2.2, 0)), (3.3, (0.004, -0.008, 0.054, 1.9, 0.12)),
            (4, (0.02, -0.004, 0.0535, 1.9, 0.12)))
        tip = (x, y, z)
        axis = unit((lean, -0.3 * lean, 1))
        return tip, add(tip, axis, 0.12), (math.cos(turn), math.sin(turn), 0)

    write_path("fig17a-engine", 4, pose, sides=True)


def surgery():
    """Fig. 17b: an instrument of three segments on a flexible object."""
    write_scene("fig17b-instrument", {
        "objects": [
            {"shape": "sphere", "radius_m": 0.045, "subdivisions": 3, "stiffness_n_per_m": 800,
             "soft": {"young_pa": 15000, "resolution": 8}}],
        "tool": {"segments": [{"from_m": [0, 0, 0.022], "to_m": [0, 0, 0.15]}, {"from_m": [0, 0, 0.022], "to_m": [0.009, 0, 0]},
                              {"from_m": [0, 0, 0.022], "to_m": [-0.009, 0, 0]}], "radius_m": 0.0025}})

    def pose(t):
        x, y, z, lean = along(t, (0, (0.02, -0.02, 0.085, 0.2)), (0.7, (0.005, -0.006, 0.056, 0.25)), (1.3, (0.002, -0.005, 0.036, 0.3)),
                              (2.0, (-0.012, -0.003, 0.034, 0.1)), (2.6, (0.010, -0.006, 0.036, 0.4)), (3.2, (0.02, -0.02, 0.08, 0.2)))
        tip = (x, y, z)
        axis = unit((lean, -0.45, 1))
        return tip, add(tip, axis, 0.13), (0, -1, -0.45)

    write_path("fig17b-instrument", 3.2, pose, sides=True)


def layers():
    """Layers of other stiffness under a surface, with an outer one that gives way."""
    write_scene("layers", {"objects": [
        {"shape": "cylinder", "radius_m": 0.04, "height_m": 0.05, "position_m": [0, 0, 0.025], "stiffness_n_per_m": 60,
         "layers": [{"depth_m": 0.007, "stiffness_n_per_m": 250, "break_n": 2.5}, {"depth_m": 0.016, "stiffness_n_per_m": 900}]}]})

    def pose(t):
        tip = along(t, (0, (0.03, -0.03, 0.085)), (0.6, (0.012, -0.012, 0.052)), (1.6, (0.006, -0.006, 0.031)), (2.2, (-0.006, 0, 0.0305)),
                    (2.8, (-0.004, 0, 0.05)), (3.2, (0, 0, 0.08)))
        return tip, add(tip, unit((0.3, -0.2, 1)), 0.12)

    write_path("layers", 3.2, pose)


def dumbbells():
    """Fig. 14: two floating dumbbells, touched and moved at the same time with one stylus."""
    def dumbbell(x, z, turn):
        return {"shape": "compound", "position_m": [x, 0, z], "orientation_wxyz": lying(turn),
                "stiffness_n_per_m": 400, "body": {"mass_kg": 0.15, "damping_per_s": 1.5, "restitution": 0.4}, "parts": [
                    {"shape": "cylinder", "radius_m": 0.006, "height_m": 0.05, "segments": 24},
                    {"shape": "sphere", "radius_m": 0.016, "subdivisions": 3, "position_m": [0, 0, -0.028]},
                    {"shape": "sphere", "radius_m": 0.016, "subdivisions": 3, "position_m": [0, 0, 0.028]}]}
    write_scene("fig14-dumbbells", {"objects": [dumbbell(-0.045, 0.05, 0.3), dumbbell(0.045, 0.05, -0.5)]})

    def pose(t):
        left, right, y = along(t, (0, (0.085, 0.08, -0.006)), (0.7, (0.062, 0.060, -0.006)), (1.4, (0.053, 0.055, -0.006)), (2.0, (0.048, 0.046, -0.01)),
                               (2.6, (0.05, 0.042, 0.0)), (3.2, (0.08, 0.08, 0.0)))
        return (-0.09, y, left), (0.11, y, right)

    write_path("fig14-dumbbells", 3.2, pose)


def rocket():
    """Fig. 16: the flying rocket, a body of several convex parts, steered with the side of the stylus."""
    write_scene("fig16-rocket", {"objects": [
        {"shape": "mesh", "file": "../shapes/rocket.obj", "position_m": [0, 0, 0.06],
         "orientation_wxyz": lying(0.9), "stiffness_n_per_m": 400,
         "body": {"mass_kg": 1, "velocity_m_per_s": [0.02, -0.016, 0], "damping_per_s": 8, "restitution": 0}}]})

    def pose(t):
        tip = along(t, (0, (0.03, -0.03, 0.11)), (0.8, (0.016, -0.012, 0.074)), (2.4, (0.03, -0.02, 0.05)), (3.2, (0.06, -0.05, 0.1)))
        return tip, add(tip, unit((0.3, -0.3, 1)), 0.12)

    write_path("fig16-rocket", 3.2, pose)


if __name__ == "__main__":
    extended_probe()
    two_objects()
    dumbbells()
    rocket()
    engine()
    surgery()
    layers()
