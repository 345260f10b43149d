"""Makes every picture of .github/images/: a live session on a display in memory, and figures of simulated studies.

Usage: make_images.py PALPATE [NAME ...]    (all pictures, or those of these names; needs xvfb, xdotool, imagemagick)
"""

import pathlib
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
IMAGES = ROOT / ".github" / "images"
PROTOCOLS = ROOT / "protocols"
sys.path.insert(0, str(ROOT / "tests" / "runner" / "display"))

from virtual_screen import VirtualScreen, wait_for  # noqa: E402

KEYS = {"sphere": "1", "cone": "2", "cylinder": "3", "cube": "4"}


class Disturbed(Exception):
    """A busy machine made the servo miss ticks: the forces went off."""


class LiveSession:
    """`palpate run protocols/quick.json --device mouse`, answered and felt with an emulated hand."""

    def __init__(self, palpate, folder):
        self.database = folder / "try.db"
        self.screen = VirtualScreen("1600x900")
        self.program = subprocess.Popen(
            [palpate, "run", PROTOCOLS / "quick.json", "--db", self.database, "--participant", "T1", "--new-participant",
             "--device", "mouse"], env=self.screen.environment, stderr=subprocess.DEVNULL)
        self.participant = self.screen.window("quick, T1")
        self.console = self.screen.window("quick, T1 - console")
        time.sleep(2)  # drawn

    def close(self):
        self.program.kill()
        self.program.wait()
        self.screen.close()

    def rows(self, query):
        try:
            with sqlite3.connect(f"file:{self.database}?mode=ro", uri=True, timeout=20) as connection:
                return connection.execute(query).fetchall()
        except sqlite3.OperationalError:  # not there yet
            return []

    def done(self):
        return self.rows("SELECT count(*) FROM attempts WHERE state = 'completed'")[0][0]

    def check(self):
        if self.rows("SELECT 1 FROM attempts WHERE state = 'cut_off'"):
            raise Disturbed
        return True

    def wait_for_trial(self):
        wait_for("a trial", lambda: self.check() and self.rows("SELECT 1 FROM attempts WHERE state = 'running'"))
        time.sleep(1.5)  # the stylus rests, and the forces come on

    def begin(self):
        self.screen.focus(self.participant)
        while not self.rows("SELECT 1 FROM attempts"):
            self.screen.key("space")
            time.sleep(0.5)

    def point(self, across, down):
        """Shares of the console, where its view is."""
        width, height = self.screen.size(self.console)
        self.screen.point(self.console, int(across * width), int(down * height))

    def feel(self, seconds):
        """The tip goes over the object in the middle of the view, from left to right and back."""
        end, step = time.monotonic() + seconds, 0
        while time.monotonic() < end:
            self.point(0.27 + 0.004 * abs(10 - step % 20), 0.36 + 0.002 * (step % 12))
            time.sleep(0.08)
            step += 1

    def answer(self, wrong=False):
        before = self.done()
        shape = self.rows("SELECT shape FROM attempts ORDER BY id DESC LIMIT 1")[0][0]
        key = KEYS["cube" if wrong and shape != "cube" else "cone" if wrong else shape]
        while self.check() and self.done() == before:
            self.screen.focus(self.participant)
            self.screen.key(key)
            time.sleep(0.5)


def live_session(palpate, folder):
    session = LiveSession(palpate, folder)
    try:
        picture(session.screen, session.participant, "instructions.png")
        session.begin()
        for trial in range(9):
            session.wait_for_trial()
            session.feel(1 + 0.4 * (trial * 7 % 5))
            session.answer(wrong=trial == 4)
            session.point(0.1, 0.65)
        session.wait_for_trial()
        session.feel(5)
        session.check()
        picture(session.screen, session.participant, "participant.png")
        picture(session.screen, session.console, "console.png")
    finally:
        session.close()
        session.database.unlink()


def undisturbed(what, *arguments):
    for _ in range(5):
        try:
            return what(*arguments)
        except Disturbed:
            print("once more: this machine was busy", file=sys.stderr)
    raise SystemExit("this machine is too busy for a session at 1 kHz")


def picture(screen, window, name):
    """Few colours: what is drawn here are letters, lines and one shaded object."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    subprocess.run(["import", "-silent", "-window", window, "-colors", "255", "-strip", f"PNG8:{IMAGES / name}"],
                   env=screen.environment, check=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        undisturbed(live_session, sys.argv[1], pathlib.Path(scratch))
