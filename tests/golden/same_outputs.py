"""Do two builds of palpate say and write the same? For changes that must not change behaviour.

Usage: same_outputs.py BEFORE AFTER [--only WORD] [--keep FOLDER]

Runs the commands of golden_commands.py with both programs, each line in a folder of its own, and compares status,
standard output, messages and every file byte for byte, but what HIDDEN, NOT_COMPARED and LIVE name. Two runs of one program
must be equal, too (`same_outputs.py P P`). Takes some minutes.
"""

import argparse
import concurrent.futures
import contextlib
import csv
import hashlib
import io
import os
import pathlib
import re
import sqlite3
import sys
import tempfile
import typing

from golden_commands import all_lines, not_run, options_by_command
from golden_steps import Place

COSTS = "ns_per_tick|ns_per_step|us_per_step|paper_test_ns|exact_test_ns"
OF_REPLIES = "t_ns|zero_t_ns|t_received_ns|t_sent_ns|first_contact_s|response_time_s|ticks|missed_ticks|max_force_n|faults"
DATED = r"(registration\.(json|md)|osf\.json|form\.json|check\.(json|html)|report\.html|README\.md|SHA256SUMS|ro-crate-metadata\.json)"
HIDDEN = (
    (r"\d{4}-\d\d-\d\d(T\d\d:\d\d(:\d\d(\.\d+)?)?Z?| \d\d:\d\d UTC)?|today \d\d:\d\d|at \d\d:\d\d:\d\d UTC", "DATE"),
    (rf'[0-9a-f]{{64}}(?=  (\S*/)?{DATED}\n)', "SUM"),
    (r"([Dd]igest[^\n]{0,60}?|the given one: | found )[0-9a-f]{64}|[0-9a-f]{64}(?=; compare it with the one)", r"\1DIGEST"),
    (rf'("name": "(\S*/)?{DATED}"[^{{}}]*"sha256": ")[0-9a-f]{{64}}', r"\1SUM"),
    (r"[\d.]+ simulated s in [\d.]+ s, [\d.]+ simulated seconds per second", "PACE"),
    (r"\b[\d.]+(e[-+]?\d+)? (us|ms|s|min|simulated seconds per second)\b", "TIME"),
    (r'("verdict": )"(fit|fit_with_losses|unfit)"', r"\1VERDICT"),
    (r"every other method takes at least [\d.]+ times", "COSTS"),
    (rf'"({COSTS})": [\d.e+]+|"eleven_us": {{[^}}]*}}', "COSTS"),
    (r'"(submitted_s|onset_ns|end_ns|confidence_ns)": ?\d+', "MOMENT"),
    (r"127\.0\.0\.1:\d{5}", "ADDRESS"),
    (r'(?<=")[0-9a-f]{32}(?=")|(?<=#)[0-9a-f]{32}', "TOKEN"),
    # The simulated hand moves at its own time: where it is when a trial begins or ends.
    (r"(Take the stylus away from the middle\.\n|Ready: hold it still\.\n)+", "HOME\n"),
    (r"\* trial \d+ was answered before the first contact\n|, \d+ ticks? missed|started inside, ", ""),
    (rf'^ "({OF_REPLIES})": ("[^"]*"|[^,\s]+)', r'"\1": MEASURED'),
    (r"servo: \d+ ticks in .*|palpate serve ends: \d+ ticks.*|{\"servo\":{.*}", "TICKS"))
# Moments; what is drawn by chance in withdrawals; the places of rows in the chain of seals: the clock ends the batches in which
# a simulation's rows are sealed.
NOT_COMPARED = {("exports", "made_utc_ns"), ("tombstones", "code_hash"), ("tombstone_secrets", "secret"),
                ("attempts", "link"), ("attempts", "seal"), ("page_answers", "link"), ("page_answers", "seal")}
# Columns of tables and exports of sessions that a hand made at its time.
LIVE = set("link seal end_link end_seal consent_utc_ns started_utc_ns started_ns ended_ns at_ns began_ns onset_ns"
           " response_ns onset_utc response_time ticks first_contact_time contact_share edge_dwell before_contact"
           " started_inside faults missed_ticks max_force longest_period_ns longest_period samples_sha256 data count"
           " interval_onsets interval_ends confidence_delay start_tip_x start_tip_y start_tip_z start_tail_x start_tail_y"
           " start_tail_z".split())


def hidden(text, place, timed=False):
    """Without what may differ between two runs: folders, days, how long it took. `timed`: without numbers."""
    text = text.replace(str(place.folder), "FOLDER").replace(str(place.program), "PALPATE")
    for pattern, name in HIDDEN:
        text = re.sub(pattern, name, text, flags=re.M)
    return re.sub(r"[ \t]+", " ", re.sub(r"[-+]?\b\d[\d.]*(e[-+]?\d+)?", "N", text)) if timed else text


def rows(database, live):
    """All of a database but columns that differ between two runs."""
    lines = []
    with contextlib.closing(sqlite3.connect(f"file:{database}?immutable=1", uri=True)) as opened:
        for kind, name, sql in opened.execute("SELECT type, name, sql FROM sqlite_master ORDER BY type, name").fetchall():
            lines.append(f"{kind} {name} {sql}")
            if kind == "table":
                cursor = opened.execute(f'SELECT * FROM "{name}"')
                kept = [i for i, (column, *_) in enumerate(cursor.description)
                        if (name, column) not in NOT_COMPARED and not (live and column in LIVE)]
                lines += [name + repr([row[i] if not isinstance(row[i], bytes) else hashlib.sha256(row[i]).hexdigest() for i in kept])
                          for row in cursor]
    return "\n".join(lines)


def without_live_columns(text):
    table = csv.DictReader(io.StringIO(text))
    return "\n".join(str({name: value for name, value in row.items() if name not in LIVE}) for row in table)


class Output(typing.NamedTuple):
    text: str
    place: Place
    timed: bool = False
    failed: bool = False

    def hidden(self):
        return hidden(self.text, self.place, self.timed)


def written(path, place):
    found = path.read_bytes()
    if found.startswith(b"SQLite format 3"):
        return Output(rows(path, path.name.startswith("live")), place)
    try:
        text = found.decode()
    except UnicodeDecodeError:
        return Output(hashlib.sha256(found).hexdigest(), place)
    live = ".live." in path.name or path.name.endswith("attempts.csv")
    return Output(without_live_columns(text) if live else text, place, ".timed." in path.name)


def said_and_written(program, line, folder):
    """Outputs by their names."""
    place, out = Place(program, folder), {}
    place.make()
    for number, step in enumerate(line):
        said = step.run(place)
        out[f"{number} {' '.join(step.words)[:150]}"] = Output(said, place, step.timed, not said.startswith(f"{step.status}\n"))
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not path.is_symlink():
            out[str(path.relative_to(folder))] = written(path, place)
    return out


def first_difference(before, after_):
    for number, (a, b) in enumerate(zip(before.splitlines(), after_.splitlines()), 1):
        if a != b:
            return f"line {number}:\n    {a[:200]}\n    {b[:200]}"
    return "one is longer"


def compare(name, before, after):
    """\return whether they differ, whether one of them failed; says so."""
    failed = any(side and side.failed for side in (before, after))
    if failed:
        print(f"{name}: does not end as it should:\n    {(before or after).text[:1000]}", flush=True)
    if not before or not after:
        print(f"{name}: one of them only", flush=True)
        return True, failed
    if before.text == after.text or (texts := (before.hidden(), after.hidden()))[0] == texts[1]:
        return False, failed
    print(f"{name}: {first_difference(*texts)}", flush=True)
    return True, failed


def run_both(programs, lines, root):
    """Yields the outputs of each line, before and after."""
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        pairs = [[pool.submit(said_and_written, program, line, root / side / str(number))
                  for side, program in zip(("before", "after"), programs)] for number, line in enumerate(lines)]
        for number, pair in enumerate(pairs):
            yield number, *(run.result() for run in pair)


def main():
    options = argparse.ArgumentParser()
    options.add_argument("before")
    options.add_argument("after")
    options.add_argument("--only", default="", help="lines of commands with this word")
    options.add_argument("--keep", help="a new folder for what they write")
    options = options.parse_args()
    programs = [pathlib.Path(program).resolve() for program in (options.before, options.after)]
    known = options_by_command(programs[1])
    lines = list(all_lines(known))
    missing = not_run(known, lines)
    for sentence in missing:
        print(sentence)
    compared = different = failed = 0
    with tempfile.TemporaryDirectory() as scratch:
        chosen = [line for line in lines if any(options.only in " ".join(step.words) for step in line)]
        for number, before, after in run_both(programs, chosen, pathlib.Path(options.keep or scratch)):
            for name in sorted(before.keys() | after.keys()):
                differ, fails = compare(f"{number}/{name}", before.get(name), after.get(name))
                compared, different, failed = compared + 1, different + differ, failed + fails
    print(f"{compared} outputs compared, {different} differ, {failed} commands fail, {len(missing)} are not run")
    return different + failed + len(missing) > 0


if __name__ == "__main__":
    sys.exit(main())
