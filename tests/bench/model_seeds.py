"""What the simulated participants show, over many seeds: the README's table by one command.

Usage: model_seeds.py PALPATE FOLDER [--seeds 1-24] [--studies version-2,quick-hand,...] [--table-only]

Simulates the paper's study (7 participants x 2 renderers x 304 trials) once for each seed with the
frozen settings, then with each ablation, and prints a table in Markdown: for each shape the mean over
seeds of the percent reduction of response time with the ray (geometric), its standard deviation over
seeds, and in how many seeds the shape is clearly faster (+) or slower (-): Holm-adjusted p of the paired
t-test below 0.05. Below it the gain where time-outs count as censored times. Time-outs: mean
share over seeds of the point's trials.
A study is one job at low priority (`nice`) and takes some 20 s of one processor. Databases stay in
FOLDER: called again, the command goes on where it stopped, and only missing studies are simulated.
The same seeds give the same table on every machine.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys

SOURCES = pathlib.Path(__file__).resolve().parents[2]
QUICK, EXACT = {"motor": {"reaction_delay_s": 0.02}}, {"search": {"aim_sd_m": 0}}
# Name: what the table calls it, protocol, patch of the frozen settings.
STUDIES = {
    "version-2": ("version 2", "ho2000", {}),
    "quick-hand": ("reaction delay 0.02 s", "ho2000", QUICK),
    "exact-aim": ("exact aim (sd 0)", "ho2000", EXACT),
    "both": ("both", "ho2000", {**QUICK, **EXACT}),
    "equal-volume": ("sizes of equal volume", "ho2000-equal-volume", {}),
    "interleaved": ("renderers interleaved", "ho2000-interleaved", {}),
}
ALPHA = 0.05


def seeds_of(text):
    seeds = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        seeds += range(int(first), int(last or first) + 1)
    return sorted(set(seeds))


def nice(command):
    done = subprocess.run(["nice", *map(str, command)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")


def simulate(palpate, folder, name, seed):
    _, protocol, patch = STUDIES[name]
    database, finished = folder / f"{name}-{seed}.db", folder / f"{name}-{seed}.done"
    if finished.exists():
        return
    settings = folder / f"{name}.settings.json"
    settings.write_text(json.dumps(patch))
    nice([palpate, "simulate", SOURCES / f"protocols/{protocol}.json", "--db", database, "--seed", seed,
          "--jobs", 1, "--settings", settings])
    finished.touch()


def analysed(palpate, folder, name, seed):
    out = folder / f"{name}-{seed}.json"
    nice([palpate, "analyze", "--db", folder / f"{name}-{seed}.db", "--json", out, "--force"])
    return json.loads(out.read_text())


def cell(studies, shape):
    """Mean gain, its spread over seeds, and the seeds that are clear."""
    gains, faster, slower, without = [], 0, 0, 0
    for study in studies:
        paired = study["paired_by_shape"][shape]
        gain, p = paired["percent_reduction_geometric"], paired["t_test"]["p_holm"]
        if gain is None:
            without += 1
            continue
        gains.append(gain)
        if p is not None and p < ALPHA:
            faster, slower = faster + (gain > 0), slower + (gain < 0)
    if not gains:
        return "no pairs"
    spread = f"{statistics.stdev(gains):.1f}" if len(gains) > 1 else "-"
    clear = f"{faster}+" + (f" {slower}-" if slower else "")
    text = f"{statistics.mean(gains):.1f} ({spread}) {clear}"
    return text + (f", no pairs in {without}" if without else "")


def censored_cell(studies, shape):
    """Mean and spread of the gain where time-outs count as censored times; "-" where nobody timed out."""
    gains = [study["paired_by_shape"][shape].get("censored", {}).get("percent_reduction") for study in studies]
    gains = [gain for gain in gains if gain is not None]
    if not gains:
        return "-"
    return f"{statistics.mean(gains):.1f} ({statistics.stdev(gains):.1f})" if len(gains) > 1 else f"{gains[0]:.1f}"


def time_outs(studies, shape):
    """Percent of the point's trials that ended at the limit, mean over seeds."""
    shares = []
    for study in studies:
        row = study["confusion"]["point"][shape]
        shares.append(100 * row["no_response"] / sum(row.values()))
    return statistics.mean(shares)


def print_table(palpate, folder, names, seeds):
    shapes = ["sphere", "cone", "cylinder", "cube"]
    print("Gain in % (sd over seeds), in how many of the seeds it is clear\n")
    print("| | seeds | " + " | ".join(shapes) + " | time-outs with the point, % |")
    print("|---|---|" + "---|" * (len(shapes) + 1))
    for name in names:
        have = [seed for seed in seeds if (folder / f"{name}-{seed}.done").exists()]
        if not have:
            continue
        studies = [analysed(palpate, folder, name, seed) for seed in have]
        lost = ", ".join(f"{time_outs(studies, shape):.1f}" for shape in shapes)
        cells = " | ".join(cell(studies, shape) for shape in shapes)
        print(f"| {STUDIES[name][0]} | {len(have)} | {cells} | {lost} |")
        censored = " | ".join(censored_cell(studies, shape) for shape in shapes)
        print(f"| its time-outs as censored | | {censored} | |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("palpate", type=lambda p: pathlib.Path(p).resolve())
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seeds", type=seeds_of, default=seeds_of("1-24"))
    parser.add_argument("--studies", default=",".join(STUDIES))
    parser.add_argument("--table-only", action="store_true", help="of what has been simulated")
    args = parser.parse_args()
    names = args.studies.split(",")
    if unknown := [name for name in names if name not in STUDIES]:
        parser.error(f"unknown study {unknown[0]}; expected some of {', '.join(STUDIES)}")
    args.folder.mkdir(parents=True, exist_ok=True)
    if not args.table_only:
        # The frozen settings first, then all ablations of a seed, so that a stop leaves equal numbers.
        main_study = [("version-2", seed) for seed in args.seeds if "version-2" in names]
        others = [(name, seed) for seed in args.seeds for name in names if name != "version-2"]
        for i, (name, seed) in enumerate(main_study + others, 1):
            print(f"{name}, seed {seed} ({i} of {len(main_study + others)})", file=sys.stderr)
            simulate(args.palpate, args.folder, name, seed)
    print_table(args.palpate, args.folder, names, args.seeds)


if __name__ == "__main__":
    main()
