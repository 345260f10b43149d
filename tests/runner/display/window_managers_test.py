"""Where a session's windows are, with the window managers that are installed and with none.

Usage: window_managers_test.py PALPATE HARNESS     (PALPATE_PICTURES names a folder for pictures to look at)
"""

import ctypes
import json
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from harnessed_windows import Windows  # takes HARNESS
from virtual_screen import VirtualScreen, skip_without_screen, wait_for
from window_case import PALPATE, WindowCase

MANAGERS = [None] + [name for name in ("openbox", "xfwm4") if shutil.which(name)]
SIZES = ["1024x768", "1920x1080", "3840x2160"]
SCENE = {"objects": [{"shape": "cube", "edge_m": 0.06, "stiffness_n_per_m": 300}]}
PROTOCOL = {"version": 1, "name": "windows", "renderers": ["ray"],
            "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03}, {"name": "die", "shape": "cube", "edge_m": 0.05}],
            "repetitions": 9, "response": {"keys": {"1": "ball", "2": "die"}}, "home": {"rest_s": 0.1},
            "servo": {"rate_hz": 200}}


def managed(screen, manager):
    if manager:
        if manager == "xfwm4" and not shutil.which("dbus-run-session"):
            raise unittest.SkipTest("xfwm4 needs dbus-run-session")
        screen.manage(manager)


class Placed(unittest.TestCase):
    def each(self, options=lambda width, height: ()):
        """The windows of each manager and size of screen."""
        skip_without_screen()
        for manager in MANAGERS:
            for size in SIZES:
                with self.subTest(manager=manager or "none", size=size):
                    self.screen = VirtualScreen(size)
                    windows = None
                    try:
                        managed(self.screen, manager)
                        self.width, self.height = map(int, size.split("x"))
                        windows = Windows(self.screen, "--no-mouse", *options(self.width, self.height))
                        windows.say("state cone 0")
                        windows.say("page text Feel.")
                        self.name = f"{manager}_{size}"
                        yield windows
                    finally:
                        if windows:
                            windows.close()
                        self.screen.close()

    def boxes(self, windows):
        return self.screen.box(windows.participant), self.screen.box(windows.console)

    def bar_is_seen(self, windows):
        """The whole red button on the screen."""
        left, top, right, _ = self.screen.box(windows.console)
        seen = self.screen.pixels("root", left, top + 14, right - left, 1)
        return all(red > 130 and green < 90 for red, green, _ in seen[20:-20])

    def test_each_window_is_at_its_requested_place(self):
        def places(width, height):
            self.participant = [30, 60, width // 3, height // 2]
            self.console = [width // 2 - 30, 80, width // 2 - 10, height - 150]
            return ["--places", json.dumps(
                {"windows": {"desktop_px": [width, height], "participant_px": self.participant,
                             "console_px": self.console}}, separators=(",", ":"))]

        for windows in self.each(places):
            asked = [(left, top, left + width, top + height)
                     for left, top, width, height in (self.participant, self.console)]
            wait_for(f"{asked}, not {self.boxes(windows)}", lambda: list(self.boxes(windows)) == asked)
            wait_for("the button", lambda: self.bar_is_seen(windows))
            windows.say("places")
            self.assertEqual(windows.expect("places")[1], "places", "nobody has moved them")

    def test_on_one_screen_the_participant_gets_the_space_beside_the_console(self):
        for windows in self.each():
            wait_for("the button", lambda: self.bar_is_seen(windows))
            participant, console = self.boxes(windows)
            self.assertLessEqual(participant[2], console[0])
            for box in (participant, console):
                self.assertGreaterEqual(min(box), 0)
                self.assertLessEqual(box[2], self.width)
                self.assertLessEqual(box[3], self.height)
            self.assertLess(console[0] - (participant[2] - participant[0]), 60, "all of the rest's width")
            self.assertGreater(participant[3] - participant[1], self.height - 90, "and height")
            time.sleep(1)
            self.assertEqual(self.boxes(windows), (participant, console), "and there they stay")
            self.screen.keep("root", f"placed_{self.name}")

    def test_none_of_our_windows_covers_the_emergency_button(self):
        for windows in self.each():
            wait_for("the button", lambda: self.bar_is_seen(windows))
            time.sleep(2)  # no longer at the beginning
            console = self.screen.box(windows.console)
            self.screen.do("windowmove", windows.participant, console[0] + 60, 0)
            self.screen.do("windowraise", windows.participant)
            wait_for("the move", lambda: self.screen.box(windows.participant)[0] > 0)
            wait_for("the button again", lambda: self.bar_is_seen(windows) and
                     self.screen.box(windows.participant)[2] <= console[0])
            self.screen.do("windowsize", windows.participant, self.width, self.height)
            wait_for("the button once more", lambda: self.bar_is_seen(windows) and
                     self.screen.box(windows.participant)[2] <= console[0])
            # If the console fills the screen, the participant's window lies below the button.
            self.screen.do("windowmove", windows.console, 0, 40)
            self.screen.do("windowsize", windows.console, self.width - 10, self.height - 60)
            wait_for("the button of a large console", lambda: self.bar_is_seen(windows) and
                     self.screen.size(windows.console)[0] == self.width - 10)
            windows.say("places")
            self.assertIn('"console_px"', windows.expect("places")[1])
            self.screen.keep("root", f"covered_{self.name}")


class Killed(unittest.TestCase):
    """A window manager that is killed leaves its properties on the root window."""

    def setUp(self):
        skip_without_screen()
        if len(MANAGERS) < 2:
            self.skipTest("no window manager is installed")
        self.screen = VirtualScreen("1600x1000", "-noreset")
        self.addCleanup(self.screen.close)

    def kill_manager(self):
        self.screen.stop_manager(signal.SIGKILL)

    def named_manager(self):
        seen = subprocess.run(["xprop", "-root", "_NET_SUPPORTING_WM_CHECK"], env=self.screen.environment, text=True,
                              stdout=subprocess.PIPE, check=True).stdout
        return seen.split()[-1] if "window id" in seen else None

    def shows(self):
        windows = Windows(self.screen, "--no-mouse")
        self.addCleanup(windows.close)
        windows.say("ping")
        windows.expect("pong")
        windows.close()

    def test_windows_open_after_a_window_manager_was_killed(self):
        managed(self.screen, "openbox")
        self.kill_manager()
        self.assertTrue(self.named_manager())
        self.shows()

    def test_explore_opens_after_a_window_manager_was_killed(self):
        managed(self.screen, "openbox")
        self.kill_manager()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        scene = pathlib.Path(folder.name) / "scene.json"
        scene.write_text(json.dumps(SCENE))
        program = subprocess.Popen([PALPATE, "explore", scene, "--device", "mouse"], env=self.screen.environment,
                                   stdin=subprocess.DEVNULL)
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        self.screen.window(".* - palpate explore")
        self.assertIsNone(program.poll())

    def test_windows_open_where_another_program_has_the_number_of_the_dead_managers_window(self):
        other = Windows(self.screen, "--no-mouse")
        self.addCleanup(other.close)
        self.set_window_property("_NET_SUPPORTING_WM_CHECK", int(other.participant))
        self.shows()

    def set_window_property(self, name, window):
        x11 = ctypes.CDLL("libX11.so.6")
        x11.XOpenDisplay.restype = x11.XInternAtom.restype = x11.XDefaultRootWindow.restype = ctypes.c_void_p
        display = ctypes.c_void_p(x11.XOpenDisplay(self.screen.name.encode()))
        root, atom = (ctypes.c_void_p(x) for x in (x11.XDefaultRootWindow(display), x11.XInternAtom(display, name.encode(), 0)))
        x11.XChangeProperty(display, root, atom, ctypes.c_ulong(33), 32, 0, ctypes.byref(ctypes.c_long(window)), 1)
        x11.XCloseDisplay(display)

    def test_a_living_window_manager_keeps_its_property(self):
        managed(self.screen, "openbox")
        before = self.named_manager()
        self.shows()
        self.assertTrue(before)
        self.assertEqual(self.named_manager(), before)

    def test_windows_outlive_their_window_manager_and_meet_the_next(self):
        windows = Windows(self.screen, "--no-mouse")
        self.addCleanup(windows.close)
        for manager in MANAGERS[1:] * 2:
            managed(self.screen, manager)
            time.sleep(1)
            windows.say("ping")
            windows.expect("pong")
            self.kill_manager()
            windows.say("ping")
            windows.expect("pong")
        windows.say("end")
        self.assertEqual(windows.program.wait(60), 0)

    def test_windows_open_without_the_extensions_for_monitors(self):
        self.screen.close()
        self.screen = VirtualScreen("1600x1000", "-extension", "RANDR", "-extension", "XINERAMA")
        self.addCleanup(self.screen.close)
        self.shows()


class Remembered(WindowCase):
    def start(self):
        (self.folder / "protocol.json").write_text(json.dumps(PROTOCOL))
        before = len(self.rows("SELECT 1 FROM attempts"))  # a resumed session begins its trial without a key
        self.program = subprocess.Popen(
            [PALPATE, "run", self.folder / "protocol.json", "--db", self.database, "--participant", "P01", "--device", "mouse"] +
            ([] if before else ["--new-participant"]), env=self.screen.environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        self.addCleanup(self.stop)
        self.windows = [self.screen.window(title) for title in ("windows, P01", "windows, P01 - console")]
        self.screen.focus(self.windows[0])
        wait_for("a trial", lambda: self.screen.key("space") or len(self.rows("SELECT 1 FROM attempts")) > before)
        time.sleep(2)

    def stop(self):
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait()

    def end(self):
        self.program.send_signal(signal.SIGTERM)
        self.program.wait(60)

    def boxes(self):
        return [self.screen.box(window) for window in self.windows]

    def notes(self):
        return [text for (text,) in self.rows("SELECT text FROM notes") if text.startswith('{"windows"')]

    def test_the_next_session_restores_the_windows_places(self):
        manager = MANAGERS[-1] if len(MANAGERS) < 3 else "openbox"
        managed(self.screen, manager)
        self.start()
        self.end()
        self.assertEqual(self.notes(), [], "they were not moved")
        self.start()
        self.screen.do("windowmove", self.windows[1], 700, 200)
        self.screen.do("windowsize", self.windows[1], 800, 600)
        self.screen.do("windowmove", self.windows[0], 40, 100)
        self.screen.do("windowsize", self.windows[0], 500, 400)
        wait_for("the sizes", lambda: [self.screen.size(window) for window in self.windows] == [(500, 400), (800, 600)])
        time.sleep(1)
        put = self.boxes()
        self.end()
        self.assertEqual(len(self.notes()), 1)
        for _ in range(2):
            self.start()
            self.assertEqual(self.boxes(), put)
            self.end()
        self.assertEqual(len(self.notes()), 1, "nobody has moved them again")
        # On another screen they would be invisible.
        self.screen.close()
        self.screen = VirtualScreen("1024x768")
        self.addCleanup(self.screen.close)
        self.start()
        for left, top, right, bottom in self.boxes():
            self.assertTrue(0 <= left < right <= 1024 and 0 <= top < bottom <= 768)


if __name__ == "__main__":
    unittest.main()
