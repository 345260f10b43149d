"""How late this program's servo is against cyclictest (Debian: rt-tests), in alternating runs.

Usage: lateness.py PALPATE [--pairs 10] [--seconds 60] [--load idle,hog] [--rights fifo,none] [--json FILE]

Lateness above 2000 us counts as 2000 us on both sides, since cyclictest keeps no more.
Both sleep by absolute time at 1 kHz and ask when they woke. cyclictest runs as
`cyclictest -m -p 80 -i 1000 -h 2000` (without SCHED_FIFO: `--policy other`); what it counts above
2000 us is in its overflow list. The ratio of medians over the runs has an interval by bootstrap
over pairs of runs (percentiles 2.5 and 97.5 of 10,000 draws). Two processes that do nothing but
count are the hog: one for each processor.
"""

import argparse
import json
import os
import pathlib
import random
import re
import statistics
import subprocess
import sys
import tempfile

PERIOD_US = 1000
LONGEST_US = 2000  # that cyclictest counts one by one
FIGURES = ("p99", "p99.9", "share_above_one_period")


def of_histogram(counts, overflow):
    """Figures from counts per whole microsecond; `overflow` ticks were later than all of these."""
    total = sum(counts.values()) + overflow
    figures = {"ticks": total}
    for name, p in (("median", 0.5), ("p99", 0.99), ("p99.9", 0.999)):
        so_far, figures[name] = 0, LONGEST_US
        for late in sorted(counts):
            so_far += counts[late]
            if so_far >= p * total:
                figures[name] = late
                break
    above = overflow + sum(n for late, n in counts.items() if late > PERIOD_US)
    figures["share_above_one_period"] = above / total if total else 0
    return figures


def cyclictest(seconds, fifo):
    command = ["cyclictest", "-m", "-i", str(PERIOD_US), "-h", "2000", "-q", "-D", str(seconds)]
    command += ["-p", "80"] if fifo else ["--policy", "other"]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    counts = {int(a): int(b) for a, b in re.findall(r"^(\d{6}) (\d+)", text, re.M) if int(b)}
    overflow = re.search(r"# Histogram Overflows: (\d+)", text)
    return of_histogram(counts, int(overflow.group(1)) if overflow else 0)


def servo(palpate, seconds, fifo):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "timing.json"
        command = [palpate, "devices", "--timing", "--seconds", str(seconds), "--json", str(out)]
        done = subprocess.run(command + ([] if fifo else ["--no-realtime"]), capture_output=True, text=True)
        if done.returncode not in (0, 1):  # 1: not fit
            sys.exit(f"{' '.join(command)}: {done.stderr}")
        timing = json.loads(out.read_text())["timing"]
    late = timing["lateness_ns"]
    # In whole microseconds, rounded down, as cyclictest counts.
    figures = {name: min(late[name] // 1000, LONGEST_US) for name in ("median", "p99", "p99.9")}
    figures["ticks"] = timing["ticks"]
    figures["share_above_one_period"] = late["share_above_one_period"]
    figures["compute_cpu_p99.9_us"] = timing["compute_cpu_ns"]["p99.9"] / 1000
    figures["compute_p99.9_us"] = timing["compute_ns"]["p99.9"] / 1000
    figures["compute_cpu_median_us"] = timing["compute_cpu_ns"]["median"] / 1000
    figures["verdict"] = timing["verdict"]
    return figures


def ratio_of_medians(ours, theirs, draws=10_000):
    """Ratio and its interval; None where cyclictest's median is zero."""
    def ratio(pairs):
        below = statistics.median(b for _, b in pairs)
        return statistics.median(a for a, _ in pairs) / below if below else None

    pairs = list(zip(ours, theirs))
    chance = random.Random(1)
    drawn = [ratio([chance.choice(pairs) for _ in pairs]) for _ in range(draws)]
    drawn = sorted(d for d in drawn if d is not None)
    if ratio(pairs) is None or len(drawn) < draws * 0.95:
        return None, None, None
    return ratio(pairs), drawn[int(0.025 * len(drawn))], drawn[int(0.975 * len(drawn))]


def hogs():
    loop = "while True: pass"
    return [subprocess.Popen([sys.executable, "-c", loop]) for _ in range(os.cpu_count() or 1)]


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("palpate")
    options.add_argument("--pairs", type=int, default=10)
    options.add_argument("--seconds", type=int, default=60)
    options.add_argument("--load", default="idle,hog")
    options.add_argument("--rights", default="fifo,none")
    options.add_argument("--json")
    args = options.parse_args()
    report = []
    for load in args.load.split(","):
        for rights in args.rights.split(","):
            loaded = hogs() if load == "hog" else []
            runs = {"palpate": [], "cyclictest": []}
            try:
                for pair in range(args.pairs):
                    order = ["palpate", "cyclictest"] if pair % 2 == 0 else ["cyclictest", "palpate"]
                    for name in order:
                        fifo = rights == "fifo"
                        runs[name].append(
                            servo(args.palpate, args.seconds, fifo) if name == "palpate" else cyclictest(args.seconds, fifo))
            finally:
                for process in loaded:
                    process.kill()
                    process.wait()
            print(f"{load}, {'SCHED_FIFO 80' if rights == 'fifo' else 'ordinary scheduler'}, "
                  f"{args.pairs} pairs of {args.seconds} s")
            row = {"load": load, "rights": rights, "runs": runs, "ratios": {}}
            for figure in FIGURES:
                ours, theirs = ([run[figure] for run in runs[name]] for name in ("palpate", "cyclictest"))
                ratio, low, high = ratio_of_medians(ours, theirs)
                row["ratios"][figure] = {"ratio": ratio, "low": low, "high": high}
                said = "undefined (zero in too many runs)" if ratio is None else f"{ratio:.2f} [{low:.2f}, {high:.2f}]"
                print(f"  {figure:24} palpate {statistics.median(ours):.6g}  cyclictest {statistics.median(theirs):.6g}"
                      f"  ratio of medians {said}")
            compute = [run["compute_cpu_p99.9_us"] for run in runs["palpate"]]
            by_clock = [run["compute_p99.9_us"] for run in runs["palpate"]]
            print(f"  compute p99.9, median of runs: {statistics.median(by_clock):.2f} us by the clock, "
                  f"{statistics.median(compute):.2f} us of the thread's own time", flush=True)
            report.append(row)
    if args.json:
        pathlib.Path(args.json).write_text(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
