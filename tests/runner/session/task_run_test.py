"""palpate run with protocols of version 2 on a terminal: every task, pages, kills and resumption.

Usage: task_run_test.py PALPATE
"""

import array
import csv
import hashlib
import json
import math
import os
import pty
import signal
import subprocess
import time
import unittest

from task_case import PALPATE, PROTOCOL, Task

PAGES = [
    {"name": "consent", "kind": "consent", "consent_version": "3b", "text": "YOU MAY STOP\fDO YOU TAKE PART"},
    {"name": "you", "kind": "questionnaire", "items": [
        {"name": "hand", "kind": "choice", "question": "WHICH HAND", "choices": ["left", "right"]},
        {"name": "age", "kind": "number", "question": "HOW OLD", "min": 18, "max": 120},
        {"name": "job", "kind": "text", "question": "WHAT WORK"},
        {"name": "tired", "kind": "scale", "question": "HOW TIRED", "labels": ["not", "very"]},
        {"name": "more", "kind": "text", "question": "ANYTHING ELSE", "required": False}]},
    {"name": "how", "kind": "instructions", "text": "FIRST SCREEN\fSECOND SCREEN"},
]


class EveryTask(Task):
    def test_identify_with_feedback_and_instructions_that_go_back_and_forth(self):
        terminal = self.start("ident")
        self.play(terminal, ("WELCOME", " "), ("ABOUT SHAPES", " "), ("MORE ABOUT SHAPES", "\x1b[D"),
                  ("ABOUT SHAPES", " "), ("MORE ABOUT SHAPES", " "),
                  ("1 ball   2 box", "x"), ("This key does nothing now.", "1"), ("1 ball   2 box", "1"),
                  ("GOOD BYE", " "))
        self.end(terminal)
        self.assertEqual([terminal.text.count(mark) for mark in "\u2713\u2717"], [1, 1])
        rows = self.export()
        self.assertEqual([row["response"] for row in rows], ["ball", "ball"])
        self.assertEqual(sorted(row["correct"] for row in rows), ["0", "1"])

    def test_compare_with_confidence(self):
        terminal = self.start("comp")
        first = ("1 / 2\nSpace bar", "1")  # no answer yet
        self.play(terminal, ("WELCOME", " "), first, ("does nothing", " "), ("2 / 2\nWHICH WAS STIFFER", "1"),
                  ("HOW SURE", ""), ("1 guessed   2 sure", "3"), ("does nothing", "2"),
                  ("1 / 2\nSpace bar", " "), ("2 / 2\nWHICH WAS STIFFER", "2"), ("1 guessed   2 sure", "1"),
                  ("GOOD BYE", " "))
        self.end(terminal)
        rows = self.export()
        self.assertEqual([(row["response"], row["confidence"]) for row in rows], [("1", "5"), ("2", "1")])
        for row in rows:
            chosen_comparison = row["comparison_interval"] == row["response"]
            self.assertEqual(row["success"], str(int(chosen_comparison)))
            stiffer = float(row["level"]) > 60
            self.assertEqual(row["correct"], str(int(chosen_comparison == stiffer)))
            onsets, ends = ([float(at) for at in row[column].split()] if " " in row[column] else
                            [float(at) for at in row[column].replace(";", ",").split(",")]
                            for column in ("interval_onsets", "interval_ends"))
            self.assertGreaterEqual(onsets[1] - ends[0], 0.2, "at rest between the intervals")

    def test_three_intervals_that_end_by_themselves_and_an_answer_without_forces(self):
        terminal = self.start("three")
        self.play(terminal, ("WELCOME", " "), ("1 / 3", ""), ("2 / 3", ""), ("3 / 3", ""), ("\nWHICH WAS ODD", "3"),
                  ("GOOD BYE", " "))
        self.end(terminal)
        self.assertEqual(self.export()[0]["response"], "3")

    def test_detect_with_catch_trials(self):
        terminal = self.start("detect")
        self.play(terminal, ("WELCOME", " "), *[("ANYTHING", "1")] * 4, ("GOOD BYE", " "))
        self.end(terminal)
        rows = self.export()
        self.assertEqual(sorted((row["catch_trial"], row["correct"]) for row in rows),
                         [("0", "1"), ("0", "1"), ("1", "0"), ("1", "0")])

    def test_typed_numbers_are_checked_with_a_message(self):
        terminal = self.start("number", "scale")
        self.play(terminal, ("WELCOME", " "), ("Type a number", "\n"),
                  ("Please type an answer first. (-10 \u2013 100)", "12,55"), ("> 12.55", "\x7f"), ("> 12.5\n", "9"),
                  ("> 12.59", "9"), ("> 12.599", "\x7f\x7f"), ("> 12.5\n", "x"), ("does nothing", "\x7f" * 9), ("> ", "101\n"),
                  ("Please type another number: (-10 \u2013 100)", "\x7f" * 3), ("> ", "-7,5\n"),
                  ("1 hard   2 soft", "2"), ("GOOD BYE", " "))
        self.end(terminal)
        self.assertEqual([(row["block_name"], row["number"], row["response"]) for row in self.export()],
                         [("number", "-7.5", "'-7.5"), ("scale", "1", "1")])  # guarded as a text

    def test_adjust_from_below_and_above(self):
        terminal = self.start("adjust")
        self.play(terminal, ("WELCOME", " "), ("1 / 2\nMAKE THEM EQUAL", "2"))
        # Keys in a burst: each is a turn.
        terminal.type("22")
        self.play(terminal, ("", "3"), ("2 / 2\nMAKE THEM EQUAL", "2"), ("does nothing", "3"),
                  ("1 / 2\nMAKE THEM EQUAL", "4"), ("1 / 2\nMAKE THEM EQUAL", "1"), ("", "4"), ("GOOD BYE", " "))
        self.end(terminal)
        rows = self.export()
        self.assertEqual([(row["level"], row["number"]) for row in rows], [("30", "60"), ("90", "80")])


class Pages(Task):
    def answers(self):
        return self.sql("SELECT page, item, version, answer FROM page_answers ORDER BY id")

    def begin(self, *blocks, **changes):
        terminal = self.start(*blocks, pages=PAGES + changes.pop("pages", []), **changes)
        self.play(terminal, ("YOU MAY STOP", " "), ("DO YOU TAKE PART", ""))
        return terminal

    def test_questionnaires_before_between_and_after(self):
        more = [{"name": "mid", "kind": "questionnaire", "when": "between", "block": "scale",
                 "items": [{"name": "n", "kind": "number", "question": "HOW MANY"}]},
                {"name": "last", "kind": "questionnaire", "when": "after",
                 "items": [{"name": "words", "kind": "text", "question": "LAST WORDS"}]}]
        terminal = self.begin("number", "scale", pages=more)
        self.play(terminal, ("1 I agree   2 I do not agree", "x"), ("does nothing", "1"),
                  ("1 left   2 right", "2"), ("HOW OLD", "7\n"),
                  ("another number: (18 \u2013 120)", "\x7f42\n"), ("WHAT WORK", "  \n"),
                  ("answer first", "\x7f\x7fJ\u00fc x\x7f?"), ("> J\u00fc ?", "\n"), ("1 not   2 very", "1"), ("ANYTHING ELSE", "\n"),
                  ("FIRST SCREEN", " "), ("SECOND SCREEN", "\x1b[D"), ("FIRST SCREEN", " "), ("SECOND SCREEN", " "),
                  ("WELCOME", " "), ("HOW HARD", "5\n"), ("HOW MANY", "-3\n"), ("1 hard   2 soft", "1"),
                  ("LAST WORDS", "bye\n"), ("GOOD BYE", " "))
        self.end(terminal)
        self.assertNotIn("no consent is recorded", terminal.text)
        self.assertEqual(self.answers(), [
            ("consent", "consent", "3b", "agree"), ("you", "hand", "", "right"), ("you", "age", "", "42"),
            ("you", "job", "", "J\u00fc ?"), ("you", "tired", "", "not"), ("you", "more", "", ""),
            ("mid", "n", "", "-3"), ("last", "words", "", "bye")])
        (digest,), = self.sql("SELECT text_sha256 FROM page_answers WHERE page = 'consent'")
        self.assertEqual(digest, hashlib.sha256(PAGES[0]["text"].encode()).hexdigest())

    def test_without_consent_nothing_is_presented_or_stored(self):
        terminal = self.begin("number")
        self.play(terminal, ("1 I agree   2 I do not agree", "2"))
        self.end(terminal)
        self.assertIn("consent was not given", terminal.text)
        self.assertNotIn("WELCOME", terminal.text)
        self.assertNotIn("[trial", terminal.text)
        self.assertEqual(self.sql("SELECT count(*) FROM attempts"), [(0,)])
        self.assertEqual(self.sql("SELECT count(*) FROM participants"), [(0,)])
        # Asked again, with another answer.
        again = self.begin("number")
        self.play(again, ("1 I agree   2 I do not agree", "1"), ("WHICH HAND", ""))
        again.kill()
        self.assertEqual(self.answers(), [("consent", "consent", "3b", "agree")])

    def test_each_answer_is_on_disk_before_the_next_question(self):
        for end in (signal.SIGKILL, signal.SIGINT):
            self.db = self.dir / f"{end}.db"
            terminal = self.start("number", pages=PAGES[1:2])
            self.play(terminal, ("1 left   2 right", "2"), ("HOW OLD", "42\n"), ("WHAT WORK", "some"), ("> some", ""))
            terminal.send_signal(end)
            terminal.finish()
            self.assertEqual([(item, answer) for _, item, _, answer in self.answers()],
                             [("hand", "right"), ("age", "42")])
            again = self.start("number", pages=PAGES[1:2])
            self.play(again, ("WHAT WORK", "\x1b[D"), ("HOW OLD", ""), ("> 42", "\n"), ("WHAT WORK", "w\n"),
                      ("1 not   2 very", "1"), ("ANYTHING ELSE", "\n"), ("WELCOME", " "), ("HOW HARD", "5\n"),
                      ("GOOD BYE", " "))
            self.end(again)
            self.assertNotIn("WHICH HAND", again.text)
            self.assertEqual(len(self.answers()), 5)

    def test_a_wrong_key_is_corrected_by_going_back_and_later_on_the_console(self):
        terminal = self.start("number", pages=PAGES[1:2])
        self.play(terminal, ("1 left   2 right", "1"), ("(18 \u2013 120)", "\x1b[D"), ("*1 left   2 right", "2"),
                  ("HOW OLD", "42\n"), ("WHAT WORK", "w\n"), ("1 not   2 very", "1"), ("ANYTHING ELSE", "\n"),
                  ("WELCOME", ":correct you age 420\n"), ("'420' is not a valid answer", ":correct you nose 4\n"),
                  ("there is no answer", ":correct you age 43\n"), ("corrected: you, age", ":correct you tired very\n"),
                  ("corrected: you, tired", " "), ("HOW HARD", "5\n"), ("GOOD BYE", " "))
        self.end(terminal)
        self.assertEqual([(item, answer) for _, item, _, answer in self.answers()],
                         [("hand", "left"), ("hand", "right"), ("age", "42"), ("job", "w"), ("tired", "not"),
                          ("more", ""), ("age", "43"), ("tired", "very")])
        self.assertEqual(self.sql("SELECT count(*) FROM notes WHERE text LIKE '%answer_corrected%'"), [(2,)])
        out = self.dir / "out.csv"
        subprocess.run([PALPATE, "export", "--db", self.db, "--format", "csv", "--out", out, "--pages"], check=True,
                       capture_output=True)
        table, = self.dir.glob("*pages*.csv")
        with open(table, newline="", encoding="utf-8") as rows:
            self.assertEqual([row["replaced"] for row in csv.DictReader(rows)], list("10101000"))

    def test_an_answer_is_on_disk_before_confidence_is_asked(self):
        terminal = self.start("comp")
        self.play(terminal, ("WELCOME", " "), ("1 / 2", " "), ("2 / 2", "1"), ("1 guessed   2 sure", ""))
        terminal.kill()
        (note,), = self.sql("SELECT text FROM notes WHERE text LIKE '%answered_before_confidence%'")
        self.assertEqual(json.loads(note)["answered_before_confidence"]["response"], "1")

    def test_after_a_kill_in_the_last_questionnaire_only_that_is_repeated(self):
        last = {"name": "last", "kind": "questionnaire", "when": "after",
                "items": [{"name": "words", "kind": "text", "question": "LAST WORDS"}]}
        terminal = self.start("number", pages=[last])
        self.play(terminal, ("WELCOME", " "), ("HOW HARD", "5\n"), ("LAST WORDS", "b"), ("> b", ""))
        terminal.kill()
        again = self.start("number", pages=[last])
        self.play(again, ("LAST WORDS", "bye\n"), ("GOOD BYE", " "))
        self.end(again)
        self.assertNotIn("WELCOME", again.text)
        self.assertEqual(self.answers(), [("last", "words", "", "bye")])
        self.assertEqual(len(self.export()), 1)
        self.assertEqual([end for (end,) in self.sql("SELECT end_reason FROM runs ORDER BY id")],
                         ["interrupted", "done"])


class ZeroForce(Task):
    def stop_and_go_on(self, terminal, key="\x1b"):
        terminal.type(key)
        terminal.wait_for("EMERGENCY by")
        terminal.type(":clear\n")
        while terminal.wait_for("fault cleared;", "no fault to clear") != "fault cleared;":
            terminal.type(":clear\n")  # the trial is being cut off
        terminal.type(":go\n")
        terminal.wait_for("going on")

    def test_the_emergency_key_works_in_every_state_of_a_trial_and_while_typing(self):
        terminal = self.start("number", "comp", pages=PAGES[1:2])
        self.play(terminal, ("1 left   2 right", ""))
        self.stop_and_go_on(terminal)
        self.play(terminal, ("", "1"), ("HOW OLD", "4"))
        self.stop_and_go_on(terminal, "\x1b[24~")  # F12, in the middle of a number
        self.play(terminal, ("", "2\n"), ("WHAT WORK", "w"))
        self.stop_and_go_on(terminal)
        self.play(terminal, ("", "\n"), ("1 not   2 very", "1"), ("ANYTHING ELSE", "\n"), ("WELCOME", " "),
                  ("HOW HARD", "12"))
        self.stop_and_go_on(terminal)  # in a trial: it is shown again
        self.play(terminal, ("HOW HARD", "7\n"), ("1 / 2", ""))
        self.stop_and_go_on(terminal)
        self.play(terminal, ("1 / 2", " "), ("2 / 2", "1"), ("1 guessed   2 sure", ""))
        self.stop_and_go_on(terminal)  # while confidence is asked
        self.play(terminal, ("1 / 2", " "), ("2 / 2", "1"), ("1 guessed   2 sure", "2"),
                  ("1 / 2", " "), ("2 / 2", "1"), ("1 guessed   2 sure", "2"), ("GOOD BYE", " "))
        self.end(terminal)
        self.assertEqual([(row["block_name"], row["number"], row["attempt"]) for row in self.export()],
                         [("number", "7", "2"), ("comp", "", "3"), ("comp", "", "1")])
        self.assertEqual(self.sql("SELECT answer FROM page_answers WHERE item = 'age'"), [("42",)])
        self.assertEqual(self.sql("SELECT DISTINCT cut_off_reason FROM attempts WHERE state = 'cut_off'"),
                         [("zero force was asked for",)])


class Periphery(Task):
    IDENT = {"responses": {"box": {"A": "1", "B": "2", "0x05": "space"}}}

    def notes(self):
        return [json.loads(text) for (text,) in self.sql("SELECT text FROM notes ORDER BY id") if text.startswith("{")]

    def test_a_response_box_that_is_unplugged_in_a_trial(self):
        box, plug = pty.openpty()
        terminal = self.start("ident", options=["--response-box", os.ttyname(plug)], **self.IDENT)
        self.play(terminal, ("WELCOME", ""))
        os.write(box, b"\x05")
        self.play(terminal, ("ABOUT SHAPES", ""))
        os.write(box, b"\x05")
        self.play(terminal, ("MORE ABOUT SHAPES", ""))
        os.write(box, b"\x05")
        self.play(terminal, ("[trial, ", ""))
        os.write(box, b"\x00z" + b"AB" * 200)  # one answer, and none of the next trial
        self.play(terminal, ("stands for no key (0x00)", ""), ("[trial, ", ""))
        os.close(box)
        os.close(plug)
        self.play(terminal, ("the response box is unplugged: answer by keyboard", "2"), ("GOOD BYE", " "))
        self.end(terminal)
        self.assertEqual([row["response"] for row in self.export()], ["ball", "box"])
        told = [note["input_trouble"] for note in self.notes() if "input_trouble" in note]
        self.assertEqual(len(told), 2, told)
        self.assertIn("0x00", told[0])
        self.assertIn("is unplugged", told[1])
        self.assertEqual(self.sql("SELECT response_device FROM runs"), [("keyboard, serial response box",)])

    def test_tones_have_their_pitches_and_are_recorded(self):
        sound = self.dir / "sound.raw"
        terminal = self.start("ident", options=["--sound-device", f"file:{sound},raw"], home={"rest_s": 0.5},
                              sounds={"ready": True, "go": True, "feedback": True, "level_db": -18})
        self.play(terminal, ("WELCOME", " "), ("ABOUT", " "), ("MORE", " "), ("[trial, ", ""))
        time.sleep(0.3)
        self.play(terminal, ("", "1"), ("[trial, ", ""))
        time.sleep(0.3)
        self.play(terminal, ("", "1"), ("GOOD BYE", " "))
        self.end(terminal)
        left = array.array("h", sound.read_bytes())[0::2]
        rate = 48000
        tones, begin = [], None
        for at in range(0, len(left), 480):
            if any(left[at:at + 480]) and begin is None:
                begin = at
            elif begin is not None and not any(left[at:at + 480]):
                tones.append(left[begin:at])
                begin = None

        def pitch(tone, at):  # Hz, of 40 ms
            part = tone[int(at * rate):int((at + 0.04) * rate)]
            return sum(a < 0 <= b for a, b in zip(part, part[1:])) / 0.04
        self.assertEqual(len(tones), 6, "ready, go, feedback, twice")
        pitches = [[round(pitch(tone, at), -1) for at in (0.03, 0.13) if at < len(tone) / rate - 0.02] for tone in tones]
        for heard, expected in zip(pitches[0:2] + pitches[3:5], [[440], [880]] * 2):
            self.assertAlmostEqual(heard[0], expected[0], delta=30)
        feedback = sorted([pitches[2], pitches[5]])
        self.assertAlmostEqual(feedback[0][0], 220, delta=30)  # wrong
        for heard, expected in zip(feedback[1], (660, 990)):  # right
            self.assertAlmostEqual(heard, expected, delta=30)
        for tone in tones:
            steady = tone[960:3840]
            level = 10 * math.log10(sum(x * x for x in steady) / len(steady) / 32767 ** 2)
            self.assertAlmostEqual(level, -18, delta=0.5)
        self.assertEqual([note["level_db"] for note in self.notes() if note.get("sounds") == "on"], [-18])

    def test_contacts_are_heard_where_the_stimulus_has_a_sound(self):
        sound = self.dir / "sound.raw"
        ball, box = PROTOCOL["stimuli"]
        rings = {"kind": "modal", "gain_per_m_per_s": 5, "pan": -1, "modes": [{"frequency_hz": 800, "decay_per_s": 30}]}
        terminal = self.start("ident", options=["--sound-device", f"file:{sound},raw"], stimuli=[{**ball, "sound": rings}, box])
        self.play(terminal, ("WELCOME", " "), ("ABOUT", " "), ("MORE", " "))
        for _ in range(2):  # the simulated hand moves to and fro
            self.play(terminal, ("[trial, ", ""))
            time.sleep(1.5)
            self.play(terminal, ("", "1"))
        self.play(terminal, ("GOOD BYE", " "))
        self.end(terminal)
        left, right = (array.array("h", sound.read_bytes())[ear::2] for ear in (0, 1))
        self.assertFalse(any(right), "it is heard at the left ear alone")
        self.assertGreater(max(left), 300)
        self.assertLessEqual(max(left), 32767 * 10 ** (-12 / 20))
        begin = next(i for i, value in enumerate(left) if value)
        part = left[begin:begin + 1920]
        self.assertAlmostEqual(sum(a < 0 <= b for a, b in zip(part, part[1:])) / 0.04, 800, delta=30)
        latency, = (note["latency_s"] for note in self.notes() if note.get("sounds") == "on")
        rows = {row["shape"]: row["sound_lag_ms"] for row in self.export()}
        self.assertEqual(rows["box"], "")
        self.assertGreaterEqual(float(rows["ball"]) + 0.05, 1000 * latency)

    def test_omitted_sounds_are_recorded(self):
        terminal = self.start("ident", options=["--without-noise", "--sound-device", "none such"],
                              sounds={"go": True})
        self.play(terminal, ("WITHOUT the protocol's sounds", ""), ("WELCOME", " "), ("ABOUT", " "), ("MORE", " "),
                  ("[trial, ", "1"), ("[trial, ", "1"), ("GOOD BYE", " "))
        self.end(terminal)
        self.assertEqual([note for note in self.notes() if "sounds" in note], [{"sounds": "left out"}])


class Killed(Task):
    def trials(self, db):
        columns = ("trial", "block_name", "track", "level", "comparison_interval", "response", "success", "correct")
        return [tuple(row[column] for column in columns) for row in self.export(db)]

    def go(self, db, kill_after=None):
        self.answer_all(["stairs", "detect"], db, before_trial=lambda count: count == kill_after)

    def test_a_kill_at_any_trial_leaves_the_rest_the_same(self):
        whole = self.dir / "whole.db"
        self.go(whole)
        expected = self.trials(whole)
        self.assertEqual(len(expected), 9)
        self.assertGreater(len({row[3] for row in expected[:5]}), 2, "levels follow the answers")
        broken = self.dir / "broken.db"
        for count in range(9):
            self.go(broken, kill_after=count)
        self.go(broken)
        self.assertEqual(self.trials(broken), expected)
        ends = [end for (end,) in self.sql("SELECT end_reason FROM runs ORDER BY id", broken)]
        self.assertEqual(ends, ["interrupted"] * 9 + ["done"])


if __name__ == "__main__":
    unittest.main()
