"""The window of `palpate explore`, on a display in memory.

Usage: explore_window_test.py PALPATE PROTOCOLS
"""

import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from virtual_screen import VirtualScreen, skip_without_screen, wait_for

PROTOCOLS = pathlib.Path(sys.argv.pop()) if len(sys.argv) > 2 else None
PALPATE = sys.argv.pop() if len(sys.argv) > 1 else None

SCENE = {"objects": [{"shape": "cube", "edge_m": 0.06, "stiffness_n_per_m": 300}, {"shape": "sphere", "radius_m": 0.02, "position_m": [0.07, 0, 0]}]}


def reddish(pixel):
    return pixel[0] > 2 * pixel[1] and pixel[0] > 2 * pixel[2]


class ExploreWindow(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        skip_without_screen()

    def setUp(self):
        self.screen = VirtualScreen("1200x800")
        self.addCleanup(self.screen.close)
        keep = tempfile.TemporaryDirectory()
        self.addCleanup(keep.cleanup)
        self.folder = pathlib.Path(keep.name)
        self.scene = self.folder / "scene.json"
        self.scene.write_text(json.dumps(SCENE))

    def open(self, *options):
        scene = options[0] if options and str(options[0]).endswith(".json") else self.scene
        options = [option for option in options if option != scene]
        self.program = subprocess.Popen([PALPATE, "explore", scene, *options], env=self.screen.environment, text=True,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(self.close_program)
        try:
            self.window = self.screen.window(f"{pathlib.Path(scene).name} - palpate explore")
        except AssertionError as error:
            self.program.kill()
            said = "\n".join(self.program.communicate())
            raise AssertionError(f"{error}; the program said {said!r}; windows: {self.screen.do('search', '--name', '.*')!r}") from None
        self.screen.focus(self.window)
        self.width, self.height = self.screen.size(self.window)
        wait_for("the emergency button", lambda: reddish(self.pixel(40, 20)))

    def close_program(self):
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait()
        self.program.stdout.close()
        self.program.stderr.close()

    def pixel(self, x, y):
        return self.screen.pixels(self.window, x, y)[0]

    def pixels(self, left, top, width, height):
        return self.screen.pixels(self.window, left, top, width, height)

    def end(self):
        self.program.send_signal(signal.SIGTERM)
        return self.program.wait(timeout=60)

    def state_is_red(self):
        """'Forces are off' stands at the top of the panel on the right."""
        left = int(0.74 * self.width)
        return sum(r > 200 and g < 140 and b < 140 for r, g, b in self.pixels(left, 70, self.width - left - 5, 90)) > 20

    def test_a_recorded_path_plays_pauses_and_is_saved(self):
        scene = PROTOCOLS / "scenes" / "fig13-two-objects.json"
        self.open(scene, "--trajectory", scene.with_suffix(".csv"), "--pictures", self.folder / "kept")
        view = (20, 80, int(0.6 * self.width), int(0.6 * self.height))
        first = self.pixels(*view)
        wait_for("a moving picture", lambda: self.pixels(*view) != first)
        time.sleep(4)  # to the end of the path
        self.screen.keep(self.window, "explore_recorded")
        self.screen.key("space")  # from the beginning
        self.screen.key("space")
        paused = self.screen.settled_picture(self.window)
        self.screen.key("Right")
        self.screen.settled_picture(self.window, differs_from=paused)
        self.screen.key("s")
        wait_for("the picture", lambda: list((self.folder / "kept").glob("scene-1.png")))
        self.assertEqual((self.folder / "kept" / "scene-1.png").read_bytes()[1:4], b"PNG")
        self.assertEqual(self.end(), 0)

    def test_the_tool_is_thicker_in_the_window_than_in_files(self):
        """A view on a screen is smaller than a picture in a paper, so the tool is drawn thicker."""
        self.scene.write_text(json.dumps({"objects": SCENE["objects"][:1]}))
        path = self.folder / "still.csv"
        path.write_text("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n" + "".join(
            f"{0.01 * k},0.01,-0.05,0.01,-0.11,-0.05,0.01\n" for k in range(20)))
        done = subprocess.run([PALPATE, "explore", self.scene, "--trajectory", path, "--frames", self.folder / "frames", "--every", "1s"],
                              text=True, capture_output=True, env=self.screen.environment)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.open("--trajectory", path, "--pictures", self.folder / "kept")
        time.sleep(1)
        self.screen.key("s")
        kept = wait_for("the picture", lambda: list((self.folder / "kept").glob("scene-1.png")))[0]
        self.assertEqual(self.end(), 0)
        ratio = self.thickness(kept) / self.thickness(self.folder / "frames" / "frame-00000.png")
        self.assertGreater(ratio, 1.1)
        self.assertLess(ratio, 1.6)

    def thickness(self, picture):
        """Width of the rod before the blue cube, relative to the cube's height, whatever the camera's distance."""
        wide, high = map(int, subprocess.run(["identify", "-format", "%w %h", picture], check=True, capture_output=True, text=True).stdout.split())
        seen = subprocess.run(["convert", picture, "-depth", "8", "rgb:-"], check=True, capture_output=True).stdout
        blue = [b > 90 and b - r > 40 for r, b in zip(seen[0::3], seen[2::3])]
        cube = [row for row in range(high) if any(blue[row * wide:(row + 1) * wide])]
        between = []
        for x in range(wide):
            rows = [row for row in cube if blue[row * wide + x]]
            if len(rows) > len(cube) / 3:
                between.append(rows[-1] - rows[0] + 1 - len(rows))
        rod = sorted(rows for rows in between if rows > 3)
        self.assertGreater(len(rod), 50)
        return rod[len(rod) // 2] / len(cube)

    def allow_forces(self):
        """Presses 'Allow forces again', the green button somewhere below the red words, until these are gone. A machine that
        stands still trips the servo at any time, and why forces are off can take several lines."""
        def allowed():
            if not self.state_is_red():
                return True
            self.screen.point(self.window, self.width - 5, 5)  # it changes colour under the pointer
            left, top = int(0.87 * self.width), 70
            green = [top + row for row, pixel in enumerate(self.pixels(left, top, 1, 250))
                     if all(abs(value - due) < 12 for value, due in zip(pixel, (41, 107, 69)))]
            if green:
                self.screen.click(self.window, left, green[len(green) // 2])
            return False
        wait_for("forces that may be on", allowed)

    def test_the_emergency_works_by_key_and_button_and_can_be_cleared(self):
        self.open()
        self.allow_forces()
        for ask in (lambda: self.screen.key("Escape"), lambda: self.screen.key("F12"),
                    lambda: self.screen.click(self.window, 30, 25), lambda: self.screen.click(self.window, self.width - 30, 25)):
            ask()
            wait_for("forces that are off", self.state_is_red)
            self.screen.keep(self.window, "explore_emergency")
            self.allow_forces()
        self.assertEqual(self.end(), 0)

    def test_the_pointer_touches_the_object_under_it(self):
        self.open("--labels")
        middle = int(0.35 * self.width), int(0.42 * self.height)
        self.screen.point(self.window, middle[0] - 40, middle[1])
        time.sleep(1)
        for step in range(12):
            self.screen.point(self.window, middle[0] - 30 + 5 * step, middle[1] + step)
            time.sleep(0.1)
        self.screen.do("click", "--repeat", 4, 4)  # the wheel: press harder
        self.screen.point(self.window, *middle)
        yellow = lambda: sum(r > 180 and 120 < g < 210 and b < 110 for r, g, b in self.pixels(20, 80, int(0.68 * self.width), int(0.68 * self.height)))
        try:
            wait_for("a force arrow", lambda: yellow() > 30)
        finally:
            self.screen.keep(self.window, "explore_mouse")
        self.assertEqual(self.end(), 0)

    def test_a_clip_has_the_pictures_that_were_shown(self):
        # A picture every 40 ms; a busy machine without a graphics card takes seconds to draw them.
        self.press_c_after(0.4)
        clip = wait_for("the clip", lambda: list((self.folder / "kept").glob("scene-1.webp")))[0]
        self.screen.keep(self.window, "explore_clip")
        data = clip.read_bytes()
        self.assertEqual((data[:4], data[8:12]), (b"RIFF", b"WEBP"))
        # Equal pictures are merged into one.
        self.assertGreaterEqual(data.count(b"ANMF"), 6)
        self.assertLessEqual(data.count(b"ANMF"), 11)
        self.assertEqual(self.end(), 0)

    def press_c_after(self, seconds):
        """For a clip of a path that moves down by 24 mm in that time."""
        path = self.folder / "path.csv"
        steps = round(100 * seconds)
        path.write_text("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n" + "".join(
            f"{0.01 * k},0,0,{0.05 - 0.024 * k / steps},0,0.01,{0.17 - 0.024 * k / steps}\n" for k in range(steps + 1)))
        self.open("--trajectory", path, "--pictures", self.folder / "kept")
        time.sleep(seconds + 2)  # to the end of the path
        self.screen.key("c")

    def press_c_for_a_long_clip(self):
        """101 pictures, which take longer to draw than the test waits before it ends the window."""
        self.press_c_after(4)
        time.sleep(2)

    def kept_clip(self):
        (clip,) = (self.folder / "kept").glob("*.webp")
        data = clip.read_bytes()
        self.assertEqual((data[:4], data[8:12]), (b"RIFF", b"WEBP"))
        self.assertIn("scene-1.webp", self.program.stdout.read())
        return max(1, data.count(b"ANMF"))  # a single picture is not an animation

    def test_a_clip_is_finished_when_the_window_is_closed(self):
        self.press_c_for_a_long_clip()
        self.screen.ask_to_close(self.window)
        self.assertEqual(self.program.wait(timeout=120), 0)
        self.assertGreaterEqual(self.kept_clip(), 90)

    def test_a_signal_saves_the_clip_drawn_so_far(self):
        self.press_c_for_a_long_clip()
        self.assertEqual(self.end(), 0)
        self.assertGreaterEqual(self.kept_clip(), 1)

    def test_objects_that_cannot_be_pulled_are_reported(self):
        self.open()
        words = lambda: self.pixels(20, int(0.72 * self.height), int(0.6 * self.width), 30)
        middle = int(0.35 * self.width), int(0.42 * self.height)
        self.screen.point(self.window, *middle)
        time.sleep(1)
        before = words()
        self.screen.do("keydown", "shift")
        self.screen.do("mousedown", 1)
        wait_for("a reason", lambda: words() != before)
        self.screen.keep(self.window, "explore_not_pulled")
        self.screen.do("mouseup", 1)
        self.screen.do("keyup", "shift")
        wait_for("the usual words", lambda: words() == before)
        self.assertEqual(self.end(), 0)

    def test_the_servo_does_not_wait_for_a_display_that_stalls(self):
        self.open("--device", "simulated")
        self.screen.stall()
        stalled = time.monotonic()
        time.sleep(5)
        stalled = time.monotonic() - stalled
        self.screen.go_on()
        self.assertEqual(self.end(), 0)
        ticks, missed, lost = map(int, re.findall(r"\d+", self.program.stdout.read()))
        # Each period has a tick or was missed, as may happen on a busy machine; none waited for the display.
        self.assertGreater(ticks + missed, 1000 * stalled)
        self.assertLess(missed, 0.5 * ticks)
        self.assertEqual(lost, 0)

    def test_nothing_covers_the_emergency_button(self):
        self.open()
        for width, height in ((1200, 800), (700, 480)):
            self.screen.do("windowsize", self.window, width, height)
            wait_for("the size", lambda: self.screen.size(self.window) == (width, height))
            wait_for("the button", lambda: all(reddish(self.pixel(int(share * width), 13)) for share in (0.1, 0.5, 0.9)))
        self.screen.keep(self.window, "explore_small")

    def test_a_missing_display_is_reported(self):
        for environment in ({}, {"DISPLAY": ":98765"}):
            done = subprocess.run([PALPATE, "explore", self.scene], text=True, capture_output=True,
                                  env=dict({k: v for k, v in self.screen.environment.items() if k != "DISPLAY"}, **environment))
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn("--frames", done.stderr)

    def test_a_lost_display_ends_it_regularly(self):
        self.open()
        self.screen.kill()
        self.assertEqual(self.program.wait(timeout=60), 1)
        self.assertIn("forces are off", self.program.stderr.read())

    def test_incompatible_options_are_refused(self):
        for words, options in (("expected one of them", ["--device", "mouse", "--trajectory", "x.csv"]), ("--frames", ["--size", "20x20"]),
                               ("no device", ["--device", "hand"]), ("window", ["--frames", "f", "--trajectory", "t", "--device", "mouse"])):
            done = subprocess.run([PALPATE, "explore", self.scene, *options], text=True, capture_output=True, env=self.screen.environment)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(words, done.stderr)


if __name__ == "__main__":
    unittest.main()
