"""How late this program's servo is against cyclictest (Debian: rt-tests), in alternating runs.

Usage: lateness.py PALPATE [--condition fifo-idle,other-idle,fifo-hog,other-hog] [--pairs 10] [--seconds 60]
                   [--hog-nice 0] [--json FILE]

Both sleep by absolute time at 1 kHz and ask when they woke, with locked memory and idle processors
kept awake (/dev/cpu_dma_latency, where the system lets them). fifo: cyclictest runs as
`cyclictest -m -p 80 -i 1000 -h 2000`, this program with the same priority. other: both on the
ordinary scheduler (`--policy other`; `--no-fifo`). hog: one process for each processor that does
nothing but count; idle: nothing else of ours runs. Which of the two goes first alternates.
Lateness above 2000 us counts as 2000 us on both sides, since cyclictest keeps no more; how many
there were is in its overflow list. The ratio of medians over the runs has an interval by bootstrap
over pairs of runs (percentiles 2.5 and 97.5 of 10,000 draws). FILE is written after every run, with
what the host took of the machine meanwhile ("steal", of all processor time).
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
import time

PERIOD_US = 1000
LONGEST_US = 2000  # that cyclictest counts one by one
CONDITIONS = ("fifo-idle", "other-idle", "fifo-hog", "other-hog")
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
        done = subprocess.run(command + ([] if fifo else ["--no-fifo"]), capture_output=True, text=True)
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
    seed = 1
    chance = random.Random(seed)
    drawn = [ratio([chance.choice(pairs) for _ in pairs]) for _ in range(draws)]
    drawn = sorted(d for d in drawn if d is not None)
    if ratio(pairs) is None or len(drawn) < draws * 0.95:
        return None, None, None
    return ratio(pairs), drawn[int(0.025 * len(drawn))], drawn[int(0.975 * len(drawn))]


def hogs(niceness):
    command = ["nice", "-n", str(niceness), sys.executable, "-c", "while True: pass"]
    return [subprocess.Popen(command) for _ in range(os.cpu_count() or 1)]


def processor_time():
    """All of it, and what the host took, in clock ticks since the machine began."""
    times = [int(word) for word in pathlib.Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    return sum(times), times[7]


def one_run(name, palpate, seconds, fifo):
    load, before = os.getloadavg()[0], processor_time()
    began = time.time()
    run = servo(palpate, seconds, fifo) if name == "palpate" else cyclictest(seconds, fifo)
    after = processor_time()
    run["began"] = time.strftime("%H:%M:%S", time.gmtime(began))
    run["load_before"] = load
    run["steal"] = (after[1] - before[1]) / max(1, after[0] - before[0])
    return run


def measure(condition, args, keep):
    """Calls `keep` with the condition's row, as far as it is known, after each run."""
    rights, load = condition.split("-")
    row = {"condition": condition, "pairs": args.pairs, "seconds": args.seconds, "hog_nice": args.hog_nice,
           "runs": {"palpate": [], "cyclictest": []}, "ratios": {}}
    loaded = hogs(args.hog_nice) if load == "hog" else []
    try:
        for pair in range(args.pairs):
            for name in ("palpate", "cyclictest") if pair % 2 == 0 else ("cyclictest", "palpate"):
                run = one_run(name, args.palpate, args.seconds, rights == "fifo")
                row["runs"][name].append(run)
                print(f"{run['began']} {condition}, pair {pair + 1} of {args.pairs}, {name:10} "
                      + "  ".join(f"{figure} {run[figure]:.4g}" for figure in FIGURES)
                      + f"  steal {run['steal']:.2g}", file=sys.stderr, flush=True)
                keep(row)
    finally:
        for process in loaded:
            process.kill()
            process.wait()
    for figure in FIGURES:
        ratio, low, high = ratio_of_medians(*([run[figure] for run in row["runs"][name]]
                                              for name in ("palpate", "cyclictest")))
        row["ratios"][figure] = {"ratio": ratio, "low": low, "high": high}
    keep(row)
    return row


def report(row):
    runs = row["runs"]
    print(f"{row['condition']}: {row['pairs']} pairs of {row['seconds']} s")
    for figure in FIGURES:
        ours, theirs = (statistics.median(run[figure] for run in runs[name]) for name in ("palpate", "cyclictest"))
        ratio, low, high = row["ratios"][figure].values()
        said = "undefined (zero in too many runs)" if ratio is None else f"{ratio:.2f} [{low:.2f}, {high:.2f}]"
        print(f"  {figure:24} palpate {ours:.6g}  cyclictest {theirs:.6g}  ratio of medians {said}")
    by_clock, compute = (statistics.median(run[name] for run in runs["palpate"])
                         for name in ("compute_p99.9_us", "compute_cpu_p99.9_us"))
    print(f"  compute p99.9, median of runs: {by_clock:.2f} us by the clock, {compute:.2f} us of the thread's own time",
          flush=True)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("palpate")
    options.add_argument("--condition", default=",".join(CONDITIONS))
    options.add_argument("--pairs", type=int, default=10)
    options.add_argument("--seconds", type=int, default=60)
    options.add_argument("--hog-nice", type=int, default=0)
    options.add_argument("--json")
    args = options.parse_args()
    conditions = args.condition.split(",")
    if not set(conditions) <= set(CONDITIONS):
        sys.exit(f"--condition: some of {', '.join(CONDITIONS)} were expected")
    rows = []

    def keep(row):
        if args.json:
            pathlib.Path(args.json).write_text(json.dumps(rows + [row], indent=2) + "\n")

    for condition in conditions:
        row = measure(condition, args, keep)
        rows.append(row)
        report(row)


if __name__ == "__main__":
    main()
