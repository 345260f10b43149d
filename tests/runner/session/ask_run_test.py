"""palpate run --ask on a terminal with an asker that is a process of its own: it answers, hangs, is killed; a session goes on.

Usage: ask_run_test.py PALPATE
"""

import json
import subprocess
import sys
import time
import unittest

import task_case
from task_case import Task

TRIALS = 5  # of the block of stairs, 50 to 100 N/m
ASKER = """
import json, socketserver, sys
class Session(socketserver.StreamRequestHandler):
    def handle(self):
        for line in self.rfile:
            print(line.decode(), end="", file=log, flush=True)
            message = json.loads(line)
            if message["type"] == "ask" and sys.argv[3] == "answers":
                level = 60.5 + message["trial"]
                self.wfile.write((json.dumps({"type": "level", "trial": message["trial"], "level": level}) + "\\n").encode())
with open(sys.argv[2], "a") as log, socketserver.ThreadingUnixStreamServer(sys.argv[1], Session) as server:
    server.serve_forever()
"""


class Ask(Task):
    def asker(self, behaviour="answers"):
        """Its process, the path of its socket, and a function that returns the received messages."""
        name = f"{len(list(self.dir.glob('*.sock')))}"
        place, log = self.dir / f"{name}.sock", self.dir / f"{name}.log"
        process = subprocess.Popen([sys.executable, "-c", ASKER, place, log, behaviour])
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        while not place.exists():
            self.assertIsNone(process.poll())
            time.sleep(0.01)
        return process, place, lambda: [json.loads(line) for line in log.read_text().splitlines()]

    def levels(self, db):
        return [float(row["level"]) for row in self.export(db)]

    def noted(self, db):
        return [json.loads(text)["level_from_own_procedure"] for (text,) in self.sql("SELECT text FROM notes", db)
                if "level_from_own_procedure" in text]

    def own(self):
        db = self.dir / "own.db"
        self.answer_all(["stairs"], db)
        return self.levels(db)

    def test_proposed_levels_are_presented_and_reported(self):
        _, place, messages = self.asker()
        self.answer_all(["stairs"], self.db, options=["--ask", place])
        self.assertEqual(self.levels(self.db), [60.5 + trial for trial in range(1, TRIALS + 1)])
        self.assertEqual(self.noted(self.db), [])
        told = [message for message in messages() if message["type"] == "tell"]
        rows = self.export()
        self.assertEqual([(one["level"], int(one["success"])) for one in told],
                         [(float(row["level"]), int(row["success"])) for row in rows])

    def test_without_an_answer_the_procedure_chooses_and_this_is_recorded(self):
        expected = self.own()
        _, place, messages = self.asker("hangs")
        hung = self.dir / "hung.db"
        self.answer_all(["stairs"], hung, options=["--ask", place, "--ask-time-out-s", "0.2"])
        self.assertEqual(self.levels(hung), expected)
        noted = self.noted(hung)
        self.assertEqual([one["level"] for one in noted], expected)
        self.assertIn("in time", noted[0]["reason"])
        self.assertEqual(len([one for one in messages() if one["type"] == "ask"]), TRIALS)

        process, place, _ = self.asker()
        killed = self.dir / "killed.db"

        def kill_at_the_third(count):
            if count == 2:
                process.kill()
                process.wait()
        self.answer_all(["stairs"], killed, options=["--ask", place], before_trial=kill_at_the_third)
        levels, noted = self.levels(killed), self.noted(killed)
        self.assertEqual(levels[:3], [61.5, 62.5, 63.5])  # the third was proposed before the kill
        self.assertEqual([one["trial"] for one in noted], [4, 5])
        self.assertEqual([one["level"] for one in noted], levels[3:])
        for one in noted:
            self.assertRegex(one["reason"], "gone|nobody listens")

    def test_a_resumed_session_tells_a_new_asker_the_recorded_trials(self):
        process, place, _ = self.asker()
        self.answer_all(["stairs"], self.db, options=["--ask", place], before_trial=lambda count: count == 2)
        self.assertEqual(self.levels(self.db), [61.5, 62.5])
        process.kill()
        process.wait()
        _, place, messages = self.asker()
        self.answer_all(["stairs"], self.db, options=["--ask", place])
        self.assertEqual(self.levels(self.db), [60.5 + trial for trial in range(1, TRIALS + 1)])
        begin, = [one for one in messages() if one["type"] == "begin"]
        self.assertEqual([(one["trial"], one["level"]) for one in begin["history"]], [(1, 61.5), (2, 62.5)])
        self.assertEqual([one["trial"] for one in messages() if one["type"] == "ask"], [3, 4, 5])
        self.assertEqual(self.noted(self.db), [])

    def test_trials_of_no_block_are_not_told(self):
        protocol = self.dir / "protocol.json"
        protocol.write_text(json.dumps({**task_case.PROTOCOL, "version": 1, "repetitions": 2,
                                        "response": {"keys": {"1": "ball", "2": "box"}}}))
        for kill in (True, False):
            _, place, messages = self.asker()
            with task_case.Terminal([task_case.PALPATE, "run", protocol, "--db", self.db, "--participant", "P01", "--device",
                                     "simulated", "--no-window", "--ask", place,
                                     *(["--new-participant"] if kill else [])]) as terminal:
                while (came := terminal.wait_for("1 ball   2 box", task_case.GO_ON, "[fault, ", " on record; ")) != " on record; ":
                    if kill and came.startswith("1 ball") and self.sql("SELECT 1 FROM attempts WHERE state = 'completed'"):
                        break
                    terminal.type({task_case.GO_ON: " ", "[fault, ": ":clear\n:go\n"}.get(came, "1"))
            begin, = messages()
            self.assertEqual(begin["history"], [])


if __name__ == "__main__":
    unittest.main()
