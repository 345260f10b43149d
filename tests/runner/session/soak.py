"""Live trials with a simulated device at the clock's pace: memory stays flat, ticks keep up with the clock.

Usage: soak.py PALPATE [--minutes M] [--json FILE]

Ticks keep up when the clock's time is what the record explains, to the tick: of the whole session, ticks and
missed ticks are the periods that have passed, whatever made some late; in every trial, each sample stands where
the ones before it and their lateness put it.
Memory grows for some two minutes, while SQLite's cache of pages (2 MB at most) fills.
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

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "data" / "store"))
from sample_planes import planes_of  # noqa: E402

RATE = 1000  # Hz
PERIOD_NS = 1_000_000_000 // RATE
CACHE_FILLS_S = 180
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
    """Least squares; per minute. None where there are too few."""
    if len(points) < 20:
        return None
    x, y = [p[0] / 60 for p in points], [p[1] for p in points]
    return statistics.linear_regression(x, y).slope


def column(planes, offset, rows, size):
    """Of the packing in data/store/attempts.h: byte planes, most significant first, of differences."""
    values, value = [], 0
    for parts in zip(*(planes[offset + i * rows:offset + (i + 1) * rows] for i in range(size))):
        value = (value + int.from_bytes(parts, "big")) % 256**size
        values.append(value)
    return values


def unexplained(packed, rows, missed_on_record):
    """Samples of a trial that are not where the clock and the record have them."""
    planes = planes_of(packed)
    ticks = column(planes, 0, rows, 4)
    periods, late = ([v - (v >> 63 << 64) for v in column(planes, at * rows, rows, 8)] for at in (4, 12))
    wrong = sum(tick != i for i, tick in enumerate(ticks))
    for i in range(1, rows):  # due at the due time before, and one period for each tick since
        due_after = periods[i] - late[i] + late[i - 1]
        wrong += due_after != PERIOD_NS * (1 + late[i - 1] // PERIOD_NS)
    return wrong + (sum(l // PERIOD_NS for l in late) > missed_on_record)


def at_minutes(points):
    """Memory at the end of each minute, kB."""
    out = {}
    for seconds, kb in points:
        out[int(seconds // 60) + 1] = kb
    return out


def await_trial(terminal):
    """Until the stimulus is felt; faults are cleared. Returns how many."""
    faults = 0
    while terminal.wait_for(FEELING, FAULT) == FAULT:
        faults += 1
        terminal.type(":clear\n:go\n")
    return faults


def type_trials(terminal, minutes):
    """Answers trials for so long. Returns (s, kB) after each, and how often a fault was cleared."""
    points, faults, start = [], 0, time.monotonic()
    while (now := time.monotonic() - start) < 60 * minutes:
        time.sleep(1.6)  # long enough for a contact
        terminal.type("12"[len(points) % 2])
        points.append((now, memory(terminal.process.pid)))
        terminal.text = terminal.text[-2000:]
        terminal.read_to = min(terminal.read_to, len(terminal.text))
        faults += await_trial(terminal)
    return points, faults


def soak(palpate, minutes, folder):
    (folder / "protocol.json").write_text(json.dumps(PROTOCOL))
    began = time.monotonic()
    with Terminal([palpate, "run", folder / "protocol.json", "--db", folder / "soak.db", "--participant", "P01",
                   "--new-participant", "--device", "simulated", "--no-window"]) as terminal:
        await_trial(terminal)
        typing_began = time.monotonic()
        points, faults = type_trials(terminal, minutes)
        typing = time.monotonic() - typing_began
        terminal.type(":stop\n1")
        while terminal.wait_for("servo: ", FAULT) == FAULT:
            terminal.type(":clear\n:go\n")
        status = terminal.finish()
    lived = time.monotonic() - began
    with sqlite3.connect(folder / "soak.db") as db:
        rows = db.execute("SELECT missed_ticks, max_force, first_contact_time, data, count FROM attempts "
                          "JOIN samples ON samples.attempt_id = attempts.id WHERE state = 'completed'").fetchall()
        (note,), = db.execute("SELECT text FROM notes WHERE text LIKE '{\"servo\"%'").fetchall()
    servo = json.loads(note)["servo"]
    settled = [kb for seconds, kb in points if seconds > CACHE_FILLS_S]
    quarter = len(settled) // 4
    return {
        "minutes": minutes, "status": status, "trials": len(rows), "faults_cleared": faults,
        "touched": sum(row[2] is not None for row in rows), "max_force_n": max(row[1] for row in rows),
        "ticks": servo["ticks"], "missed_ticks": servo["missed_ticks"], "longest_period_ms": servo["longest_period_ns"] / 1e6,
        "servo_s": servo["elapsed_ns"] / 1e9, "typing_s": typing, "process_s": lived,
        "unexplained_ticks": servo["elapsed_ns"] // PERIOD_NS - (servo["ticks"] - 1 + servo["missed_ticks"]),
        "samples": sum(row[4] for row in rows),
        "unexplained_samples": sum(unexplained(packed, count, missed) for missed, _, _, packed, count in rows),
        "memory_kb_first": points[0][1], "memory_kb_last": points[-1][1], "memory_kb_at_minute": at_minutes(points),
        "memory_kb_growth": points[-1][1] - next(kb for seconds, kb in points if seconds >= points[-1][0] / 4),
        "memory_kb_growth_settled": max(settled[-quarter:]) - max(settled[:quarter]) if quarter else None,
        "memory_kb_per_minute_settled": slope([p for p in points if p[0] > CACHE_FILLS_S]),
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
        "every tick that was due came or is on record as missed": result["unexplained_ticks"] == 0,
        "the servo's time is the wall clock's": result["typing_s"] < result["servo_s"] < result["process_s"],
        "each sample is where the record has it": result["samples"] > 0 and result["unexplained_samples"] == 0,
        "memory is flat": result["memory_kb_growth"] < 1500 and (result["memory_kb_growth_settled"] or 0) < 256,
    }
    for what, holds in checks.items():
        print("ok  " if holds else "FAIL", what)
    return 0 if all(checks.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
