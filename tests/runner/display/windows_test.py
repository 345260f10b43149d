"""Participant's window and experimenter's console on a real display, without a session.

Usage: windows_test.py HARNESS
"""

import math
import os
import subprocess
import time
import unittest

from harnessed_windows import HARNESS, Windows
from virtual_screen import PATIENCE, VirtualScreen, skip_without_screen, wait_for

EMERGENCY, PAUSE, NOTE, QUIT = 5, 0, 7, 8


def END_NOW(width):
    """The button that asks whether to end, px."""
    return width - 60, 500


class WindowsTest(unittest.TestCase):
    def setUp(self):
        skip_without_screen()
        self.screen = VirtualScreen()
        self.addCleanup(self.screen.close)
        self.windows = Windows(self.screen)
        self.addCleanup(self.windows.close)

    def press(self, *keys):
        self.screen.key(*keys)

    def expect(self, line):
        return self.windows.expect(line)

    def test_a_trial_looks_the_same_whatever_the_shape(self):
        self.windows.say("page neutral")
        self.windows.say("state sphere 0")
        wait_for("the key map", lambda: len(set(self.screen.picture(self.windows.participant))) > 20)
        blank = self.screen.settled_picture(self.windows.participant)
        console = self.screen.settled_picture(self.windows.console)
        for shape in ["cone", "cylinder", "cube"]:
            self.windows.say("page neutral")
            self.windows.say(f"state {shape} 0")
            console = self.screen.settled_picture(self.windows.console, differs_from=console)
            self.screen.keep(self.windows.console, f"console_{shape}")
            self.assertEqual(self.screen.settled_picture(self.windows.participant), blank, shape)
        self.screen.keep(self.windows.participant, "participant_trial")
        self.windows.say("page text Fühlen Sie die Form. 触って形を当ててください。")
        self.screen.settled_picture(self.windows.participant, differs_from=blank)
        self.screen.keep(self.windows.participant, "participant_text")

    def test_a_long_text_takes_several_screens(self):
        self.screen.focus(self.windows.participant)
        blank = self.screen.settled_picture(self.windows.participant)
        self.windows.say("page text " + " ".join(f"word{i}" for i in range(400)))
        first = self.screen.settled_picture(self.windows.participant, differs_from=blank)
        self.screen.keep(self.windows.participant, "participant_long_text")
        self.press("a")  # it does not turn pages
        self.assertEqual(self.expect("key")[1], "key a")
        self.press("space")
        second = self.screen.settled_picture(self.windows.participant, differs_from=first)
        self.press("Left")
        self.assertTrue(first == self.screen.settled_picture(self.windows.participant,
                                                             differs_from=second))
        for _ in range(20):
            before = self.screen.settled_picture(self.windows.participant)
            self.press("space")
            time.sleep(0.5)
            if self.screen.settled_picture(self.windows.participant) == before:
                break
        self.assertEqual(self.expect("key")[1], "key space", "of the last screen only")
        self.windows.say("ping")
        self.assertEqual(self.expect("pong")[0], [])

    def test_the_view_shows_the_tool_that_the_stylus_carries(self):
        def bright():
            width, height = self.screen.size(self.windows.console)
            view = self.screen.pixels(self.windows.console, 20, 80, width // 2, height * 6 // 10)
            return sum(min(pixel) > 150 and max(pixel) - min(pixel) < 25 for pixel in view)

        self.windows.say("page neutral")
        self.windows.say("state cube 0")
        wait_for("the stylus in the view", lambda: bright() > 100)
        self.screen.settled_picture(self.windows.console)
        before = bright()
        self.windows.say("state cube 0 tool")
        wait_for("the tool, beside the stylus", lambda: bright() > before + 100)
        self.screen.keep(self.windows.console, "console_tool")

    def test_keys_in_order_keypad_as_digits(self):
        self.windows.say("page neutral")
        self.screen.focus(self.windows.participant)
        self.screen.settled_picture(self.windows.participant)
        self.press("1", "KP_2", "3", "KP_4", "space", "a")
        for key in ["1", "2", "3", "4", "space", "a"]:
            self.assertEqual(self.expect("key")[1], f"key {key}")

    def test_answers_reach_the_participants_screen_from_the_console(self):
        self.windows.say("page neutral")
        self.screen.settled_picture(self.windows.participant)
        self.screen.focus(self.windows.console)
        self.press("2", "KP_3")
        self.assertEqual(self.expect("key")[1], "key 2")
        self.assertEqual(self.expect("key")[1], "key 3")

    def test_a_note_takes_the_keyboard_but_not_the_keypad(self):
        self.windows.say("page neutral")
        self.windows.say("state cube 0")
        self.screen.settled_picture(self.windows.console)
        width, height = self.screen.size(self.windows.console)
        self.screen.point(self.windows.console, width - 200, height - 28)
        pointed = self.screen.settled_picture(self.windows.console)
        self.screen.click(self.windows.console, width - 200, height - 28)
        wait_for("the cursor", lambda: self.screen.picture(self.windows.console) != pointed)
        self.screen.do("type", "--delay", 120, "moved chair 1")
        self.press("KP_2")
        self.screen.do("type", "--delay", 120, "x")
        self.press("Return")
        seen, note = self.expect(f"command {NOTE}")
        self.assertEqual(note, f"command {NOTE} moved chair 1x")
        self.assertEqual(seen, ["key 2"])

    def test_emergency_from_every_window_and_by_the_button(self):
        self.windows.say("page neutral")
        self.windows.say("state cube 384")
        self.screen.settled_picture(self.windows.console)
        for window in [self.windows.participant, self.windows.console]:
            self.screen.focus(window)
            for key in ["F12", "Escape"]:
                self.press(key)
                self.expect("emergency")
                self.expect(f"command {EMERGENCY}")
        self.screen.keep(self.windows.console, "console_fault")
        self.click_emergency()

    def click_emergency(self, x=0.5, y=25):
        """Forces off at once, then the command with its source."""
        width, _ = self.screen.size(self.windows.console)
        self.screen.click(self.windows.console, int(x * width), y)
        self.expect("emergency")
        self.assertEqual(self.expect(f"command {EMERGENCY}")[1],
                         f"command {EMERGENCY} the EMERGENCY button")

    def is_red(self, x, y):
        red, green, blue = self.screen.pixels(self.windows.console, x, y)[0]
        return red > 2 * green and red > 2 * blue

    def test_nothing_covers_the_emergency_button(self):
        self.windows.say("page neutral")
        self.windows.say("state cube 0")
        console = self.windows.console
        self.screen.settled_picture(console)
        width, height = self.screen.size(console)
        for state in ["pre-flight", "instructions", "homing", "rest", "paused", "fault", "end"]:
            self.windows.say(f"state cube 0 {state}")
            self.click_emergency(x=0.98)
        self.windows.say("state cube 0")
        self.click_emergency(x=0.01)
        # Over the question whether to end, and while its reason is typed
        asked = self.screen.settled_picture(console)
        self.screen.click(console, *END_NOW(width))
        self.screen.settled_picture(console, differs_from=asked)
        self.screen.keep(console, "console_end_now")
        self.click_emergency()
        self.screen.click(console, width - 200, END_NOW(width)[1] - 23)
        self.screen.do("type", "--delay", 120, "why 1")
        self.screen.keep(console, "console_end_why")
        self.click_emergency(x=0.98)
        # While a note is typed, and while something is dragged over it
        self.screen.click(console, width - 200, height - 28)
        self.screen.do("type", "--delay", 120, "x")
        self.click_emergency()
        self.screen.point(console, 300, 300)
        self.screen.do("mousedown", 3)
        self.screen.point(console, 300, 25)
        self.click_emergency()
        self.screen.do("mouseup", 3)

    def test_the_emergency_button_is_whole_in_a_small_window(self):
        self.windows.say("page neutral")
        self.windows.say("state cube 384")
        console = self.windows.console
        for width, height in [(700, 480), (320, 200), (120, 60)]:
            self.screen.do("windowsize", console, width, height)
            wait_for("the size", lambda: self.screen.size(console) == (width, height))
            wait_for("the button", lambda: all(
                self.is_red(int(share * width), 13) for share in (0.1, 0.5, 0.9)))
            self.screen.keep(console, f"console_small_{width}")
            self.click_emergency()

    def test_the_pointer_moves_and_turns_the_stylus(self):
        self.windows.say("state cube 0")
        self.screen.settled_picture(self.windows.console)
        rest, rest_axis = self.windows.where()
        self.screen.point(self.windows.console, 300, 250)
        self.screen.point(self.windows.console, 310, 260)
        wait_for("the tip", lambda: self.windows.where()[0] != rest)
        self.screen.settled_picture(self.windows.console)
        there, axis = self.windows.where()
        self.assertEqual(axis, rest_axis)
        self.screen.do("click", 4)  # the wheel
        wait_for("the tip", lambda: self.windows.where()[0] != there)
        there = self.windows.where()[0]
        self.screen.do("keydown", "ctrl")
        self.screen.point(self.windows.console, 380, 260)
        wait_for("the axis", lambda: self.windows.where()[1] != axis)
        self.screen.settled_picture(self.windows.console)
        self.screen.do("keyup", "ctrl")
        after = self.windows.where()[0]
        for a, b in zip(after, there):
            self.assertAlmostEqual(a, b, delta=1e-6)

    def test_the_tip_follows_the_surface_under_the_pointer_and_the_wheel_presses(self):
        self.windows.say("state sphere 0")
        self.screen.settled_picture(self.windows.console)

        def distance_at(x, y):
            """Distance of the tip from the centre, once it has come to rest."""
            self.screen.point(self.windows.console, x, y)
            time.sleep(1)
            return math.dist(self.windows.where()[0], (0, 0, 0))

        middle = (289, 331)  # of the view, and of the sphere
        self.assertGreater(distance_at(40, 120), 0.075, "beside the object it floats off")
        for place in [middle, (310, 316), (270, 346)]:
            self.assertAlmostEqual(distance_at(*place), 0.03 - 0.0015, delta=0.0008)
        for _ in range(5):
            self.screen.do("click", 4)  # the wheel, away from the viewer
            time.sleep(0.2)
        self.assertAlmostEqual(distance_at(*middle), 0.03 - 0.0065, delta=0.0008)
        self.assertGreater(distance_at(540, 120), 0.075)
        self.assertAlmostEqual(distance_at(*middle), 0.03 - 0.0015, delta=0.0008)

    def test_a_stalled_display_delays_no_other_thread(self):
        self.windows.say("page neutral")
        self.windows.say("state cube 0")
        self.screen.settled_picture(self.windows.console)
        self.screen.stall()
        for i in range(2000):
            self.windows.say(f"page message {i}")
            self.windows.say("state cone 0")
        self.windows.say("ping")
        self.expect("pong")  # while the display is still stalled
        self.screen.go_on()
        self.screen.focus(self.windows.participant)
        self.press("1")
        self.expect("key 1")

    def test_windows_destroyed_or_killed(self):
        for how in ["windowclose", "windowkill"]:
            screen = VirtualScreen()
            self.addCleanup(screen.close)
            windows = Windows(screen)
            self.addCleanup(windows.close)
            screen.settled_picture(windows.participant)
            screen.do(how, windows.participant)
            windows.expect("closed")
            windows.say("ping")
            windows.expect("pong")
            windows.say("end")
            self.assertEqual(windows.program.wait(PATIENCE), 0, how)

    def test_the_display_server_dies(self):
        self.windows.say("page neutral")
        self.screen.settled_picture(self.windows.participant)
        self.screen.kill()
        self.expect("closed")
        self.windows.say("ping")
        self.expect("pong")
        self.windows.say("end")
        self.assertEqual(self.windows.program.wait(PATIENCE), 0)

    def test_the_display_server_dies_while_everything_is_taken_down(self):
        self.windows.say("end slowly")
        self.windows.expect("over")
        self.screen.kill()
        self.windows.say("go on")
        self.assertEqual(self.windows.program.wait(PATIENCE), 0)

    def test_ends_when_asked(self):
        self.windows.say("end")
        self.assertEqual(self.windows.program.wait(PATIENCE), 0)


class NoDisplay(unittest.TestCase):
    def test_says_so(self):
        environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
        done = subprocess.run([HARNESS], env=environment, text=True, stdout=subprocess.PIPE,
                              stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 3)
        self.assertIn("no graphical display", done.stdout)


if __name__ == "__main__":
    unittest.main()
