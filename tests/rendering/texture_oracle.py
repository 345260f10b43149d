"""The oracle of textured contacts: the same grating as a mesh, through the renderer of surfaces.

A plate of ten periods of a sine, 64 points each, against a smooth plate that carries the texture.
Both are stroked across and along the ridges; the forces must agree within what facets do to a sine.
Usage: texture_oracle.py PALPATE
"""
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

PERIOD, PERIODS, POINTS = 0.002, 10, 64  # m
LENGTH, WIDTH, THICK = PERIOD * PERIODS, 0.02, 0.01  # m
STIFFNESS = 800  # N/m


def height(x, depth):
    return -depth / 2 * (1 - math.cos(2 * math.pi * x / PERIOD))


def grating(path, depth):
    """The plate's outline across the ridges, drawn out along y; crests at z = THICK / 2."""
    count = PERIODS * POINTS
    xs = [LENGTH * (i / count - 0.5) for i in range(count + 1)]
    lines = []
    for y in (-WIDTH / 2, WIDTH / 2):
        for x in xs:
            lines.append(f"v {x!r} {y!r} {THICK / 2 + height(x, depth)!r}")
        for x in xs:
            lines.append(f"v {x!r} {y!r} {-THICK / 2!r}")
    n = count + 1
    top = lambda side, i: side * 2 * n + i + 1
    low = lambda side, i: side * 2 * n + n + i + 1
    for i in range(count):
        lines.append(f"f {top(0, i)} {top(0, i + 1)} {top(1, i + 1)} {top(1, i)}")
        lines.append(f"f {low(0, i)} {low(1, i)} {low(1, i + 1)} {low(0, i + 1)}")
        lines.append(f"f {low(0, i)} {low(0, i + 1)} {top(0, i + 1)} {top(0, i)}")
        lines.append(f"f {top(1, i)} {top(1, i + 1)} {low(1, i + 1)} {low(1, i)}")
    lines.append(f"f {low(0, 0)} {top(0, 0)} {top(1, 0)} {low(1, 0)}")
    lines.append(f"f {low(0, count)} {low(1, count)} {top(1, count)} {top(0, count)}")
    path.write_text("\n".join(lines) + "\n")


def stroke(path, depth):
    """Down onto the plate, then 12 mm across the ridges, from a valley on, and a little along them."""
    with path.open("w") as out:
        print("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z", file=out)
        for i in range(4000):
            down = min(1, i / 500)
            x = -0.007 + 0.0035 * max(0, i - 500) * 1e-3
            y = 0.004 * math.sin(i / 700)
            z = THICK / 2 + 0.001 - down * (0.001 + depth)
            print(f"{i / 1000},{x!r},{y!r},{z!r},{x!r},{y!r},{z + 0.12!r}", file=out)


def forces(palpate, folder, scene, path, renderer):
    out = folder / "forces.csv"
    subprocess.run([palpate, "render", "--scene", scene, "--renderer", renderer, "--trajectory", path,
                    "--out", out, "--force"], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)
    with out.open() as rows:
        return [tuple(float(row[f"force_{axis}"]) for axis in "xyz") for row in csv.DictReader(rows)]


def main():
    palpate = sys.argv[1]
    failed = False
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        # m, of the texture and of the press; most rms of the mean force; most ticks 10 % off
        for texture, press, most_rms, most_off in ((0.0001, 0.001, 0.005, 0), (0.0004, 0.002, 0.1, 0.015)):
            grating(folder / "grating.obj", texture)
            (folder / "mesh.json").write_text(json.dumps({"objects": [
                {"shape": "mesh", "file": "grating.obj", "stiffness_n_per_m": STIFFNESS}]}))
            (folder / "texture.json").write_text(json.dumps({"objects": [
                {"shape": "box", "size_m": [LENGTH, WIDTH, THICK], "stiffness_n_per_m": STIFFNESS,
                 "texture": {"kind": "sine", "period_m": PERIOD, "depth_m": texture}}]}))
            curvature = texture / 2 * (2 * math.pi / PERIOD) ** 2
            stroke(folder / "path.csv", press)
            for renderer in ("point", "ray"):
                mesh = forces(palpate, folder, folder / "mesh.json", folder / "path.csv", renderer)
                felt = forces(palpate, folder, folder / "texture.json", folder / "path.csv", renderer)
                pairs = list(zip(mesh, felt))[600:]
                mean = sum(math.hypot(*a) for a, _ in pairs) / len(pairs)
                apart = [math.dist(a, b) for a, b in pairs]
                rms = math.sqrt(sum(one * one for one in apart) / len(apart)) / mean
                off = sum(one > 0.1 * mean for one in apart) / len(apart)
                print(f"{renderer}, curvature x depth {curvature * press:.2f}: rms {100 * rms:.2f} % of "
                      f"{mean:.3f} N, {100 * off:.2f} % of ticks 10 % off")
                failed |= not (mean > 0.1 and rms <= most_rms and off <= most_off)
    return failed


if __name__ == "__main__":
    sys.exit(main())
