"""palpate run from outside: what breaks a session, and what is kept of it.

Usage: run_broken_test.py PALPATE
"""

import contextlib
import os
import signal
import subprocess
import time
import unittest

from live_case import FEELING, PALPATE, PROTOCOL, Live


class Broken(Live):
    def test_after_a_kill_in_a_trial_it_resumes_with_that_trial(self):
        terminal = self.begin()
        terminal.type("1")
        terminal.wait_for("trial 2 of 4]\n")
        terminal.wait_for(FEELING)
        terminal.kill()
        self.assertEqual(self.attempts(), [(1, 1, "completed"), (2, 1, "running")])
        with self.run_session() as again:
            self.finish(again)
        self.assertEqual(self.attempts(), [(1, 1, "completed"), (2, 1, "cut_off"), (2, 2, "completed"),
                                           (3, 1, "completed"), (4, 1, "completed")])
        self.assertEqual(self.ends(), ["interrupted", "done"])
        self.assertEqual([row["trial"] for row in self.export()], ["1", "2", "3", "4"])
        attempts = (self.dir / "attempts.csv").read_text()
        self.assertEqual(attempts.count("\n"), 2, attempts)

    def test_a_truncated_index_loses_no_data(self):
        terminal = self.begin()
        for trial in (1, 2, 3):
            os.truncate(f"{self.db}-shm", 0 if trial < 3 else 100)
            terminal.type("1")
            while terminal.wait_for(FEELING, "[space bar: go on]") != FEELING:
                terminal.type(" ")
        os.truncate(f"{self.db}-shm", 0)
        terminal.type("1")
        self.finish(terminal)
        self.assertEqual(self.attempts(), [(trial, 1, "completed") for trial in (1, 2, 3, 4)])

    def test_a_replay_never_overwrites_a_mesh_that_it_reads(self):
        (self.dir / "solid.obj").write_text(
            "v 0 0 0\nv 0.04 0 0\nv 0 0.04 0\nv 0 0 0.04\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        before = (self.dir / "solid.obj").read_bytes()
        stimuli = [{"name": name, "shape": "mesh", "file": "solid.obj"} for name in ("ball", "box")]
        with self.run_session(samples=True, stimuli=stimuli) as terminal:
            self.finish(terminal)
        replay = [PALPATE, "replay", "--db", self.db, "--trial", "P01/1/2", "--meshes", self.dir, "--out"]
        done = subprocess.run([*replay, self.dir / "solid.obj", "--force"], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
        self.assertIn("mesh", done.stderr)
        self.assertEqual((self.dir / "solid.obj").read_bytes(), before)
        done = subprocess.run([*replay, self.dir / "ticks.csv"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_meshes_are_stored_with_the_data_for_replay_and_export(self):
        solid = "v 0 0 0\nv .04 0 0\nv 0 .04 0\nv 0 0 .04\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        (self.dir / "solid.obj").write_text(solid)
        stimuli = [{"name": "ball", "shape": "mesh", "file": "solid.obj"}, PROTOCOL["stimuli"][1]]
        session = self.begin(stimuli=stimuli, repetitions=1, blocks_per_renderer=1, samples=True)
        time.sleep(0.5)
        session.type("1")
        self.finish(session)
        (trial,) = [t["trial"] for t in self.export() if t["shape"] == "ball"]

        # Half the size, and then deleted: the record has the original.
        mesh = self.dir / "solid.obj"
        mesh.write_text(solid.replace(".04", ".02"))
        replay = [PALPATE, "replay", "--db", self.db, "--trial", f"P01/1/{trial}"]
        for _ in range(2):
            done = subprocess.run(replay, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertIn("equal the record, bit by bit", done.stdout)
            mesh.unlink(missing_ok=True)
        for form, place in [("bids", "stimuli"), ("psych-ds", "materials")]:
            out = self.dir / form
            subprocess.run([PALPATE, "export", "--db", self.db, "--format", form, "--out", out], check=True,
                           capture_output=True)
            (kept,) = (out / place).rglob("solid.obj")
            self.assertEqual(kept.read_text(), solid)

    def test_signals_end_it_with_everything_on_record(self):
        for which, word in ((signal.SIGINT, "Interrupt"), (signal.SIGTERM, "Terminated")):
            terminal = self.begin(code=f"P{int(which)}")
            terminal.send_signal(which)
            self.finish(terminal, status=1)
            self.assertIn(f"signal: {word}", terminal.text)
        self.assertEqual(self.ends(), ["aborted", "aborted"])
        with self.run_session(code=f"P{int(signal.SIGINT)}") as again:
            self.finish(again)

    def test_a_hangup_of_the_terminal_ends_it(self):
        terminal = self.begin()
        terminal.hang_up()
        self.assertEqual(terminal.process.wait(30), 1)
        self.assertEqual(self.ends(), ["aborted"])
        self.assertEqual(self.attempts(), [(1, 1, "cut_off")])

    def test_the_end_of_the_input_ends_it(self):
        done = subprocess.run([PALPATE, "run", self.protocol(), "--db", self.db, "--participant", "P01", "--device",
                               "simulated", "--no-window"], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=60)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("screen was closed", done.stderr)

    def test_pipes_work_like_a_terminal(self):
        process = subprocess.Popen([PALPATE, "run", self.protocol(repetitions=1, blocks_per_renderer=1, texts={}), "--db",
                                    self.db, "--participant", "P01", "--device", "simulated", "--no-window"],
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(process.kill)
        for _ in range(2):
            while FEELING.encode() not in process.stderr.readline():
                pass
            process.stdin.write(b"1\n")
            process.stdin.flush()
        out, err = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 0, err)
        self.assertIn(b"2 of 2 trials on record; done", out)

    def test_a_full_disk_is_reported_and_the_current_trial_is_not_called_saved(self):
        disk = self.dir / "disk"
        disk.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=400k", "none", disk], capture_output=True).returncode:
            self.skipTest("nothing can be mounted here")
        try:
            self.db = disk / "live.db"
            terminal = self.begin(samples=True)
            with open(disk / "ballast", "wb", buffering=0) as ballast, contextlib.suppress(OSError):
                while True:
                    ballast.write(bytes(512))
            terminal.type("1")
            self.assertEqual(terminal.finish(), 1, terminal.text)
            self.assertRegex(terminal.text, "disk|space")
            os.remove(disk / "ballast")
            self.assertEqual([state for _, _, state in self.attempts()], ["running"])
            with self.run_session(samples=True) as again:
                self.finish(again)
            self.assertIn((1, 2, "completed"), self.attempts())
        finally:
            subprocess.run(["umount", "-l", disk], check=True)

    def test_a_database_in_use_is_refused(self):
        self.begin()
        with self.run_session(code="P02") as second:
            self.assertEqual(second.finish(), 2)
            self.assertIn("open", second.text)


if __name__ == "__main__":
    unittest.main()
