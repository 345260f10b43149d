"""A session of tasks on a terminal, for the tests of this folder; PALPATE is their first argument."""

import contextlib
import csv
import json
import pathlib
import sqlite3
import subprocess
import sys
import tempfile
import unittest

from terminal import Terminal, end_if_it_hangs

PALPATE = sys.argv.pop(1)

LEVEL = {"level": {"path": "/stiffness_n_per_m"}}
SURE = {"confidence": {"question": "HOW SURE", "scale": [{"label": "guessed"}, {"label": "sure", "number": 5}]}}
BLOCKS = {
    "ident": {"task": "identify", "stimuli": ["ball", "box"], "repetitions": 1, "feedback": True,
              "question": "WHICH", "instructions": "ABOUT SHAPES\fMORE ABOUT SHAPES"},
    "comp": {"task": "compare", "stimuli": ["ball"], "standard": "ball", **LEVEL, **SURE,
             "procedure": {"kind": "constant", "levels": [40, 80], "repetitions": 1},
             "question": "WHICH WAS STIFFER", "inter_interval_s": 0.2},
    "three": {"task": "compare", "stimuli": ["ball"], "standard": "ball", "intervals": 3, **LEVEL,
              "procedure": {"kind": "constant", "levels": [40], "repetitions": 1},
              "question": "WHICH WAS ODD", "interval_limit_s": 0.3, "inter_interval_s": 0.2},
    "detect": {"task": "detect", "stimuli": ["ball"], "repetitions": 2, "catch_trials": 0.5, "question": "ANYTHING"},
    "number": {"task": "rate", "stimuli": ["ball"], "repetitions": 1, "min": -10, "max": 100, "question": "HOW HARD"},
    "scale": {"task": "rate", "stimuli": ["ball"], "repetitions": 1, "question": "HOW SOFT",
              "scale": [{"label": "hard", "number": -1}, {"label": "soft", "number": 1}]},
    "adjust": {"task": "adjust", "stimuli": ["ball"], "standard": "ball", **LEVEL, "min": 20, "max": 100,
               "turn": 10, "starts": [30, 90], "repetitions": 2, "question": "MAKE THEM EQUAL"},
    "stairs": {"task": "compare", "stimuli": ["ball"], "standard": "ball", **LEVEL, "question": "STIFFER",
               "procedure": {"kind": "staircase", "start": 90, "min": 50, "max": 100, "steps": [20, 10],
                             "stop": {"trials": 5}}},
}
PROTOCOL = {
    "version": 2, "name": "live", "renderers": ["point"], "seed": 5, "orientation": "fixed",
    # Slow and soft, so that no five ticks in a row are missed while many tests share a processor.
    "servo": {"rate_hz": 100}, "home": {"rest_s": 0.1}, "material": {"stiffness_n_per_m": 60},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1, "stiffness_n_per_m": 60},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "texts": {"instructions": "WELCOME", "end": "GOOD BYE"},
}
GO_ON = "[space bar: go on]"


class Task(unittest.TestCase):
    def setUp(self):
        end_if_it_hangs(self, 240)
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        self.db = self.dir / "live.db"

    def protocol(self, *blocks, **changes):
        path = self.dir / "protocol.json"
        whole = PROTOCOL | {"blocks": [{"name": name, **BLOCKS[name]} for name in blocks]} | changes
        path.write_text(json.dumps(whole))
        return path

    def start(self, *blocks, options=(), db=None, **changes):
        db = db or self.db
        known = db.exists() and self.sql("SELECT count(*) FROM participants", db) != [(0,)]
        new = [] if known else ["--new-participant"]
        terminal = Terminal([PALPATE, "run", self.protocol(*blocks, **changes), "--db", db, "--participant", "P01",
                             "--device", "simulated", "--no-window", *new, *options])
        self.addCleanup(terminal.__exit__)
        return terminal

    def play(self, terminal, *steps):
        """Pairs of awaited output and typed input. Trials cut off by a busy machine are repeated."""
        for word, keys in steps:
            came = terminal.wait_for(word, "[fault, ")
            if came == "[fault, ":
                self.skipTest("the machine was too busy for the servo")
            terminal.type(keys)

    def end(self, terminal, status=0):
        self.assertEqual(terminal.finish(), status, terminal.text)

    def sql(self, query, db=None):
        with contextlib.closing(sqlite3.connect(db or self.db)) as opened:
            self.assertEqual(opened.execute("PRAGMA integrity_check").fetchone()[0], "ok")
            return opened.execute(query).fetchall()

    def export(self, db=None):
        out = self.dir / "trials.csv"
        subprocess.run([PALPATE, "export", "--db", db or self.db, "--format", "csv", "--out", out, "--force"],
                       check=True, capture_output=True)
        with open(out, newline="", encoding="utf-8") as table:
            return list(csv.DictReader(table))

    def answer_all(self, blocks, db, before_trial=lambda count: None, **start):
        """Answers "1" until the end, or is killed where `before_trial`, which is given the number of trials on record
        when one is shown, says so."""
        terminal = self.start(*blocks, db=db, **start)
        done = len(self.sql("SELECT id FROM attempts WHERE state = 'completed'", db)) if db.exists() else 0
        while True:
            came = terminal.wait_for("1 / 2\n", "2 / 2\nSTIFFER", "ANYTHING", GO_ON, "[fault, ", " on record; ")
            if came == " on record; ":
                self.end(terminal)
                return
            if came in ("1 / 2\n", "ANYTHING") and before_trial(done):
                terminal.kill()
                return
            terminal.type({"1 / 2\n": " ", GO_ON: " ", "[fault, ": ":clear\n:go\n"}.get(came, "1"))
            done += came in ("2 / 2\nSTIFFER", "ANYTHING")
