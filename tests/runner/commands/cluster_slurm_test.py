"""palpate cluster on a real Slurm of two nodes: whatever is killed, requeued, restarted or full, the merged result has
the bytes of one machine's. Usage: cluster_slurm_test.py PALPATE PROTOCOLS [REPETITIONS]
Needs root (daemons, a small file system) and Debian's slurm-wlm and munge. REPETITIONS: so many that a point takes half a
second or so."""

import errno
import json
import os
import pathlib
import signal
import sqlite3
import subprocess
import sys
import tempfile
import unittest

from slurm import NotHere, Slurm

PALPATE, PROTOCOLS = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
REPETITIONS = int(sys.argv[3]) if len(sys.argv) > 3 else 20
POINTS, SHARDS = 40, 8


class OnSlurm(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.folder.chmod(0o755)
        (self.folder / "s.json").write_text(json.dumps({"version": 1, "parameters": [
            {"name": "noise", "of": "participant", "path": "/percept/direction_sd_deg", "distribution": "uniform",
             "low": 10, "high": 20}]}))
        self.slurm = Slurm(self.folder / "slurm")
        try:
            self.slurm.__enter__()
        except NotHere as why:
            self.skipTest(f"Slurm does not run here: {why}")
        self.addCleanup(self.slurm.__exit__)

    def palpate(self, *arguments):
        done = subprocess.run([PALPATE, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True,
                              env=self.slurm.environment)
        self.assertEqual(done.returncode, 0, f"{arguments}\n{done.stdout}{done.stderr}")
        return done.stdout

    def part(self, shard):
        return self.disk / "d" / "parts" / f"part{shard:06}.sweep"

    def points(self, shard):
        try:
            with sqlite3.connect(f"file:{self.part(shard)}?mode=ro", uri=True) as file:
                return file.execute("SELECT count(*) FROM points").fetchone()[0]
        except sqlite3.Error:
            return 0

    def states(self, job):
        lines = self.slurm.ask("squeue", "-h", "--array", "-o", "%K %T", "-j", job).splitlines()
        return dict(line.split() for line in lines)

    def half_way(self):
        """Waits for a shard that runs, has a point and lacks two; its number."""
        found = []

        def look():
            running = [int(k) for k, state in self.states(self.job).items() if state == "RUNNING"]
            found[:] = [k for k in running if 1 <= self.points(k) <= POINTS // SHARDS - 2 and k not in self.hit]
            return found

        self.slurm.wait("a shard is half way", look)
        self.hit.add(found[0])
        return found[0]

    def process_of(self, shard):
        wanted = f"{shard}/{SHARDS}"
        for entry in pathlib.Path("/proc").iterdir():
            try:
                words = (entry / "cmdline").read_text().split("\0") if entry.name.isdigit() else []
                if wanted in words and os.path.realpath(entry / "cwd") == str(self.disk / "d"):
                    return int(entry.name)
            except OSError:
                continue  # it has ended
        self.fail(f"no process of shard {shard}")

    def small_disk(self):
        self.disk = (self.folder / "disk").resolve()
        self.disk.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=8m", "tmpfs", self.disk], check=True)
        self.addCleanup(subprocess.run, ["umount", "--lazy", self.disk], check=True)

    def fill_disk(self):
        with open(self.disk / "filler", "wb", buffering=0) as file:
            try:
                while True:
                    file.write(b"\0" * 4096)
            except OSError as error:
                self.assertEqual(error.errno, errno.ENOSPC)

    def others_ended(self, requeued):
        """Whether only the last shard is left. A requeued task would wait for two minutes, so let it begin."""
        states = self.states(self.job)
        if states.get(str(requeued)) == "PENDING":
            self.slurm.ask("scontrol", "update", f"jobid={self.job}_{requeued}", "StartTime=now")
        return set(states) <= {str(SHARDS)}

    def kill_requeue_and_restart(self):
        """Numbers of the shards that were killed and requeued, once all but the last have ended."""
        killed = self.half_way()
        os.kill(self.process_of(killed), signal.SIGKILL)

        requeued = self.half_way()
        subprocess.run(["scontrol", "requeue", f"{self.job}_{requeued}"], env=self.slurm.environment, check=True)

        self.half_way()  # its node's daemon restarts, the task stays
        self.slurm.end("n1")
        self.slurm.start_node("n1")

        self.half_way()
        self.slurm.end("slurmctld")
        self.slurm.start_controller()
        self.slurm.wait("the controller is back", lambda: self.slurm.ask("scontrol", "ping"))
        self.slurm.wait("all but the last have ended", lambda: self.others_ended(requeued))
        return killed, requeued

    def test_results_survive_kills_requeues_restarts_and_a_full_disk(self):
        self.small_disk()
        self.hit = set()
        plan = [PROTOCOLS / "quick.json", "--space", "s.json", "--points", POINTS, "--participants", 1,
                "--repetitions", REPETITIONS]
        said = self.palpate("cluster", "sweep", *plan, "--shards", SHARDS, "--dir", "disk/d")
        self.job = said.split()[1].rstrip(":")
        last = f"{self.job}_{SHARDS}"
        subprocess.run(["scontrol", "hold", last], env=self.slurm.environment, check=True)
        killed, requeued = self.kill_requeue_and_restart()
        self.assertLess(self.points(killed), POINTS // SHARDS)
        self.assertEqual(self.points(requeued), POINTS // SHARDS)

        self.slurm.ask("scontrol", "release", last)
        full = self.half_way()
        self.assertEqual(full, SHARDS)
        self.fill_disk()
        self.slurm.wait("the shard without room has ended", lambda: not self.states(self.job))
        self.assertLess(self.points(full), POINTS // SHARDS)
        (self.disk / "filler").unlink()

        status = self.palpate("cluster", "status", "disk/d")
        self.assertIn(f"shards: {SHARDS - 2} done, 0 running, 0 waiting, 2 not done", status)
        self.assertFalse((self.disk / "d" / "all.sweep").exists())
        self.assertIn(f"shards {killed},{full}", self.palpate("cluster", "submit", "disk/d"))
        self.slurm.wait("the analysis is there", lambda: not self.slurm.ask("squeue", "-h").strip())
        self.assertIn("report.html", self.palpate("cluster", "status", "disk/d"))
        self.palpate("sweep", *plan, "--db", "one.sweep")
        self.assertEqual((self.disk / "d" / "all.sweep").read_bytes(), (self.folder / "one.sweep").read_bytes())


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
