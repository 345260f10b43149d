"""palpate serve with a protocol: its record is that of palpate run, whatever happens to the program or the server.

Usage: served_session_test.py PALPATE PROTOCOLS CLIENT.py
"""

import contextlib
import csv
import json
import pathlib
import signal
import socket
import sqlite3
import subprocess
import sys
import time
import unittest

from serve_case import PALPATE, PATIENCE, ServeCase, ServeError

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "session"))
from terminal import Terminal  # noqa: E402

LEVEL = {"level": {"path": "/stiffness_n_per_m"}, "min": 20, "max": 60}
PROTOCOL = {
    "version": 2, "name": "served", "renderers": ["point", "ray"], "seed": 5, "samples": True,
    # Slow and soft, so that no five ticks in a row are missed while many tests share a processor.
    "servo": {"rate_hz": 100}, "home": {"rest_s": 0.1}, "material": {"stiffness_n_per_m": 50},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
}
IDENTIFY = {"name": "which", "task": "identify", "stimuli": ["ball", "box"], "repetitions": 1}
EXTERNAL = {"name": "free", "task": "external", "stimuli": ["ball", "box"], "trials": 4}
# Where a server is killed.
POINTS = ("served", "greeted", "waiting for home", "felt", "touched", "noted", "stopped", "answered", "a millisecond later",
          "written", "acknowledged", "the next one asked for")
# Columns that depend on the time, or on a busy machine.
OF_TIME = {"response_time", "first_contact_time", "onset_utc", "missed_ticks", "attempt", "ticks", "faults", "max_force", "before_contact",
           "longest_period", "contact_share", "edge_dwell", "interval_onsets", "interval_ends", "started_inside",
           "response_device", "note"}
OF_PLAN = {"task", "protocol_sha256"}  # that differ between a block of palpate's and one of the program's


class Served(ServeCase):
    def setUp(self):
        super().setUp()
        self.db = self.dir / "served.db"

    def protocol(self, *blocks, **changes):
        path = self.dir / "protocol.json"
        path.write_text(json.dumps(PROTOCOL | {"blocks": list(blocks)} | changes))
        return path

    def begin(self, protocol, *options, db=None):
        return self.run_server([PALPATE, "serve", "--device", "simulated", "--protocol", protocol, "--db", db or self.db,
                                "--participant", "P01", *options])

    def trial(self, hand, answer, **start):
        """Runs a trial until it is on record: one cut off by a busy machine is repeated. \return its facts"""
        while True:
            try:
                hand.start(**start)
                if hand.next is None:
                    return None
                return hand.answer(answer)
            except ServeError as error:
                if error.code not in ("forces-off", "nothing-felt", "stopped"):
                    raise
                hand.clear()

    def sql(self, query, db=None):
        with contextlib.closing(sqlite3.connect(db or self.db)) as opened:
            self.assertEqual(opened.execute("PRAGMA integrity_check").fetchone()[0], "ok")
            return opened.execute(query).fetchall()

    def run_palpate(self, *args, status=0):
        done = subprocess.run([PALPATE, *map(str, args)], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, status, done.stderr)
        return done.stderr if status else done.stdout

    def rows(self, db=None):
        out = self.dir / "trials.csv"
        self.run_palpate("export", "--db", db or self.db, "--format", "csv", "--out", out, "--force")
        with open(out, newline="", encoding="utf-8") as table:
            return list(csv.DictReader(table))

    def run_live(self, protocol):
        """The database of palpate run, where every answer is box."""
        live = self.dir / "live.db"
        with Terminal([PALPATE, "run", protocol, "--db", live, "--participant", "P01", "--device", "simulated", "--no-window",
                       "--new-participant"]) as terminal:
            while True:
                came = terminal.wait_for("1 ball   2 box", "[fault, ", " on record; ")
                if came == " on record; ":
                    break
                terminal.type(":clear\n:go\n" if came == "[fault, " else "2")
            self.assertEqual(terminal.finish(), 0, terminal.text)
        return live

    def test_rows_equal_those_of_run_with_the_same_answers(self):
        protocol = self.protocol(IDENTIFY)
        live = self.run_live(protocol)
        process = self.begin(protocol)
        with self.client() as hand:
            self.assertEqual(hand.server["record"]["trials"], 4)
            while hand.next is not None:
                due = hand.next
                said = self.trial(hand, "box", trial=due["trial"], stimulus=due["stimulus"], renderer=due["renderer"])
                self.assertEqual((said["stimulus"], said["correct"]), (due["stimulus"], due["stimulus"] == "box"))
        self.assertEqual(process.wait(PATIENCE), 0)
        ran, served = self.rows(live), self.rows()
        self.assertEqual([len(ran), list(ran[0])], [4, list(served[0])])
        for a, b in zip(ran, served):
            self.assertEqual({k: v for k, v in a.items() if k not in OF_TIME},
                             {k: v for k, v in b.items() if k not in OF_TIME})
        self.assertEqual(self.sql("SELECT end_reason FROM runs"), [("done",)])
        for trial in range(1, 5):  # the recorded forces equal those of rendering the path
            said = self.run_palpate("replay", "--db", self.db, "--trial", f"P01/1/{trial}", "--compare")
            self.assertRegex(said, r"(?m)(\d+) of \1 ticks|all \d+ ticks", said)

    def be_refused(self, hand):
        """Asks for what an external block does not take before its first trial."""
        for wrong in ({}, {"stimulus": "cone", "level": 30}, {"stimulus": "ball"}, {"stimulus": "ball", "level": 61},
                      {"stimulus": "ball", "level": 30, "renderer": "line"}, {"stimulus": "ball", "level": 30},
                      {"stimulus": "ball", "level": 30, "renderer": "ray", "trial": 2}):
            with self.assertRaises(ServeError) as caught:
                hand.start(**wrong)
            self.assertIn(caught.exception.code, ("bad-trial", "bad-message"), wrong)
        self.refused("recorded", hand.load, {"objects": []})
        self.refused("nothing-felt", hand.answer, "soft")

    def answer_one_and_stop_the_next(self, hand, orientation):
        first = self.trial(hand, "soft", stimulus="box", level=25, renderer="ray", orientation_wxyz=orientation,
                           trial=1)
        self.assertEqual((first["response"], first["level"], first["correct"]), ("soft", 25, False))
        self.assertEqual(hand.next["trial"], 2)
        hand.start(stimulus="ball", level=60, renderer="point")
        self.refused("bad-answer", hand.answer, "box")
        self.refused("running", hand.start, stimulus="ball", level=60, renderer="point")
        hand.stop("the participant sneezed")
        hand.mark(7, "flash")
        hand.note("a bell rang")
        self.assertEqual(hand.next["trial"], 2)

    def answer_by_words_and_by_clock(self, hand):
        while True:
            try:
                hand.start(stimulus="ball", level=60, renderer="point")
                said = hand.answer("hard", correct=True)
                break
            except ServeError:
                hand.clear()
        self.assertTrue(said["correct"])
        self.know_the_clock(hand)
        zero = hand.start(stimulus="ball", level=40, renderer="point")
        time.sleep(0.05)
        now = time.monotonic_ns()
        with self.assertRaises(ServeError):
            hand.answer("hard", t_ns=zero - 1)
        said = hand.answer("hard", t_ns=now)
        self.assertEqual(said["stamped"], "client")
        self.assertAlmostEqual(said["response_time_s"], (now - zero) * 1e-9, places=9)

    def test_an_external_block(self):
        answers = {"answers": ["soft", "hard"], **LEVEL}
        process = self.begin(self.protocol({**EXTERNAL, **answers}))
        turned = [0.6, 0, 0.8, 0]
        with self.client() as hand:
            self.assertEqual(hand.next["stimuli"], ["ball", "box"])
            self.assertEqual(hand.next["level_range"], [20, 60])
            self.be_refused(hand)
            self.answer_one_and_stop_the_next(hand, turned)
        self.assertIsNone(process.poll())  # it waits for another controller
        with self.client() as hand:  # resumes
            self.assertEqual([(t["trial"], t["stimulus"], t["response"]) for t in hand.server["record"]["stored"]],
                             [(1, "box", "soft")])
            self.answer_by_words_and_by_clock(hand)
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(PATIENCE), 0)
        self.check_record_of_the_external_block(turned)
        self.run_palpate("analyze", "--db", self.db)
        again = self.begin(self.dir / "protocol.json")
        with self.client() as hand:
            self.assertEqual((hand.server["record"]["done"], hand.next["trial"]), (3, 4))
        again.kill()

    def check_record_of_the_external_block(self, orientation):
        rows = self.rows()
        self.assertEqual([(row["shape"], row["level"], row["renderer"], row["response"], row["correct"], row["task"])
                          for row in rows],
                         [("box", "25", "ray", "soft", "0", "external"),
                          ("ball", "60", "point", "hard", "1", "external"),
                          ("ball", "40", "point", "hard", "0", "external")])
        self.assertEqual([float(rows[0][f"orientation_{axis}"]) for axis in "wxyz"], orientation)
        notes = [text for (text,) in self.sql("SELECT text FROM notes ORDER BY id")]
        self.assertIn('{"mark":{"code":7,"text":"flash"}}', notes)
        self.assertIn("a bell rang", notes)
        self.assertIn(("the participant sneezed",),
                      self.sql("SELECT cut_off_reason FROM attempts WHERE state = 'cut_off'"))
        self.assertEqual(self.sql("SELECT end_reason FROM runs"), [("paused",)])

    def test_wrong_use(self):
        external = self.protocol(EXTERNAL)
        run = ["run", external, "--db", self.db, "--participant", "P01", "--device", "simulated", "--no-window"]
        self.assertIn("palpate serve runs it", self.run_palpate(*run, status=2))
        self.assertIn("palpate serve runs it", self.run_palpate("simulate", external, "--db", self.db, status=2))
        serve = ["serve", "--device", "simulated", "--protocol", external]
        self.assertIn("together", self.run_palpate(*serve, status=2))
        self.assertIn("--scene", self.run_palpate(*serve, "--db", self.db, "--participant", "P01", "--scene", self.scene, status=2))
        self.assertIn("--consent", self.run_palpate("serve", "--device", "simulated", "--consent", "1", status=2))
        turns = {"name": "turns", "task": "adjust", "stimuli": ["ball"], "standard": "box", "repetitions": 1, "turn": 1,
                 "starts": [30], **LEVEL}
        serve[-1] = self.protocol(turns)
        self.assertIn("an adjustment", self.run_palpate(*serve, "--db", self.db, "--participant", "P01", status=2))
        self.assertFalse(self.db.exists())

    def pair(self, hand, *levels):
        """Feels both intervals of a pair, again where a busy machine turned the forces off."""
        while True:
            try:
                hand.start(intervals=[{"stimulus": "ball", "renderer": "ray", "level": level, "standard": level == 30}
                                      for level in levels])
                self.refused("not-yet", hand.answer, "1")
                self.assertEqual(hand.next_interval()["interval"], 2)
                self.refused("last-interval", hand.next_interval)
                return
            except ServeError as error:
                if error.code not in ("forces-off", "stopped"):
                    raise
                hand.clear()

    def test_external_pairs_are_on_record_with_both_intervals(self):
        self.begin(self.protocol(EXTERNAL | LEVEL | {"intervals": 2, "inter_interval_s": 0.1}))
        with self.client() as hand:
            self.assertEqual((hand.next["intervals"], hand.next["answers"]), (2, ["1", "2"]))
            ball = {"stimulus": "ball", "renderer": "ray", "level": 30}
            self.assertEqual(self.refused("bad-trial", hand.start, **ball).place, "/intervals")
            self.assertEqual(self.refused("bad-trial", hand.start, intervals=[ball]).place, "/intervals")
            self.assertEqual(self.refused("bad-trial", hand.start, intervals=[ball, ball | {"level": 61}]).place,
                             "/intervals/1/level")
            self.assertEqual(self.refused("bad-message", hand.start, intervals=[ball, {"levels": 3}]).place,
                             "/intervals/1/levels")
            standards = [ball | {"standard": True}] * 2
            self.assertEqual(self.refused("bad-trial", hand.start, intervals=standards).place, "/intervals")
            self.refused("nothing-felt", hand.next_interval)
            self.pair(hand, 30, 50)
            first = hand.answer("2")
            self.assertTrue(first["correct"])
            self.assertLess(0, first["response_time_s"])
            self.pair(hand, 50, 30)
            self.assertFalse(hand.answer("2")["correct"])
            self.pair(hand, 30, 40)
            hand.stop("between")
        rows = self.rows()
        self.assertEqual([(row["interval_levels"], row["level"], row["standard_level"], row["response"], row["correct"])
                          for row in rows], [("30;50", "50", "30", "2", "1"), ("50;30", "50", "30", "2", "0")])
        self.run_palpate("replay", "--db", self.db, "--trial", "P01/1/1", "--compare")
        self.run_palpate("analyze", "--db", self.db)

    def test_timed_intervals_follow_by_themselves(self):
        self.begin(self.protocol(EXTERNAL | {"intervals": 3, "interval_limit_s": 0.3, "inter_interval_s": 0.1}))
        with self.client() as hand:
            while True:
                hand.start(intervals=[{"stimulus": "ball", "renderer": "ray", "standard": i < 2} for i in range(3)])
                came = [self.one_of(hand, "interval", "question", "forces_off") for _ in range(3)]
                if "forces_off" not in [one["event"] for one in came]:
                    break
                hand.clear()
            self.assertEqual([(one["event"], one.get("interval")) for one in came],
                             [("interval", 2), ("interval", 3), ("question", None)])
            self.assertTrue(hand.answer("3")["correct"])

    def test_a_comparison_comes_as_the_protocol_plans_it(self):
        pairs = {"name": "pairs", "task": "compare", "stimuli": ["ball"], "standard": "ball", "level": LEVEL["level"],
                 "procedure": {"kind": "constant", "levels": [30, 70], "repetitions": 1}, "renderers": ["ray"],
                 "inter_interval_s": 0.1}
        self.begin(self.protocol(pairs))
        with self.client() as hand:
            while hand.next is not None:
                self.assertEqual(hand.next["intervals"], 2)
                try:
                    hand.start()
                    hand.next_interval()
                    hand.answer("1")
                except ServeError as error:
                    if error.code not in ("forces-off", "stopped", "nothing-felt"):
                        raise
                    hand.clear()
        self.assertEqual(len(self.rows()), 2)

    def test_markers_and_sounds_go_out_as_in_a_session(self):
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(receiver.close)
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(PATIENCE)
        sound = self.dir / "sound.raw"
        markers = f"udp:127.0.0.1:{receiver.getsockname()[1]}"
        process = self.begin(self.protocol(EXTERNAL, masking_noise={"kind": "pink", "level_db": -24}), "--markers", markers,
                             "--sound-device", f"file:{sound},raw")
        with self.client() as hand:
            self.trial(hand, "ball", stimulus="ball", renderer="ray")
            hand.mark(77, "flash")
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(PATIENCE), 0)
        lines = []
        while not lines or lines[-1]["marker"] != "mark":
            lines.append(json.loads(receiver.recv(4096)))
        answered = next(line for line in lines if line["marker"] == "response")
        self.assertEqual((answered["trial"], answered["shape"], answered["response"]), (1, "ball", "ball"))
        self.assertEqual(lines[0]["marker"], "trial_start")
        self.assertEqual(lines[-1]["code"], 77)
        self.assertTrue(any(sound.read_bytes()))
        notes = [text for (text,) in self.sql("SELECT text FROM notes ORDER BY id")]
        self.assertTrue(any(text.startswith('{"markers"') for text in notes), notes)
        self.assertTrue(any('"masking_noise":"on"' in text for text in notes), notes)

    def test_silence_cuts_the_trial_off(self):
        self.begin(self.protocol(EXTERNAL))
        with self.client(keep_alive=False) as hand:
            hand.start(stimulus="ball", renderer="ray")
            self.assertEqual(self.one_of(hand, "cut_off")["trial"], 1)
            off = hand.wait_for("forces_off", PATIENCE)
            self.refused("forces-off", hand.start, stimulus="ball", renderer="ray")
            self.assertTrue(off["reason"])
            hand.clear()
            hand.start(stimulus="ball", renderer="ray")
            hand._link.socket.shutdown(2)  # disconnects without a message
        eye = self.client(role="watch")
        while eye.server["record"]["done"] != 0 or len(self.sql("SELECT 1 FROM attempts WHERE state = 'cut_off'")) < 2:
            time.sleep(0.05)

    def begun(self, hand, due, **start):
        """Starts the trial until forces are on."""
        while True:
            try:
                return hand.start(trial=due["trial"], **start)
            except ServeError as error:
                if error.code != "forces-off":
                    raise
                hand.clear()

    def kill_at(self, point, process, hand, due, answer, start):
        """Kills the server at a point of the trial that is due.
        \return the trial's facts where it was acknowledged, whether its answer was sent"""
        wal = self.db.with_name(self.db.name + "-wal")
        said, sent = None, False
        if point == "waiting for home":
            hand._send("start", False, {"trial": due["trial"], **start})
            time.sleep(0.02)
        elif point not in ("greeted", "acknowledged", "the next one asked for"):
            self.begun(hand, due, **start)
        if point == "touched":
            self.one_of(hand, "first_contact", "forces_off")
        elif point == "noted":
            hand.mark(40, "kept")
        elif point == "stopped":
            hand.stop("stopped before the kill")
        elif point in ("answered", "a millisecond later", "written"):
            before, sent = wal.stat().st_size, True
            number = hand._send("answer", True, {"response": answer})
            time.sleep(0.001 if point == "a millisecond later" else 0)
            while point == "written" and wal.stat().st_size == before and number not in hand._replies:
                pass  # it is being written
        elif point in ("acknowledged", "the next one asked for"):
            said = self.trial(hand, answer, trial=due["trial"], **start)
            if point == "the next one asked for" and hand.next is not None:
                hand._send("start", False, {"trial": hand.next["trial"], **start})
        process.kill()
        self.assertEqual(process.wait(PATIENCE), -signal.SIGKILL)
        return said, sent

    def kill_at_every_point(self, protocol, answer_of, start_of):
        """A session whose server is killed at every point; the last server finishes it.
        \return what was acknowledged, by trial"""
        acknowledged, maybe = {}, None  # facts by trial; the trial whose answer was sent before a kill
        for point in [*POINTS, None]:
            process = self.begin(protocol)
            if point == "served":
                process.kill()
                process.wait(PATIENCE)
                continue
            with contextlib.suppress(OSError), self.client() as hand:
                stored = {t["trial"]: (t["stimulus"], t["response"]) for t in hand.server["record"]["stored"]}
                self.assertEqual(len(stored), len(hand.server["record"]["stored"]))
                if maybe is not None and maybe["trial"] in stored:  # its reply alone was lost
                    acknowledged[maybe["trial"]] = maybe
                self.assertEqual(stored, {k: (t["stimulus"], t["response"]) for k, t in acknowledged.items()}, point)
                maybe = None
                while (due := hand.next) is not None:
                    start, answer = start_of(due["trial"]), answer_of(due["trial"])
                    if point is not None:
                        said, sent = self.kill_at(point, process, hand, due, answer, start)
                        if said is not None:
                            acknowledged[due["trial"]] = said
                        if sent:
                            maybe = {"trial": due["trial"], "stimulus": start["stimulus"], "response": answer}
                        break
                    acknowledged[due["trial"]] = self.trial(hand, answer, trial=due["trial"], **start)
        self.assertEqual(process.wait(PATIENCE), 0)
        return acknowledged

    def test_a_controller_that_goes_while_its_start_waits_leaves_forces_off(self):
        self.begin(self.protocol({**EXTERNAL, "trials": 2}, home={"rest_s": 60}))  # the hand does not rest as long
        eye = self.client(role="watch")
        hand = self.client()
        hand._send("start", False, {"stimulus": "ball", "renderer": "ray"})
        self.one_of(eye, "waiting")
        hand._link.socket.shutdown(2)
        self.one_of(eye, "controller_gone")
        self.one_of(eye, "cut_off")
        with self.client() as hand:
            self.refused("forces-off", hand.start, stimulus="ball", renderer="ray")
            hand.clear()
            hand._send("start", False, {"stimulus": "ball", "renderer": "ray"})
            self.one_of(eye, "waiting")

    def test_any_words_of_a_program_are_kept(self):
        process = self.begin(self.protocol({**EXTERNAL, "trials": 2}))
        words = ["", "\x00", "a\nb\r\t\x1b[31mred", "\u202e\ufeff\U0001f600", "x" * 1000, "'; DROP TABLE trials; --", "=1+1"]
        with self.client() as hand:
            for word in words:
                for say in (hand.note, lambda text: hand.mark(9, text), hand.stop):
                    with contextlib.suppress(ServeError):
                        say(word)
                self.begun(hand, hand.next, stimulus="ball", renderer="ray")
                with contextlib.suppress(ServeError):
                    hand.answer(word)
                with contextlib.suppress(ServeError):
                    hand.stop(word)
                with contextlib.suppress(ServeError):
                    hand.start(stimulus=word, renderer="ray")
            said = self.trial(hand, "ball", stimulus="ball", renderer="ray")
            self.assertEqual(said["trial"], 1)
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(PATIENCE), 0)
        reasons = {reason for (reason,) in self.sql("SELECT cut_off_reason FROM attempts WHERE state = 'cut_off'")}
        self.assertGreaterEqual(reasons, {words[4], words[5], words[6]})
        self.assertEqual(len(self.rows()), 1)
        self.assertTrue(all(letter == "\n" or letter >= " " for letter in process.stderr.read()))

    def test_kills_at_twelve_points_lose_no_acknowledged_trial(self):
        ran = self.rows(self.run_live(self.protocol({**IDENTIFY, "repetitions": 2})))
        self.assertEqual(len(ran), 8)

        def start_of(trial):  # as palpate run showed it
            row = ran[trial - 1]
            return {"stimulus": row["shape"], "renderer": row["renderer"],
                    "orientation_wxyz": [float(row[f"orientation_{axis}"]) for axis in "wxyz"]}

        acknowledged = self.kill_at_every_point(self.protocol({**EXTERNAL, "name": "which", "trials": 8}), lambda trial: "box", start_of)
        rows = self.rows()
        self.assertEqual([int(row["trial"]) for row in rows], list(range(1, 9)))
        self.assertEqual(sorted(acknowledged), list(range(1, 9)))
        for row, asked in zip(rows, ran):
            said = acknowledged[int(row["trial"])]
            self.assertEqual((row["shape"], row["response"]), (said["stimulus"], said["response"]))
            if "response_time_s" in said:
                self.assertEqual(float(row["response_time"]), said["response_time_s"])
            self.assertEqual({k: v for k, v in row.items() if k not in OF_TIME | OF_PLAN},
                             {k: v for k, v in asked.items() if k not in OF_TIME | OF_PLAN})
        self.assertIn(('{"mark":{"code":40,"text":"kept"}}',), self.sql("SELECT text FROM notes"))
        self.assertIn(("stopped before the kill",), self.sql("SELECT cut_off_reason FROM attempts"))


if __name__ == "__main__":
    unittest.main()
