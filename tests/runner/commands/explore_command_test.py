"""`palpate explore` without a display: pictures of recorded paths, and what it refuses.

Usage: explore_command_test.py PALPATE PROTOCOLS
"""

import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

PROTOCOLS = pathlib.Path(sys.argv.pop()) if len(sys.argv) > 2 else None
PALPATE = sys.argv.pop() if len(sys.argv) > 1 else None

SCENE = {"objects": [{"shape": "cube", "edge_m": 0.05}]}
HEADER = "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z"


def decode_png(data):
    """Width, height and the pixels as rows of bytes, from an RGB PNG without interlacing."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert (depth, colour) == (8, 2)
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    raw, rows, stride, before = zlib.decompress(packed), [], 3 * width, bytes(3 * width)
    for y in range(height):
        filter_, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left = line[i - 3] if i >= 3 else 0
            up, corner = before[i], before[i - 3] if i >= 3 else 0
            if filter_ == 1:
                line[i] = (line[i] + left) & 255
            elif filter_ == 2:
                line[i] = (line[i] + up) & 255
            elif filter_ == 3:
                line[i] = (line[i] + (left + up) // 2) & 255
            elif filter_ == 4:
                estimate = left + up - corner
                nearest = min((abs(estimate - left), 0, left), (abs(estimate - up), 1, up), (abs(estimate - corner), 2, corner))
                line[i] = (line[i] + nearest[2]) & 255
        rows.append(bytes(line))
        before = rows[-1]
    return width, height, rows


def pixels(path):
    _, _, rows = decode_png(path.read_bytes())
    return [(row[i], row[i + 1], row[i + 2]) for row in rows for i in range(0, len(row), 3)]


def red(path):
    return sum(r > g + 70 and r > b + 70 for r, g, b in pixels(path))


def middle_row(path):
    """Mean row of the pixels of the first object, which is blue; the rows count from the top."""
    _, _, rows = decode_png(path.read_bytes())
    found = [y for y, row in enumerate(rows) for i in range(0, len(row), 3) if row[i + 2] > row[i] + 40]
    assert len(found) > 20, "no ball"
    return sum(found) / len(found)


class Explore(unittest.TestCase):
    def setUp(self):
        self.keep = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.keep.name)
        self.scene = self.write("scene.json", json.dumps(SCENE))
        # From above down to 5 mm below the surface, in 0.1 s.
        rows = [f"{0.005 * k},0,0,{0.05 - 0.0015 * k},0,0,{0.17 - 0.0015 * k}" for k in range(21)]
        self.path = self.write("path.csv", "\n".join([HEADER, *rows]) + "\n")

    def tearDown(self):
        self.keep.cleanup()

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def run_explore(self, *options, scene=None, environment=None):
        variables = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
        return subprocess.run([PALPATE, "explore", scene or self.scene, *map(str, options)], text=True, capture_output=True,
                              env=dict(variables, **(environment or {})))

    def draw(self, name, *options, scene=None):
        done = self.run_explore("--trajectory", self.path, "--frames", self.folder / name, "--size", "200x120", *options, scene=scene)
        self.assertEqual(done.returncode, 0, done.stderr)
        return sorted((self.folder / name).iterdir())

    def refuses(self, words, *options, scene=None):
        done = self.run_explore(*options, scene=scene)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(words, done.stderr)
        self.assertEqual(done.stdout, "")

    def test_one_picture_for_each_requested_time(self):
        frames = self.draw("frames", "--every", "25ms")
        self.assertEqual([frame.name for frame in frames], [f"frame-{k:05}.png" for k in range(5)])
        for frame in frames:
            self.assertEqual(decode_png(frame.read_bytes())[:2], (200, 120))

    def test_a_force_is_drawn_and_no_force_is_not(self):
        first, *_, last = self.draw("frames", "--every", "50ms")
        self.assertEqual(red(first), 0, "0.05 s earlier the tip is 25 mm above the cube")
        self.assertGreater(red(last), 20)

    def falling(self, gravity):
        """Frames of a ball above a plate, with the stylus far away."""
        scene = self.write("fall.json", json.dumps({"gravity_m_per_s2": gravity, "objects": [
            {"shape": "sphere", "radius_m": 0.02, "position_m": [0, 0, 0.06], "body": {"mass_kg": 0.1, "restitution": 0}},
            {"shape": "box", "size_m": [0.2, 0.2, 0.02], "position_m": [0, 0, -0.01]}]}))
        self.path = self.write("far.csv", "\n".join([HEADER, *(f"{0.005 * k},0.5,0.5,0.5,0.5,0.5,0.6" for k in range(101))]) + "\n")
        return [middle_row(frame) for frame in self.draw(f"fall{gravity[2]}", "--every", "50ms", scene=scene)]

    def test_falling_objects_fall_in_the_picture(self):
        rows = self.falling([0, 0, -9.81])
        # 0.04 m of free fall take 0.09 s; then it lies on the plate.
        self.assertGreater(rows[1], rows[0] + 1)
        self.assertGreater(rows[2], rows[1] + 2)
        self.assertLess(max(rows[4:]) - min(rows[4:]), 1)
        floating = self.falling([0, 0, 0])
        self.assertLess(max(floating) - min(floating), 0.5)

    def test_the_same_path_gives_the_same_files(self):
        first, second = self.draw("one", "--every", "50ms"), self.draw("two", "--every", "50ms")
        self.assertEqual([f.read_bytes() for f in first], [f.read_bytes() for f in second])

    def test_the_view_and_the_renderer_change_the_picture(self):
        here = self.draw("here", "--every", "1s")[0].read_bytes()
        self.assertNotEqual(here, self.draw("there", "--every", "1s", "--view", "120,10")[0].read_bytes())
        self.assertNotEqual(here, self.draw("near", "--every", "1s", "--view", "30,22,2")[0].read_bytes())
        self.assertNotEqual(here, self.draw("point", "--every", "1s", "--renderer", "point")[0].read_bytes())

    def test_an_animation_holds_every_picture(self):
        file = self.folder / "scene.webp"
        done = self.run_explore("--trajectory", self.path, "--animation", file, "--size", "160x90", "--every", "25ms")
        self.assertEqual(done.returncode, 0, done.stderr)
        data = file.read_bytes()
        self.assertEqual((data[:4], data[8:12]), (b"RIFF", b"WEBP"))
        self.assertEqual(struct.unpack("<I", data[4:8])[0] + 8, len(data))
        self.assertIn(b"ANIM", data)
        # Equal pictures are merged into a longer one; here the tip moves down in all of them.
        self.assertEqual(data.count(b"ANMF"), 5)

    def test_nothing_is_overwritten_without_force(self):
        before = self.draw("frames", "--every", "50ms")
        options = ("--trajectory", self.path, "--frames", self.folder / "frames", "--size", "100x60", "--every", "100ms")
        self.refuses("--force", *options)
        self.assertEqual(len(before), len(list((self.folder / "frames").iterdir())))
        done = self.run_explore(*options, "--force")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(list((self.folder / "frames").iterdir())), 2, "the old ones are gone")

    def test_a_folder_with_other_files_is_never_replaced(self):
        (self.folder / "mine").mkdir()
        self.write("mine/thesis.txt", "all of it")
        options = ("--trajectory", self.path, "--frames", self.folder / "mine", "--force")
        self.refuses("thesis.txt", *options)
        self.refuses("this is a file", "--trajectory", self.path, "--frames", self.path, "--force")
        self.refuses("reads it", "--trajectory", self.path, "--animation", self.scene, "--force")
        self.assertEqual((self.folder / "mine/thesis.txt").read_text(), "all of it")

    def test_wrong_usage_says_what_is_expected(self):
        frames = ("--trajectory", self.path, "--frames", self.folder / "frames")
        self.refuses("--trajectory", "--frames", self.folder / "frames")
        for size in ("1280", "0x0", "1280x", "12x720", "9000x100", "axb", "1280x720x3", "-5x20"):
            self.refuses("1280x720", *frames, "--size", size)
        for every in ("16", "0ms", "-1s", "nans", "ms", "1e9s", "16 ms"):
            self.refuses("16ms", *frames, "--every", every)
        for view in ("30", "30,90", "a,b", "30,20,0", "30,20,1,1", "nan,0"):
            self.refuses("30,20", *frames, f"--view={view}")
        self.refuses("point or ray", *frames, "--renderer", "lines")
        self.assertFalse((self.folder / "frames").exists())

    def test_bad_files_are_named(self):
        frames = ("--frames", self.folder / "frames")
        self.refuses("/objects", "--trajectory", self.path, *frames, scene=self.write("bad.json", '{"objects": []}'))
        self.refuses("line 1", "--trajectory", self.write("bad.csv", "a,b\n1,2\n"), *frames)
        self.refuses("nothing.csv", "--trajectory", self.folder / "nothing.csv", *frames)
        many = self.write("long.csv", f"{HEADER}\n0,0,0,0,0,1,0\n1000,0,0,0,0,1,0\n")
        self.refuses("100000", "--trajectory", many, *frames, "--every", "1ms")
        self.assertFalse((self.folder / "frames").exists())

    def test_a_path_with_nan_readings_is_drawn(self):
        self.path = self.write("path.csv", f"{HEADER}\n0,nan,0,0,0,1,0\n0.1,1e300,0,0,0,inf,0\n")
        self.assertEqual(len(self.draw("frames", "--every", "100ms")), 2)

    def test_without_a_driver_the_message_names_it(self):
        nowhere = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent", "__EGL_VENDOR_LIBRARY_DIRS": "/nonexistent"}
        done = self.run_explore("--trajectory", self.path, "--frames", self.folder / "frames", environment=nowhere)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("libgl1-mesa-dri", done.stderr)
        self.assertFalse((self.folder / "frames").exists())

    def test_every_scene_of_the_gallery_is_touched(self):
        scenes = sorted((PROTOCOLS / "scenes").glob("*.json"))
        self.assertGreaterEqual(len(scenes), 5)
        for scene in scenes:
            with self.subTest(scene.stem):
                self.path = scene.with_suffix(".csv")
                frames = self.draw(scene.stem, "--every", "400ms", scene=scene)
                self.assertGreater(max(red(frame) for frame in frames), 3, "no force in any picture")


if __name__ == "__main__":
    unittest.main()
