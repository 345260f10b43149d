"""What drawing for the participant costs the servo: lateness of ticks with and without a seen object, in alternating runs.

Usage: sight_isolation.py PALPATE [--pairs 10] [--seconds 8] [--json FILE]

A session at 1 kHz runs in two windows on a display in memory (software drawing). In the second run of a pair the
participant sees the object and the tool, drawn at 60 Hz. Figures are those of each session's own record, by the clock.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "runner" / "display"))
from live_session import rows  # noqa: E402
from virtual_screen import VirtualScreen, wait_for  # noqa: E402

QUANTILES = ["median", "p99", "p99.9", "max"]


def protocol(seen):
    box = {"name": "box", "shape": "box", "size_m": [0.05, 0.04, 0.06]}
    view = {"screen_m": [[-0.26, 0.25, -0.16], [0.26, 0.25, -0.16], [-0.26, 0.25, 0.16]], "eye_m": [0, -0.4, 0.1]}
    return {"version": 2, "name": "bench", "renderers": ["ray"], "seed": 1, "home": {"rest_s": 0.1, "margin_m": 0.01},
            "stimuli": [box | ({"seen": {"what": ["object", "tool"]}} if seen else {})],
            **({"view": view} if seen else {}), "texts": {"instructions": "Go on."},
            "blocks": [{"name": "b", "task": "rate", "stimuli": ["box"], "repetitions": 1, "time_out_s": 600}]}


def measure(palpate, seconds, seen):
    """The servo's record of a session with one trial of `seconds`, and the frames that were drawn of it."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        database, made = folder / "bench.db", folder / "bench.json"
        made.write_text(json.dumps(protocol(seen)))
        screen = VirtualScreen()
        try:
            session = subprocess.Popen(
                [palpate, "run", made, "--db", database, "--participant", "B1", "--device", "simulated"],
                env=screen.environment, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            wait_for("the window", lambda: screen.do("search", "--onlyvisible", "--name", "^bench, B1$"))
            screen.focus(screen.window("bench, B1"))

            def begun():
                screen.key("space")
                time.sleep(0.5)
                return rows(database, "SELECT 1 FROM attempts")

            wait_for("the first trial", begun)
            time.sleep(seconds)
            screen.key("5", "Return")
            time.sleep(1)
            session.terminate()
            session.wait(timeout=60)
        finally:
            screen.close()
        notes = [text for (text,) in rows(database, "SELECT text FROM notes ORDER BY at_ns")]
        servo = [json.loads(text)["servo"] for text in notes if text.startswith('{"servo"')][-1]
        tasks = [json.loads(task) for (task,) in rows(database, "SELECT task FROM attempts WHERE state = 'completed'")]
        return servo | {"frames": sum(task.get("seen", {}).get("frames", 0) for task in tasks)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("palpate")
    parser.add_argument("--pairs", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=8)
    parser.add_argument("--json")
    given = parser.parse_args()
    pairs = []
    for number in range(given.pairs):
        pairs.append([measure(given.palpate, given.seconds, seen) for seen in (False, True)])
        unseen, seen = (one["lateness_ns"]["p99.9"] / 1000 for one in pairs[-1])
        print(f"pair {number + 1}: p99.9 {unseen:.1f} us unseen, {seen:.1f} with {pairs[-1][1]['frames']} frames", file=sys.stderr)
    print(f"{'lateness, us':28}{'unseen':>12}{'seen':>12}{'ratio':>8}  range over pairs")
    for name in QUANTILES:
        values = [[one["lateness_ns"][name] / 1000 for one in pair] for pair in pairs]
        unseen, seen = (statistics.median(pair[i] for pair in values) for i in (0, 1))
        ratios = [pair[1] / pair[0] for pair in values]
        print(f"{name:28}{unseen:12.1f}{seen:12.1f}{statistics.median(ratios):8.2f}  {min(ratios):.2f} to {max(ratios):.2f}")
    for name in ("missed_ticks", "ticks", "frames"):
        print(f"{name + ', in all':28}{sum(pair[0][name] for pair in pairs):12}{sum(pair[1][name] for pair in pairs):12}")
    if given.json:
        pathlib.Path(given.json).write_text(json.dumps(pairs))


if __name__ == "__main__":
    main()
