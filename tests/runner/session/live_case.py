"""A session of palpate run on a terminal, for the tests of this folder; PALPATE is their first argument."""

import contextlib
import csv
import json
import os
import pathlib
import sqlite3
import subprocess
import sys
import tempfile
import unittest

from terminal import Terminal, end_if_it_hangs

PALPATE = sys.argv.pop(1)

PROTOCOL = {
    "version": 1, "name": "two", "renderers": ["ray"], "seed": 7,
    # Slow and soft, so that no five ticks in a row are missed while many tests share a processor.
    "servo": {"rate_hz": 100}, "material": {"stiffness_n_per_m": 100},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "repetitions": 2, "blocks_per_renderer": 2, "home": {"rest_s": 0.1},
    "texts": {"instructions": "Welcome, \u00dcbung", "break": "have a rest", "end": "good bye"},
    "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 30},
}
FEELING = "[trial, "


class Live(unittest.TestCase):
    def setUp(self):
        end_if_it_hangs(self)
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        self.db = self.dir / "live.db"

    def protocol(self, **changes):
        path = self.dir / "protocol.json"
        path.write_text(json.dumps(PROTOCOL | changes))
        return path

    def run_session(self, *options, db=None, code="P01", sure=True, columns=0, **changes):
        """`sure`: the code is intended, so no question is asked."""
        new = ["--new-participant"] if sure and code not in self.codes(db or self.db) else []
        return Terminal([PALPATE, "run", self.protocol(**changes), "--db", db or self.db, "--participant", code,
                         "--device", "simulated", "--no-window", *new, *options], columns=columns)

    def run_piped(self, *options, code="P01", typed=b"", **changes):
        """Like a script: without a terminal."""
        return subprocess.run([PALPATE, "run", self.protocol(**changes), "--db", self.db, "--participant", code,
                               "--device", "simulated", "--no-window", *options], input=typed, capture_output=True,
                              timeout=60)

    @staticmethod
    def codes(db):
        if not os.path.exists(db):
            return []
        with contextlib.closing(sqlite3.connect(db)) as opened:
            return [code for (code,) in opened.execute("SELECT code FROM participants ORDER BY id")]

    def begin(self, *options, **changes):
        """A session whose first trial is being felt."""
        terminal = self.run_session(*options, **changes)
        self.addCleanup(terminal.__exit__)
        while terminal.wait_for(FEELING, "[space bar: go on]") != FEELING:
            terminal.type(" ")
        return terminal

    def finish(self, terminal, key="1", status=0):
        """Answers all further trials, until the session is over."""
        while True:
            came = terminal.wait_for(FEELING, "[space bar: go on]", "[fault, ", "on record; ")
            if came == "on record; ":
                break
            terminal.type({FEELING: key, "[fault, ": ":clear\n:go\n"}.get(came, " "))
        self.assertEqual(terminal.finish(), status, terminal.text)

    def sql(self, query):
        with contextlib.closing(sqlite3.connect(self.db)) as db:
            self.assertEqual(db.execute("PRAGMA integrity_check").fetchone()[0], "ok")
            self.assertEqual(db.execute("PRAGMA foreign_key_check").fetchall(), [])
            return db.execute(query).fetchall()

    def export(self):
        out = self.dir / "trials.csv"
        subprocess.run([PALPATE, "export", "--db", self.db, "--format", "csv", "--out", out, "--force"], check=True,
                       capture_output=True)
        with open(out, newline="", encoding="utf-8") as table:
            return list(csv.DictReader(table))

    def attempts(self):
        return self.sql("SELECT trial, attempt, state FROM attempts ORDER BY trial, attempt")

    def ends(self):
        return [end for (end,) in self.sql("SELECT end_reason FROM runs ORDER BY id")]

    def notes(self):
        """The experimenter's; the program's own are JSON."""
        return [text for (text,) in self.sql("SELECT text FROM notes ORDER BY id") if not text.startswith("{")]
