"""A session in windows on a screen of its own, for the tests of this folder; PALPATE is their last argument."""

import contextlib
import pathlib
import sqlite3
import sys
import tempfile
import unittest

from virtual_screen import VirtualScreen, skip_without_screen

PALPATE = sys.argv.pop() if len(sys.argv) > 1 else None


class WindowCase(unittest.TestCase):
    def setUp(self):
        skip_without_screen()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.database = self.folder / "study.db"
        self.program = None
        self.new_screen()

    def new_screen(self):
        self.screen = VirtualScreen()
        self.addCleanup(self.screen.close)

    def messages(self):
        return (self.folder / "messages.txt").read_text()

    def rows(self, query):
        if not self.database.exists():
            return []
        with contextlib.closing(sqlite3.connect(f"file:{self.database}?mode=ro", uri=True, timeout=20)) as opened:
            try:
                return opened.execute(query).fetchall()
            except sqlite3.OperationalError:  # being made
                return []
