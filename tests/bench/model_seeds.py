"""What the simulated participants show, over many seeds: the tables of RESULTS.md by one command.

Usage: model_seeds.py PALPATE FOLDER [--seeds 101-120] [--studies version-3,steps-1-2,...] [--table-only]

Simulates the paper's study (7 participants x 2 renderers x 304 trials) once for each seed with each version,
with version 2 and the first of the steps from it to version 3, and with each ablation, and prints tables in
Markdown. The first: for each shape the mean over seeds of the percent reduction of response time with the ray
(geometric), the 95 % interval of that mean (Student's t over seeds), its standard deviation over seeds, and in
how many seeds the shape is clearly faster (+) or slower (-): Holm-adjusted p of the paired t-test below 0.05.
Below it the gain where time-outs count as censored times; at the end in how many seeds cone and cube both gain
more than sphere and cylinder. The second: for each version, shape and renderer mean time, accuracy, time-outs
and percepts up to the decision. The third, with --contact: contact share, from a small study with samples.
A study is one job at low priority (`nice`) and takes some 10 to 30 s of one processor. Databases stay in
FOLDER: called again, the command goes on where it stopped, and only missing studies are simulated.
The same seeds give the same tables on every machine.
"""

import argparse
import gzip
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile

SOURCES = pathlib.Path(__file__).resolve().parents[2]
QUICK, EXACT = {"motor": {"reaction_delay_s": 0.02}}, {"search": {"aim_sd_m": 0}}
PLACE = {"percept": {"place": "surface"}}
# Name: what the table calls it, protocol, version of the participant, patch of its settings.
STUDIES = {
    "version-3": ("version 3", "ho2000", 3, {}),
    "version-2": ("version 2", "ho2000", 2, {}),
    "steps-1-3": ("steps 1 to 3, and evidence by movement (version 3 passive)", "ho2000", 3, {"heading": {"chosen": False}}),
    "steps-1-2": ("steps 1 and 2, and nothing is forgotten", "ho2000", 2, {**PLACE, "observer": {"forgetting": False}}),
    "step-1": ("step 1, percepts on the surface", "ho2000", 2, PLACE),
    "v3-equal-volume": ("sizes of equal volume", "ho2000-equal-volume", 3, {}),
    "v3-quick-hand": ("reaction delay 0.02 s", "ho2000", 3, QUICK),
    "v3-exact-aim": ("exact aim (sd 0)", "ho2000", 3, EXACT),
    "v3-interleaved": ("renderers interleaved", "ho2000-interleaved", 3, {}),
    "version-1": ("version 1", "ho2000", 1, {}),
    "v2-quick-hand": ("version 2, reaction delay 0.02 s", "ho2000", 2, QUICK),
    "v2-exact-aim": ("version 2, exact aim (sd 0)", "ho2000", 2, EXACT),
    "v2-both": ("version 2, both", "ho2000", 2, {**QUICK, **EXACT}),
    "v2-equal-volume": ("version 2, sizes of equal volume", "ho2000-equal-volume", 2, {}),
    "v2-interleaved": ("version 2, renderers interleaved", "ho2000-interleaved", 2, {}),
}
DEFAULT_STUDIES = [name for name in STUDIES if not name.startswith("v2-")]
SHAPES = ["sphere", "cone", "cylinder", "cube"]
NON_DECISION, PERCEPT_RATE = 1.5, 6  # s, Hz: of every version
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
    _, protocol, version, patch = STUDIES[name]
    database, finished = folder / f"{name}-{seed}.db", folder / f"{name}-{seed}.done"
    if finished.exists():
        return
    settings = folder / f"{name}.settings.json"
    settings.write_text(json.dumps(patch))
    nice([palpate, "simulate", SOURCES / f"protocols/{protocol}.json", "--db", database, "--seed", seed,
          "--jobs", 1, "--participant-version", version, "--settings", settings])
    analysed(palpate, folder, name, seed)
    finished.touch()


def analysed(palpate, folder, name, seed):
    out = folder / f"{name}-{seed}.json"
    if (folder / f"{name}-{seed}.done").exists() and out.exists():
        return json.loads(out.read_text())
    nice([palpate, "analyze", "--db", folder / f"{name}-{seed}.db", "--json", out, "--force"])
    return json.loads(out.read_text())


def interval(values):
    """Half the width of the 95 % interval of the mean."""
    # Quantiles 0.975 of Student's t for 1 to 30 degrees of freedom.
    quantiles = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131,
                 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042]
    n = len(values)
    return quantiles[min(n - 1, 30) - 1] * statistics.stdev(values) / math.sqrt(n)


def gain_of(study, shape):
    return study["paired_by_shape"][shape]["percent_reduction_geometric"]


def cell(studies, shape):
    """Mean gain, its interval, its spread over seeds, and the seeds that are clear."""
    gains, faster, slower, without = [], 0, 0, 0
    for study in studies:
        gain, p = gain_of(study, shape), study["paired_by_shape"][shape]["t_test"]["p_holm"]
        if gain is None:
            without += 1
            continue
        gains.append(gain)
        if p is not None and p < ALPHA:
            faster, slower = faster + (gain > 0), slower + (gain < 0)
    if not gains:
        return "no pairs"
    mean = statistics.mean(gains)
    clear = f"{faster}+" + (f" {slower}-" if slower else "")
    if len(gains) < 2:
        return f"{mean:.1f} {clear}"
    half = interval(gains)
    text = f"{mean:.1f} [{mean - half:.1f}, {mean + half:.1f}] ({statistics.stdev(gains):.1f}) {clear}"
    return text + (f", no pairs in {without}" if without else "")


def has_pattern(study):
    """Whether cone and cube both gain more than sphere and cylinder."""
    gains = {shape: gain_of(study, shape) for shape in SHAPES}
    return None not in gains.values() and min(gains["cone"], gains["cube"]) > max(gains["sphere"], gains["cylinder"])


def censored_cell(studies, shape):
    """Mean and spread of the gain where time-outs count as censored times; "-" where nobody timed out."""
    gains = [study["paired_by_shape"][shape].get("censored", {}).get("percent_reduction") for study in studies]
    gains = [gain for gain in gains if gain is not None]
    if not gains:
        return "-"
    return f"{statistics.mean(gains):.1f} ({statistics.stdev(gains):.1f})" if len(gains) > 1 else f"{gains[0]:.1f}"


def time_outs(studies, shape, renderer="point"):
    """Percent of the trials that ended at the limit, mean over seeds."""
    shares = []
    for study in studies:
        row = study["confusion"][renderer][shape]
        shares.append(100 * row["no_response"] / sum(row.values()))
    return statistics.mean(shares)


def accuracy(studies, shape, renderer):
    """Percent of the trials that were answered with their shape, mean over seeds."""
    rows = [study["confusion"][renderer][shape] for study in studies]
    return statistics.mean(100 * row[shape] / sum(row.values()) for row in rows)


def mean_time(studies, shape, renderer):
    return statistics.mean(study["times"][renderer][shape]["mean_of_participant_means"] for study in studies)


def print_gains(done):
    print("Gain in %: mean [95 % interval of the mean] (sd over seeds), in how many of the seeds it is clear\n")
    print("| | seeds | " + " | ".join(SHAPES) + " | cone and cube above the others | time-outs with the point, % |")
    print("|---|---|" + "---|" * (len(SHAPES) + 2))
    for name, studies in done.items():
        lost = ", ".join(f"{time_outs(studies, shape):.1f}" for shape in SHAPES)
        cells = " | ".join(cell(studies, shape) for shape in SHAPES)
        print(f"| {STUDIES[name][0]} | {len(studies)} | {cells} | in {sum(map(has_pattern, studies))} | {lost} |")
        if any("censored" in study["paired_by_shape"][shape] for study in studies for shape in SHAPES):
            censored = " | ".join(censored_cell(studies, shape) for shape in SHAPES)
            print(f"| its time-outs as censored | | {censored} | | |")


def print_cells(done):
    print("\nEach cell, point / ray: mean time in s, correct in %, time-outs in %, percepts up to the decision\n")
    print("| | " + " | ".join(SHAPES) + " |\n|---|" + "---|" * len(SHAPES))
    for name, studies in done.items():
        row = []
        for shape in SHAPES:
            times = [mean_time(studies, shape, renderer) for renderer in ("point", "ray")]
            texts = (" / ".join(f"{time:.1f}" for time in times) + " s",
                     " / ".join(f"{accuracy(studies, shape, r):.1f}" for r in ("point", "ray")) + " %",
                     " / ".join(f"{time_outs(studies, shape, r):.1f}" for r in ("point", "ray")) + " %",
                     " / ".join(f"{PERCEPT_RATE * (time - NON_DECISION):.0f}" for time in times))
            row.append(", ".join(texts))
        print(f"| {STUDIES[name][0]} | " + " | ".join(row) + " |")


def contact_shares(palpate, folder, version, seed):
    """{renderer, shape: share of the time with contact}, of 4 participants with 3 presentations of each, every tick kept."""
    out = folder / f"contact-{version}-{seed}.json"
    if not out.exists():
        protocol = json.loads((SOURCES / "protocols/quick.json").read_text())
        protocol.update({"$schema": str(SOURCES / "protocols/protocol.schema.json"), "samples": True})
        path, database = folder / "contact.protocol.json", folder / f"contact-{version}-{seed}.db"
        path.write_text(json.dumps(protocol))
        nice([palpate, "simulate", path, "--db", database, "--seed", seed, "--participants", 4, "--jobs", 1,
              "--participant-version", version])
        ticks = {}
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            nice([palpate, "export", "--db", database, "--format", "bids", "--out", pathlib.Path(scratch) / "bids"])
            for recording in pathlib.Path(scratch).rglob("*.tsv.gz"):
                about = json.loads(recording.with_suffix("").with_suffix(".json").read_text())
                contacts, trial = about["Columns"].index("contacts"), about["Columns"].index("trial")
                cells = {row["trial"]: f"{row['renderer']} {row['shape']}" for row in about["Trials"]}
                with gzip.open(recording, "rt") as rows:
                    for row in rows:
                        row = row.split("\t")
                        if row[trial].isdigit():  # between trials there are none
                            count = ticks.setdefault(cells[int(row[trial])], [0, 0])
                            count[0] += row[contacts] != "0"
                            count[1] += 1
        out.write_text(json.dumps({cell: touched / all_ for cell, (touched, all_) in ticks.items()}))
        database.unlink()
    return json.loads(out.read_text())


def print_contact(palpate, folder, seed):
    print(f"\nShare of the time with contact, point / ray (seed {seed})\n")
    print("| | " + " | ".join(SHAPES) + " |\n|---|" + "---|" * len(SHAPES))
    for version in (2, 3):
        shares = contact_shares(palpate, folder, version, seed)
        cells = " | ".join(f"{shares['point ' + shape]:.2f} / {shares['ray ' + shape]:.2f}" for shape in SHAPES)
        print(f"| version {version} | {cells} |")


def print_tables(palpate, folder, names, seeds):
    done = {}
    for name in names:
        have = [seed for seed in seeds if (folder / f"{name}-{seed}.done").exists()]
        if have:
            done[name] = [analysed(palpate, folder, name, seed) for seed in have]
    print_gains(done)
    print_cells(done)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("palpate", type=lambda p: pathlib.Path(p).resolve())
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seeds", type=seeds_of, default=seeds_of("101-120"))
    parser.add_argument("--studies", default=",".join(DEFAULT_STUDIES))
    parser.add_argument("--table-only", action="store_true", help="of what has been simulated")
    parser.add_argument("--contact", action="store_true", help="of the first seed: the share of time with contact as well")
    args = parser.parse_args()
    names = args.studies.split(",")
    if unknown := [name for name in names if name not in STUDIES]:
        parser.error(f"unknown study {unknown[0]}; expected some of {', '.join(STUDIES)}")
    args.folder.mkdir(parents=True, exist_ok=True)
    if not args.table_only:
        # The latest version first, then all others of a seed, so that a stop leaves equal numbers.
        todo = [("version-3", seed) for seed in args.seeds if "version-3" in names]
        todo += [(name, seed) for seed in args.seeds for name in names if name != "version-3"]
        for i, (name, seed) in enumerate(todo, 1):
            print(f"{name}, seed {seed} ({i} of {len(todo)})", file=sys.stderr)
            simulate(args.palpate, args.folder, name, seed)
    print_tables(args.palpate, args.folder, names, args.seeds)
    if args.contact:
        print_contact(args.palpate, args.folder, args.seeds[0])


if __name__ == "__main__":
    main()
