#!/usr/bin/env python3
"""Instructions of a tick with each feature, counted step by step (ptrace), and what the feature adds to a plain tick.

Each scene is rendered by `palpate render` along one path: a hand that strokes a ball of 1,280 triangles, a third of the time
off it. Where no counter of the processor is at hand and valgrind does not know its instructions, this counts all the same.

Usage: tick_instructions.py PALPATE   (a release build with symbols; x86-64 Linux; a minute)
The table is that of runner/evidence/scenes/feature_costs.cpp, which `palpate render --explain` prints. After a change to the
tick write it there, with date and machine.
"""

import ctypes
import json
import math
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

TRACEME, PEEKTEXT, PEEKUSER, POKETEXT, CONT, SINGLESTEP, GETREGS, SETREGS = 0, 1, 3, 4, 7, 9, 12, 13
RIP, RSP = 16, 19  # of user_regs_struct, in words
TICKS = range(600, 1000)  # counted
libc = ctypes.CDLL(None, use_errno=True)
libc.ptrace.restype = ctypes.c_long
libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]

BALL = {"shape": "sphere", "radius_m": 0.03, "subdivisions": 3}


def ball(**more):
    return {**BALL, **more}


def beside(number):
    return ball(position_m=[0.061 * number, 0, 0])


def path(rows=1000):
    """Tip slides over the ball; with the ray the side touches as well."""
    lines = ["t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z"]
    for i in range(rows):
        turn, lean = 0.003 * i, 0.6 * math.sin(0.002 * i)
        n = (math.cos(turn) * math.cos(lean), math.sin(turn) * math.cos(lean), math.sin(lean))
        depth = -0.0015 if i % 60 < 20 else 0.0015
        tip = [(0.03 - depth) * c for c in n]
        tilt = (-math.sin(turn), math.cos(turn), 0)
        axis = [0.6 * c + 0.8 * t for c, t in zip(n, tilt)]
        length = math.sqrt(sum(a * a for a in axis))
        tail = [p + 0.12 * a / length for p, a in zip(tip, axis)]
        lines.append(",".join(f"{x:.9f}" for x in [i / 1000, *tip, *tail]))
    return "\n".join(lines) + "\n"


def dimpled_ball():
    """The same ball as a file with one dimple, so that it is a closed surface and no convex mesh."""
    t = (1 + 5 ** 0.5) / 2
    v = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t), (t, 0, -1), (t, 0, 1),
         (-t, 0, -1), (-t, 0, 1)]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
         (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(3):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(v)
                v.append(tuple((x + y) / 2 for x, y in zip(v[a], v[b])))
            return middles[key]
        for a, b, c in f:
            p, q, r = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, p, r), (b, q, p), (c, r, q), (p, q, r)]
        f = finer
    lines = []
    for i, p in enumerate(v):
        length = math.sqrt(sum(x * x for x in p))
        scale = (0.029 if i == 100 else 0.03) / length
        lines.append("v " + " ".join(f"{scale * x:.12f}" for x in p))
    return "\n".join(lines + ["f " + " ".join(str(i + 1) for i in face) for face in f]) + "\n"


SCENES = {
    "plain": {"objects": [ball()]},
    "damping": {"objects": [ball(damping_ns_per_m=0.5)]},
    "friction": {"objects": [ball(friction_static=0.3, friction_dynamic=0.2)]},
    "two": {"objects": [ball(), beside(1)]},
    "compound": {"objects": [{"shape": "compound", "parts": [ball(), beside(1)]}]},
    "surface": {"objects": [{"shape": "mesh", "file": "ball.obj"}]},
    "sine": {"objects": [ball(texture={"kind": "sine", "period_m": 0.002, "depth_m": 0.0002})]},
    "noise": {"objects": [ball(texture={"kind": "noise", "period_m": 0.002, "depth_m": 0.0002})]},
    "curl": {"objects": [ball(fields=[{"kind": "curl", "axis": [0, 0, 1], "damping_ns_per_m": 2, "destabilising": True}])]},
}
# feature, renderer with it, scene with it, renderer without it, scene without it
ROWS = [("side contact, torque", "ray", "plain", "point", "plain")]
for probe in ("point", "ray"):
    ROWS += [("several objects", probe, "two", probe, "plain"), ("unions and tools", probe, "compound", probe, "two"),
             ("closed surfaces", probe, "surface", probe, "plain"), ("damping", probe, "damping", probe, "plain"),
             ("friction", probe, "friction", probe, "plain"), ("texture by a formula", probe, "sine", probe, "plain"),
             ("texture by a table", probe, "noise", probe, "plain"), ("field", probe, "curl", probe, "plain")]


def ptrace(request, pid, address=0, data=0):
    return libc.ptrace(request, pid, address, data)


def registers(pid):
    room = (ctypes.c_ulonglong * 27)()
    libc.ptrace(GETREGS, pid, None, ctypes.cast(room, ctypes.c_void_p))
    return room


def counted(palpate, offset, arguments, folder):
    """Mean instructions of the ticks."""
    pid = os.fork()
    if pid == 0:
        os.chdir(folder)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        libc.ptrace(TRACEME, 0, None, None)
        os.execv(palpate, [palpate, *arguments])
    os.waitpid(pid, 0)
    maps = pathlib.Path(f"/proc/{pid}/maps").read_text()
    base = int(re.search(r"^([0-9a-f]+)-.*" + re.escape(os.path.realpath(palpate)) + "$", maps, re.M).group(1), 16)
    entry = base + offset
    word = ptrace(PEEKTEXT, pid, entry)
    trap = (word & ~0xff) | 0xcc
    counts, tick = [], 0
    ptrace(POKETEXT, pid, entry, ctypes.c_ulong(trap & (2 ** 64 - 1)).value)
    while True:
        ptrace(CONT, pid)
        _, status = os.waitpid(pid, 0)
        if os.WIFEXITED(status):
            break
        ptrace(POKETEXT, pid, entry, ctypes.c_ulong(word & (2 ** 64 - 1)).value)
        room = registers(pid)
        room[RIP] = entry
        libc.ptrace(SETREGS, pid, None, ctypes.cast(room, ctypes.c_void_p))
        back, top = ptrace(PEEKTEXT, pid, room[RSP]) & (2 ** 64 - 1), room[RSP]
        steps = 0
        while True:
            ptrace(SINGLESTEP, pid)
            os.waitpid(pid, 0)
            steps += 1
            if tick not in TICKS:
                break
            if ptrace(PEEKUSER, pid, 8 * RIP) & (2 ** 64 - 1) == back and ptrace(PEEKUSER, pid, 8 * RSP) & (2 ** 64 - 1) > top:
                counts.append(steps)
                break
        tick += 1
        ptrace(POKETEXT, pid, entry, ctypes.c_ulong(trap & (2 ** 64 - 1)).value)
    return sum(counts) / len(counts) if counts else float("nan")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    palpate = os.path.realpath(sys.argv[1])
    names = subprocess.run(["nm", "-C", palpate], capture_output=True, text=True, check=True).stdout
    found = {}
    for line in names.splitlines():
        match = re.match(r"([0-9a-f]+) \w .*::ProbeRenderer<.*::(Point|Segment)Probe>::tick\(palpate::rendering::Scene const&", line)
        if match:
            found["point" if match.group(2) == "Point" else "ray"] = int(match.group(1), 16)
    counts = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "path.csv").write_text(path())
        (folder / "ball.obj").write_text(dimpled_ball())
        for name, scene in SCENES.items():
            (folder / f"{name}.json").write_text(json.dumps(scene))
            for probe in ("point", "ray"):
                arguments = ["render", "--scene", f"{name}.json", "--renderer", probe, "--trajectory", "path.csv", "--out", "o.csv",
                             "--force"]
                counts[probe, name] = counted(palpate, found[probe], arguments, folder)
                print(f"{probe:6}{name:10}{counts[probe, name]:10.1f}", flush=True)
    print(f"\n{'feature':24}{'probe':8}{'adds':>8}")
    for feature, with_probe, with_scene, probe, scene in ROWS:
        print(f"{feature:24}{with_probe:8}{counts[with_probe, with_scene] - counts[probe, scene]:8.0f}")


if __name__ == "__main__":
    main()
