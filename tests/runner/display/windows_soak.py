"""A session of two intervals in windows, for as long as is wanted: nothing may crash.

Usage: windows_soak.py PALPATE [--minutes M] [--seed S] [--size 1024x768] [--manager openbox|xfwm4] [--slow FACTOR]

It begins with pages, then takes turns: trials that are answered, with the pointer on the object; windows that are
moved and resized; pauses; the emergency button; a session that is closed by its window and begun again. Meant for
builds with AddressSanitizer (preset asan) or, with
`--slow 12 --size 640x480 --with "valgrind --suppressions=tests/shared/valgrind.supp --show-mismatched-frees=no
--error-exitcode=9"`, for portable ones: there a frame takes seconds, and keys must wait for it. (Valgrind does not see the
program's own operator new where it is inlined, and takes every delete for a mismatched one.) Drawn in software with one
thread, which is where a driver's errors of timing have been seen.
"""

import argparse
import contextlib
import json
import pathlib
import random
import sqlite3
import subprocess
import sys
import tempfile
import time

from virtual_screen import VirtualScreen

LEVEL = {"stimuli": ["ball"], "standard": "ball", "level": {"path": "/stiffness_n_per_m"}}
PROTOCOL = {
    "version": 2, "name": "soak", "renderers": ["point"], "seed": 5, "servo": {"rate_hz": 200}, "home": {"rest_s": 0.1},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "stiffness_n_per_m": 60}],
    "pages": [{"name": "how", "kind": "instructions", "text": "A stylus.\fA ball."},
              {"name": "you", "kind": "questionnaire", "items": [
                  {"name": "hand", "kind": "choice", "question": "Which hand?", "choices": ["left", "right"]}]}],
    "blocks": [{"name": "which", "task": "compare", **LEVEL, "question": "Which one was stiffer?", "inter_interval_s": 0.2,
                "procedure": {"kind": "constant", "levels": [50, 70, 90], "repetitions": 4000}}],
}


class Soak:
    def __init__(self, options, folder):
        self.options, self.folder = options, pathlib.Path(folder)
        self.draw = random.Random(options.seed)
        self.screen = VirtualScreen(options.size)
        if options.manager:
            self.screen.manage(options.manager)
        self.width, self.height = map(int, options.size.split("x"))
        (self.folder / "protocol.json").write_text(json.dumps(PROTOCOL))
        self.counts = {"sessions": 0, "rounds": 0, "pauses": 0, "resized": 0, "emergencies": 0}
        self.program = None

    def completed(self):
        if not (self.folder / "soak.db").exists():
            return 0
        with contextlib.closing(sqlite3.connect(f"file:{self.folder}/soak.db?mode=ro", uri=True, timeout=20)) as opened:
            try:
                return opened.execute("SELECT count(*) FROM attempts WHERE state = 'completed'").fetchone()[0]
            except sqlite3.OperationalError:  # being made
                return 0

    def runs(self):
        return self.program.poll() is None

    def window(self, title):
        while self.runs():
            found = self.screen.do("search", "--onlyvisible", "--name", f"^{title}$").split()
            if found:
                return found[0]
            time.sleep(0.2)

    def start(self):
        self.counts["sessions"] += 1
        environment = dict(self.screen.environment, LIBGL_ALWAYS_SOFTWARE="1")
        new = ["--new-participant"] if self.counts["sessions"] == 1 else []
        self.program = subprocess.Popen(
            [*self.options.using.split(), self.options.palpate, "run", self.folder / "protocol.json", "--db",
             self.folder / "soak.db", "--participant", "P01", *new, "--device", "mouse"],
            env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=open(self.folder / "said", "w"))
        self.participant, self.console = self.window("soak, P01"), self.window("soak, P01 - console")

    def button(self, words):
        """Clicks a button of the console: the six are in two columns; in a small window they span its width."""
        wide, _ = self.screen.size(self.console)
        row, column = {"pause": (0, 0), "go on": (0, 1)}[words]
        for top in (410, 430):
            self.screen.click(self.console, wide - (250 if column == 0 else 60), top + 40 * row)

    def round(self):
        self.counts["rounds"] += 1
        what = self.draw.random()
        self.screen.focus(self.participant) if self.runs() else None
        if what < 0.7:
            self.screen.point(self.console, self.draw.randint(60, 500), self.draw.randint(100, 300))
            for key in ("space", self.draw.choice("12"), "space", self.draw.choice("12")):
                self.screen.key(key)
                time.sleep(0.4 * self.options.slow)
        elif what < 0.9:
            self.counts["resized"] += 1
            window = self.draw.choice([self.participant, self.console])
            self.screen.do("windowsize", window, self.draw.randint(240, self.width), self.draw.randint(240, self.height))
            self.screen.do("windowmove", window, self.draw.randint(0, self.width // 2), self.draw.randint(0, 200))
        elif what < 0.95:
            self.counts["pauses"] += 1
            self.button("pause")
            time.sleep(self.draw.choice([2, 20]))
            self.button("go on")
        elif what < 0.98:
            self.counts["emergencies"] += 1
            self.screen.key("F12")
            time.sleep(1)
            wide, _ = self.screen.size(self.console)
            self.screen.click(self.console, wide - 60, 90)  # clear the fault
            self.button("go on")
        else:
            self.close()
            self.start()

    def close(self):
        self.screen.ask_to_close(self.participant)
        time.sleep(1)  # the console asks; closing the window again ends the session
        self.screen.ask_to_close(self.participant)
        if self.program.wait(1200 if self.options.using else 300) != 1:  # closed by the participant's window
            raise AssertionError(f"status {self.program.returncode}")

    def run(self):
        self.start()
        end = time.monotonic() + 60 * self.options.minutes
        try:
            while time.monotonic() < end:
                if not self.runs():
                    raise AssertionError(f"status {self.program.returncode}")
                try:
                    self.round()
                except AssertionError:
                    if self.runs():
                        continue  # the pointer or the keyboard was not available
                    raise
            self.close()
            return None
        except AssertionError as fault:
            return f"{fault}\n" + (self.folder / "said").read_text()
        finally:
            if self.runs():
                self.program.kill()
                self.program.wait()
            self.screen.close()


def main():
    options = argparse.ArgumentParser()
    options.add_argument("palpate")
    options.add_argument("--minutes", type=float, default=10)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--slow", type=float, default=1, help="times the usual pauses between keys")
    options.add_argument("--size", default="1024x768")
    options.add_argument("--manager", choices=["openbox", "xfwm4"])
    options.add_argument("--with", dest="using", default="", help="a command to run it with")
    options = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        soak = Soak(options, folder)
        fault = soak.run()
        print(json.dumps(soak.counts | {"trials": soak.completed()}))
    print(f"FAIL {fault}" if fault else "ok   nothing crashed")
    return 1 if fault else 0


if __name__ == "__main__":
    sys.exit(main())
