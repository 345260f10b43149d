"""palpate cluster with a Slurm of a few lines: sbatch runs the tasks of an array at once, squeue tells what a file says.
Usage: cluster_command_test.py PALPATE PROTOCOLS"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PALPATE, PROTOCOLS = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()

SBATCH = """#!/usr/bin/env python3
import os, pathlib, subprocess, sys
here = pathlib.Path(__file__).parent
calls = here / "calls"
job = 100 + len(calls.read_text().splitlines() if calls.exists() else [])
with open(calls, "a") as file:
    print("\\t".join(sys.argv[1:]), file=file)
if (here / "refuse").exists():
    sys.exit("sbatch: error: invalid partition")
options = dict(a.lstrip("-").split("=", 1) for a in sys.argv[1:-1] if "=" in a)
tasks = [None]
if "array" in options:
    tasks = []
    for part in options["array"].split(","):
        first, _, last = part.partition("-")
        tasks += range(int(first), int(last or first) + 1)
skip = (here / "kill").read_text().split() if (here / "kill").exists() else []
for task in tasks:
    if str(task) in skip:
        continue
    if task is None and skip:
        break  # afterok: not all are done
    env = {**os.environ, **({} if task is None else {"SLURM_ARRAY_TASK_ID": str(task)})}
    subprocess.run([sys.argv[-1]], cwd=options["chdir"], env=env, check=True, stdout=subprocess.DEVNULL)
print(f"{job};somewhere")
"""
SQUEUE = """#!/bin/sh
cat "$(dirname "$0")/queue" 2> /dev/null || { echo "slurm_load_jobs error: Invalid job id specified" >&2; exit 1; }
"""


class Cluster(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.slurm = self.folder / "slurm"
        self.slurm.mkdir()
        for name, text in (("sbatch", SBATCH), ("squeue", SQUEUE)):
            (self.slurm / name).write_text(text)
            (self.slurm / name).chmod(0o755)
        self.no_slurm = self.folder / "none"  # what a shell says of a command that is not there
        self.no_slurm.mkdir()
        for name in ("sbatch", "squeue"):
            (self.no_slurm / name).write_text(f"#!/bin/sh\necho 'sh: 1: {name}: not found' >&2\nexit 127\n")
            (self.no_slurm / name).chmod(0o755)
        (self.folder / "s.json").write_text(json.dumps({"version": 1, "parameters": [
            {"name": "noise", "of": "participant", "path": "/percept/direction_sd_deg", "distribution": "uniform",
             "low": 10, "high": 20}]}))

    def palpate(self, *arguments, status=0, slurm=True):
        path = f"{self.slurm if slurm else self.no_slurm}:{os.environ['PATH']}"
        done = subprocess.run([PALPATE, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True, timeout=300,
                              env={**os.environ, "PATH": path})
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.stdout}{done.stderr}")
        return done.stdout + done.stderr

    PLAN = [PROTOCOLS / "quick.json", "--space", "s.json", "--points", 5, "--participants", 1, "--repetitions", 1]

    def single(self):
        self.palpate("sweep", *self.PLAN, "--db", "one.sweep")
        return (self.folder / "one.sweep").read_bytes()

    def calls(self):
        return [line.split("\t") for line in (self.slurm / "calls").read_text().splitlines()]

    def test_an_array_of_shards_gives_the_file_of_one_machine(self):
        said = self.palpate("cluster", "sweep", *self.PLAN, "--shards", 3, "--dir", "a b", "--time", "01:00:00", "--partition", "all")
        self.assertIn("job 100: shards 1-3", said)
        self.assertIn("ten minutes", said)
        self.assertEqual((self.folder / "a b/all.sweep").read_bytes(), self.single())
        self.assertIn("SIMULATED", (self.folder / "a b/analysis.txt").read_text())
        self.assertIn("gains", json.loads((self.folder / "a b/analysis.json").read_text()))
        array, finish = self.calls()
        for option in ("--parsable", "--array=1-3", "--requeue", "--time=01:00:00", "--partition=all"):
            self.assertIn(option, array)
        self.assertIn("--dependency=afterok:100", finish)
        status = self.palpate("cluster", "status", "a b")
        self.assertIn("shards: 3 done, 0 running, 0 waiting, 0 not done", status)
        self.assertIn("points: 5 of 5", status)
        self.assertIn("report.html", status)

    def test_killed_shards_resume_with_the_same_result(self):
        (self.slurm / "kill").write_text("2 3")
        self.palpate("cluster", "sweep", *self.PLAN, "--shards", 4, "--dir", "d")
        self.assertFalse((self.folder / "d/all.sweep").exists())
        (self.slurm / "queue").write_text("3 RUNNING\n")
        status = self.palpate("cluster", "status", "d")
        self.assertIn("shards: 2 done, 1 running, 0 waiting, 1 not done", status)
        self.assertIn("not done: shards 2;", status)
        self.assertIn("still in the queue", self.palpate("cluster", "submit", "d", status=2))
        (self.slurm / "queue").write_text("[2-3] PENDING\n3 PENDING\n")
        self.assertIn("1 waiting", self.palpate("cluster", "status", "d"))
        (self.slurm / "queue").unlink()
        (self.slurm / "kill").unlink()
        self.palpate("cluster", "submit", "d")
        self.assertIn("--array=2-3", self.calls()[2])
        self.assertEqual((self.folder / "d/all.sweep").read_bytes(), self.single())

    STUDY = [PROTOCOLS / "quick.json", "--participants", 3, "--seed", 4]

    def trials(self, database):
        self.palpate("export", "--db", database, "--format", "csv", "--out", "trials.csv", "--force")
        return (self.folder / "trials.csv").read_bytes()

    def test_a_study_in_shards_of_participants_equals_that_of_one_machine(self):
        (self.slurm / "kill").write_text("1")
        said = self.palpate("cluster", "simulate", *self.STUDY, "--shards", 2, "--dir", "d")
        self.assertIn("shards 1-2", said)
        status = self.palpate("cluster", "status", "d")
        self.assertIn("shards: 1 done", status)
        self.assertIn("sessions: 2 of 3", status)
        (self.slurm / "kill").unlink()
        self.palpate("cluster", "submit", "d")
        self.assertIn("all.db", self.palpate("cluster", "status", "d"))
        self.palpate("simulate", *self.STUDY, "--db", "one.db")
        self.assertEqual(self.trials("d/all.db"), self.trials("one.db"))
        self.palpate("analyze", "--db", "one.db", "--json", "one.json")
        mine, ours = (json.loads((self.folder / name).read_text()) for name in ("one.json", "d/analysis.json"))
        self.assertEqual(mine["paired_by_shape"], ours["paired_by_shape"])
        self.assertIn("--shards", self.palpate("cluster", "simulate", *self.STUDY, "--shards", 4, "--dir", "e", status=2))
        self.assertIn("--space", self.palpate("cluster", "simulate", *self.STUDY, "--space", "s.json", "--shards", 2, "--dir", "e", status=2))

    def test_tasks_are_estimated_by_their_trials_and_swept_as_on_one_machine(self):
        # 4 + 70 + 80 trials of two intervals, 10 s each, 3000 simulated s in a second.
        stiffness = PROTOCOLS / "stiffness-2afc.json"
        said = self.palpate("cluster", "sweep", stiffness, "--space", "s.json", "--points", 100, "--participants", 30,
                            "--shards", 1, "--dir", "t", "--no-submit")
        self.assertIn("roughly 52 min", said)
        self.assertNotIn("warning", said)
        said = self.palpate("cluster", "simulate", stiffness, "--participants", 3000, "--shards", 3, "--dir", "u", "--no-submit")
        self.assertIn("roughly 18 min", said)
        ball = {"shape": "sphere", "radius_m": 0.02, "subdivisions": 1, "stiffness_n_per_m": 300}
        (self.folder / "few.json").write_text(json.dumps({
            "version": 2, "name": "few", "renderers": ["point"], "orientation": "fixed", "stimuli": [{"name": "ball", **ball}],
            "blocks": [{"name": "stairs", "task": "compare", "stimuli": ["ball"], "standard": "ball",
                        "level": {"path": "/stiffness_n_per_m"},
                        "procedure": {"kind": "staircase", "start": 500, "min": 300, "max": 600, "steps": [50],
                                      "stop": {"trials": 12}}}]}))
        few = ["few.json", "--space", "s.json", "--points", 3, "--participants", 2]
        self.palpate("cluster", "sweep", *few, "--shards", 2, "--dir", "v")
        self.palpate("sweep", *few, "--db", "few.sweep")
        self.assertEqual((self.folder / "v/all.sweep").read_bytes(), (self.folder / "few.sweep").read_bytes())
        self.assertIn("points: 3 of 3", self.palpate("cluster", "status", "v"))

    def test_a_folder_keeps_the_version_that_it_began_with(self):
        old = ["--participant-version", 1]
        (self.slurm / "kill").write_text("1")
        self.palpate("cluster", "simulate", *self.STUDY, *old, "--shards", 2, "--dir", "d")
        self.palpate("cluster", "sweep", *self.PLAN, *old, "--shards", 2, "--dir", "e")
        (self.slurm / "kill").unlink()
        for folder in ("d", "e"):
            self.palpate("cluster", "submit", folder)
        self.palpate("simulate", *self.STUDY, *old, "--db", "old.db")
        self.palpate("sweep", *self.PLAN, *old, "--db", "old.sweep")
        self.assertEqual(self.trials("d/all.db"), self.trials("old.db"))
        self.assertEqual((self.folder / "e/all.sweep").read_bytes(), (self.folder / "old.sweep").read_bytes())
        self.palpate("cluster", "simulate", *self.STUDY, "--shards", 2, "--dir", "f", "--no-submit")
        self.palpate("cluster", "sweep", *self.PLAN, "--shards", 2, "--dir", "g", "--no-submit")
        for folder in ("f", "g"):  # whatever the default of the resuming program
            self.assertIn("--participant-version 3", (self.folder / folder / "shard.sh").read_text())

    PLAN_OPTIONS = ["--gain-sd", 0.15, "--residual-sd", 0.5, "--effect", "cone=22,cube=11", "--participants", "4-30",
                    "--studies", 400, "--trials", "5,9,20"]

    def test_a_plan_in_curves_equals_that_of_one_machine(self):
        (self.slurm / "kill").write_text("2")
        self.assertIn("shards 1-3", self.palpate("cluster", "plan", *self.PLAN_OPTIONS, "--dir", "d"))
        self.assertIn("curves: 2 of 3", self.palpate("cluster", "status", "d"))
        (self.slurm / "kill").unlink()
        self.palpate("cluster", "submit", "d")
        self.assertIn("result: analysis.txt, analysis.json, power.svg", self.palpate("cluster", "status", "d"))
        said = self.palpate("plan", *self.PLAN_OPTIONS, "--json", "one.json", "--figure", "one.svg")
        for mine, ours in (("one.json", "d/analysis.json"), ("one.svg", "d/power.svg")):
            self.assertEqual((self.folder / mine).read_bytes(), (self.folder / ours).read_bytes())
        self.assertEqual(said, (self.folder / "d/analysis.txt").read_text())

    def test_a_plan_takes_powers_of_the_same_model_and_simulation_only(self):
        plan = ["plan", *self.PLAN_OPTIONS]
        self.palpate(*plan, "--json", "one.json")
        known = json.loads((self.folder / "one.json").read_text())
        known["curves"][0]["points"][-1]["power_all"] = known["curves"][0]["points"][-1]["power"] = 0.0125
        (self.folder / "false.json").write_text(json.dumps(known))
        self.palpate(*plan, "--reuse", "false.json", "--json", "two.json")
        found = json.loads((self.folder / "two.json").read_text())
        self.assertEqual(found["curves"][0]["points"][-1]["power"], 0.0125)  # it was reused, not simulated
        self.assertEqual(found["curves"][1:], known["curves"][1:])
        for change, words in ((["--residual-sd", 0.6], "/model/residual_sd: has another model"), (["--studies", 500], "/settings/studies: has another simulation"),
                              (["--seed", 3], "/settings/seed: has another simulation"), (["--effect", "cone=22"], "another model")):
            options = {**dict(zip(self.PLAN_OPTIONS[::2], self.PLAN_OPTIONS[1::2])), **dict([change])}
            words_now = [word for pair in options.items() for word in pair]
            self.assertIn(words, self.palpate("plan", *words_now, "--reuse", "one.json", status=2))
        (self.folder / "bad.json").write_text("{}")
        self.assertIn("bad.json", self.palpate(*plan, "--reuse", "bad.json", status=2))
        self.assertIn("none.json", self.palpate(*plan, "--reuse", "none.json", status=2))

    def test_a_folder_of_another_version_is_refused(self):
        (self.folder / "old").mkdir()
        (self.folder / "old/cluster.json").write_text('{"version": 1, "shards": 3}')
        self.assertIn("expected version 2, found 1", self.palpate("cluster", "status", "old", status=2))
        self.palpate("cluster", "sweep", *self.PLAN, "--shards", 3, "--dir", "d", "--no-submit")
        job = json.loads((self.folder / "d/cluster.json").read_text())
        for shards in (0, -3, 6, "many"):
            (self.folder / "d/cluster.json").write_text(json.dumps({**job, "shards": shards}))
            for command in ("status", "submit"):
                self.assertIn("cluster.json", self.palpate("cluster", command, "d", status=2))

    def test_the_scripts_work_without_slurm(self):
        said = self.palpate("cluster", "sweep", *self.PLAN, "--shards", 2, "--dir", "d", status=1, slurm=False)
        self.assertIn("there is no Slurm here", said)
        said = self.palpate("cluster", "sweep", *self.PLAN, "--shards", 2, "--dir", "e", "--no-submit", slurm=False)
        self.assertIn("ready", said)
        for shard in ("2", "1"):
            subprocess.run([self.folder / "e/shard.sh", shard], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([self.folder / "e/finish.sh"], check=True, stdout=subprocess.DEVNULL)
        self.assertEqual((self.folder / "e/all.sweep").read_bytes(), self.single())
        self.assertIn("2 done", self.palpate("cluster", "status", "e", slurm=False))

    def test_an_early_merge_does_not_count_as_the_result(self):
        self.palpate("cluster", "sweep", *self.PLAN, "--shards", 3, "--dir", "d", "--no-submit")

        def script(*words):
            subprocess.run([self.folder / "d" / words[0], *words[1:]], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

        script("shard.sh", "1")
        script("finish.sh")
        script("shard.sh", "2")
        script("shard.sh", "3")
        status = self.palpate("cluster", "status", "d")
        self.assertIn("3 done", status)
        self.assertIn("not merged yet", status)
        script("finish.sh")
        self.assertIn("report.html", self.palpate("cluster", "status", "d"))
        self.assertEqual((self.folder / "d/all.sweep").read_bytes(), self.single())

    def test_later_changes_of_files_have_no_effect(self):
        room = self.folder / "lab" / "protocols"
        (room / "shapes").mkdir(parents=True)
        octahedron = ("v 0.03 0 0\nv -0.03 0 0\nv 0 0.03 0\nv 0 -0.03 0\nv 0 0 0.03\nv 0 0 -0.03\nf 1 3 5\nf 3 2 5\nf 2 4 5\n"
                      "f 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n")
        (room / "shapes" / "inner.obj").write_text(octahedron)
        (self.folder / "lab" / "outer.obj").write_text(octahedron.replace("0.03", "0.02"))
        protocol = json.loads((PROTOCOLS / "quick.json").read_text())
        protocol["stimuli"][0] = {"name": "sphere", "shape": "mesh", "file": "shapes/inner.obj"}
        protocol["stimuli"][1] = {"name": "cone", "shape": "mesh", "file": "../outer.obj"}
        (room / "p.json").write_text(json.dumps(protocol))
        (self.folder / "patch.json").write_text('{"observer": {"threshold": 0.8}}')
        plan = [room / "p.json", "--space", "s.json", "--settings", "patch.json", *self.PLAN[3:]]
        self.palpate("sweep", *plan, "--db", "one.sweep")
        self.palpate("cluster", "sweep", *plan, "--shards", 2, "--dir", "d", "--no-submit")
        for file in (room / "p.json", room / "shapes" / "inner.obj", self.folder / "lab" / "outer.obj", self.folder / "s.json",
                     self.folder / "patch.json"):
            file.write_text("changed")
        for words in (["shard.sh", "1"], ["shard.sh", "2"], ["finish.sh"]):
            subprocess.run([self.folder / "d" / words[0], *words[1:]], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.assertEqual((self.folder / "d/all.sweep").read_bytes(), (self.folder / "one.sweep").read_bytes())

    def test_all_files_are_private_whatever_the_umask(self):
        (self.folder / "there").mkdir(mode=0o777)
        (self.folder / "there").chmod(0o777)
        before = os.umask(0)
        try:
            for folder in ("new", "there"):
                self.palpate("cluster", "sweep", *self.PLAN, "--shards", 2, "--dir", folder)
            self.palpate("simulate", PROTOCOLS / "quick.json", "--db", "s.db", "--participants", 2)
            self.palpate("analyze", "--db", "s.db", "--figures", "figures/of/it", "--report", "r.html")
            self.palpate("export", "--db", "s.db", "--format", "bids", "--out", "bids")
        finally:
            os.umask(before)
        paths = [p for name in ("new", "there", "figures", "bids", "s.db", "r.html")
                 for p in (self.folder / name, *(self.folder / name).rglob("*"))]
        self.assertIn(self.folder / "new/analysis.txt", paths)
        self.assertIn(self.folder / "there/inputs/protocol.json", paths)
        open_to_others = {str(p): oct(p.stat().st_mode) for p in paths if p.stat().st_mode & 0o077}
        self.assertEqual(open_to_others, {})

    def test_scripts_that_others_can_change_are_not_submitted(self):
        self.palpate("cluster", "sweep", *self.PLAN, "--shards", 2, "--dir", "d", "--no-submit")
        d = self.folder / "d"

        def refused(said):
            text = self.palpate("cluster", "submit", "d", status=2)
            self.assertIn(said, text)
            self.assertFalse((self.slurm / "calls").exists())

        for name in ("shard.sh", "finish.sh", "cluster.json", "inputs/protocol.json", "inputs", "parts", "logs", "."):
            mode = (d / name).stat().st_mode
            (d / name).chmod(mode | 0o002)
            refused("can be written by others")
            (d / name).chmod(mode)
        self.folder.chmod(0o777)
        refused("others can write to")
        self.folder.chmod(0o1777)  # other users cannot rename its entries
        (d / "shard.sh").rename(d / "own.sh")
        (d / "shard.sh").symlink_to("own.sh")
        refused("is a link")
        (d / "shard.sh").unlink()
        os.link(d / "own.sh", d / "shard.sh")
        refused("hard link")
        (d / "own.sh").unlink()
        if os.geteuid() == 0:
            for path in (d / "finish.sh", d):
                os.chown(path, 64321, 64321)
                refused("belongs to another user")
                os.chown(path, 0, 0)
        self.palpate("cluster", "submit", "d")
        self.assertTrue((d / "analysis.txt").exists())

    def test_wrong_usage(self):
        for arguments, said in (([], "expected sweep, simulate, plan, status or submit"), (["run"], "found 'run'"), (["status"], "one folder"),
                                (["status", "none"], "cluster.json"), (["sweep", *self.PLAN, "--dir", "x"], "shards"),
                                (["sweep", *self.PLAN, "--shards", 2], "--dir"), (["sweep", *self.PLAN, "--shards", 6, "--dir", "x"], "--shards"),
                                (["sweep", *self.PLAN, "--shards", 2, "--dir", "slurm"], "not empty")):
            self.assertIn(said, self.palpate("cluster", *arguments, status=2))
        self.assertFalse((self.folder / "x").exists())
        (self.slurm / "refuse").touch()
        self.assertIn("invalid partition", self.palpate("cluster", "sweep", *self.PLAN, "--shards", 2, "--dir", "x", status=1))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
