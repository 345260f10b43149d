"""Tasks and pages in real windows: letters as they are typed, the wheel, answers that are spoken.

Usage: task_windows_test.py PALPATE     (PALPATE_PICTURES names a folder for pictures to look at)
"""

import json
import struct
import subprocess
import time
import unittest
import zlib

from virtual_screen import PATIENCE, wait_for
from window_case import PALPATE, WindowCase

PROTOCOL = {
    "version": 2, "name": "tasks", "renderers": ["point"], "seed": 5, "orientation": "fixed",
    "servo": {"rate_hz": 200}, "home": {"rest_s": 0.1}, "material": {"stiffness_n_per_m": 60},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1, "stiffness_n_per_m": 60}],
    "texts": {"end": "Danke."},
}
LEVEL = {"stimuli": ["ball"], "level": {"path": "/stiffness_n_per_m"}}
COMPARE = {"name": "which", "task": "compare", **LEVEL, "standard": "ball", "question": "Which one was stiffer?",
           "procedure": {"kind": "constant", "levels": [90], "repetitions": 1}, "inter_interval_s": 0.2,
           "confidence": {"question": "How sure are you?", "scale": [{"label": "guessed"}, {"label": "certain"}]}}
NUMBER = {"name": "how", "task": "rate", "stimuli": ["ball"], "repetitions": 1, "question": "How hard?", "max": 50, "time_out_s": 600}
ADJUST = {"name": "equal", "task": "adjust", **LEVEL, "standard": "ball", "min": 20, "max": 100, "turn": 5,
          "starts": [30], "question": "Make them equal"}


def png(width, height, colour):
    """A PNG file of one colour."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = (b"\0" + bytes(colour) * width) * height
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class TaskWindows(WindowCase):
    def start(self, *blocks, options=(), **changes):
        (self.folder / "protocol.json").write_text(json.dumps(PROTOCOL | {"blocks": blocks} | changes))
        self.said = open(self.folder / "messages.txt", "w+")
        self.addCleanup(self.said.close)
        self.program = subprocess.Popen(
            [PALPATE, "run", self.folder / "protocol.json", "--db", self.database, "--participant", "P01",
             "--new-participant", "--device", "mouse", *options],
            env=self.screen.environment, stdout=self.said, stderr=self.said)
        self.addCleanup(self.stop)
        wait_for("the windows", lambda: self.program.poll() is not None or
                 self.screen.do("search", "--onlyvisible", "--name", "^tasks, P01$"))
        self.assertIsNone(self.program.poll(), self.messages())
        self.participant = self.screen.window("tasks, P01")
        self.console = self.screen.window("tasks, P01 - console")
        wait_for("a page", lambda: len(set(self.screen.picture(self.participant))) > 20)
        self.screen.focus(self.participant)

    def stop(self):
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait()

    def tasks(self):
        return [json.loads(task) for (task,) in
                self.rows("SELECT task FROM attempts WHERE state = 'completed' ORDER BY id")]

    def page(self, name, before=None):
        """The picture of the next page, which is kept."""
        picture = self.screen.settled_picture(self.participant, differs_from=before)
        self.screen.keep(self.participant, name)
        return picture

    def press(self, *keys, then, name):
        """Keys on one page; the next page."""
        before = self.screen.settled_picture(self.participant)
        self.screen.key(*keys)
        if then:
            return self.page(name, before)
        return before

    def type(self, words):
        self.screen.do("type", "--delay", 60, "--", words)

    def press_until(self, condition, *keys):
        """A key before time zero does not count: press it again."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self.screen.key(*keys)
            pause = time.monotonic() + 1
            while time.monotonic() < pause:
                if condition():
                    return
                time.sleep(0.02)
        self.screen.keep(self.participant, "stuck")
        raise AssertionError(f"{keys} did nothing; " + self.messages())

    def end(self):
        wait_for("the end page", lambda: self.program.poll() is not None or self.screen.key("space") or
                 time.sleep(0.3) or self.program.poll() is not None)
        self.assertEqual(self.program.returncode, 0, self.messages())

    def look_at_pictures(self):
        def red():
            width, height = self.screen.size(self.participant)
            shown = self.screen.pixels(self.participant, 0, 0, width, height)
            return sum(pixel == (255, 0, 0) for pixel in shown)

        self.page("page_picture")
        self.assertGreater(red(), 80 * 50, "the picture is shown, enlarged")
        self.press("space", then=True, name="page_without_picture")
        self.assertEqual(red(), 0)
        self.press("Left", then=True, name="page_picture_again")
        self.assertGreater(red(), 0)
        self.press("space", then=True, name="page_second")

    def agree(self):
        """Longer than the window: agreement is possible only after all of it was shown."""
        self.screen.key("1")
        time.sleep(0.5)
        self.assertEqual(self.rows("SELECT count(*) FROM page_answers"), [(0,)])
        screens = 1
        while not self.rows("SELECT 1 FROM page_answers"):
            self.assertLess(screens, 30)
            self.screen.key("space")
            screens += 1
            self.page(f"consent_{screens}")
            self.screen.key("1")
            time.sleep(0.5)
        self.assertGreater(screens, 1)

    def fill_in(self):
        typing = self.page("typing_empty")
        self.type("Lab, Jena?")
        self.page("typing", typing)
        self.type("x")
        self.press("BackSpace", "Return", then=True, name="typing_number")
        # The numeric pad, whatever NumLock says.
        self.press("KP_7", "Return", then=True, name="number_refused")
        self.press("BackSpace", "KP_4", "KP_2", "Return", then=True, name="choice")
        self.screen.key("2")
        wait_for("the answers", lambda: len(self.rows("SELECT 1 FROM page_answers")) == 4)

    def rate(self):
        self.type("-7,25")
        self.screen.key("Return")
        wait_for("the answer", self.tasks)
        self.assertEqual(self.tasks()[0]["number"], -7.25)

    def test_pages_with_a_picture_and_letters_as_they_are_typed(self):
        (self.folder / "red.png").write_bytes(png(80, 50, (255, 0, 0)))
        long_text = " ".join(f"Word{i}" for i in range(900))
        pages = [
            {"name": "how", "kind": "instructions", "text": "A stylus.\fA ball.", "pictures": ["red.png"]},
            {"name": "consent", "kind": "consent", "consent_version": "1", "text": long_text},
            {"name": "you", "kind": "questionnaire", "items": [
                {"name": "work", "kind": "text", "question": "What is your work?"},
                {"name": "age", "kind": "number", "question": "How old are you?", "min": 18, "max": 120},
                {"name": "hand", "kind": "choice", "question": "Which hand?", "choices": ["left", "right"]}]}]
        self.start(NUMBER, pages=pages)
        self.look_at_pictures()
        self.press("space", then=True, name="consent_1")
        self.agree()
        self.fill_in()
        self.assertEqual([answer for (answer,) in self.rows("SELECT answer FROM page_answers ORDER BY id")],
                         ["agree", "Lab, Jena?", "42", "right"])
        wait_for("a trial", lambda: self.rows("SELECT 1 FROM attempts"))
        time.sleep(1)
        self.page("rate")
        self.rate()
        self.end()

    def test_the_emergency_works_while_a_number_is_typed(self):
        self.start(NUMBER)
        wait_for("a trial", lambda: self.screen.key("space") or self.rows("SELECT 1 FROM attempts"))
        time.sleep(1)
        before = self.screen.settled_picture(self.participant)
        self.type("-7,25")
        self.page("rate_typed", before)
        self.screen.key("F12")
        wait_for("the cut-off", lambda: self.rows("SELECT 1 FROM attempts WHERE state = 'cut_off'"))
        self.screen.keep(self.console, "rate_emergency")
        width, _ = self.screen.size(self.console)
        self.screen.click(self.console, width - 60, 90)  # clear the fault
        self.screen.click(self.console, width - 100, 440)  # go on
        wait_for("the trial again", lambda: len(self.rows("SELECT 1 FROM attempts")) == 2)
        self.screen.focus(self.participant)
        time.sleep(1)
        self.rate()
        self.end()

    def test_pages_after_the_last_trial(self):
        pages = [
            {"name": "thanks", "kind": "instructions", "when": "after", "text": "Two questions more."},
            {"name": "strain", "kind": "questionnaire", "when": "after", "items": [
                {"name": "tired", "kind": "choice", "question": "Are you tired?", "choices": ["yes", "no"]},
                {"name": "why", "kind": "text", "question": "Anything else?"}]}]
        self.start(NUMBER, pages=pages)
        wait_for("a trial", lambda: self.screen.key("space") or self.rows("SELECT 1 FROM attempts"))
        time.sleep(1)
        before = self.screen.settled_picture(self.participant)
        self.type("12")
        typed = self.page("after_rate", before)
        self.press_until(self.tasks, "Return")
        thanks = self.page("after_thanks", typed)
        self.assertEqual(self.rows("SELECT count(*) FROM page_answers"), [(0,)])
        self.press_until(lambda: self.screen.picture(self.participant) != thanks, "space")
        self.page("after_choice", thanks)
        self.press("2", then=True, name="after_text_empty")
        self.type("No, nothing.")
        self.page("after_text")
        self.screen.key("Return")  # the answers of a page are kept together
        wait_for("the answers", lambda: len(self.rows("SELECT 1 FROM page_answers")) == 2)
        self.assertEqual(self.rows("SELECT page, item, answer FROM page_answers ORDER BY id"),
                         [("strain", "tired", "no"), ("strain", "why", "No, nothing.")])
        time.sleep(1)
        self.screen.keep(self.participant, "after_end")
        self.end()
        self.assertEqual(self.rows("SELECT count(*) FROM attempts WHERE state = 'completed'"), [(1,)])

    def test_two_intervals_confidence_and_the_wheel(self):
        self.start(COMPARE, ADJUST)
        wait_for("a trial", lambda: self.screen.key("space") or self.rows("SELECT 1 FROM attempts"))
        time.sleep(1)
        self.page("compare_first")
        self.screen.keep(self.console, "compare_console")
        before = self.screen.settled_picture(self.participant)
        self.press_until(lambda: self.screen.picture(self.participant) != before, "space")
        time.sleep(1)
        self.page("compare_second")
        second = self.screen.settled_picture(self.participant)
        self.press_until(lambda: self.screen.picture(self.participant) != second, "1")
        self.page("confidence")
        self.press_until(self.tasks, "2")
        self.assertEqual(self.tasks()[0]["confidence"], 2)
        wait_for("the other block", lambda: self.screen.key("space") or
                 len(self.rows("SELECT 1 FROM attempts")) == 2)
        time.sleep(1)
        self.page("adjust")
        self.screen.point(self.participant, 200, 200)
        for _ in range(4):
            self.screen.do("click", 4)  # up
        self.screen.do("click", 5)
        time.sleep(1)
        self.screen.keep(self.console, "adjust_console")
        self.press_until(lambda: len(self.tasks()) == 2, "4")
        self.assertEqual(self.tasks()[1]["number"], 45)
        self.end()

    def test_the_experimenter_types_spoken_answers(self):
        self.start(COMPARE, options=["--spoken"])
        wait_for("a trial", lambda: self.screen.key("space") or self.rows("SELECT 1 FROM attempts"))
        time.sleep(1)
        self.screen.keep(self.console, "spoken_console")
        width, height = self.screen.size(self.console)
        first = self.screen.settled_picture(self.participant)
        self.press_until(lambda: self.screen.picture(self.participant) != first, "space")
        time.sleep(1)
        self.screen.key("2")  # the participant's own keys do not answer
        time.sleep(0.5)
        second = self.screen.settled_picture(self.participant)
        self.screen.click(self.console, width - 200, height - 62)
        self.type("1")
        self.screen.key("Return")
        wait_for("the question", lambda: self.screen.picture(self.participant) != second)
        self.assertEqual(self.tasks(), [])
        time.sleep(0.5)
        self.type("certain")
        self.screen.key("Return")
        wait_for("the answer", self.tasks)
        self.screen.keep(self.console, "spoken_answered")
        self.assertEqual(self.tasks()[0]["confidence"], 2)
        self.assertEqual(self.rows("SELECT response, response_device FROM attempts, runs"),
                         [("1", "spoken, typed by the experimenter")])


if __name__ == "__main__":
    unittest.main()
