"""Holds BIDS exports against bids-validator 1.15.0, which is fetched from the npm registry once and kept.

Usage: bids_validator_test.py PALPATE PROTOCOLS CACHE_FOLDER
Status 77 (skipped), with the reason, where there is no Node 18 or the registry cannot be reached.
"""

import hashlib
import json
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile

PALPATE, PROTOCOLS, CACHE = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
VERSION = "1.15.0"
SHA256 = "6df1b2aa1df305fdfbea90cd9427b4fe3b8613310163fb12c627410396078f60"  # of the registry's tarball
SKIPPED = 77


def skip(reason):
    print(f"SKIPPED, BIDS exports were NOT held against bids-validator: {reason}")
    sys.exit(SKIPPED)


def validator():
    """Path of its command; unpacked in the cache folder."""
    folder = CACHE / f"bids-validator-{VERSION}"
    command = folder / "package" / "bin" / "bids-validator"
    if command.is_file():
        return command
    CACHE.mkdir(parents=True, exist_ok=True)
    try:
        fetched = subprocess.run(["npm", "pack", "--silent", f"bids-validator@{VERSION}"], cwd=CACHE, capture_output=True,
                                 text=True, timeout=300)
    except (FileNotFoundError, subprocess.TimeoutExpired) as error:
        skip(f"npm: {error}")
    tarball = CACHE / f"bids-validator-{VERSION}.tgz"
    if fetched.returncode != 0 or not tarball.is_file():
        skip(f"npm pack: {fetched.stderr.strip()[:300]}")
    if hashlib.sha256(tarball.read_bytes()).hexdigest() != SHA256:
        sys.exit(f"{tarball} is not what it was: its SHA-256 has changed")
    draft = pathlib.Path(tempfile.mkdtemp(dir=CACHE))
    with tarfile.open(tarball) as archive:
        archive.extractall(draft)
    draft.rename(folder)
    return command


def simulate(folder, name, participants, /, start="quick", about=None, more=(), **changes):
    protocol = json.loads((PROTOCOLS / f"{start}.json").read_text())
    protocol.pop("$schema")
    protocol.update(changes)
    (folder / f"{name}.json").write_text(json.dumps(protocol))
    who = ["--about", about] if about else []
    for words in (["simulate", folder / f"{name}.json", "--db", folder / f"{name}.db", "--participants", participants],
                  ["export", "--db", folder / f"{name}.db", "--format", "bids", *who, *more, "--out", folder / name]):
        subprocess.run([PALPATE, *map(str, words)], check=True, capture_output=True, timeout=600)
    return folder / name


def issues(command, dataset):
    """(errors, warnings): keys of what the validator says."""
    done = subprocess.run(["node", command, "--json", dataset], capture_output=True, text=True, timeout=600)
    try:
        said = json.loads(done.stdout)["issues"]
    except (ValueError, KeyError):
        sys.exit(f"the validator failed: {done.stdout[:500]} {done.stderr[:500]}")
    return [[issue["key"] for issue in said[kind]] for kind in ("errors", "warnings")]


def expect(condition, what):
    print(("ok: " if condition else "FAILED: ") + what)
    return condition


def main():
    node = shutil.which("node")
    if not node or int(subprocess.run([node, "-p", "process.versions.node"], capture_output=True, text=True)
                       .stdout.split(".")[0] or 0) < 18:
        skip("there is no Node 18 or later")
    command = validator()
    good = True
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        plain = simulate(folder, "plain", 2, samples=False, practice={"repetitions": 1}, sessions={"count": 2, "warm_up_trials": 2})
        sampled = simulate(folder, "sampled", 2, name="with-samples", repetitions=1)
        tasks = simulate(folder, "tasks", 1, start="stiffness-2afc", samples=True)
        for dataset in (plain, sampled, tasks):
            errors, warnings = issues(command, dataset)
            good &= expect(errors == [], f"{dataset.name}: no errors {errors}")
            good &= expect(set(warnings) <= {"NO_AUTHORS"}, f"{dataset.name}: no warning but that authors are to be added {warnings}")
        about = PROTOCOLS.parent / "tests" / "protocols" / "studies" / "good" / "everything.json"
        errors, warnings = issues(command, simulate(folder, "authors", 2, about=about, samples=False))
        good &= expect(errors == [] and warnings == [], f"with --about: no errors {errors}, no warnings {warnings}")
        for name, start, changes in [("motion", "quick", {"repetitions": 1}), ("motion-tasks", "stiffness-2afc", {}),
                                     ("motion-body", "floating", {"repetitions": 1})]:
            dataset = simulate(folder, name, 1, start=start, about=about, samples=True, **changes,
                               more=["--motion", "--contacts", "--movement"] if start != "stiffness-2afc" else ["--motion"])
            errors, warnings = issues(command, dataset)
            # It looks for a header in every TSV file, and motion files have none.
            good &= expect(errors == [] and set(warnings) <= {"CUSTOM_COLUMN_WITHOUT_DESCRIPTION"}, f"{name}: no errors {errors}, {warnings}")
        table = next(plain.glob("sub-S001/ses-1/beh/*_beh.tsv"))
        table.rename(table.with_name("sub-S001_trials.tsv"))
        good &= expect("NOT_INCLUDED" in issues(command, plain)[0], "a name that is none is found")
    return 0 if good else 1


sys.exit(main())
