"""On which monitor the windows of a session are.

Usage: monitors_test.py PALPATE HARNESS     (PALPATE_PICTURES names a folder for pictures to look at)
"""

import json
import shutil
import subprocess
import threading
import time
import unittest

from harnessed_windows import Windows  # takes HARNESS
from virtual_screen import PATIENCE, MonitorScreen, skip_without_screen, wait_for
from window_case import PALPATE, WindowCase

PROTOCOL = {"version": 1, "name": "windows", "renderers": ["ray"],
            "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03}, {"name": "die", "shape": "cube", "edge_m": 0.05}],
            "repetitions": 1, "response": {"keys": {"1": "ball", "2": "die"}}, "servo": {"rate_hz": 200}}


# xfwm4 does not know the second monitor: its library finds only the first one of the driver.
MANAGERS = [None] + [name for name in ("openbox",) if shutil.which(name)]
SMALL, LARGE = (1280, 800), (1920, 1080)


def box_of(monitor):
    size, left, top = monitor.split("+")
    width, height = map(int, size.split("x"))
    return int(left), int(top), int(left) + width, int(top) + height


def inside(box, other):
    return box[0] >= other[0] and box[1] >= other[1] and box[2] <= other[2] and box[3] <= other[3]


class Monitors(WindowCase):
    """The screen of these tests is one monitor."""

    def run_on(self, *options):
        protocol = self.folder / "protocol.json"
        protocol.write_text(json.dumps(PROTOCOL))
        return subprocess.Popen([PALPATE, "run", protocol, "--db", self.database, "--participant", "P01", "--device", "mouse",
                                 *options], env=self.screen.environment, text=True, stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def test_missing_monitors_are_refused_for_either_window(self):
        for option in ("--participant-monitor", "--console-monitor"):
            program = self.run_on(option, "3")
            _, messages = program.communicate(timeout=PATIENCE)
            self.assertEqual(program.returncode, 1, messages)
            self.assertIn("monitor 3 is not connected; there are 1", messages, option)

    def test_a_single_monitor_takes_both_windows(self):
        program = self.run_on("--participant-monitor", "1", "--console-monitor", "1")
        try:
            boxes = [self.screen.box(self.screen.window(title)) for title in ("windows, P01", "windows, P01 - console")]
        finally:
            program.kill()
            program.communicate()
        boxes.sort()
        self.assertLessEqual(boxes[0][2], boxes[1][0], "side by side")


class OnTwo(unittest.TestCase):
    """The console belongs on the primary monitor, the participant's window on the other."""

    def each(self):
        skip_without_screen()
        for manager in MANAGERS:
            screen = MonitorScreen()
            try:
                if manager:
                    screen.manage(manager)
                for sizes in ((SMALL, LARGE), (LARGE, SMALL)):
                    for swapped in (False, True):
                        left, right = sizes[::-1] if swapped else sizes
                        monitors = [f"{left[0]}x{left[1]}+0+0", f"{right[0]}x{right[1]}+{left[0]}+0"]
                        if swapped:
                            monitors.reverse()
                        for primary in (0, 1):
                            with self.subTest(manager=manager or "none", monitors=monitors, primary=primary):
                                screen.place(*monitors, primary=primary)
                                self.name = f"{manager}_{left[0]}_{right[0]}_{primary}{swapped:d}"
                                self.own, self.other = box_of(monitors[1 - primary]), box_of(monitors[primary])
                                yield screen
            finally:
                screen.close()

    def check(self, screen, *options):
        windows = Windows(screen, "--no-mouse", *options)
        try:
            windows.say("state cone 0")
            windows.say("page text Feel.")
            windows.say("settled")
            before, _ = windows.expect("settled")
            for _ in range(2):
                participant, console = screen.box(windows.participant), screen.box(windows.console)
                self.assertTrue(inside(participant, self.own), f"{participant} in {self.own}")
                self.assertTrue(inside(console, self.other), f"{console} in {self.other}")
                if options:
                    self.assertEqual(participant, self.own)
                time.sleep(0.7)
            self.assertEqual([line for line in [*windows.before, *before] if line.startswith(("misplaced", "warning"))], [])
            screen.keep("root", f"two_{self.name}{'_full' if options else ''}")
        finally:
            windows.close()

    def test_full_screen_fills_the_participants_monitor(self):
        for screen in self.each():
            self.check(screen, "--full-screen")

    def test_each_window_is_on_its_monitor(self):
        for screen in self.each():
            self.check(screen)


class OnOneThatIsKnown(unittest.TestCase):
    @unittest.skipUnless(shutil.which("xfwm4") and shutil.which("dbus-run-session"), "xfwm4 is not installed")
    def test_it_is_told_when_the_window_manager_does_not_fill_the_monitor(self):
        skip_without_screen()
        screen = MonitorScreen()
        self.addCleanup(screen.close)
        screen.place("1280x800+0+0", "1920x1080+1280+0")
        screen.manage("xfwm4")
        windows = Windows(screen, "--no-mouse", "--full-screen")
        self.addCleanup(windows.close)
        self.assertIn("the participant's window ", windows.expect("misplaced the")[1])
        left, top, right, _ = screen.box(windows.console)
        wait_for("the button", lambda: all(red > 130 and green < 90 for red, green, _ in
                                           screen.pixels("root", left, top + 14, right - left, 1)[20:-20]))


class Session(WindowCase):
    """A session on two monitors."""

    def new_screen(self):
        self.screen = MonitorScreen()
        self.addCleanup(self.screen.close)
        self.monitors = ["1280x800+0+0", "1920x1080+1280+0"]
        self.screen.place(*self.monitors)

    def start(self, *options):
        (self.folder / "protocol.json").write_text(json.dumps(dict(PROTOCOL, repetitions=9, home={"rest_s": 0.1})))
        self.errors = open(self.folder / "messages.txt", "w")
        self.addCleanup(self.errors.close)
        self.program = subprocess.Popen(
            [PALPATE, "run", self.folder / "protocol.json", "--db", self.database, "--participant", "P01", "--new-participant",
             "--device", "mouse", *options], env=self.screen.environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self.errors)
        self.addCleanup(self.program.wait)
        self.addCleanup(self.program.kill)
        self.participant, self.console = (self.screen.window(title) for title in ("windows, P01", "windows, P01 - console"))

    def begin(self, *options):
        self.start(*options)
        self.screen.focus(self.participant)
        wait_for("a trial", lambda: self.screen.key("space") or self.running())

    def running(self):
        return self.rows("SELECT 1 FROM attempts WHERE state = 'running'")

    def cut_off(self):
        return [reason for (reason,) in self.rows("SELECT cut_off_reason FROM attempts WHERE state = 'cut_off'")]

    def troubles(self):
        notes = [json.loads(text) for (text,) in self.rows("SELECT text FROM notes") if text.startswith("{")]
        return [note["screen_trouble"] for note in notes if "screen_trouble" in note]

    def console_is_above(self):
        """Where both windows are."""
        left, top, right, bottom = self.screen.box(self.console)
        self.screen.do("mousemove", (left + right) // 2, bottom - 60)
        return f"window:{self.console}" in self.screen.do("getmouselocation").split()

    def bar_is_seen(self):
        left, top, right, _ = self.screen.box(self.console)
        seen = self.screen.pixels("root", left, top + 14, right - left, 1)
        return len(seen) == right - left and all(red > 130 and green < 90 for red, green, _ in seen[20:-20])

    def is_on(self, window, monitor):
        return inside(self.screen.box(window), box_of(self.monitors[monitor]))

    def test_monitors_are_chosen_by_number(self):
        self.start("--full-screen", "--participant-monitor", "1", "--console-monitor", "2")
        wait_for("both", lambda: self.screen.box(self.participant) == box_of(self.monitors[0]) and self.is_on(self.console, 1))

    def test_no_trial_begins_with_the_participants_window_on_the_experimenters_monitor(self):
        """Something moves it there again and again, as a window manager may."""
        over = threading.Event()
        self.addCleanup(over.set)

        def move():
            while not over.wait(0.02):
                window = self.screen.do("search", "--name", "^windows, P01$").split()
                if window:
                    self.screen.do("windowmove", window[0], 0, 100)
        mover = threading.Thread(target=move)
        mover.start()
        self.addCleanup(mover.join)
        self.addCleanup(over.set)
        self.start("--full-screen")
        wait_for("words", lambda: "is on DUMMY0, not on its monitor DUMMY1" in self.messages())
        self.screen.focus(self.participant)
        for _ in range(8):
            self.screen.key("space")
            time.sleep(0.3)
        self.assertEqual(self.rows("SELECT 1 FROM attempts"), [])
        self.assertIsNone(self.program.poll())
        wait_for("the whole console", self.console_is_above)
        self.screen.keep("root", "on_the_wrong_monitor")

    def test_explore_moves_to_the_monitor_that_is_left(self):
        self.screen.place(*self.monitors, primary=1)
        scene = self.folder / "scene.json"
        scene.write_text(json.dumps({"objects": [{"shape": "cube", "edge_m": 0.06, "stiffness_n_per_m": 300}]}))
        program = subprocess.Popen([PALPATE, "explore", scene, "--device", "mouse"], env=self.screen.environment, stdin=subprocess.DEVNULL)
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        window = self.screen.window("scene.json - palpate explore")
        wait_for("the window", lambda: self.is_on(window, 1))
        self.screen.place(self.monitors[0], None)
        wait_for("the window", lambda: self.is_on(window, 0))

    def lose(self, *options):
        for manager in MANAGERS:
            for lost in (1, 0):
                with self.subTest(manager=manager or "none", lost=lost):
                    self.screen.place(*self.monitors)
                    if manager:
                        self.screen.manage(manager)
                    self.begin(*options)
                    self.screen.place(*[None if number == lost else monitor for number, monitor in enumerate(self.monitors)])
                    wait_for("the end of the trial", self.cut_off)
                    self.assertIn(f"monitor DUMMY{lost} is gone", self.cut_off()[0])
                    self.assertEqual(len(self.troubles()), 1)
                    self.assertIn(f"monitor DUMMY{lost} is gone", self.messages())
                    left = box_of(self.monitors[1 - lost].split("+")[0] + "+0+0")  # xrandr begins the desktop there
                    wait_for("both", lambda: all(inside(self.screen.box(window), left) for window in (self.participant, self.console)) and
                             self.bar_is_seen())
                    self.screen.keep("root", f"lost_{manager}_{lost}_{len(options)}")
                    time.sleep(1)
                    self.assertTrue(self.bar_is_seen())
                    self.assertEqual(self.running(), [], "the experimenter has not resumed it")
                    self.screen.place(*self.monitors)
                    wait_for("both where they were", lambda: self.is_on(self.participant, 1) and self.is_on(self.console, 0) and
                             (not options or self.screen.box(self.participant) == box_of(self.monitors[1])))
                    self.screen.keep("root", f"back_{manager}_{lost}_{len(options)}")
                    self.program.kill()
                    self.program.wait()
                    if manager:
                        self.screen.stop_manager()
                    self.database.unlink()
                    for rest in self.folder.glob("study.db-*"):
                        rest.unlink()

    def test_a_monitor_goes_away_in_a_trial(self):
        self.lose()

    def test_a_monitor_goes_away_in_a_trial_in_full_screen(self):
        self.lose("--full-screen")


if __name__ == "__main__":
    unittest.main()
