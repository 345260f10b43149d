"""palpate run from outside, on a terminal: a session, its commands and wrong usage.

Usage: run_session_test.py PALPATE
"""

import csv
import json
import os
import re
import stat
import subprocess
import unittest

from live_case import FEELING, PALPATE, PROTOCOL, Live


class Whole(Live):
    def test_a_session_from_welcome_to_good_bye(self):
        terminal = self.begin("--consent", "v2 2026-01", "--hand", "left", "--response-latency", "0.012")
        self.assertIn("participant P01 has number 1; session 1 of 1", terminal.text)
        self.assertIn("Welcome, \u00dcbung", terminal.text)
        terminal.type("x1")  # a key without a meaning is ignored
        self.finish(terminal, "2")
        self.assertIn("have a rest", terminal.text)
        self.assertIn("good bye", terminal.text)
        self.assertIn("4 of 4 trials on record; done", terminal.text)
        rows = self.export()
        self.assertEqual([row["trial"] for row in rows], ["1", "2", "3", "4"])
        self.assertEqual([row["response"] for row in rows], ["ball", "box", "box", "box"])
        for row in rows:
            self.assertEqual(row["correct"], str(int(row["shape"] == row["response"])))
            self.assertEqual((row["device"], row["simulated"], row["response_device"]), ("simulated", "1", "keyboard"))
            self.assertGreater(float(row["response_time"]), 0)
        (consent, at, hand, latency, started, protocol), = self.sql(
            "SELECT consent_version, consent_utc_ns, hand, response_latency, started_utc_ns, protocols.text "
            "FROM runs, protocols")
        self.assertEqual((consent, hand, latency), ("v2 2026-01", "left", 0.012))
        self.assertEqual(at, started)
        self.assertEqual(json.loads(protocol), PROTOCOL)
        self.assertEqual(stat.S_IMODE(os.stat(self.db).st_mode), 0o600)

    def test_the_terminal_never_names_the_shape(self):
        terminal = self.begin(stimuli=[{"name": "SECRET1", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1}],
                              response={"keys": {"1": "SECRET1"}})
        shown = terminal.text.count("SECRET1")
        trials = terminal.text.count("1 SECRET1")
        self.assertEqual(shown, trials, "only the key map says it")
        terminal.type("1")
        self.finish(terminal)

    def test_participants_get_their_numbers_orders_and_sessions(self):
        sessions = {"sessions": {"count": 2}}
        with self.run_session("--number", "5", **sessions) as terminal:
            terminal.wait_for("participant P01 has number 5; session 1 of 2")
            self.finish(terminal)
        with self.run_session(code="P02", **sessions) as terminal:
            terminal.wait_for("participant P02 has number 1; session 1 of 2")
            terminal.type(":quit\n")
            self.finish(terminal)
            self.assertIn("participant P02 (not enrolled)", terminal.text)
        with self.run_session(**sessions) as terminal:
            terminal.wait_for("session 1 was also today", "has number 5; session 2 of 2")
            self.finish(terminal)
        with self.run_session(**sessions) as terminal:
            self.assertEqual(terminal.finish(), 2)
            self.assertIn("participant P01 has completed every session", terminal.text)
        with self.run_session("--number", "4", **sessions) as terminal:
            self.assertEqual(terminal.finish(), 2)
            self.assertIn("has number 5, not 4", terminal.text)
        schedule = subprocess.run([PALPATE, "schedule", self.protocol(**sessions), "--participant", "5", "--format",
                                   "csv"], check=True, capture_output=True, text=True).stdout
        planned = [(row["session"], row["trial"], row["shape"], float(row["orientation_w"]))
                   for row in csv.DictReader(schedule.splitlines())]
        done = [(row["session"], row["trial"], row["shape"], float(row["orientation_w"]))
                for row in self.export() if row["participant_id"] == "P01"]
        self.assertEqual(done, planned)

    def test_practice_continues_to_the_criterion_with_feedback(self):
        practice = {"repetitions": 1, "criterion": 1.0, "max_rounds": 2}
        terminal = self.begin(practice=practice, repetitions=1, blocks_per_renderer=1,
                              texts={"instructions": "go", "practice": "try it"})
        terminal.type("1")
        self.finish(terminal)
        rows = self.export()
        self.assertEqual([row["practice"] for row in rows], list("111100"))
        self.assertEqual(terminal.text.count("\u2713"), 2)
        self.assertEqual(terminal.text.count("\u2717"), 2)

    def test_lines_break_between_words_and_no_status_is_empty(self):
        terminal = self.begin(columns=40)
        terminal.type(":note " + "abcdefgh " * 12 + "\n")
        terminal.wait_for("* note:")
        terminal.type("1")
        self.finish(terminal)
        said = terminal.text[terminal.text.index("* note:"):]
        note = re.split(r"\n[*\[]", said)[0]
        self.assertLessEqual(max(map(len, note.splitlines())), 40)
        self.assertEqual(note.replace("\n", " ").split(), ["*", "note:"] + ["abcdefgh"] * 12)
        self.assertNotIn("[]", terminal.text)

    def test_a_page_uses_the_protocols_texts_for_go_and_replies(self):
        texts = {"ready": "Bereit", "go": "Los", "other_key": "Diese Taste gilt nicht"}
        terminal = self.begin(texts=texts, response={"keys": {
            "1": {"stimulus": "ball", "label": "Kugel"}, "2": {"stimulus": "box", "label": "W\u00fcrfel"}}})
        self.assertIn("1 Kugel   2 W\u00fcrfel", terminal.text)
        self.assertLess(terminal.text.index("Bereit"), terminal.text.index("Los   1 Kugel"))
        terminal.type("7")
        terminal.wait_for("Diese Taste gilt nicht")
        terminal.type("1")
        self.finish(terminal)
        self.assertEqual({row["response"] for row in self.export()}, {"ball"})

    def test_time_out(self):
        terminal = self.begin(response={"keys": {"1": "ball", "2": "box"}, "time_out_s": 1}, repetitions=1,
                              blocks_per_renderer=1)
        terminal.wait_for("trial 2 of 2")
        self.finish(terminal)
        row = self.export()[0]
        self.assertEqual((row["timed_out"], row["response"], row["response_time"], row["before_contact"]),
                         ("1", "", "1", "0"))

    def test_an_answer_before_contact_is_kept_and_flagged(self):
        terminal = self.begin()
        terminal.type("1")
        self.finish(terminal)
        rows = self.export()
        self.assertEqual([row["before_contact"] for row in rows],
                         [str(int(row["first_contact_time"] == "")) for row in rows])
        self.assertEqual(terminal.text.count("answered before the first contact"),
                         sum(row["before_contact"] == "1" for row in rows))


class Commands(Live):
    def test_repeat_cuts_the_trial_off_and_shows_it_again(self):
        terminal = self.begin()
        terminal.type(":repeat\n")
        terminal.wait_for("trial 1 was cut off: repeated by the experimenter")
        self.finish(terminal)
        self.assertEqual(self.attempts(), [(1, 1, "cut_off"), (1, 2, "completed"), (2, 1, "completed"),
                                           (3, 1, "completed"), (4, 1, "completed")])
        self.assertEqual([row["attempt"] for row in self.export()], ["2", "1", "1", "1"])

    def test_pause_holds_the_next_trial_and_ignores_keys(self):
        terminal = self.begin()
        terminal.type(":pause\n")
        terminal.wait_for("pause after this trial")
        terminal.type("1")
        terminal.wait_for("[paused, ")
        terminal.type("1 2:note she asked for water\n")
        terminal.wait_for("note: she asked for water")
        terminal.type(":go\n")
        self.finish(terminal)
        self.assertEqual(len(self.export()), 4)
        self.assertEqual(self.notes(), ["she asked for water"])

    def test_a_stop_after_the_trial_can_be_resumed_another_day(self):
        terminal = self.begin()
        terminal.type(":stop\n1")
        self.finish(terminal)
        self.assertIn("1 of 4 trials on record; paused", terminal.text)
        with self.run_session() as again:
            self.finish(again)
        self.assertEqual(self.ends(), ["paused", "done"])
        self.assertEqual(len(self.export()), 4)

    def test_stop_after_the_block(self):
        terminal = self.begin()
        terminal.type(":stop block\n1")
        terminal.wait_for(FEELING)
        terminal.type("1")
        self.finish(terminal)
        self.assertIn("2 of 4 trials on record; paused", terminal.text)

    def test_quit_and_withdrawal_are_recorded_with_their_reason(self):
        terminal = self.begin()
        terminal.type(":quit feels unwell\n")
        self.finish(terminal)
        self.assertEqual(self.ends(), ["aborted"])
        self.assertEqual(self.notes(), ["ended: ended by the experimenter: feels unwell"])
        self.assertEqual(self.attempts(), [(1, 1, "cut_off")])
        terminal = self.begin()
        terminal.type(":quit withdrawn\n")
        self.finish(terminal)
        self.assertEqual(self.ends(), ["aborted", "withdrawn"])
        with self.run_session() as refused:
            self.assertEqual(refused.finish(), 2)
            self.assertIn("--after-withdrawal", refused.text)

    def test_a_withdrawn_participant_is_resumed_only_on_request(self):
        terminal = self.begin()
        terminal.type(":QUIT Withdrawn.\n")
        self.finish(terminal)
        self.assertIn("; withdrawn", terminal.text)
        for changes in ({}, {"texts": {"instructions": "other words"}}):
            with self.run_session(**changes) as refused:
                self.assertEqual(refused.finish(), 2)
                self.assertIn("--after-withdrawal", refused.text)
        with self.run_session("--after-withdrawal") as again:
            again.wait_for("[space bar: go on]")
            again.type(":stop\n ")
            self.finish(again)
        self.assertEqual(self.ends(), ["withdrawn", "paused"])
        self.assertIn("begun again after a withdrawal", self.notes())
        with self.run_session("--after-withdrawal") as mistaken:
            self.assertEqual(mistaken.finish(), 2)
            self.assertIn("has not withdrawn", mistaken.text)
        with self.run_session() as on:
            self.finish(on)
        self.assertEqual(self.ends()[-1], "done")

    def test_a_resumed_session_says_so_first(self):
        terminal = self.begin()
        self.assertNotIn("continues with trial", terminal.text)
        terminal.type(":stop\n1")
        self.finish(terminal)
        with self.run_session() as again:
            again.wait_for("1 of 4 trials done, last run today ", " (paused), continues with trial 2")
            self.finish(again)

    def test_a_stop_can_be_cancelled(self):
        terminal = self.begin()
        terminal.type(":stop\n:stop\n1")
        self.finish(terminal)
        self.assertIn("the stop is cancelled", terminal.text)
        self.assertEqual(self.ends(), ["done"])

    def test_after_an_abort_the_end_text_is_not_shown(self):
        terminal = self.begin()
        terminal.type(":quit\n")
        self.finish(terminal)
        self.assertNotIn("good bye", terminal.text)

    def test_the_end_does_not_count_as_a_trial(self):
        terminal = self.begin()
        self.finish(terminal)
        self.assertRegex(terminal.text, r"\[end, [^\n]*trial 4 of 4")

    def test_emergency_holds_until_it_is_cleared(self):
        terminal = self.begin()
        terminal.type("\x1b")
        terminal.wait_for("trial 1 was cut off: zero force was asked for")
        terminal.wait_for("[fault, ")
        terminal.type(":go\n")
        terminal.wait_for("clear the fault first")
        terminal.type(":clear\n")
        terminal.wait_for("fault cleared")
        terminal.type(":go\n")
        self.finish(terminal)
        self.assertEqual(self.attempts()[:2], [(1, 1, "cut_off"), (1, 2, "completed")])
        self.assertEqual(self.notes(), ["emergency zero: the key Escape", "fault cleared"])

    def test_alt_with_a_key_is_a_reported_emergency_not_an_answer(self):
        terminal = self.begin()
        terminal.type("\x1b1")
        terminal.wait_for("EMERGENCY by the key Alt+1: forces are off")
        self.finish(terminal)
        self.assertEqual(self.attempts()[:2], [(1, 1, "cut_off"), (1, 2, "completed")])
        self.assertEqual(self.notes()[0], "emergency zero: the key Alt+1")

    def test_a_wrong_command_gets_the_list(self):
        terminal = self.begin()
        before = terminal.text.count(":pause ")
        terminal.type(":nonsense\n")
        terminal.wait_for(":pause ")
        self.assertEqual(terminal.text.count(":pause "), before + 1)
        terminal.type("1")
        self.finish(terminal)


class Usage(Live):
    def test_wrong_usage_is_status_2_and_leaves_nothing(self):
        good = {"--db": self.db, "--participant": "P01", "--device": "simulated"}
        too_fast = {"servo": {"rate_hz": 1000}, "workspace": {"centre_m": [1, 0, 0]}}
        for changes, word, protocol in (
                ({"--participant": "Jane Doe"}, "pseudonym", {}), ({"--device": "phantom"}, "there are: falcon", {}),
                ({"--hand": "both"}, "left or right", {}), ({"--number": "0"}, "1 or more", {}),
                ({"--session": "0"}, "1 or more", {}), ({"--response-latency": "-1"}, "0 or more", {}),
                ({"--markers": "smoke"}, "udp:HOST:PORT", {}), ({"--markers": "udp:localhost"}, "udp:HOST:PORT", {}),
                ({"--device": "mouse"}, "needs the window", {}), ({}, "which reaches", too_fast)):
            options = [str(part) for pair in (good | changes).items() for part in pair]
            done = subprocess.run([PALPATE, "run", self.protocol(**protocol), *options, "--no-window"],
                                  stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(word, done.stderr)
            self.assertEqual(done.stdout, "")
        for missing in good:
            options = [str(part) for pair in good.items() if pair[0] != missing for part in pair]
            done = subprocess.run([PALPATE, "run", self.protocol(), *options], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(missing[2:], done.stderr)
        self.assertEqual([path.name for path in self.dir.iterdir()], ["protocol.json"])


if __name__ == "__main__":
    unittest.main()
