"""What a participant sees beside touch, in real windows: where it is drawn, by the geometry of the station, and what is on
record of it.

Usage: seen_windows_test.py PALPATE     (PALPATE_PICTURES names a folder for pictures to look at)
"""

import csv
import json
import math
import subprocess
import time
import unittest

from task_windows_test import png
from virtual_screen import PATIENCE, wait_for
from window_case import PALPATE, WindowCase

SCREEN = [[-0.26, 0.25, -0.16], [0.26, 0.25, -0.16], [-0.26, 0.25, 0.16]]
EYE = [0.05, -0.4, 0.1]
SIZE = [0.05, 0.04, 0.06]  # m, of a box about the origin
BACKGROUND = 0.2


def stimulus(name, **seen):
    return {"name": name, "shape": "box", "size_m": SIZE, **({"seen": {"when": "always", **seen}} if seen else {})}


def protocol(*stimuli, **view):
    names = [one["name"] for one in stimuli]
    return {
        "version": 2, "name": "seen", "renderers": ["point"], "seed": 5, "orientation": "fixed",
        "servo": {"rate_hz": 200}, "home": {"rest_s": 0.1}, "material": {"stiffness_n_per_m": 60},
        "view": {"screen_m": SCREEN, "eye_m": EYE, "background": BACKGROUND} | view, "stimuli": list(stimuli),
        "blocks": [{"name": "numbers", "task": "rate", "stimuli": names, "repetitions": 1, "question": "?", "time_out_s": 600}],
    }


def share(point, eye=EYE):
    """Where the line from an eye through a point meets the screen: shares of its width and height, from the upper left."""
    depth = (SCREEN[0][1] - eye[1]) / (point[1] - eye[1])
    x, z = (eye[i] + depth * (point[i] - eye[i]) for i in (0, 2))
    return (x - SCREEN[0][0]) / (SCREEN[1][0] - SCREEN[0][0]), 1 - (z - SCREEN[0][2]) / (SCREEN[2][2] - SCREEN[0][2])


def box_of(eye=EYE, ratio=1, offset=(0, 0, 0)):
    """Left, right, upper and lower edge of the drawn box, in shares of the screen."""
    corners = [share([s * ratio * SIZE[i] / 2 + offset[i] for i, s in enumerate(signs)], eye)
               for signs in [(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]]
    across, down = zip(*corners)
    return min(across), max(across), min(down), max(down)


class SeenWindows(WindowCase):
    def start(self, made, **files):
        for name, content in files.items():
            (self.folder / name.replace("_", ".")).write_bytes(content)
        (self.folder / "protocol.json").write_text(json.dumps(made))
        self.said = open(self.folder / "messages.txt", "w+")
        self.addCleanup(self.said.close)
        self.program = subprocess.Popen(
            [PALPATE, "run", self.folder / "protocol.json", "--db", self.database, "--participant", "P01",
             "--new-participant", "--device", "mouse"],
            env=self.screen.environment, stdout=self.said, stderr=self.said)
        self.addCleanup(self.stop)
        wait_for("the windows", lambda: self.program.poll() is not None or
                 self.screen.do("search", "--onlyvisible", "--name", "^seen, P01$"))
        self.assertIsNone(self.program.poll(), self.messages())
        self.participant = self.screen.window("seen, P01")
        self.screen.focus(self.participant)

    def stop(self):
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait()

    def look(self, name):
        self.screen.settled_picture(self.participant)
        self.screen.keep(self.participant, name)
        self.width, self.height = self.screen.size(self.participant)
        return self.screen.pixels(self.participant, 0, 0, self.width, self.height)

    def part(self):
        """px: the part of the window that has the sides of the screen: left, top, width, height."""
        wanted = (SCREEN[1][0] - SCREEN[0][0]) / (SCREEN[2][2] - SCREEN[0][2])
        width, height = min(self.width, wanted * self.height), min(self.height, self.width / wanted)
        return (self.width - width) / 2, (self.height - height) / 2, width, height

    def drawn(self, pixels, is_it, columns=None):
        """Left, right, upper and lower edge, px, of the pixels between the words and the keys."""
        first, last = columns or (0, self.width)
        rows = range(int(0.25 * self.height), int(0.8 * self.height))
        found = [(x, y) for y in rows for x in range(first, last) if is_it(pixels[y * self.width + x])]
        self.assertTrue(found)
        across, down = zip(*found)
        return min(across), max(across) + 1, min(down), max(down) + 1

    def is_object(self, pixel):
        """The object is brighter than the background, or warmer."""
        return pixel[0] - pixel[2] > 8

    def assert_at(self, found, box, within=2):
        left, top, width, height = self.part()
        expected = (left + box[0] * width, left + box[1] * width, top + box[2] * height, top + box[3] * height)
        for one, other in zip(found, expected):
            self.assertLess(abs(one - other), within, (found, expected))

    def seen_box(self, name, view=None, **seen):
        self.start(protocol(stimulus("a", what="object", **seen), **(view or {})))
        wait_for("the object", lambda: any(map(self.is_object, self.look(name))))
        return self.drawn(self.look(name), self.is_object)

    def test_object_is_where_its_lines_meet_the_screen(self):
        self.assert_at(self.seen_box("seen_box"), box_of())

    def test_size_and_offset_are_those_of_the_protocol(self):
        found = self.seen_box("seen_larger", size_ratio=1.3, offset_m=[0.03, 0, -0.01])
        self.assert_at(found, box_of(ratio=1.3, offset=(0.03, 0, -0.01)))

    def assert_blur(self, blur_deg):
        self.start(protocol(stimulus("a", what="object", blur_deg=blur_deg)))
        wait_for("the object", lambda: any(map(self.is_object, self.look("seen_blur"))))
        pixels = self.look("seen_blur")
        left, top, width, height = self.part()
        box = box_of()
        row = int(top + (box[2] + 0.6 * (box[3] - box[2])) * height)
        line = [sum(pixels[row * self.width + x]) for x in range(self.width)]
        # The left edge of the front is a step, blurred a cumulative normal: 2 sd between 16 and 84 %. The face is shaded
        # beyond.
        expected = math.tan(math.radians(blur_deg)) * (SCREEN[0][1] - EYE[1]) * width / (SCREEN[1][0] - SCREEN[0][0])
        edge = left + box[0] * width
        near = line[int(edge - 4 * expected):int(edge + 4 * expected)]
        low, high = near[0], max(near)

        def crossing(portion):
            level = low + portion * (high - low)
            at = next(i for i, value in enumerate(near) if value >= level)
            return at + (level - near[at]) / (near[at] - near[at - 1])
        sd = (crossing(0.8413) - crossing(0.1587)) / 2
        self.assertLess(abs(sd / expected - 1), 0.06, (sd, expected))
        self.assertLess(abs(crossing(0.5) + int(edge - 4 * expected) + 0.5 - edge), 1)

    def test_small_blur_has_its_standard_deviation(self):
        self.assert_blur(0.3)

    def test_large_blur_has_its_standard_deviation(self):
        self.assert_blur(0.6)

    def test_mirror_flips_the_picture(self):
        left, right, top, bottom = box_of()
        self.assert_at(self.seen_box("seen_mirror", {"mirror": "horizontal"}), (1 - right, 1 - left, top, bottom))

    def test_each_eye_has_its_half(self):
        self.start(protocol(stimulus("a", what="object"), stereo="side_by_side", ipd_m=0.07))
        wait_for("the object", lambda: any(map(self.is_object, self.look("seen_halves"))))
        pixels = self.look("seen_halves")
        for half, side in ((0, -1), (1, 1)):
            columns = (half * self.width // 2, (half + 1) * self.width // 2)
            found = self.drawn(pixels, self.is_object, columns)
            left, _, width, _ = self.part()
            box = box_of([EYE[0] + side * 0.035, *EYE[1:]])
            expected = [half * self.width / 2 + (left + edge * width) / 2 for edge in box[:2]]
            for one, other in zip(found, expected):
                self.assertLess(abs(one - other), 2, (half, found, expected))

    def test_picture_stands_at_the_object(self):
        self.start(protocol(stimulus("a", what="picture", picture="red.png")), red_png=png(40, 40, (255, 0, 0)))
        is_red = (255, 0, 0).__eq__
        wait_for("the picture", lambda: any(map(is_red, self.look("seen_picture"))))
        found = self.drawn(self.look("seen_picture"), is_red)
        left, top, width, height = self.part()
        across, down = share((0, 0, 0))
        self.assertLess(abs((found[0] + found[1]) / 2 - left - across * width), 2)
        self.assertLess(abs((found[2] + found[3]) / 2 - top - down * height), 2)

    def test_nothing_shows_what_is_not_to_be_seen(self):
        """A page is the same for a large and a small box: neither is seen."""
        small = stimulus("b") | {"size_m": [0.01, 0.01, 0.01]}
        self.start(protocol(stimulus("a"), small))
        pages = []
        for trial in range(2):
            time.sleep(3)  # until forces are on
            self.screen.key("BackSpace", "BackSpace")  # what was typed for the last one
            self.look(f"unseen_{trial}")
            pages.append(self.screen.settled_picture(self.participant))
            before = len(self.rows("SELECT 1 FROM attempts WHERE state = 'completed'"))
            self.answer(before)
        self.assertEqual(pages[0], pages[1])

    def answer(self, before):
        end = time.monotonic() + PATIENCE
        while len(self.rows("SELECT 1 FROM attempts WHERE state = 'completed'")) == before:
            self.assertLess(time.monotonic(), end, self.messages())
            self.screen.key("5")
            self.screen.key("Return")
            time.sleep(0.5)

    def test_lag_of_the_frames_is_on_record(self):
        self.start(protocol(stimulus("a", what=["object", "tool"], delay_s=0.1), stimulus("b")) | {"samples": True})
        for before in range(2):
            self.look(f"seen_record_{before}")
            time.sleep(3)  # several frames of a busy machine
            self.answer(before)
        tasks = {json.loads(task)["intervals"][0]["stimulus"]: json.loads(task) for (task,) in
                 self.rows("SELECT task FROM attempts WHERE state = 'completed'")}
        self.assertNotIn("seen", tasks["b"])
        self.assertGreater(tasks["a"]["seen"]["frames"], 3)
        self.assertGreater(tasks["a"]["seen"]["lag_s"], 0)
        frames = self.rows("SELECT swap_ns, pose_ns, delay_ns FROM frames ORDER BY frame")
        self.assertEqual(len(frames), tasks["a"]["seen"]["frames"])
        self.assertEqual(frames[0][0], tasks["a"]["seen"]["first_ns"])
        for (swap, pose, delay), later in zip(frames, frames[1:]):
            self.assertLess(swap, later[0])
            self.assertEqual(delay, 100_000_000)
            self.assertGreaterEqual(swap - pose, delay)
        self.assertLessEqual(tasks["a"]["seen"]["lag_s"], tasks["a"]["seen"]["lag_p99_s"])
        self.stop()
        table = self.folder / "trials.csv"
        subprocess.run([PALPATE, "export", "--db", self.database, "--format", "csv", "--out", table], check=True, stdout=subprocess.DEVNULL)
        rows = {row["shape"]: row for row in csv.DictReader(table.read_text().splitlines())}
        self.assertAlmostEqual(float(rows["a"]["seen_lag_ms"]), 1000 * tasks["a"]["seen"]["lag_s"], places=6)
        self.assertEqual((rows["b"]["seen_lag_ms"], rows["b"]["frames_dropped"]), ("", ""))

    def test_text_display_is_refused(self):
        (self.folder / "protocol.json").write_text(json.dumps(protocol(stimulus("a", what="object"))))
        run = subprocess.run([PALPATE, "run", self.folder / "protocol.json", "--db", self.database, "--participant", "P01",
                              "--new-participant", "--device", "simulated", "--no-window"], capture_output=True, text=True)
        self.assertEqual(run.returncode, 2)
        self.assertIn("would not see 'a'", run.stderr)


if __name__ == "__main__":
    unittest.main()
