#!/usr/bin/env python3
"""Writes the shapes of concave.json beside this file: closed surfaces in metres, centred, normals outward."""

import math
import pathlib

FOLDER = pathlib.Path(__file__).resolve().parent


class Mesh:
    def __init__(self, title):
        self.lines, self.count = [f"# {title}; written by make_shapes.py; m"], 0

    def part(self, name, corners, faces):
        """A closed surface; faces counter-clockwise seen from outside, corners counted from 0."""
        if name:
            self.lines.append(f"g {name}")
        self.lines += ["v " + " ".join(f"{x + 0.0:.9g}" for x in corner) for corner in corners]
        self.lines += ["f " + " ".join(str(self.count + k + 1) for k in face) for face in faces]
        self.count += len(corners)

    def write(self, name):
        (FOLDER / name).write_text("\n".join(self.lines) + "\n")


def prism(outline, low, high, place=lambda x, y, z: (x, y, z)):
    """An outline, counter-clockwise in x and y, from z = low to high."""
    n = len(outline)
    corners = [place(x, y, z) for z in (low, high) for x, y in outline]
    faces = [list(range(n - 1, -1, -1)), list(range(n, 2 * n))]
    faces += [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    return corners, faces


def circle(radius, sides):
    return [(radius * math.cos(2 * math.pi * k / sides), radius * math.sin(2 * math.pi * k / sides)) for k in range(sides)]


def ell():
    mesh = Mesh("an L, 70 x 70 x 25 mm, arms 25 mm wide")
    a, b = 0.035, -0.01
    mesh.part("", *prism([(-a, -a), (a, -a), (a, b), (b, b), (b, a), (-a, a)], -0.0125, 0.0125))
    mesh.write("ell.obj")


def cross():
    mesh = Mesh("a cross, 90 x 90 x 30 mm, arms 30 mm wide")
    a, b = 0.045, 0.015
    mesh.part("", *prism([(-b, -a), (b, -a), (b, -b), (a, -b), (a, b), (b, b), (b, a), (-b, a), (-b, b), (-a, b), (-a, -b), (-b, -b)],
                         -b, b))
    mesh.write("cross.obj")


def torus(ring=0.035, tube=0.014, around=16, sides=8):
    mesh = Mesh("a torus of 16 x 8 facets, 98 mm across, the tube 28 mm")
    corners = []
    for x, y in circle(1, around):
        corners += [(x * (ring + u), y * (ring + u), z) for u, z in circle(tube, sides)]
    at = lambda i, j: i % around * sides + j % sides
    mesh.part("", corners, [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i in range(around) for j in range(sides)])
    mesh.write("torus.obj")


def rocket(sides=16):
    """Convex parts as groups: they overlap, and nobody has to work out where fins and body meet."""
    mesh = Mesh("a rocket, 88 mm long: convex parts as groups")
    hull = circle(0.012, sides)
    mesh.part("body", *prism(hull, -0.03, 0.02))
    nose = [(x, y, 0.02) for x, y in hull] + [(0, 0, 0.048)]
    mesh.part("nose", nose, [list(range(sides - 1, -1, -1))] + [[k, (k + 1) % sides, sides] for k in range(sides)])
    fin = [(0.008, -0.03), (0.03, -0.04), (0.03, -0.022), (0.008, 0.002)]
    for k in range(4):
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][k]
        # Out along the radius, up along the axis, across it.
        mesh.part(f"fin {k + 1}", *prism(fin, -0.0025, 0.0025, lambda r, z, w: (c * r + s * w, s * r - c * w, z)))
    mesh.write("rocket.obj")


if __name__ == "__main__":
    ell()
    cross()
    torus()
    rocket()
