"""How the gain with the ray goes together with movement, of the simulated participants over many seeds.

Usage: movement_seeds.py PALPATE FOLDER [--seeds 1-20] [--versions 1-3] [--repetitions 4] [--table-only]

Simulates the paper's study with servo samples, with fewer trials (4 presentations of each shape in place of 76:
7 participants x 2 renderers x 16 trials a seed), once for each seed and version, measures its movement
(palpate analyze --movement), and prints a table in Markdown. For each version and shape, mean over seeds with
its 95 % interval (Student's t over seeds): the gain in time with the ray in %, the ratio ray / point of coverage
a second and of strokes, the share of contact point / ray, and the remaining gain in time between trials of
equal measure. The table describes what occurs together: nobody set the movements.
Results stay in FOLDER: called again, the command goes on where it stopped. Databases are deleted.
"""

import argparse
import json
import math
import pathlib
import statistics
import sys

sys.dont_write_bytecode = True
from model_seeds import SHAPES, SOURCES, interval, nice, seeds_of

MEASURES = ["coverage_rate", "strokes", "contact_share"]


def study(palpate, folder, version, seed, repetitions, jobs):
    out = folder / f"movement-{version}-{seed}-{repetitions}.json"
    if not out.exists():
        protocol = json.loads((SOURCES / "protocols/ho2000.json").read_text())
        protocol.pop("$schema")
        protocol.update({"samples": True, "repetitions": repetitions,
                         "blocks_per_renderer": min(repetitions, protocol["blocks_per_renderer"])})
        path, database = folder / "movement.protocol.json", folder / f"movement-{version}-{seed}.db"
        path.write_text(json.dumps(protocol))
        nice([palpate, "simulate", path, "--db", database, "--seed", seed, "--jobs", jobs,
              "--participant-version", version])
        nice([palpate, "analyze", "--db", database, "--movement", "--jobs", jobs, "--json", out])
        database.unlink()
    return json.loads(out.read_text())


def percent(log_ratio):
    return 100 * (1 - math.exp(log_ratio))


def mean_and_interval(values, decimals):
    known = [value for value in values if value is not None]
    if not known:
        return "-"
    mean = statistics.mean(known)
    text = f"{mean:.{decimals}f}"
    if len(known) > 1:
        half = interval(known)
        text += f" [{mean - half:.{decimals}f}, {mean + half:.{decimals}f}]"
    return text


def gain(studies, shape, measure, key):
    """The gain of a mean over seeds of the difference of log time, with its interval, in %."""
    known = [row[key] for one in studies for row in one["gain_beside_movement"]
             if (row["shape"], row["measure"]) == (shape, measure) and row[key] is not None]
    if not known:
        return "-"
    mean = statistics.mean(known)
    if len(known) < 2:
        return f"{percent(mean):.1f}"
    half = interval(known)
    return f"{percent(mean):.1f} [{percent(mean + half):.1f}, {percent(mean - half):.1f}]"


def mean_of(one, measure, renderer, shape):
    return one["measures"][measure]["means"][renderer][shape]["mean"]


def ratio(one, measure, shape):
    point, ray = (mean_of(one, measure, renderer, shape) for renderer in ("point", "ray"))
    return ray / point if point and ray is not None else None


def print_table(done):
    print("SIMULATED PARTICIPANTS\n")
    print("| version, shape | seeds | gain in time, % | coverage a second, ray / point | strokes, ray / point | "
          "contact share, point / ray | gain at equal coverage rate | at equal strokes | at equal contact share |")
    print("|---|---|" + "---|" * 7)
    for version, studies in done.items():
        for shape in SHAPES:
            shares = " / ".join(mean_and_interval([mean_of(one, "contact_share", renderer, shape) for one in studies], 2)
                                for renderer in ("point", "ray"))
            cells = [gain(studies, shape, MEASURES[0], "log_time_difference"),
                     mean_and_interval([ratio(one, "coverage_rate", shape) for one in studies], 2),
                     mean_and_interval([ratio(one, "strokes", shape) for one in studies], 2), shares]
            cells += [gain(studies, shape, measure, "log_time_difference_at_equal_measure") for measure in MEASURES]
            print(f"| {version}, {shape} | {len(studies)} | " + " | ".join(cells) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("palpate", type=lambda p: pathlib.Path(p).resolve())
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seeds", type=seeds_of, default=seeds_of("1-20"))
    parser.add_argument("--versions", type=seeds_of, default=seeds_of("1-3"))
    parser.add_argument("--repetitions", type=int, default=4)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--table-only", action="store_true", help="of what has been simulated")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    done = {version: [] for version in args.versions}
    # A seed of every version in turn, so that a stop leaves equal numbers.
    for seed in args.seeds:
        for version in args.versions:
            out = args.folder / f"movement-{version}-{seed}-{args.repetitions}.json"
            if args.table_only and not out.exists():
                continue
            print(f"version {version}, seed {seed}", file=sys.stderr)
            done[version].append(study(args.palpate, args.folder, version, seed, args.repetitions, args.jobs))
    print_table(done)


if __name__ == "__main__":
    main()
