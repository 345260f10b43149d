"""The rules of Psych-DS (https://psych-ds.github.io, "must") that our exports have to keep."""

import csv
import io
import json
import pathlib
import re

NAME = re.compile(r"[a-z]+-[0-9A-Za-z]+(_[a-z]+-[0-9A-Za-z]+)*_data\.csv")
OURS = re.compile(r"study-[0-9A-Za-z]+_(subject-[0-9A-Za-z]+|description-attempts)(_[a-z]+-[0-9A-Za-z]+)*_data\.csv")
KEYWORDS = set("study site subject session task condition trial stimulus description".split())


def names_of_variables(description):
    names = []
    for variable in description.get("variableMeasured", []):
        names.append(variable if isinstance(variable, str) else variable.get("name"))
    return names


def psychds_faults(folder):
    """Every fault of a dataset, as sentences."""
    folder = pathlib.Path(folder)
    raw = (folder / "dataset_description.json").read_bytes()
    faults = ["dataset_description.json: begins with a BOM"] if raw.startswith(b"\xef\xbb\xbf") else []
    description = json.loads(raw.decode("utf-8-sig"))
    if description.get("@context") not in ("https://schema.org/", "http://schema.org/"):
        faults.append("@context is not https://schema.org/")
    if description.get("@type") != "Dataset":
        faults.append("@type is not Dataset")
    faults += [f"no {key}" for key in ("name", "description", "variableMeasured") if not description.get(key)]
    described = names_of_variables(description)
    if len(set(described)) != len(described):
        faults.append("variableMeasured says a name twice")
    used = set()
    files = sorted(path for path in (folder / "data").rglob("*") if path.is_file())
    if not files:
        faults.append("no data file")
    for path in files:
        if not NAME.fullmatch(path.name) or not OURS.fullmatch(path.name):
            faults.append(f"{path.name}: no Psych-DS name")
            continue
        pairs = [part.split("-") for part in path.name[: -len("_data.csv")].split("_")]
        if not {key for key, _ in pairs} <= KEYWORDS or len({key for key, _ in pairs}) != len(pairs):
            faults.append(f"{path.name}: keywords that are not official, or twice")
        data = path.read_bytes()
        if data.startswith(b"\xef\xbb\xbf"):
            faults.append(f"{path.name}: begins with a BOM")
        header, *rows = csv.reader(io.StringIO(data.decode("utf-8-sig"), newline=""), strict=True)
        if any(len(row) != len(header) for row in rows):
            faults.append(f"{path.name}: rows of other lengths than the header")
        if len(set(header)) != len(header) or "" in header:
            faults.append(f"{path.name}: a header that is empty or twice")
        used.update(header)
        for keyword, value in pairs:
            if keyword == "subject" and any(dict(zip(header, row))["participant_id"] != value for row in rows):
                faults.append(f"{path.name}: holds another participant")
    faults += [f"column {name} is not in variableMeasured" for name in sorted(used - set(described))]
    faults += [f"variableMeasured has {name}, which no file has" for name in sorted(set(described) - used)]
    return faults
