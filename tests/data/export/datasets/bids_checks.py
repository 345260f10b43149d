"""What bids-validator does not look at: numbers that are none, onsets out of order, participants that do not match,
columns that are not described, recordings that do not fit their trial."""

import csv
import gzip
import json
import math
import pathlib
import re

NAME = re.compile(
    r"sub-(?P<sub>[0-9A-Za-z]+)_ses-(?P<ses>\d+)_task-(?P<task>[0-9A-Za-z]+)(_run-(?P<run>\d+))?"
    r"(_recording-haptic)?_(beh|physio)\.(tsv|json|tsv\.gz)"
)
NUMBERS = (
    "onset duration session block trial correct response_time orientation_w orientation_x orientation_y orientation_z "
    "practice timed_out first_contact_time simulated missed_ticks attempt participant_number started_inside ticks "
    "longest_period faults max_force before_contact contact_share edge_dwell elapsed"
).split()
MAY_BE_MISSING = set(
    "response first_contact_time observer_sha256 response_device contact_share edge_dwell "  # and of tasks:
    "correct level standard_level number confidence confidence_delay comparison_interval interval_levels".split()
)
LISTS = {"interval_onsets", "interval_ends", "interval_levels"}  # separated by semicolons
MIXED = {"response", "number", "confidence"}  # what they are depends on the task, and is described


def read_tsv(path):
    """Header and rows; the text as it is: BIDS has no quoting."""
    text = path.read_bytes().decode("utf-8")
    assert "\r" not in text and text.endswith("\n") and not text.startswith("\ufeff"), path
    header, *rows = [line.split("\t") for line in text[:-1].split("\n")]
    return header, rows


def is_number(text):
    try:
        return math.isfinite(float(text)) and re.fullmatch(r"-?\d+(\.\d+)?(e[+-]\d+)?", text) is not None
    except ValueError:
        return False


def described(sidecar, column):
    about = sidecar.get(column)
    told = isinstance(about, dict) and "Description" in about
    return told and ("Units" in about or "Levels" in about or column in LISTS | MIXED)


def table_faults(path):
    faults = []
    header, rows = read_tsv(path)
    sidecar_path = path.with_name(path.name[: -len(".tsv")] + ".json")
    if not sidecar_path.is_file():
        return [f"{path.name}: no sidecar"]
    sidecar = json.loads(sidecar_path.read_text())
    faults += [f"{path.name}: column {name} is not described" for name in header if not described(sidecar, name)]
    if header[:2] != ["onset", "duration"]:
        faults.append(f"{path.name}: does not begin with onset and duration")
    onsets = []
    for line, row in enumerate(rows, 2):
        if len(row) != len(header):
            faults.append(f"{path.name}:{line}: {len(row)} fields for {len(header)} columns")
            continue
        for name, value in zip(header, row):
            if value == "":
                faults.append(f"{path.name}:{line}: {name} is empty, not n/a")
            elif value == "n/a":
                if name not in MAY_BE_MISSING:
                    faults.append(f"{path.name}:{line}: {name} is missing")
            elif name in NUMBERS and not is_number(value):
                faults.append(f"{path.name}:{line}: {name} is no number: {value}")
            if isinstance(sidecar.get(name), dict) and "Levels" in sidecar[name]:
                if value != "n/a" and value not in sidecar[name]["Levels"]:
                    faults.append(f"{path.name}:{line}: {name} has no level {value}")
        onsets.append(row[0])
    if all(map(is_number, onsets)):
        if [float(x) for x in onsets] != sorted(float(x) for x in onsets):
            faults.append(f"{path.name}: onsets are not sorted")
        if onsets and float(onsets[0]) != 0:
            faults.append(f"{path.name}: the first onset is not 0")
    return faults


def places_of(name, samples, tick):
    """Of each trial, the rows of its ticks; and their faults."""
    places, faults = {}, []
    for i, row in enumerate(samples):
        if row[0] == "n/a":
            continue
        place = places.setdefault(row[0], [])
        # Each interval of a trial counts its ticks from 0.
        if place and [int(x) for x in row[1 : tick + 1]] <= [int(x) for x in samples[place[-1]][1 : tick + 1]]:
            faults.append(f"{name}: row {i}: the ticks are out of order")
        place.append(i)
    return places, faults


def recorded_trial_faults(name, trial, place, onset, told, about, sidecar):
    """Of one trial's rows against the table's row and the sidecar's entry of it; onset in s, by its first row."""
    faults = []
    if abs(onset - float(told["onset"])) * sidecar.get("SamplingFrequency", 0) > 1:
        faults.append(f"{name}: trial {trial} does not stand at its onset")
    if about.get("first_row") != place[0] or about.get("rows") != place[-1] + 1 - place[0]:
        faults.append(f"{name}: trial {trial} does not stand where Trials says")
    if len(place) > int(told["ticks"]):
        faults.append(f"{name}: more samples of trial {trial} than the trial has ticks")
    for key in ("renderer", "shape"):
        if about.get(key) != told[key]:
            faults.append(f"{name}: trial {trial}: another {key} than in the table")
    pose = [float(told[f"orientation_{axis}"]) for axis in "wxyz"]
    if about.get("orientation_wxyz") != pose:
        faults.append(f"{name}: trial {trial}: another pose than in the table")
    if about.get("shape") not in sidecar.get("Objects", {}):
        faults.append(f"{name}: trial {trial}: its object is not in Objects")
    return faults


def place_faults(name, places, samples, tick, told, sidecar):
    """Of the trials' rows (places) against the table's rows (told) and the sidecar."""
    faults = []
    rate, start = sidecar.get("SamplingFrequency", 0), sidecar.get("StartTime", 0)
    listed = {str(trial["trial"]): trial for trial in sidecar.get("Trials", [])}
    if set(listed) != set(places):
        faults.append(f"{name}: Trials lists others than there are")
    for trial, place in places.items():
        if trial not in told:
            faults.append(f"{name}: trial {trial} is not in the table")
            continue
        onset = start + (place[0] - int(samples[place[0]][tick])) / rate if rate > 0 else 0
        faults += recorded_trial_faults(name, trial, place, onset, told[trial], listed.get(trial, {}), sidecar)
    return faults


def recording_faults(path):
    faults = []
    sidecar = json.loads(path.with_name(path.name[: -len(".tsv.gz")] + ".json").read_text())
    columns = sidecar.get("Columns", [])
    faults += [f"{path.name}: column {name} is not described" for name in columns if "Description" not in sidecar.get(name, {})]
    if not (sidecar.get("SamplingFrequency", 0) > 0):
        faults.append(f"{path.name}: no SamplingFrequency")
    if not isinstance(sidecar.get("StartTime"), (int, float)):
        faults.append(f"{path.name}: no StartTime")
    table = path.with_name(path.name.replace("_recording-haptic_physio.tsv.gz", "_beh.tsv"))
    if not table.is_file():
        return faults + [f"{path.name}: no table of the same run"]
    header, rows = read_tsv(table)
    told = {row["trial"]: row for row in (dict(zip(header, row)) for row in rows)}
    with gzip.open(path, "rt", newline="") as file:
        samples = [line[:-1].split("\t") for line in file]
    if any(len(row) != len(columns) for row in samples):
        return faults + [f"{path.name}: rows do not have {len(columns)} fields"]
    if any(value != "n/a" and not is_number(value) for row in samples for value in row):
        return faults + [f"{path.name}: a value is no number"]
    if any(0 < row.count("n/a") < len(row) for row in samples):
        faults.append(f"{path.name}: a row is n/a in part")
    tick = columns.index("tick")
    places, more = places_of(path.name, samples, tick)
    return faults + more + place_faults(path.name, places, samples, tick, told, sidecar)


def bids_faults(folder):
    """Every fault of a dataset, as sentences."""
    folder = pathlib.Path(folder)
    faults = []
    description = json.loads((folder / "dataset_description.json").read_text())
    faults += [f"dataset_description.json: no {key}" for key in ("Name", "BIDSVersion", "DatasetType", "GeneratedBy")
               if not description.get(key)]
    header, rows = read_tsv(folder / "participants.tsv")
    listed = [row[0] for row in rows]
    found = sorted(path.name for path in folder.glob("sub-*"))
    if header[0] != "participant_id" or sorted(listed) != found:
        faults.append(f"participants.tsv lists {listed}, the folders are {found}")
    sidecar = json.loads((folder / "participants.json").read_text())
    faults += [f"participants.tsv: column {name} is not described" for name in header if name not in sidecar]
    for path in sorted(folder.glob("sub-*/**/*")):
        if path.is_dir():
            continue
        match = NAME.fullmatch(path.name)
        if not match:
            faults.append(f"{path.name}: no BIDS name")
            continue
        if path.parent.relative_to(folder).as_posix() != f"sub-{match['sub']}/ses-{match['ses']}/beh":
            faults.append(f"{path}: its name is not of its folder")
        if path.name.endswith("_beh.tsv"):
            faults += table_faults(path)
        if path.name.endswith(".tsv.gz"):
            faults += recording_faults(path)
    if "SIMULATED" not in description.get("Name", "") and any("1" in row[1:] for row in rows):
        faults.append("simulated participants, but the name does not say so")
    return faults


def tables(folder):
    """(participant, session, trial) -> column -> text of every row; n/a as the empty text of CSV."""
    rows_of = {}
    for path in sorted(pathlib.Path(folder).glob("sub-*/ses-*/beh/*_beh.tsv")):
        who = NAME.fullmatch(path.name)["sub"]
        header, rows = read_tsv(path)
        for row in rows:
            values = {name: "" if value == "n/a" else value for name, value in zip(header, row)}
            rows_of[who, values["session"], values["trial"]] = values
    return rows_of


def read_csv(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))
