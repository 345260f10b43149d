"""What a tick costs in a live session with windows, log and USB traffic on.

Usage: live_session.py PALPATE EMULATED_FALCONS [--seconds 20] [--json FILE]

A session at 1 kHz with the ray renderer runs in two windows on a display in memory (software
drawing), with every tick's sample kept in its database, while another program of ours reads an
emulated Falcon through libusb and a guard process. Beside it `palpate devices --timing` measures
the same tick in its thread's own processor time. The session's figures are by the clock: what
other programs took of a tick is in them. From each session's own record.
"""

import argparse
import json
import os
import pathlib
import sqlite3
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "runner" / "display"))
from virtual_screen import VirtualScreen, wait_for  # noqa: E402

PROTOCOL = {
    "version": 1, "name": "bench", "renderers": ["ray"], "samples": True,
    "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": 0.03, "subdivisions": 3},
                {"name": "cube", "shape": "cube", "edge_m": 0.05}],
    "repetitions": 1, "seed": 1, "home": {"rest_s": 0.1, "margin_m": 0.01},
    "response": {"keys": {"1": "sphere", "2": "cube"}, "time_out_s": 600}, "texts": {"instructions": "Go on."},
}


def rows(database, query):
    if not database.exists():
        return []
    connection = sqlite3.connect(f"file:{database}?mode=ro", uri=True, timeout=20)
    try:
        return connection.execute(query).fetchall()
    except sqlite3.OperationalError:  # being made
        return []
    finally:
        connection.close()


def run_session(palpate, folder, seconds):
    """The servo's own record of a session with one trial of `seconds`, and the timing beside it."""
    database, protocol = folder / "bench.db", folder / "bench.json"
    protocol.write_text(json.dumps(PROTOCOL))
    screen = VirtualScreen()
    try:
        session = subprocess.Popen(
            [palpate, "run", protocol, "--db", database, "--participant", "B1", "--device", "simulated"],
            env=screen.environment, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        wait_for("the window", lambda: screen.do("search", "--onlyvisible", "--name", "^bench, B1$"))
        screen.focus(screen.window("bench, B1"))

        def begun():
            screen.key("space")
            time.sleep(0.5)
            return rows(database, "SELECT 1 FROM attempts")

        wait_for("the first trial", begun)
        timing = folder / "timing.json"
        subprocess.run([palpate, "devices", "--timing", "--seconds", str(seconds), "--json", timing],
                       stdout=subprocess.DEVNULL)
        screen.key("1")
        time.sleep(1)
        session.terminate()
        session.wait(timeout=60)
    finally:
        screen.close()
    notes = [text for (text,) in rows(database, "SELECT text FROM notes ORDER BY at_ns")]
    records = [json.loads(text)["servo"] for text in notes if text.startswith('{"servo"')]
    return records[-1], json.loads(timing.read_text())["timing"]


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("palpate")
    options.add_argument("emulated_falcons")
    options.add_argument("--seconds", type=float, default=20)
    options.add_argument("--json")
    args = options.parse_args()
    # Reads the emulated device for a second, over and over.
    loop = 'while true; do "$0" "$1" devices --device falcon > /dev/null 2>&1; done'
    usb = subprocess.Popen(["sh", "-c", loop, args.emulated_falcons, args.palpate], start_new_session=True)
    try:
        with tempfile.TemporaryDirectory() as folder:
            live, timing = run_session(args.palpate, pathlib.Path(folder), args.seconds)
    finally:
        os.killpg(usb.pid, 9)
        usb.wait()

    def us(figures, *names):
        return "  ".join(f"{name} {figures[name] / 1000:.1f}" for name in names)

    cpu = timing["compute_cpu_ns"]
    print(f"session:  {live['ticks']} ticks, {live['missed_ticks']} missed, {live['lost_samples']} samples lost\n"
          f"  lateness us          {us(live['lateness_ns'], 'median', 'p99', 'p99.9', 'max')}\n"
          f"  compute us, clock    {us(live['compute_ns'], 'median', 'p99', 'p99.9', 'max')}\n"
          f"timing beside it: {timing['ticks']} ticks, {timing['missed_ticks']} missed\n"
          f"  lateness us          {us(timing['lateness_ns'], 'median', 'p99', 'p99.9', 'max')}\n"
          f"  warm-up us, clock    {us(timing['warm_up_ns'], 'median', 'p99.9', 'max')}\n"
          f"  compute us, clock    {us(timing['compute_ns'], 'median', 'p99.9', 'max')}\n"
          f"  compute us, own time {us(cpu, 'median', 'p99.9', 'max')}"
          f"  of which asking for it {us(timing['asking_cpu_ns'], 'median')}")
    if args.json:
        pathlib.Path(args.json).write_text(json.dumps({"session": live, "timing": timing}, indent=2) + "\n")


if __name__ == "__main__":
    main()
