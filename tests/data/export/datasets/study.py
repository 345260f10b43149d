"""Simulated databases with attempts that were cut off, one with samples, and their exports in every format."""

import atexit
import json
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "store"))
import seals  # noqa: E402

PALPATE, PROTOCOLS = sys.argv[1], pathlib.Path(sys.argv[2])
KEYS = {"1": "sphere", "2": "cone", "3": "cylinder", "4": "cube"}


def run_palpate(*args, status=0):
    done = subprocess.run([PALPATE, *map(str, args)], capture_output=True, text=True, timeout=600)
    assert done.returncode == status, (args, done.returncode, done.stdout + done.stderr)
    return done


def simulate(folder, name, participants, /, **changes):
    """A database of simulated participants; `changes` to protocols/quick.json, which here keeps no samples."""
    protocol = json.loads((PROTOCOLS / "quick.json").read_text())
    protocol.pop("$schema")
    protocol.update({"samples": False} | changes)
    path = folder / f"{name}.json"
    path.write_text(json.dumps(protocol))
    run_palpate("simulate", path, "--db", folder / f"{name}.db", "--participants", participants)
    return folder / f"{name}.db"


def cut_off_some(database):
    """Attempts that were cut off, as a live session leaves them."""
    db = sqlite3.connect(database)
    db.execute(
        "INSERT INTO attempts (session_id, run_id, trial, attempt, block, renderer, shape, practice, orientation_w, "
        "orientation_x, orientation_y, orientation_z, began_ns, state, cut_off_reason) SELECT session_id, run_id, trial, "
        "2, block, renderer, shape, practice, orientation_w, orientation_x, orientation_y, orientation_z, onset_ns - 5, "
        "'cut_off', 'said \"stop\", then left' FROM attempts WHERE trial = 3"
    )
    seals.seal_again(db)
    db.close()


class Study(unittest.TestCase):
    """Databases and exports are made once, by the first test that needs them."""

    dir = None

    @classmethod
    def setUpClass(cls):
        if Study.dir is not None:
            return
        scratch = tempfile.TemporaryDirectory()
        atexit.register(scratch.cleanup)
        Study.dir = pathlib.Path(scratch.name)
        Study.plain = simulate(Study.dir, "plain", 3)
        Study.sampled = simulate(Study.dir, "sampled", 2, name="with-samples", repetitions=1, samples=True,
                               sessions={"count": 2}, response={"keys": KEYS, "time_out_s": 1.5})
        cut_off_some(Study.plain)
        cut_off_some(Study.sampled)
        for name in ("plain", "sampled"):
            for form, out in (("csv", f"{name}-csv/trials.csv"), ("bids", f"{name}-bids"), ("psych-ds", f"{name}-psychds")):
                (Study.dir / out).parent.mkdir(exist_ok=True)
                run_palpate("export", "--db", Study.dir / f"{name}.db", "--format", form, "--out", Study.dir / out)
            (Study.dir / f"{name}-relative").mkdir()
            run_palpate("export", "--db", Study.dir / f"{name}.db", "--format", "csv", "--times", "relative",
                        "--out", Study.dir / f"{name}-relative" / "trials.csv")

    def export(self, form, out, *more, status=0, database=None):
        return run_palpate("export", "--db", database or self.plain, "--format", form, "--out", out, *more, status=status)

    def changed_copy(self, name, *changes):
        db = shutil.copy(self.sampled, self.dir / f"{name}.db")
        connection = sqlite3.connect(db)
        for change in changes:
            connection.execute(*(change if isinstance(change, tuple) else (change,)))
        seals.seal_again(connection)
        connection.close()
        return db
