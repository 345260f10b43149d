"""Sessions in real windows: answered by keys, felt with the pointer, and broken in mid-trial.

Usage: session_windows_test.py PALPATE
"""

import csv
import json
import os
import pathlib
import signal
import subprocess
import tempfile
import time
import unittest

from virtual_screen import PATIENCE, wait_for
from window_case import PALPATE, WindowCase

SHAPES = ["sphere", "cone", "cylinder", "cube"]
TRIALS = 4
PROTOCOL = {
    "version": 1, "name": "windows", "renderers": ["ray"],
    "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": 0.03, "subdivisions": 2},
                {"name": "cone", "shape": "cone", "radius_m": 0.03, "height_m": 0.06},
                {"name": "cylinder", "shape": "cylinder", "radius_m": 0.03, "height_m": 0.06},
                {"name": "cube", "shape": "cube", "edge_m": 0.05}],
    "repetitions": 1,
    "response": {"keys": {"1": "sphere", "2": "cone", "3": "cylinder", "4": "cube"},
                 "time_out_s": 600},
    "home": {"rest_s": 0.1, "margin_m": 0.01},
    "servo": {"rate_hz": 200},
    "texts": {"instructions": "Erkennen Sie die Form.", "end": "Danke."},
    "seed": 5,
}


class SessionTest(WindowCase):
    def setUp(self):
        super().setUp()
        self.write_protocol()
        self.addCleanup(self.stop)

    def write_protocol(self, **changes):
        (self.folder / "protocol.json").write_text(json.dumps({**PROTOCOL, **changes}))

    def stop(self):
        if self.program and self.program.poll() is None:
            self.program.kill()
        if self.program:
            self.program.wait()

    def start(self, device="mouse", to_the_first_trial=True):
        """Starts or resumes a session, up to its first trial."""
        search = "search", "--onlyvisible", "--name", "^windows, P01$"
        wait_for("the end of the windows before", lambda: not self.screen.do(*search))
        with open(self.folder / "messages.txt", "a") as messages:
            self.program = subprocess.Popen(
                [PALPATE, "run", self.folder / "protocol.json", "--db", self.database,
                 "--participant", "P01", "--device", device],
                env=self.screen.environment, stdout=messages, stderr=messages)
        wait_for("the windows", lambda: self.program.poll() is not None or
                 self.screen.do(*search))
        self.assertIsNone(self.program.poll(), self.messages())
        self.participant = self.screen.window("windows, P01")
        self.console = self.screen.window("windows, P01 - console")
        wait_for("the instructions",
                 lambda: len(set(self.screen.picture(self.participant))) > 20)
        instructions = self.screen.settled_picture(self.participant)
        before = len(self.attempts())
        self.screen.focus(self.participant)
        if not to_the_first_trial:
            return
        self.press_until("space", lambda: len(self.attempts()) > before)
        self.screen.settled_picture(self.participant, differs_from=instructions)

    def press_until(self, key, condition):
        """A key before time zero does not count: press it again."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if self.halted():
                self.clear_and_go_on()
            self.screen.key(key)
            pause = time.monotonic() + 1
            while time.monotonic() < pause:
                if condition():
                    return
                time.sleep(0.02)
        self.screen.keep(self.participant, "stuck")
        self.screen.keep(self.console, "stuck_console")
        raise AssertionError(f"key {key} did nothing; " + self.messages())

    def halted(self):
        """A busy machine makes the servo miss ticks, and five in a row turn the forces off."""
        return self.attempts() and self.attempts()[-1][3] == "cut_off"

    def clear_and_go_on(self):
        width, _ = self.screen.size(self.console)
        self.screen.click(self.console, width - 60, 90)  # clear the fault
        self.screen.click(self.console, width - 100, 400)  # go on

    def attempts(self):
        return self.rows("SELECT trial, attempt, shape, state FROM attempts ORDER BY id")

    def done(self):
        return sum(state == "completed" for *_, state in self.attempts())

    def answer(self, count=1, key="2"):
        for _ in range(count):
            before = self.done()
            self.press_until(key, lambda: self.done() > before)

    def wait_for_trial(self):
        """Waits until a trial runs and its page is on the screen."""
        wait_for("a trial", lambda: self.attempts() and self.attempts()[-1][3] == "running")
        time.sleep(1)  # "ready" is over
        return self.screen.settled_picture(self.participant)

    def finish(self):
        while self.done() < TRIALS:
            self.answer()
        self.press_until("space", lambda: self.program.poll() is not None)  # read the last page
        self.assertEqual(self.program.returncode, 0, self.messages())

    def check_whole(self, cut_off):
        """Every trial is recorded once, whatever happened, and each attempt is accounted for."""
        self.assertEqual(self.rows("PRAGMA integrity_check"), [("ok",)])
        out = self.folder / "trials.csv"
        subprocess.run([PALPATE, "export", "--db", self.database, "--format", "csv", "--out", out,
                        "--force"], check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)
        with open(out, newline="") as file:
            trials = list(csv.DictReader(file))
        self.assertEqual([int(t["trial"]) for t in trials], list(range(1, TRIALS + 1)))
        self.assertEqual({t["device"] for t in trials}, {"mouse"})
        self.assertEqual({t["response"] for t in trials}, {"cone"})
        self.assertGreaterEqual(sum(state == "cut_off" for *_, state in self.attempts()), cut_off)

    def test_the_participant_sees_the_same_for_every_shape(self):
        self.start()
        seen = {}
        for trial in range(TRIALS):
            picture = self.wait_for_trial()
            shape = self.attempts()[-1][2]
            self.screen.keep(self.participant, f"session_participant_{shape}")
            self.screen.keep(self.console, f"session_console_{shape}")
            seen.setdefault(shape, set()).add(picture)
            self.answer()
        self.assertEqual(sorted(seen), sorted(SHAPES))
        self.assertEqual(len(set.union(*seen.values())), 1)
        self.assertGreater(len(set(picture)), 20, "the key map")
        width, _ = self.screen.size(self.participant)

        def far_along_the_bar():
            red, green, _ = self.screen.pixels(self.participant, int(0.8 * width), 18)[0]
            return green > 1.4 * red

        wait_for("the bar on the last page, full", far_along_the_bar)
        self.screen.keep(self.participant, "session_end")
        self.finish()
        self.check_whole(cut_off=0)

    def test_the_pointer_feels_the_object(self):
        self.start()
        self.wait_for_trial()
        width, height = self.screen.size(self.console)
        middle = int(0.3 * width), int(0.39 * height)
        # Move to the middle of the view, where the object is; this suffices.
        self.screen.point(self.console, 40, height - 300)
        self.screen.point(self.console, *middle)
        time.sleep(2)
        self.screen.keep(self.console, "session_touch")
        self.answer()
        contacts = self.rows("SELECT first_contact_time, max_force FROM attempts "
                             "WHERE state = 'completed'")
        self.assertIsNotNone(contacts[0][0], "nothing was touched")
        self.assertGreater(contacts[0][1], 0.1)

    def test_the_window_is_destroyed_in_mid_trial(self):
        self.start()
        self.answer(2)
        self.wait_for_trial()
        self.screen.do("windowclose", self.participant)
        wait_for("the end", lambda: self.program.poll() is not None)
        self.assertEqual(self.program.returncode, 1, self.messages())
        self.assertIn("closed", self.messages())
        self.assertGreaterEqual(self.done(), 2)
        self.start()
        self.finish()
        self.check_whole(cut_off=1)

    def test_closing_a_window_in_a_session_asks_first(self):
        self.start()
        for name in ("participant", "console"):
            self.answer()
            self.wait_for_trial()
            window = getattr(self, name)  # of this run
            self.screen.ask_to_close(window)
            time.sleep(1)
            self.assertIsNone(self.program.poll(), self.messages())
            self.screen.keep(self.console, "session_closing")
            self.screen.key("F12")
            wait_for("zero force", self.halted)
            self.assertIn(("emergency zero: the key F12",), self.rows("SELECT text FROM notes"))
            if name == "console":
                break
            self.screen.ask_to_close(window)
            wait_for("the end", lambda: self.program.poll() is not None)
            self.assertIn("closed", self.messages())
            self.start()
        self.screen.ask_to_close(self.console)
        wait_for("the end", lambda: self.program.poll() is not None)
        self.assertIn("ended by the experimenter", self.messages())

    def test_the_display_server_dies_in_mid_trial(self):
        self.start()
        self.answer(2)
        self.wait_for_trial()
        self.screen.kill()
        wait_for("the end", lambda: self.program.poll() is not None)
        self.assertEqual(self.program.returncode, 1, self.messages())
        self.assertEqual(self.rows("SELECT end_reason FROM runs"), [("aborted",)])
        self.new_screen()
        self.start()
        self.finish()
        self.check_whole(cut_off=1)

    def test_the_process_is_killed_in_mid_trial(self):
        self.start()
        self.answer(2)
        self.wait_for_trial()
        self.program.kill()
        self.program.wait()
        self.start()
        self.finish()
        self.check_whole(cut_off=1)
        self.assertEqual(self.rows("SELECT end_reason FROM runs ORDER BY id"),
                         [("interrupted",), ("done",)])

    def test_the_disk_is_full_in_mid_trial(self):
        disk = self.folder / "disk"
        disk.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=400k", "none", disk],
                          stderr=subprocess.DEVNULL).returncode:
            self.skipTest("nothing can be mounted here")
        self.addCleanup(subprocess.run, ["umount", "-l", disk], check=True)
        self.database = disk / "study.db"
        self.start()
        self.answer(2)
        self.wait_for_trial()
        before = self.attempts()
        ballast = disk / "ballast"
        with open(ballast, "wb", buffering=0) as file:
            try:
                while True:
                    file.write(bytes(512))
            except OSError:
                pass
        # On a busy machine the note of a fault may find no space either: it ends in any case.
        self.press_until("2", lambda: self.program.poll() is not None)
        self.assertEqual(self.program.returncode, 1, self.messages())
        self.assertRegex(self.messages(), "disk|space")
        ballast.unlink()
        self.assertEqual(self.rows("PRAGMA integrity_check"), [("ok",)])
        self.assertEqual(self.attempts(), before, "the trial in hand is not said to be saved")
        self.start()
        self.finish()
        self.check_whole(cut_off=1)
        self.assertEqual(self.rows("SELECT end_reason FROM runs ORDER BY id"),
                         [("interrupted",), ("done",)])

    def test_a_signal_ends_it_regularly(self):
        self.start()
        self.answer(1)
        self.wait_for_trial()
        self.program.send_signal(signal.SIGTERM)
        wait_for("the end", lambda: self.program.poll() is not None)
        self.assertEqual(self.program.returncode, 1, self.messages())
        self.start()
        self.finish()
        self.check_whole(cut_off=1)

    def test_a_stalled_display_has_no_effect(self):
        self.write_protocol(response={**PROTOCOL["response"], "time_out_s": 1})
        self.start()
        self.screen.stall()
        stalled = self.done()
        # Trials run out of time and are recorded while nothing can be drawn.
        wait_for("trials without a display", lambda: self.done() >= stalled + 2)
        self.screen.go_on()
        wait_for("the last trial", lambda: self.done() == TRIALS)
        self.finish()
        rows = self.rows("SELECT ticks, missed_ticks, longest_period_ns FROM attempts "
                         "WHERE state = 'completed'")
        self.assertEqual(len(rows), TRIALS)
        for ticks, missed, longest in rows:
            self.assertGreaterEqual(ticks + missed, 180)
            self.assertLess(longest, 1_000_000_000)

    def test_a_stalled_computer_does_not_end_trials_with_the_mouse(self):
        self.start()
        self.wait_for_trial()
        self.assertEqual(self.done(), 0)
        for stands_still in (0.1, 2.5):  # s; forces of motors would be off after 25 ms
            self.program.send_signal(signal.SIGSTOP)
            time.sleep(stands_still)
            self.program.send_signal(signal.SIGCONT)
            time.sleep(0.5)
        self.assertEqual([state for *_, state in self.attempts()], ["running"])
        self.answer()
        missed, longest, faults = self.rows("SELECT missed_ticks, longest_period_ns, faults FROM attempts "
                                            "WHERE state = 'completed'")[0]
        self.assertGreaterEqual(missed, 500, "2.5 s at 200 Hz")
        self.assertGreaterEqual(longest, 2_490_000_000)  # it stood still within a period
        self.assertTrue(faults & 64, "missed-ticks")
        self.assertFalse(faults & 128, "forces-off")
        self.screen.keep(self.console, "session_stood_still")
        self.finish()
        self.check_whole(cut_off=0)

    def test_emergency_zero_until_the_fault_is_cleared(self):
        self.start()
        self.answer(1)
        self.wait_for_trial()
        self.screen.key("F12")
        wait_for("the cut-off", lambda: self.attempts()[-1][3] == "cut_off")
        before = len(self.attempts())
        self.screen.settled_picture(self.participant)
        self.screen.keep(self.console, "session_emergency")
        self.clear_and_go_on()
        self.screen.keep(self.console, "session_cleared")
        if len(self.attempts()) == before:
            self.press_until("space", lambda: len(self.attempts()) > before)
        self.finish()
        self.check_whole(cut_off=1)
        notes = [text for (text,) in self.rows("SELECT text FROM notes ORDER BY id")]
        self.assertIn("emergency zero: the key F12", notes)
        self.assertIn("fault cleared", notes)

    def forces_are_on(self):
        """Waits until a trial has forces: only then does it have a time zero and counts of ticks."""
        if self.halted():
            self.clear_and_go_on()
        running = self.rows("SELECT count(*) FROM attempts WHERE state = 'running'")
        return running and running[0][0] == 1 and self.screen.settled_picture(self.participant)

    def write_a_note(self):
        width, height = self.screen.size(self.console)
        self.screen.click(self.console, width - 200, height - 28)
        self.screen.do("type", "--delay", 100, "x")

    def emergencies(self):
        return sum(text == "emergency zero: the EMERGENCY button"
                   for (text,) in self.rows("SELECT text FROM notes"))

    def forces_are_shown_off(self):
        """The word beside "Servo" on the console is red."""
        return any(red > 180 and green < 140
                   for red, green, _ in self.screen.pixels(self.console, 140, 598, 120, 16))

    def click_emergency(self):
        """Its record waits in memory until the first trial has begun."""
        before = self.emergencies()
        self.screen.click(self.console, 100, 25)
        wait_for("the emergency", lambda: self.emergencies() > before if self.attempts()
                 else self.forces_are_shown_off())

    def click_button(self, row, column):
        """One of the six buttons: rows and columns from 0."""
        width, _ = self.screen.size(self.console)
        self.screen.click(self.console, width - (250 if column == 0 else 60), 400 + 40 * row)

    def write_a_reason(self):
        self.click_button(2, 1)
        self.screen.click(self.console, self.screen.size(self.console)[0] - 200, 455)
        self.screen.do("type", "--delay", 100, "why 1")

    def emergencies_on_pages(self):
        for page in ["instructions", "practice"]:
            self.click_emergency()
            self.screen.keep(self.console, f"emergency_{page}")
            self.clear_and_go_on()
            self.press_until("space", lambda: page == "instructions" or self.attempts())

    def emergencies_while_homing(self):
        homing = self.attempts()[-1]
        self.click_emergency()  # while waiting for the stylus, or just after
        wait_for("the cut-off", lambda: self.attempts()[homing[0] - 1][3] != "running")
        self.click_emergency()  # and again during the fault
        self.clear_and_go_on()

    def emergencies_over_dialogs(self):
        dialogs = {"none": lambda: None, "end": lambda: self.click_button(2, 1),
                   "reason": self.write_a_reason, "note": self.write_a_note}
        for name, open_dialog in dialogs.items():
            wait_for("a trial", lambda: self.forces_are_on())
            open_dialog()
            before = len(self.attempts())
            self.click_emergency()
            self.screen.keep(self.console, f"emergency_{name}")
            wait_for("the cut-off", lambda: self.attempts()[before - 1][3] == "cut_off")
            self.assertEqual(self.rows("SELECT cut_off_reason FROM attempts WHERE cut_off_reason "
                                       "IS NOT NULL ORDER BY id DESC LIMIT 1"),
                             [("zero force was asked for",)], name)
            if name in ("end", "reason"):
                self.screen.click(self.console, self.screen.size(self.console)[0] - 60, 493)  # back
            self.clear_and_go_on()

    def emergencies_after_answers(self):
        wait_for("a practice trial", lambda: self.forces_are_on())
        self.answer()
        self.click_emergency()  # during the feedback, or right after it
        self.screen.keep(self.console, "emergency_feedback")
        self.clear_and_go_on()
        self.answer(4 - 1)  # the rest of the practice
        self.click_emergency()  # between the blocks
        self.screen.keep(self.console, "emergency_between")
        self.screen.keep(self.participant, "emergency_between_page")
        self.assertEqual(self.attempts()[-1][3], "completed", "no trial begins before the fault is cleared")
        before = len(self.attempts())
        self.clear_and_go_on()
        # The next trial begins at once or, where a page is shown, with a key.
        self.press_until("space", lambda: len(self.attempts()) > before)

    def test_the_emergency_button_works_in_every_state_and_over_every_dialog(self):
        self.write_protocol(material={"stiffness_n_per_m": 100}, practice={"repetitions": 1},
                            breaks={"min_seconds": 3},
                            texts={"instructions": "Feel.", "practice": "Try.", "break": "Rest.",
                                   "end": "Thanks."}, home={"rest_s": 1, "margin_m": 0.01})
        self.start(device="simulated", to_the_first_trial=False)
        self.emergencies_on_pages()
        self.emergencies_while_homing()
        self.emergencies_over_dialogs()
        self.emergencies_after_answers()


class NoDisplay(unittest.TestCase):
    def test_the_mouse_needs_one(self):
        with tempfile.TemporaryDirectory() as folder:
            protocol = pathlib.Path(folder) / "protocol.json"
            protocol.write_text(json.dumps(PROTOCOL))
            environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
            done = subprocess.run(
                [PALPATE, "run", protocol, "--db", f"{folder}/study.db", "--participant", "P01",
                 "--device", "mouse"], env=environment, text=True, stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn("no graphical display", done.stderr)


if __name__ == "__main__":
    unittest.main()
