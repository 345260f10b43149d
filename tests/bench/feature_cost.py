#!/usr/bin/env python3
"""What a feature costs where it is not used, in instructions per tick, counted by callgrind.

A tick of the program as it is, over a scene that does not use the feature, is held against a tick
of a pipeline that lacks it. Above 2 % more, the script fails. Beside it: what the feature costs
where it is used.

The pipelines that lack features (tests/bench/least_tick.h, unlogged_trial.h and instantiations of
the tick in feature_cost.cpp):
  alone           the general tick, compiled for one convex part that is a plain spring, and no other
  least           the same by hand: one convex part, a plain spring, a small mesh: no trees, broad phase, list of contacts,
                  sums, materials; for the point no sides, no torque, no second device. The
                  leaner of these two is the yardstick
  without X       the general tick, compiled without X, over a scene that uses all other materials
  no broad phase  all parts are always near
  unlogged        a trial's loop in a session that cannot keep samples
The path is the same in both: a hand over an icosphere of 20 triangles, a third of the time off it.

Usage: feature_cost.py FEATURE_COST SESSION_COST   (both built with PALPATE_NATIVE=OFF: valgrind
knows no AVX-512)
"""

import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

LIMIT = 0.02
TICKS = (500, 2500)  # the difference of two runs leaves out what is done once

# feature, scene without it, pipelines without it, scene with it, what that adds to
ROWS = [
    ("side contact", "point-plain", ["point-plain-least", "point-plain-alone"], "ray-plain", "point-plain"),
    ("torque, second device", "point-plain", ["point-plain-least", "point-plain-alone"], "ray-plain-least", "ray-torqueless"),
    ("edge tree", "ray-plain", ["ray-plain-least", "ray-plain-alone"], "ray-large", "ray-large-bare"),
    ("trees for small meshes", "point-plain", ["point-plain-least", "point-plain-alone"], "point-forced-trees", "point-plain"),
    ("trees for small meshes", "ray-plain", ["ray-plain-least", "ray-plain-alone"], "ray-forced-trees", "ray-plain"),
]
for probe in ("point", "ray"):
    for material in ("friction", "damping"):
        ROWS.append((material, f"{probe}-all-but-{material}", [f"{probe}-all-but-{material}-least"],
                     f"{probe}-{material}", f"{probe}-plain"))
    ROWS.append(("several objects", f"{probe}-plain", [f"{probe}-plain-least", f"{probe}-plain-alone"], f"{probe}-near", f"{probe}-plain"))
    ROWS.append(("far objects (1,000)", f"{probe}-near", [f"{probe}-near-without-broad-phase"], f"{probe}-far",
                 f"{probe}-near"))
ROWS.append(("sample log", "session-off", ["session-least"], "session-on", "session-off"))


def collected(program, case, ticks, folder):
    """Instructions within the measured functions, and what the program printed."""
    out = folder / f"{case}-{ticks}.out"
    done = subprocess.run(
        ["valgrind", "--quiet", "--tool=callgrind", "--collect-atstart=no",
         "--toggle-collect=palpate::bench::measured_*", f"--callgrind-out-file={out}", program, case, str(ticks)],
        capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"feature_cost: {program} {case} {ticks} failed:\n{done.stderr}")
    found = re.search(r"^(?:summary|totals): (\d+)", out.read_text(), re.MULTILINE)
    if not found or int(found.group(1)) == 0:
        sys.exit(f"feature_cost: callgrind counted nothing in {case}")
    return int(found.group(1)), done.stdout


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    programs = {"session": sys.argv[2]}
    cases = sorted({case for row in ROWS for case in (row[1], *row[2], *row[3:])})
    with tempfile.TemporaryDirectory() as scratch, \
            concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        def count(case):
            kind, _, name = case.partition("-")
            program, argument = (programs[kind], name) if kind in programs else (sys.argv[1], case)
            (few, _), (many, printed) = (
                collected(program, argument, ticks, pathlib.Path(scratch)) for ticks in TICKS)
            return (many - few) / (TICKS[1] - TICKS[0]), printed
        counted = dict(zip(cases, pool.map(count, cases)))
    failed = False
    print("Instructions a tick (callgrind). Not used: as it is, a pipeline without it, the difference. Used: more.\n")
    print(f"{'feature':24}{'probe':8}{'as it is':>10}{'without':>10}{'more':>9}{'used adds':>11}")
    for feature, without, yardsticks, used, base in ROWS:
        for other in yardsticks:
            if counted[without][1] != counted[other][1]:
                print(f"feature_cost: {without} and {other} did not render the same", file=sys.stderr)
                failed = True
        here, bare = counted[without][0], min(counted[other][0] for other in yardsticks)
        more = here / bare - 1
        mark = ""
        if more > LIMIT:
            failed = True
            mark = f"  above {LIMIT:.0%}"
        probe = without.partition("-")[0].replace("session", "ray")
        print(f"{feature:24}{probe:8}{here:10.1f}{bare:10.1f}{more:+9.1%}{counted[used][0] - counted[base][0]:+11.1f}{mark}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
