"""Live trials with a simulated device at the clock's pace: memory stays flat, ticks keep up with the clock.

Usage: soak.py PALPATE [--minutes M] [--json FILE]
"""

import argparse
import json
import os
import pathlib
import re
import sqlite3
import statistics
import sys
import tempfile
import time

from terminal import Terminal

RATE = 1000  # Hz
PROTOCOL = {
    "version": 1, "name": "soak", "renderers": ["ray"], "samples": True, "servo": {"rate_hz": RATE},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02}, {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "repetitions": 3000, "home": {"rest_s": 0.2}, "response": {"keys": {"1": "ball", "2": "box"}},
}
FEELING, HOMING, FAULT = "[trial, ", "[homing, ", "[fault, "


def memory(process):
    """Resident, kB, without what the kernel may drop."""
    return int(re.search(r"RssAnon:\s+(\d+) kB", pathlib.Path(f"/proc/{process}/status").read_text())[1])


def slope(points):
    """Least squares; per minute."""
    x, y = [p[0] / 60 for p in points], [p[1] for p in points]
    return statistics.linear_regression(x, y).slope


def soak(palpate, minutes, folder):
    (folder / "protocol.json").write_text(json.dumps(PROTOCOL))
    points, trials, faults = [], 0, 0
    with Terminal([palpate, "run", folder / "protocol.json", "--db", folder / "soak.db", "--participant", "P01", "--device",
                   "simulated", "--no-window"]) as terminal:
        start = time.monotonic()
        while (now := time.monotonic() - start) < 60 * minutes:
            if terminal.wait_for(FEELING, FAULT) == FAULT:
                faults += 1
                terminal.type(":clear\n:go\n")
                continue
            time.sleep(1.6)  # long enough for a contact
            terminal.type("12"[trials % 2])
            trials += 1
            points.append((now, memory(terminal.process.pid)))
            terminal.text = terminal.text[-2000:]
            terminal.read_to = min(terminal.read_to, len(terminal.text))
        terminal.type(":stop\n1")
        terminal.wait_for("servo: ")
        status = terminal.finish()
        servo = re.search(r"servo: (\d+) ticks in ([\d.]+) s, (\d+) missed, longest period ([\d.]+) ms", terminal.text)
    with sqlite3.connect(folder / "soak.db") as db:
        rows = db.execute("SELECT ticks, missed_ticks, (response_ns - onset_ns) / 1e9, max_force, first_contact_time "
                          "FROM attempts WHERE state = 'completed'").fetchall()
    ticks, elapsed, missed = int(servo[1]), float(servo[2]), int(servo[3])
    settled = [point for point in points if point[0] > 0.25 * 60 * minutes]
    return {
        "minutes": minutes, "status": status, "trials": len(rows), "faults_cleared": faults,
        "touched": sum(row[4] is not None for row in rows), "max_force_n": max(row[3] for row in rows),
        "ticks": ticks, "missed_ticks": missed, "seconds": elapsed, "longest_period_ms": float(servo[4]),
        # Ticks that the clock says are due, less those that came and those that are on record as missed.
        "drift_ticks": elapsed * RATE - ticks - missed,
        "worst_trial_drift_ticks": max(abs(t * RATE - n - m) for n, m, t, _, _ in rows),
        "memory_kb_first": points[0][1], "memory_kb_settled": settled[0][1], "memory_kb_last": points[-1][1],
        "memory_kb_per_minute": slope(settled),
    }


def main():
    options = argparse.ArgumentParser()
    options.add_argument("palpate")
    options.add_argument("--minutes", type=float, default=1)
    options.add_argument("--json")
    options = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        result = soak(options.palpate, options.minutes, pathlib.Path(folder))
    print(json.dumps(result, indent=1))
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(result, indent=1) + "\n")
    checks = {
        "it ended as asked": result["status"] == 0,
        "trials were run": result["trials"] >= 10 * options.minutes,
        "most of them touched the stimulus": result["touched"] >= 0.5 * result["trials"],
        # The servo starts and ends a few ticks beside the clock's two readings.
        "ticks keep up with the clock": abs(result["drift_ticks"]) < 100,
        "in each trial as well": result["worst_trial_drift_ticks"] < 100,
        "memory is flat": result["memory_kb_last"] - result["memory_kb_settled"] < 1500,
    }
    for what, holds in checks.items():
        print("ok  " if holds else "FAIL", what)
    return 0 if all(checks.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
