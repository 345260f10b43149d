"""Levels proposed by a program at a socket: one that answers, one that dies, hangs, sends rubbish, sends a megabyte.
Usage: ask_level_test.py PALPATE propose_levels.py"""

import json
import math
import os
import pathlib
import socket
import sqlite3
import subprocess
import sys
import threading
import time
import unittest

from command_case import PALPATE, CommandCase

EXAMPLE = sys.argv.pop(1)
TRIALS = 12
PROTOCOL = {
    "version": 2, "name": "asked", "renderers": ["point"], "orientation": "fixed", "home": {"rest_s": 0.1}, "seed": 4,
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03, "subdivisions": 2, "stiffness_n_per_m": 300}],
    "blocks": [
        {"name": "constant", "task": "compare", "stimuli": ["ball"], "standard": "ball",
         "level": {"path": "/stiffness_n_per_m"}, "procedure": {"kind": "constant", "levels": [200, 400], "repetitions": 1}},
        {"name": "stairs", "task": "compare", "stimuli": ["ball"], "standard": "ball", "level": {"path": "/stiffness_n_per_m"},
         "procedure": {"kind": "staircase", "start": 500, "min": 300, "max": 600, "steps": [50], "down": 2,
                       "stop": {"trials": TRIALS}}}]}


class Program(threading.Thread):
    """Listens, keeps what it is sent, and answers as `reply` says: bytes, None (nothing) or "die"."""

    def __init__(self, path, reply):
        super().__init__(daemon=True)
        self.reply, self.messages, self.connections = reply, [], 0
        self.server = socket.socket(socket.AF_UNIX)
        self.server.bind(str(path))
        self.server.listen()
        self.start()

    def run(self):
        while True:
            try:
                connection, _ = self.server.accept()
            except OSError:
                return
            self.connections += 1
            with connection:
                try:
                    self.serve(connection)
                except OSError:
                    pass

    def serve(self, connection):
        for line in connection.makefile("r"):
            message = json.loads(line)
            self.messages.append(message)
            if message["type"] != "ask":
                continue
            answer = self.reply(message)
            if answer == "die":
                connection.shutdown(socket.SHUT_RDWR)
                return
            if answer is not None:
                connection.sendall(answer)

    def of(self, kind):
        return [message for message in self.messages if message["type"] == kind]


def level(message, value):
    return (json.dumps({"type": "level", "trial": message["trial"], "level": value}) + "\n").encode()


class Asking(CommandCase):
    def setUp(self):
        super().setUp()
        self.protocol = self.file("asked.json", PROTOCOL)

    def program(self, reply):
        program = Program(self.dir / "socket", reply)
        self.addCleanup(program.server.close)
        return program

    def simulate(self, db, *more, status=0):
        return self.palpate("simulate", self.protocol, "--db", db, "--participants", 1, *more, status=status)

    def asked(self, reply, name="a.db", time_out=5):
        program = self.program(reply)
        db = self.dir / name
        self.simulate(db, "--ask", self.dir / "socket", "--ask-time-out-s", time_out)
        return program, db

    def levels(self, db):
        return [float(row["level"]) for row in self.exported(db)[1] if row["block_name"] == "stairs"]

    def events(self, db):
        with sqlite3.connect(db) as base:
            found = [json.loads(text)["level_from_own_procedure"] for (text,) in base.execute("SELECT text FROM notes")
                     if "level_from_own_procedure" in text]
        base.close()
        return found


class AskLevel(Asking):
    def test_levels_are_requested_presented_and_reported(self):
        program, db = self.asked(lambda message: level(message, 310.5 + message["trial"]))
        asked = program.of("ask")
        self.assertEqual(len(asked), TRIALS)
        self.assertEqual(self.levels(db), [310.5 + message["trial"] for message in asked])
        self.assertEqual(self.events(db), [])
        begin, = program.of("begin")
        self.assertEqual((begin["protocol"], begin["participant"], begin["session"], begin["history"]), ("asked", 1, 1, []))
        for message in asked:
            self.assertEqual((message["block"], message["least"], message["most"], message["path"]),
                             ("stairs", 300, 600, "/stiffness_n_per_m"))
        told = program.of("tell")
        self.assertEqual([message["level"] for message in told], self.levels(db))
        self.assertTrue(all(message["answered"] and message["success"] == message["correct"] for message in told))

    def test_the_shipped_program_converges(self):
        path = self.dir / "socket"
        program = subprocess.Popen([sys.executable, EXAMPLE, str(path)])
        self.addCleanup(program.wait)
        self.addCleanup(program.terminate)
        while not path.exists():
            self.assertIsNone(program.poll())
        db = self.dir / "example.db"
        self.simulate(db, "--ask", path)
        levels = self.levels(db)
        self.assertEqual((len(levels), self.events(db)), (TRIALS, []))
        self.assertGreater(len(set(levels)), 3)
        self.assertTrue(all(300 <= one <= 600 for one in levels))
        # Kesten's rule, from the recorded answers: the first two steps are whole and half, later ones depend on
        # reversals.
        answers = [row["success"] == "1" for row in self.exported(db)[1] if row["block_name"] == "stairs"]
        turns = 0
        for at in range(TRIALS - 1):
            turns += at > 0 and answers[at] != answers[at - 1]
            divisor = at + 1 if at < 2 else 2 + turns
            expected = levels[at] - 300 / divisor * (answers[at] - 0.75)
            self.assertAlmostEqual(levels[at + 1], min(max(expected, 300), 600), places=6)
        # A killed program leaves its socket behind, but can start again.
        program.kill()
        program.wait()
        again = subprocess.Popen([sys.executable, EXAMPLE, str(path)])
        self.addCleanup(again.wait)
        self.addCleanup(again.terminate)
        deadline = time.monotonic() + 60
        while subprocess.run([PALPATE, "simulate", self.protocol, "--db", self.dir / "again.db", "--participants", "1",
                              "--ask", path], capture_output=True).returncode != 0:  # not there yet
            self.assertIsNone(again.poll())
            self.assertLess(time.monotonic(), deadline)
        self.assertEqual(self.levels(self.dir / "again.db"), levels)

    def test_the_shipped_program_has_thirty_lines(self):
        with open(EXAMPLE) as text:
            self.assertLessEqual(len(text.readlines()), 30)

    def own_procedure(self):
        db = self.dir / "own.db"
        self.simulate(db)
        return self.levels(db)

    def test_without_a_valid_answer_the_procedure_chooses(self):
        expected = self.own_procedure()
        cases = {"dies": (lambda message: "die", "gone", 5),
                 "hangs": (lambda message: None, "in time", 0.02),
                 "rubbish": (lambda message: b"\x00\xff{]\n", "expected {", 5),
                 "a list": (lambda message: b"[1, 2]\n", "expected {", 5),
                 "no number": (lambda message: level(message, "soft"), "expected a level from 300 to 600", 5),
                 "NaN": (lambda message: level(message, None), "expected a level from 300 to 600", 5),
                 "too stiff": (lambda message: level(message, 601), "expected a level from 300 to 600", 5),
                 "of the future": (lambda message: level({"trial": message["trial"] + 1}, 400), "expected the answer to trial", 5),
                 "a megabyte": (lambda message: b"1" * 1_000_000, "more than 65536 bytes", 5),
                 "old answers": (lambda message: level({"trial": 0}, 400) * 3000, "in time", 0.1)}
        for number, (name, (reply, reason, time_out)) in enumerate(cases.items()):
            with self.subTest(name):
                (self.dir / "socket").unlink(missing_ok=True)
                program, db = self.asked(reply, f"{number}.db", time_out)
                self.assertEqual(self.levels(db), expected)
                events = self.events(db)
                self.assertEqual([one["level"] for one in events], expected)
                for event in events:
                    self.assertTrue(reason in event["reason"] or "gone" in event["reason"], event["reason"])
                self.assertIn(reason, events[0]["reason"])
                if "expected" in reason:
                    self.assertIn(reason, program.of("refused")[0]["message"])

    def test_a_valid_answer_counts_again_after_refusals(self):
        _, db = self.asked(lambda message: level(message, 450) if message["trial"] > 6 else level(message, -1))
        levels, events = self.levels(db), self.events(db)
        self.assertEqual([one["trial"] for one in events], [trial for trial in range(3, 7)])
        self.assertEqual(levels[len(events):], [450] * (TRIALS - len(events)))

    def test_recorded_trials_are_not_requested_again(self):
        program, whole = self.asked(lambda message: level(message, 400 + message["trial"]))
        expected = self.levels(whole)
        # A session that was cut off: the same without its last five trials.
        (self.dir / "socket").unlink()
        program = self.program(lambda message: level(message, 400 + message["trial"]))
        part = self.dir / "part.db"
        stopping = subprocess.Popen([PALPATE, "simulate", self.protocol, "--db", part, "--participants", "1", "--ask",
                                     self.dir / "socket"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while len(program.of("ask")) < 5 and stopping.poll() is None:
            pass
        stopping.terminate()
        stopping.wait()
        before = len(program.of("ask"))
        self.simulate(part, "--ask", self.dir / "socket")
        self.assertEqual(self.levels(part), expected)
        asked = [message["trial"] for message in program.of("ask")]
        self.assertEqual(sorted(asked), sorted(set(asked)))
        history = program.of("begin")[-1]["history"]
        if before < TRIALS:
            self.assertEqual([one["level"] for one in history if one["block"] == "stairs"],
                             [400 + trial for trial in asked[:before]])

    def test_wrong_usage_is_refused_before_anything_is_stored(self):
        db = self.dir / "no.db"
        (self.dir / "file").write_text("")
        for where in ("nowhere", "file"):
            self.assertIn("--ask", self.simulate(db, "--ask", self.dir / where, status=2).stderr)
        dead = socket.socket(socket.AF_UNIX)
        dead.bind(str(self.dir / "dead"))
        dead.close()
        self.assertIn("nobody listens", self.simulate(db, "--ask", self.dir / "dead", status=2).stderr)
        self.program(lambda message: None)
        for time_out in ("0", "-1", "nan", "1000"):
            self.assertIn("--ask-time-out-s", self.simulate(db, "--ask", self.dir / "socket", "--ask-time-out-s", time_out,
                                                            status=2).stderr)


ASKS = {**PROTOCOL, "name": "asks", "blocks": [
    {"name": "stairs", "task": "compare", "stimuli": ["ball"], "standard": "ball", "level": {"path": "/stiffness_n_per_m"},
     "factors": ["size"],
     "procedure": {"kind": "ask", "min": 310, "max": 600, "scale": "log", "stop": {"trials": 16}}}],
    "groups": {"names": ["young", "old"]},
    "factors": [{"name": "size", "levels": [{"name": "large", "set": {}}, {"name": "small", "set": {"/stimuli/*/radius_m": 0.02}}]}]}
# In the form of AEPsych's client 0.5, without a server.
STUB = """
import json

class AEPsychClient:
    def __init__(self, ip, port):
        self.calls, self.asked, self.configs = open("calls.jsonl", "a", buffering=1), {}, {}
    def note(self, **call):
        self.calls.write(json.dumps(call) + chr(10))
    def configure(self, config_str, config_name):
        self.configs[config_name] = config_str
        self.note(configure=config_str, name=config_name)
    def resume(self, config_name):
        self.name = config_name
    def ask(self):
        n = self.asked[self.name] = self.asked.get(self.name, 0) + 1
        config = self.configs[self.name]
        names = config.split("parnames = [")[1].split("]")[0].split(", ")
        wanted = int(config.split("min_asks = ")[2].split(chr(10))[0])
        return {"config": {name: [2.5 + n / 100] for name in names}, "is_finished": n >= wanted, "num_points": 1}
    def tell(self, config, outcome):
        self.note(tell=config, outcome=outcome, name=self.name)
"""


class AskProcedure(Asking):
    def setUp(self):
        super().setUp()
        self.protocol = self.file("asks.json", ASKS)

    def test_every_level_is_the_programs(self):
        program, db = self.asked(lambda message: level(message, 400 + message["trial"] / 8))
        asked = program.of("ask")
        self.assertEqual(len(asked), 32)
        self.assertEqual(self.levels(db), [400 + message["trial"] / 8 for message in asked])
        self.assertEqual({(m["least"], m["most"], m["scale"], m["stimulus"]) for m in asked}, {(310, 600, "log", "ball")})
        self.assertEqual(sorted(m["factors"]["size"] for m in asked), ["large"] * 16 + ["small"] * 16)
        self.assertEqual(program.of("begin")[0]["group"], "young")
        for told, row in zip(program.of("tell"), self.exported(db)[1], strict=True):
            self.assertEqual((told["response"], told["response_time_s"]), (row["response"], float(row["response_time"])))
        found = self.palpate("analyze", "--db", db, "--json", self.dir / "found.json").stdout
        self.assertIn("JND", found)

    def test_without_a_program_levels_cover_the_range(self):
        db = self.dir / "alone.db"
        self.assertIn("without --ask", self.simulate(db).stderr)
        rows = self.exported(db)[1]
        for size in ("large", "small"):
            places = sorted(math.log(float(row["level"]) / 310) / math.log(600 / 310) for row in rows if row["size"] == size)
            self.assertEqual(len(places), 16)
            gaps = [b - a for a, b in zip(places, places[1:])]
            self.assertLess(max(gaps) - min(gaps), 1e-9)  # sixteen points of van der Corput's sequence

    def test_a_person_needs_a_program(self):
        db = self.dir / "person.db"
        for command in (("run", self.protocol, "--db", db, "--participant", "P1", "--device", "mouse"),
                        ("serve", "--protocol", self.protocol, "--db", db, "--participant", "P1", "--device", "simulated")):
            self.assertIn("asks a program for its levels", self.palpate(*command, status=2).stderr)
        self.assertFalse(db.exists())

    def test_aepsych_chooses_on_the_scale(self):
        (self.dir / "aepsych_client.py").write_text(STUB)
        path = self.dir / "socket"
        example = pathlib.Path(EXAMPLE).parent / "aepsych_levels.py"
        program = subprocess.Popen([sys.executable, example, path, "--first", "5"], cwd=self.dir,
                                   env={**os.environ, "PYTHONPATH": str(self.dir)})
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        while not path.is_socket():
            time.sleep(0.02)
        db = self.dir / "a.db"
        self.simulate(db, "--ask", path, "--ask-time-out-s", 20)
        self.assertEqual(self.events(db), [])
        self.assertEqual(sorted(round(math.log10(one), 9) for one in self.levels(db)),
                         sorted(round(2.5 + n / 100, 9) for n in range(1, 17) for _ in range(2)))
        calls = [json.loads(line) for line in (self.dir / "calls.jsonl").read_text().splitlines()]
        configured = [call for call in calls if "configure" in call]
        self.assertEqual(len({call["name"] for call in configured}), 2)
        self.assertIn("lower_bound = " + repr(math.log10(310)), configured[0]["configure"])
        told = [call for call in calls if "tell" in call]
        rows = self.exported(db)[1]
        self.assertEqual([call["outcome"] for call in told], [int(row["success"]) for row in rows])
        for call, row in zip(told, rows, strict=True):
            self.assertAlmostEqual(call["tell"]["level"][0], math.log10(float(row["level"])))


POINTS = {**PROTOCOL, "name": "points", "stimuli": [{**PROTOCOL["stimuli"][0], "texture": {"kind": "sine", "period_m": 0.002, "depth_m": 0.0002}}],
          "blocks": [
    {"name": "field", "task": "compare", "stimuli": ["ball"], "standard": "ball",
     "level": {"dimensions": [{"name": "reference", "path": "/stiffness_n_per_m", "of": "standard"},
                              {"name": "stiff-ness", "path": "/stiffness_n_per_m", "scale": "log"}]},
     "procedure": {"kind": "ask", "ranges": {"reference": {"min": 200, "max": 400}, "stiff-ness": {"min": 100, "max": 600}},
                   "stop": {"trials": TRIALS}}},
    {"name": "later", "task": "compare", "stimuli": ["ball"], "standard": "ball", "level": {"path": "/stiffness_n_per_m"},
     "procedure": {"kind": "staircase", "start": 500, "min": 300, "max": 600, "steps": [50], "down": 2, "stop": {"trials": 4}}}]}


def levels_of(message, **values):
    return (json.dumps({"type": "levels", "trial": message["trial"], "levels": values}) + "\n").encode()


class AskDimensions(Asking):
    def setUp(self):
        super().setUp()
        self.protocol = self.file("points.json", POINTS)

    def points(self, db):
        return [(float(row["reference"]), float(row["stiff-ness"])) for row in self.exported(db)[1] if row["block_name"] == "field"]

    def test_points_are_requested_presented_and_reported(self):
        program, db = self.asked(lambda message: level(message, 400) if "path" in message else
                                 levels_of(message, **{"reference": 200 + message["trial"], "stiff-ness": 300.5}))
        asked = [message for message in program.of("ask") if "dimensions" in message]
        self.assertEqual(self.points(db), [(200 + message["trial"], 300.5) for message in asked])
        self.assertEqual(len(asked), TRIALS)
        self.assertEqual(asked[0]["dimensions"], [
            {"name": "reference", "path": "/stiffness_n_per_m", "of": "standard", "scale": "linear", "least": 200, "most": 400},
            {"name": "stiff-ness", "path": "/stiffness_n_per_m", "of": "comparison", "scale": "log", "least": 100, "most": 600}])
        self.assertEqual(set(asked[0]["own"]), {"reference", "stiff-ness"})
        self.assertFalse({"path", "least", "most", "scale"} & set(asked[0]))
        told = [message for message in program.of("tell") if message["block"] == "field"]
        self.assertEqual([tuple(message["levels"].values()) for message in told], self.points(db))
        self.assertEqual({message["level"] for message in told}, {None})
        self.assertEqual(self.events(db), [])

    def test_invalid_points_are_named_and_replaced(self):
        good = {"reference": 300, "stiff-ness": 300}
        cases = [({"reference": 300}, "'stiff-ness' from 100 to 600: it is missing"),
                 ({**good, "hardness": 3}, "no level for 'hardness'"),
                 ({**good, "reference": 199}, "'reference' from 200 to 400"),
                 ({**good, "stiff-ness": float("nan")}, "expected"),
                 ({**good, "stiff-ness": "300"}, "'stiff-ness' from 100 to 600"),
                 (None, "an object with a number for each dimension")]
        wanted = iter(cases)

        def reply(message):
            if "path" in message:
                return None
            case = next(wanted, None)
            values = good if case is None else case[0]
            return (json.dumps({"type": "levels", "trial": message["trial"], "levels": values}) + "\n").encode()
        program, db = self.asked(reply, time_out=1)
        refused = [message["message"] for message in program.of("refused")][:len(cases)]
        for text, (_, expected) in zip(refused, cases, strict=True):
            self.assertIn(expected, text)
        asked = [message for message in program.of("ask") if "dimensions" in message]
        for point, message in list(zip(self.points(db), asked, strict=True))[:len(cases)]:
            self.assertEqual(point, tuple(message["own"].values()))
        self.assertEqual(self.points(db)[len(cases):], [(300, 300)] * (TRIALS - len(cases)))
        events = [event for event in self.events(db) if "levels" in event]
        self.assertEqual([event["levels"] for event in events], [message["own"] for message in asked[:len(cases)]])

    def test_a_program_ends_a_block(self):
        for protocol, block in ((POINTS, "field"), (PROTOCOL, "stairs")):
            self.protocol = self.file("ended.json", {**protocol, "name": "ended-" + block})
            program = self.program(lambda message: b'{"type": "finished"}\n' if message["trial"] > 7 and message["block"] == block else None)
            db = self.dir / (block + ".db")
            self.simulate(db, "--ask", self.dir / "socket", "--ask-time-out-s", 0.3)
            program.server.close()
            (self.dir / "socket").unlink()
            rows = self.exported(db)[1]
            self.assertEqual(sum(row["block_name"] == block for row in rows), 7 - 2 * (block == "stairs"))
            with sqlite3.connect(db) as base:
                notes = [json.loads(text) for (text,) in base.execute("SELECT text FROM notes") if "block_ended_by_program" in text]
            base.close()
            self.assertEqual(notes, [{"block_ended_by_program": {"session": 1, "block": block, "before_trial": 8}}])
            if block == "field":
                self.assertEqual(sum(row["block_name"] == "later" for row in rows), 4)
                self.simulate(db)  # nothing is left
                self.assertEqual(self.exported(db)[1], rows)

    def test_aepsych_chooses_points(self):
        (self.dir / "aepsych_client.py").write_text(STUB)
        path = self.dir / "socket"
        example = pathlib.Path(EXAMPLE).parent / "aepsych_levels.py"
        program = subprocess.Popen([sys.executable, example, path, "--first", "2", "--asks", "5"], cwd=self.dir,
                                   env={**os.environ, "PYTHONPATH": str(self.dir)})
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        while not path.is_socket():
            time.sleep(0.02)
        db = self.dir / "a.db"
        self.simulate(db, "--ask", path, "--ask-time-out-s", 20)
        calls = [json.loads(line) for line in (self.dir / "calls.jsonl").read_text().splitlines()]
        configured = next(call for call in calls if "configure" in call)["configure"]
        self.assertIn("parnames = [reference, stiff_ness]", configured)
        self.assertIn("lower_bound = 2.0\n", configured.split("[stiff_ness]")[1])
        points = self.points(db)
        self.assertEqual(len(points), 5)  # the program ended the block
        self.assertEqual([round(math.log10(stiff), 9) for _, stiff in points], [round(2.5 + n / 100, 9) for n in range(1, 6)])
        told = [call for call in calls if "tell" in call and "reference" in call["tell"]]
        self.assertEqual(len(told), 5)


if __name__ == "__main__":
    unittest.main()
