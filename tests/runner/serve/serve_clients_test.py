"""The clients of palpate serve and their examples: asyncio, a pipe, Octave, and programs as labs have them.

Usage: serve_clients_test.py PALPATE PROTOCOLS CLIENT.py
"""

import asyncio
import contextlib
import csv
import importlib.util
import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import unittest

from serve_case import BALL, CLIENT, PALPATE, PATIENCE, ServeCase, ServeError, client

EXAMPLES = CLIENT.parents[1] / "examples"
OCTAVE = CLIENT.parents[2] / "octave"
SOURCES = CLIENT.parents[3]
README = (SOURCES / "runner" / "README.md").read_text(encoding="utf-8")
PROTOCOL = {
    "version": 2, "name": "clients", "renderers": ["ray"], "seed": 5, "servo": {"rate_hz": 100}, "home": {"rest_s": 0.1},
    "material": {"stiffness_n_per_m": 50},
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
                {"name": "box", "shape": "cube", "edge_m": 0.03}],
    "blocks": [{"name": "free", "task": "external", "stimuli": ["ball", "box"], "trials": 3}],
}


def agrees(program):
    """A person who presses Enter now and again: on a busy machine the servo may take the forces off."""

    def press():
        with contextlib.suppress(OSError, ValueError):
            while program.poll() is None:
                program.stdin.write("\n")
                program.stdin.flush()
                time.sleep(0.3)
    threading.Thread(target=press, daemon=True).start()


class Clients(ServeCase):
    def setUp(self):
        super().setUp()
        self.token = self.dir / "token.json"
        self.db = self.dir / "study.db"

    def record(self, **block):
        (self.dir / "p.json").write_text(json.dumps({**PROTOCOL, "blocks": [{**PROTOCOL["blocks"][0], **block}]}))
        process = self.run_server([PALPATE, "serve", "--device", "simulated", "--protocol", self.dir / "p.json", "--db", self.db,
                                   "--participant", "P01", "--token-file", self.token])
        self.said = json.loads(self.token.read_text())
        return process

    def rows(self):
        out = self.dir / "rows.csv"
        subprocess.run([PALPATE, "export", "--db", self.db, "--format", "csv", "--out", out], check=True, capture_output=True)
        with open(out, newline="", encoding="utf-8") as table:
            return list(csv.DictReader(table))

    def run_program(self, *command, **more):
        try:
            done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=PATIENCE, cwd=self.dir, **more)
        except subprocess.TimeoutExpired as hang:
            raise AssertionError(f"it does not end; it said: {hang.stdout}\n{hang.stderr}") from hang
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def run_with_a_person(self, *command):
        program = subprocess.Popen(list(map(str, command)), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True, cwd=self.dir)
        self.addCleanup(program.kill)
        agrees(program)
        said = []
        for stream in (program.stdout, program.stderr):
            said.append([])
            threading.Thread(target=lambda where, to: to.extend(where), args=(stream, said[-1]), daemon=True).start()
        self.assertEqual(program.wait(PATIENCE), 0, said)
        time.sleep(0.2)  # until its last words were read
        return "".join(said[0])

    def assert_on_record(self, table):
        """A table of trial, stimulus, response, correct and response time against the record."""
        rows = self.rows()
        self.assertEqual(len(rows), 3)
        self.assertEqual([(r["trial"], r["shape"], r["response"], r["correct"]) for r in rows],
                         [(t["trial"], t["stimulus"], t["response"], {"True": "1", "False": "0"}.get(t["correct"], t["correct"]))
                          for t in table])
        for row, told in zip(rows, table):
            self.assertAlmostEqual(float(row["response_time"]), float(told.get("response_time_s") or told["response_time"]), places=6)

    async def started_with_a_contact(self, hand):
        """Time zero of trial 3, once it was felt: on a busy machine forces may go off before."""
        while True:
            zero = await hand.start(renderer="point", trial=3)
            first = asyncio.ensure_future(hand.wait_for("first_contact", PATIENCE))
            off = asyncio.ensure_future(asyncio.sleep(20))
            await asyncio.wait({first, off}, return_when=asyncio.FIRST_COMPLETED)
            off.cancel()
            if first.done():
                return zero
            first.cancel()
            await hand.stop()
            await hand.clear()

    async def use(self, hand):
        """All that the blocking client has."""
        await hand.load(BALL)
        await hand.subscribe(100, ("tip", "force", "depth"))
        zero = await self.started_with_a_contact(hand)
        # Two requests at once each get their reply.
        clock, marked = await asyncio.gather(hand.clock(), hand.mark(3, "x"))
        self.assertLess(abs(clock.offset_ns), clock.round_trip_ns / 2 + 1)
        self.assertGreater(marked, zero)
        await asyncio.sleep(0.7)  # it keeps sending signs of life
        said = await hand.answer("ball")
        self.assertEqual((said["trial"], said["zero_t_ns"]), (3, zero))
        await asyncio.sleep(0.1)
        samples = hand.samples()
        count = len(samples["tick"])
        self.assertGreater(count, 10)
        self.assertEqual([samples[name].shape for name in ("tip", "force", "depth")],
                         [(count, 3), (count, 3), (count,)])
        with self.assertRaises(TimeoutError):
            await hand.wait_for("never", 0.05)
        await hand.set("/objects/0/stiffness_n_per_m", 40)
        await hand.note("n")
        await hand.emergency()
        await hand.clear()
        await hand.stop("enough")
        self.assertIn("stopped", [event["event"] for event in hand.events()])

    def test_asyncio_equals_the_blocking_client(self):
        self.serve()

        async def session(**where):
            async with await client.AsyncClient.connect(**where, token=self.said["token"], time_out=PATIENCE) as hand:
                self.assertIn("objects", hand.server["scene"])
                with self.assertRaises(ServeError) as caught:
                    await client.AsyncClient.connect(**where, token="0" * 32)
                self.assertEqual(caught.exception.code, "bad-token")
                await self.use(hand)
            with self.assertRaises(ServeError) as caught:
                await hand.stop()
            self.assertEqual(caught.exception.code, "closed")

        asyncio.run(session(url=self.said["url"]))
        asyncio.run(session(socket_path=str(self.path)))

    def test_a_task_that_waits_ends_when_it_is_cancelled_whatever_comes_meanwhile(self):
        self.serve()

        async def session():
            async with await client.AsyncClient.connect(socket_path=str(self.path), token=self.said["token"], role="watch",
                                                        time_out=PATIENCE) as eye:
                for turns in range(8):  # of the loop, between the event and the cancellation
                    waiting = asyncio.ensure_future(eye.wait_for("never", PATIENCE))
                    await asyncio.sleep(0)
                    await asyncio.sleep(0)
                    kept = eye._take({"event": "left", "t_ns": 1})
                    if asyncio.iscoroutine(kept):
                        await kept
                    for _ in range(turns):
                        await asyncio.sleep(0)
                    waiting.cancel()
                    await asyncio.wait([waiting], timeout=5)
                    self.assertTrue(waiting.cancelled(), f"after {turns} turns")

        asyncio.run(session())

    def test_a_program_hears_that_the_server_has_gone(self):
        process = self.serve()
        hand = self.client()
        hand.subscribe()
        self.touch(hand)

        async def session():
            async with await client.AsyncClient.connect(self.said["url"], self.said["token"], role="watch", time_out=PATIENCE) as eye:
                hand.note("the last")
                await eye.wait_for("note", PATIENCE)
                hand.note("after the last")
                waiting = asyncio.ensure_future(eye.wait_for("never", PATIENCE))
                process.kill()
                with self.assertRaises(ServeError):
                    await waiting
                for ask in (eye.samples, eye.events):
                    with self.assertRaises(ServeError) as caught:
                        ask()
                    self.assertEqual(caught.exception.code, "closed")

        asyncio.run(session())
        self.refused("closed", hand.wait_for, "never", PATIENCE)
        self.assertGreater(len(hand.samples()["tick"]), 0)  # what had come is not lost
        for ask in (hand.samples, hand.events):
            self.refused("closed", ask)

    def test_a_pipe_passes_messages_on(self):
        self.serve("--token-file", self.token)
        lines = ['{"type": "start"}', '{"type": "stop"}', '{"type": "jump"}', "nonsense", '{"type": "subscribe", "rate_hz": 50}',
                 '{"type": "events"}', '{"type": "samples"}', "[]"]
        out = self.run_program(sys.executable, CLIENT, self.token, input="\n".join(lines) + "\n")
        said = [json.loads(line) for line in out.splitlines()]
        self.assertEqual([one["ok"] for one in said], [True, True, True, False, False, True, True, True, False])
        self.assertEqual(said[3]["error"]["code"], "bad-message")
        self.assertIn("started", [event["event"] for event in said[6]["events"]])
        self.assertEqual(said[7]["tick"], [])
        done = subprocess.run([sys.executable, CLIENT, self.dir / "none"], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, 1)
        self.assertNotIn("Traceback", done.stderr)

    def test_a_time_needs_a_clock(self):
        self.serve()
        with self.client() as hand:
            with self.assertRaises(ValueError):
                hand.answer("ball", t_ns=1)
            hand.best_clock = client.Clock(0, 3_000_000)
            with self.assertRaises(ValueError):
                hand.answer("ball", t_ns=1)

    def test_the_trial_loop_on_record(self):
        process = self.record()
        out = self.dir / "trials.csv"
        # On a busy machine the servo may cut a trial off: then one more key is used.
        self.run_program(sys.executable, EXAMPLES / "serve_trials.py", self.token, "--out", out, "--keys", "12" * 50)
        self.assertEqual(process.wait(PATIENCE), 0)
        with open(out, newline="") as table:
            self.assert_on_record(list(csv.DictReader(table)))

    def test_a_trial_whose_time_is_over_does_not_end_the_experiment(self):
        process = self.record(time_out_s=0.2)
        with self.client() as hand:
            while hand.next["trial"] == 1:
                try:
                    hand.start(stimulus="ball", trial=1)
                    stored = self.one_of(hand, "stored", "forces_off")
                    if stored["event"] == "stored":
                        break
                except ServeError as error:
                    self.assertEqual(error.code, "forces-off")
                hand.clear()
            self.assertEqual((stored["trial"], stored["timed_out"]), (1, True))
            self.assertEqual(hand.next["trial"], 2)
            late = self.refused("timed-out", hand.answer, "ball")
            self.assertEqual((late.stored["trial"], late.stored["next"]["trial"]), (1, 2))
        out = self.dir / "trials.csv"
        eye = self.client(role="watch")
        program = subprocess.Popen([sys.executable, EXAMPLES / "serve_trials.py", self.token, "--out", out], text=True,
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(lambda: (program.kill(), program.communicate()))

        def press():
            with contextlib.suppress(OSError, ValueError, ServeError):
                while program.poll() is None:  # always too late
                    came = eye.wait_for(("stored", "forces_off"), PATIENCE)
                    program.stdin.write("1\n" if came["event"] == "stored" else "1\ng\n")
                    program.stdin.flush()
        threading.Thread(target=press, daemon=True).start()
        self.assertEqual(program.wait(PATIENCE), 0, program.stderr.read())
        self.assertEqual(process.wait(PATIENCE), 0)
        self.assertEqual([row["timed_out"] for row in self.rows()], ["1", "1", "1"])
        with open(out, newline="") as table:
            self.assertEqual([(row["trial"], row["timed_out"]) for row in csv.DictReader(table)], [("2", "True"), ("3", "True")])

    def test_frames_of_a_game_engine(self):
        self.serve("--token-file", self.token, scene=False)
        frames = [json.loads(line) for line in self.run_with_a_person(
            sys.executable, EXAMPLES / "serve_frames.py", self.token, "--frames", 60).splitlines()]
        self.assertEqual([frame["frame"] for frame in frames], list(range(60)))
        for frame in frames:
            self.assertLess(max(map(abs, frame["tip"])), 0.3)
            length = sum(x * x for x in frame["points_to"]) ** 0.5
            self.assertAlmostEqual(length, 0.12, places=3)

    def test_frames_go_on_after_forces_were_off_and_end_with_the_server(self):
        process = self.serve("--token-file", self.token, scene=False)
        self.said = json.loads(self.token.read_text())
        program = subprocess.Popen([sys.executable, EXAMPLES / "serve_frames.py", self.token, "--frames", "1000000"],
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(lambda: (program.kill(), program.communicate()))
        agrees(program)
        with self.client(role="watch") as eye:
            for _ in range(2):
                self.one_of(eye, "started")
                self.assertTrue(program.stdout.readline())
                eye.emergency()
                self.one_of(eye, "emergency")
                time.sleep(1.5)
                self.assertNotIn("started", [event["event"] for event in eye.events()])
                eye.clear()
            self.one_of(eye, "started")
        process.kill()
        _, said = program.communicate(timeout=PATIENCE)
        self.assertEqual(program.returncode, 1)
        self.assertIn("the server has gone", said)
        self.assertIn("forces are off", said)
        self.assertNotIn("Traceback", said)

    def test_a_live_plot(self):
        if importlib.util.find_spec("matplotlib") is None:
            self.skipTest("matplotlib is not installed")
        self.serve("--token-file", self.token)
        self.said = json.loads(self.token.read_text())
        picture = self.dir / "plot.png"
        with self.client() as hand:
            program = subprocess.Popen([sys.executable, EXAMPLES / "serve_plot.py", self.token, "--out", picture, "--seconds", "1.5"],
                                       cwd=self.dir, stderr=subprocess.PIPE, text=True)
            self.addCleanup(program.kill)
            while program.poll() is None:
                try:
                    hand.start()
                    while program.poll() is None and not hand._events:
                        time.sleep(0.1)
                    self.one_of(hand, "forces_off", "started", "first_contact", "left")
                    time.sleep(0.5)
                    hand.stop()
                except ServeError:
                    hand.clear()
        self.assertEqual(program.returncode, 0, program.stderr.read())
        program.stderr.close()
        self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertGreater(picture.stat().st_size, 5000)

    def readme(self, language, words):
        """The README's block of a language that contains these words, as shown."""
        section = README[README.index("## How to drive palpate from PsychoPy"):]
        found = [block for block in re.findall(rf"```{language}\n(.*?)```", section[:section.index("\n## ", 1)], re.DOTALL)
                 if words in block]
        self.assertEqual(len(found), 1, words)
        return found[0]

    def serve_as_in_the_readme(self, command, **more):
        """In a folder with the protocols of the sources, with the program in PATH."""
        if not (self.dir / "protocols").exists():
            (self.dir / "protocols").symlink_to(SOURCES / "protocols")
        process = subprocess.Popen(["bash", "-c", "exec " + command.strip()], cwd=self.dir, stdout=subprocess.PIPE,
                                   stderr=subprocess.DEVNULL, text=True,
                                   env={**os.environ, "PATH": f"{PALPATE.parent}:{os.environ['PATH']}"}, **more)
        self.addCleanup(lambda: (process.kill(), process.communicate()))
        self.assertIn("serving", process.stdout.readline())
        self.said = json.loads(self.token.read_text())
        return process

    def study_as_in_the_readme(self, trials):
        """Its protocol is that of the README, with fewer trials, softer objects and a slower servo."""
        whole = json.loads(self.readme("json", '"external"'))
        (self.dir / "study.json").write_text(json.dumps(whole))
        subprocess.run([PALPATE, "validate", self.dir / "study.json"], check=True, capture_output=True)
        small = {name: PROTOCOL[name] for name in ("servo", "home", "material", "stimuli")}
        (self.dir / "study.json").write_text(json.dumps({**whole, **small, "blocks": [{**whole["blocks"][0], "trials": trials}]}))
        return self.serve_as_in_the_readme(self.readme("sh not tested:[^\n]*", "--participant P03"))

    def run_until_done(self, command, **more):
        """Retries if forces went off on a busy machine: the session resumes with the trial that is due."""
        while True:
            done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=PATIENCE, cwd=self.dir, **more)
            if done.returncode == 0:
                return done.stdout
            self.assertRegex(done.stderr, "forces-off|nothing-felt|stopped")
            with self.client() as hand:
                hand.clear()

    def test_the_scene_of_the_readme_is_served(self):
        process = self.serve_as_in_the_readme(self.readme("sh not tested:[^\n]*", "--scene"))
        with self.client(role="watch") as eye:
            self.assertTrue(eye.server["scene"]["objects"])
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(PATIENCE), 0)

    def test_python_as_in_the_readme(self):
        process = self.study_as_in_the_readme(trials=2)
        (self.dir / "loop.py").write_text(self.readme("python", "from client"))
        out = self.run_until_done([sys.executable, "loop.py"], input="yes\nno\n",
                                  env={**os.environ, "PYTHONPATH": str(CLIENT.parent)})
        self.assertEqual(process.wait(PATIENCE), 0)
        rows = self.rows()
        self.assertEqual([row["shape"] for row in rows], ["ball", "ball"])
        self.assertEqual(rows[-1]["response"], out.split("? ")[-1].split()[1])

    def test_octave_as_in_the_readme(self):
        if shutil.which("octave-cli") is None:
            self.skipTest("Octave is not installed")
        process = self.study_as_in_the_readme(trials=1)
        (self.dir / "loop.m").write_text(self.readme("octave", "palpate ("))
        self.run_until_done(["octave-cli", "--no-init-file", "--path", OCTAVE, "loop.m"])
        self.assertEqual(process.wait(PATIENCE), 0)
        self.assertEqual([(row["shape"], row["response"]) for row in self.rows()], [("ball", "yes")])

    def test_octave(self):
        if shutil.which("octave-cli") is None:
            self.skipTest("Octave is not installed")
        process = self.record()
        out = self.run_with_a_person("octave-cli", "--no-init-file", OCTAVE / "trials.m", self.token)
        self.assertEqual(process.wait(PATIENCE), 0)
        self.assert_on_record(list(csv.DictReader(io.StringIO(out))))
        lost = subprocess.run(["octave-cli", "--no-init-file", OCTAVE / "trials.m", self.token], capture_output=True, text=True,
                              timeout=PATIENCE, cwd=self.dir)
        self.assertNotEqual(lost.returncode, 0)


if __name__ == "__main__":
    unittest.main()
