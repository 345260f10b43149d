"""Do two builds of palpate say and write the same? For changes that must not change behaviour.

Usage: same_outputs.py BEFORE AFTER [--only WORD] [--keep FOLDER]

Runs the same commands with both programs, each in a folder of its own, and compares status, standard output, messages
and every file byte for byte: study databases, exports, analyses, reports, figures, schedules, forces along the recorded
paths. Two runs of one program must be equal, too (`same_outputs.py P P`). Takes some minutes.
"""

import argparse
import concurrent.futures
import contextlib
import hashlib
import os
import pathlib
import re
import sqlite3
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PROTOCOLS = sorted(path.name for path in (SOURCE / "protocols").glob("*.json")
                   if ".schema." not in path.name and ".texts." not in path.name)
SCENES = sorted(path.stem for path in (SOURCE / "protocols/scenes").glob("*.csv"))
TASKS = [name for name in PROTOCOLS if name.startswith(("stiffness", "size", "roughness"))]


def commands(words):
    """Lines of commands that build on each other; a line of its own runs beside the others."""
    yield [["--help"], ["--version"], ["nonsense"]] + [["help", word] for word in words]
    for name in PROTOCOLS:
        yield [["validate", f"protocols/{name}"], ["schedule", f"protocols/{name}", "--participant", "3"]]
    for scene in SCENES:
        renderers = ["ray"] if scene.startswith(("fig3b", "fig17")) else ["ray", "point"]
        yield [["render", "--scene", f"protocols/scenes/{scene}.json", "--renderer", renderer, "--trajectory",
                f"protocols/scenes/{scene}.csv", "--out", f"{scene}-{renderer}.csv"] for renderer in renderers]
    yield [["simulate", "protocols/quick.json", "--db", "quick.db", "--participants", "6", "--jobs", "1"], *after("quick.db"),
           ["plan", "--db", "quick.db", "--effect", "cone=22,cube=11", "--studies", "200", "--trials", "3,20", "--json", "plan.json",
            "--figure", "power.svg"],
           ["forget", "--db", "quick.db", "--participant", "S002", "--yes"], ["export", "--db", "quick.db", "--format", "csv", "--out", "rest.csv"]]
    for version in ("1", "2"):
        yield [["simulate", "protocols/quick.json", "--db", f"v{version}.db", "--participants", "2", "--jobs", "1", "--participant-version", version],
               *after(f"v{version}.db")]
    for name in TASKS + ["concave.json", "layered.json", "floating.json", "ho2000-interleaved.json"]:
        yield [["simulate", f"protocols/{name}", "--db", "study.db", "--participants", "2", "--jobs", "1"], *after("study.db")]
    yield [["simulate", "protocols/floating.json", "--db", "kept.db", "--participants", "1", "--jobs", "1"],
           ["replay", "--db", "kept.db", "--trial", "S001/1/3", "--out", "replayed.csv"]]
    yield [["simulate", "protocols/quick.json", "--db", f"part{part}.db", "--participants", "4", "--jobs", "1", "--shard", f"{part}/2"]
           for part in (1, 2)] + [["merge", "--out", "whole.db", "part1.db", "part2.db"], *after("whole.db")]
    yield [["simulate", "protocols/floating.json", "--db", "moved.db", "--participants", "2", "--jobs", "1"],
           ["analyze", "--db", "moved.db", "--movement", "--json", "movement.json", "--report", "movement.html"],
           ["export", "--db", "moved.db", "--format", "csv", "--out", "moved.csv"],
           ["analyze", "--csv", "moved.csv", "--json", "table.json"],
           ["replay", "--db", "moved.db", "--trial", "S001/1/1", "--compare", "--out", "both.csv"],
           ["watch", "--db", "moved.db", "--trial", "S001/1/1", "--compare", "--out", "trial.html"]]
    yield [["sweep", "protocols/quick.json", "--space", "protocols/spaces/small.json", "--points", "4", "--participants", "2",
            "--repetitions", "1", "--jobs", "1", "--db", "small.sweep"],
           ["analyze", "--sweep", "small.sweep", "--json", "sweep.json", "--report", "sweep.html"],
           ["export", "--db", "small.sweep", "--format", "csv", "--out", "sweep.csv"]]
    yield [["explore", "protocols/scenes/fig13-two-objects.json", "--trajectory", "protocols/scenes/fig13-two-objects.csv",
            "--frames", "frame", "--every", "200ms"],
           ["accuracy", "--search", "20000", "--seed", "77"]]
    yield [["plan", "--jnd-effect", "20", "--studies", "100", "--participants", "6-12"],
           ["plan", "--gain-sd", "0.15", "--residual-sd", "0.5", "--effect", "cone=15", "--studies", "200", "--trials", "20"]]


def after(database):
    yield ["analyze", "--db", database, "--json", database + ".json", "--report", database + ".html", "--figures", database + ".figures"]
    for format_ in ("csv", "bids", "psych-ds"):
        yield ["export", "--db", database, "--format", format_, "--out", f"{database}.{format_}"]


def hidden(text, folder, program):
    """Without what may differ between two runs: folders, days, how long it took."""
    text = text.replace(str(folder), "FOLDER").replace(str(program), "PALPATE")
    text = re.sub(r"\d{4}-\d\d-\d\d(T\d\d:\d\d(:\d\d(\.\d+)?)?Z?)?", "DATE", text)
    return re.sub(r"\b[\d.]+ (us|ms|s|min|simulated seconds per second)\b", "TIME", text)


def rows(database):
    """All of a database but for the moments of exports, what is drawn by chance in withdrawals, and the places of rows in
    the chain of seals: the clock ends the batches in which a simulation's rows are sealed."""
    lines = []
    with contextlib.closing(sqlite3.connect(f"file:{database}?immutable=1", uri=True)) as opened:
        for kind, name, sql in opened.execute("SELECT type, name, sql FROM sqlite_master ORDER BY type, name").fetchall():
            lines.append(f"{kind} {name} {sql}")
            if kind == "table":
                cursor = opened.execute(f'SELECT * FROM "{name}"')
                kept = [i for i, (column, *_) in enumerate(cursor.description)
                        if (name, column) not in (("exports", "made_utc_ns"), ("tombstones", "code_hash"), ("tombstone_secrets", "secret"),
                                             ("attempts", "link"), ("attempts", "seal"), ("page_answers", "link"), ("page_answers", "seal"))]
                lines += [repr([row[i] if not isinstance(row[i], bytes) else hashlib.sha256(row[i]).hexdigest() for i in kept])
                          for row in cursor]
    return "\n".join(lines)


def files(folder):
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not path.is_symlink():
            content = path.read_bytes()
            yield str(path.relative_to(folder)), rows(path).encode() if content.startswith(b"SQLite format 3") else content


def said_and_written(program, line, folder):
    folder.mkdir(parents=True)
    (folder / "protocols").symlink_to(SOURCE / "protocols")
    out = {}
    for number, words in enumerate(line):
        done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True, errors="replace",
                              env=dict(os.environ, TZ="UTC", LC_ALL="C.UTF-8", COLUMNS="80"))
        name = f"{number} palpate {' '.join(words)}"
        out[name] = f"{done.returncode}\n{hidden(done.stdout, folder, program)}\n{hidden(done.stderr, folder, program)}"
    for name, content in files(folder):
        try:
            out[name] = hidden(content.decode(), folder, program)
        except UnicodeDecodeError:
            out[name] = hashlib.sha256(content).hexdigest()
    return out


def first_difference(before, after_):
    for number, (a, b) in enumerate(zip(before.splitlines(), after_.splitlines()), 1):
        if a != b:
            return f"line {number}:\n    {a[:200]}\n    {b[:200]}"
    return "one is longer"


def main():
    options = argparse.ArgumentParser()
    options.add_argument("before")
    options.add_argument("after")
    options.add_argument("--only", default="", help="lines of commands with this word")
    options.add_argument("--keep", help="a new folder for what they write")
    options = options.parse_args()
    programs = [pathlib.Path(program).resolve() for program in (options.before, options.after)]
    said = subprocess.run([programs[0], "--help"], capture_output=True, text=True).stdout
    words = re.findall(r"^  ([a-z]+)  +\S", said, re.MULTILINE)
    lines = [line for line in map(list, commands(words)) if options.only in str(line)]
    compared = different = failed = 0
    with tempfile.TemporaryDirectory() as scratch, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        root = pathlib.Path(options.keep or scratch)
        pairs = [[pool.submit(said_and_written, program, line, root / side / str(number))
                  for side, program in zip(("before", "after"), programs)] for number, line in enumerate(lines)]
        for number, (before, after_) in enumerate([run.result() for run in pair] for pair in pairs):
            for name in sorted(before.keys() | after_.keys()):
                compared += 1
                if " palpate " in name and not name.endswith(" nonsense") and not before.get(name, "0\n").startswith("0\n"):
                    failed += 1
                    print(f"{number}/{name}: shows nothing, as it fails:\n    {before[name][:200]}", flush=True)
                if before.get(name) == after_.get(name):
                    continue
                different += 1
                print(f"{number}/{name}: " + ("one of them only" if name not in before or name not in after_ else
                                              first_difference(before[name], after_[name])), flush=True)
    print(f"{compared} outputs compared, {different} differ, {failed} commands fail")
    return different + failed > 0


if __name__ == "__main__":
    sys.exit(main())
