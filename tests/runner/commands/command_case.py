"""Commands of palpate run as a user does, in a folder of their own; PALPATE is the first argument of a test."""

import csv
import io
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
PALPATE = pathlib.Path(sys.argv.pop(1)).resolve()


class CommandCase(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)

    def palpate(self, *args, status=0):
        done = subprocess.run([PALPATE, *map(str, args)], capture_output=True, text=True, timeout=600)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def file(self, name, content):
        path = self.dir / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    def exported(self, db):
        """The CSV of a database as text, and its rows."""
        out = self.dir / f"{db.stem}.csv"
        self.palpate("export", "--db", db, "--format", "csv", "--out", out, "--force")
        text = out.read_text()
        return text, list(csv.DictReader(io.StringIO(text)))
