"""Participant's window and experimenter's console on one monitor: what is hidden, in sight, uncovered.

Usage: one_monitor_test.py HARNESS
"""

import time
import unittest

from harnessed_windows import Windows
from virtual_screen import VirtualScreen, skip_without_screen, wait_for


class OneMonitor(unittest.TestCase):
    def open(self, *options, size="1600x1000"):
        skip_without_screen()
        self.screen = VirtualScreen(size)
        self.addCleanup(self.screen.close)
        windows = Windows(self.screen, *options)
        self.addCleanup(windows.close)
        return windows

    def test_the_shape_is_hidden_until_requested(self):
        windows = self.open("--no-mouse")
        self.assertIn("hides shape and scene", windows.before[0])
        windows.say("state cone 0")
        wait_for("the console", lambda: self.screen.pixels(windows.console, 30, 13)[0][0] > 150)
        time.sleep(1)  # the red button is drawn before the state
        hidden = self.screen.settled_picture(windows.console)
        self.screen.keep(windows.console, "console_hidden")
        windows.say("state cube 0")
        time.sleep(1)
        # Only the test's own message names it.
        self.assertTrue(self.top(self.screen.settled_picture(windows.console), windows) ==
                        self.top(hidden, windows))
        width, height = self.screen.size(windows.console)
        self.screen.click(windows.console, 100, 310)
        shown = self.screen.settled_picture(windows.console, differs_from=hidden)
        self.screen.keep(windows.console, "console_shown")
        windows.say("state cone 0")
        again = self.screen.settled_picture(windows.console, differs_from=shown)
        self.assertTrue(self.top(again, windows) != self.top(shown, windows))

    def top(self, picture, windows):
        """Without the messages."""
        width, _ = self.screen.size(windows.console)
        return picture[:3 * width * 510]

    def test_the_newest_message_is_visible_in_a_small_window(self):
        windows = self.open("--no-mouse", size="1024x768")
        width, height = self.screen.size(windows.console)

        def newest():
            return self.screen.pixels(windows.console, 10, height - 115, width - 40, 65)

        def check(word):
            seen = []
            for shape in ["cone", "cylinder"]:  # named by the newest message
                windows.say(f"state {shape} {384 if word == 'fault' else 0} {word}")
                time.sleep(1)
                self.screen.settled_picture(windows.console)
                seen.append(newest())
            self.screen.keep(windows.console, f"console_1024_{word}")
            self.assertTrue(seen[0] != seen[1], word)

        for word in ["pre-flight", "instructions", "homing", "trial", "rest", "paused", "fault"]:
            check(word)
        self.screen.click(windows.console, 100, 150)  # show them
        check("trial")
        self.screen.keep(windows.console, "console_1024_shown")

    def test_full_screen_leaves_the_participants_page_uncovered(self):
        for size in ["1024x768", "1920x1080"]:
            windows = self.open("--no-mouse", "--full-screen", size=size)
            self.assertIn("--full-screen needs a second monitor", windows.before[0])
            a, b = (self.screen.box(window) for window in (windows.participant, windows.console))
            self.assertTrue(a[2] <= b[0] or b[2] <= a[0], f"{a} and {b} overlap at {size}")
            for box in (a, b):
                self.assertGreaterEqual(box[0], 0)
                self.assertLessEqual(box[2], int(size.split("x")[0]))


if __name__ == "__main__":
    unittest.main()
