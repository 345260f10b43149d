"""palpate sweep, merge and export of sweeps, from outside. Usage: sweep_command_test.py PALPATE PROTOCOLS"""

import csv
import json
import math
import os
import resource
import signal
import sqlite3
import subprocess
import time
import unittest

from sweep_case import COLUMNS, PALPATE, PROTOCOL, PROTOCOLS, SPACE, SweepCase


class Sweeps(SweepCase):
    def test_each_point_has_a_row_with_ordered_columns(self):
        self.sweep("a.sweep")
        rows = self.rows("a.sweep")
        self.assertEqual(self.bytes("a.sweep.csv").split(b"\r\n")[0].decode(), COLUMNS)
        self.assertEqual([row["point"] for row in rows], [str(i) for i in range(1, 7)])
        for row in rows:
            self.assertEqual((row["status"], row["reason"]), ("ok", ""))
            self.assertTrue(5 <= float(row["noise"]) <= 30 and 0.025 <= float(row["size"]) <= 0.035)
            for column in COLUMNS.split(",")[14:]:
                self.assertTrue(0 <= float(row[column]) <= 1, column)
        # A Latin hypercube: one point in each sixth of the logarithm of the size.
        parts = sorted(int(6 * math.log(float(row["size"]) / 0.025) / math.log(1.4)) for row in rows)
        self.assertEqual(parts, list(range(6)))
        self.assertEqual(len({row["noise"] for row in rows}), 6)
        self.assertIn("exists", self.palpate("export", "--db", "a.sweep", "--format", "csv", "--out", "a.sweep.csv", status=2))

    def test_a_point_equals_simulate_and_analyze(self):
        self.sweep("a.sweep", "--shard", "2/3")
        rows = {row["point"]: row for row in self.rows("a.sweep")}
        self.assertEqual(set(rows), {"3", "4"})
        point = json.loads(self.palpate(*self.command("a.sweep", "--print-point", 4)))
        self.write("point.json", point["protocol"])
        self.write("patch.json", {group: values for group, values in point["settings"].items() if isinstance(values, dict)})
        self.palpate("simulate", "point.json", "--db", "study.db", "--participants", 2, "--seed", point["seed"],
                     "--settings", "patch.json")
        self.palpate("analyze", "--db", "study.db", "--json", "a.json")
        analysis, row = json.loads((self.folder / "a.json").read_text()), rows["4"]
        self.assertEqual(float(row["noise"]), point["settings"]["percept"]["direction_sd_deg"])
        self.assertEqual([float(row["size"])] * 2, [stimulus["radius_m"] for stimulus in point["protocol"]["stimuli"]])
        for shape in ("ball", "hat"):
            pair = analysis["paired_by_shape"][shape]
            gain = pair["percent_reduction_geometric"]
            self.assertEqual(float(row["gain_" + shape]), gain)
            self.assertAlmostEqual(float(row["gain_se_" + shape]), (100 - gain) * pair["t_test"]["se_log_ratio"], 9)
            for renderer in ("point", "ray"):
                cell = f"{renderer}_{shape}"
                self.assertEqual(float(row["time_" + cell]), analysis["times"][renderer][shape]["mean_of_participant_means"])
                self.assertEqual(float(row["accuracy_" + cell]), analysis["accuracy"][renderer][shape]["accuracy"])

    def test_the_same_bytes_whatever_jobs_shards_and_kills(self):
        began = time.monotonic()
        self.sweep("one.sweep", "--jobs", 1)
        takes = time.monotonic() - began
        self.sweep("two.sweep", "--jobs", 2)
        self.assertEqual(self.bytes("one.sweep"), self.bytes("two.sweep"))
        for k in (3, 1, 2, 4):
            self.sweep(f"part{k}.sweep", "--shard", f"{k}/4")
        self.palpate("merge", "--out", "all.sweep", *[f"part{k}.sweep" for k in (4, 2, 1, 3)])
        self.assertEqual(self.bytes("one.sweep"), self.bytes("all.sweep"))
        self.palpate("merge", "--out", "again.sweep", "part3.sweep", "all.sweep", "part1.sweep")
        self.assertEqual(self.bytes("one.sweep"), self.bytes("again.sweep"))
        for k in (2, 1):  # several shards in one file
            self.sweep("same.sweep", "--shard", f"{k}/2")
        self.assertEqual(self.bytes("one.sweep"), self.bytes("same.sweep"))

        killed, file = 0, self.folder / "killed.sweep"
        for attempt in range(60):
            running = subprocess.Popen([PALPATE, *map(str, self.command("killed.sweep", "--jobs", 2))], cwd=self.folder,
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                running.wait(0.1 * takes * (1 + attempt))
                if running.returncode == 0:
                    break
            except subprocess.TimeoutExpired:
                running.send_signal(signal.SIGKILL)
                running.wait()
                killed += 1
        self.assertEqual(running.returncode, 0, "never came to its end")
        self.assertGreater(killed, 0)
        self.assertEqual(self.bytes("one.sweep"), file.read_bytes())
        self.assertEqual([path.name for path in self.folder.iterdir() if "journal" in path.name], [])

    def test_a_file_keeps_the_version_that_it_began_with(self):
        for version in (1, 2):
            old = ["--participant-version", version]
            whole, begun = f"whole{version}.sweep", f"begun{version}.sweep"
            self.sweep(whole, *old)
            self.sweep(begun, *old, "--shard", "2/3")
            point = json.loads(self.palpate(*self.command(begun, "--print-point", 1)))
            self.assertEqual(point["settings"]["version"], version)
            done = subprocess.run([PALPATE, *map(str, self.command(begun))], cwd=self.folder, capture_output=True, text=True, timeout=600)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(f"{begun}: continues with version {version}", done.stderr)
            self.assertEqual(self.bytes(begun), self.bytes(whole))
            self.assertIn("holds another sweep", self.sweep(begun, "--participant-version", 3, status=2))
        self.sweep("new.sweep", points=1)
        self.sweep("3.sweep", "--participant-version", 3, points=1)
        self.assertEqual(self.bytes("new.sweep"), self.bytes("3.sweep"))
        self.assertEqual(json.loads(self.palpate(*self.command("none.sweep", "--print-point", 1)))["settings"]["version"], 3)

    def test_a_signal_stops_it_and_the_same_command_resumes(self):
        running = subprocess.Popen([PALPATE, *map(str, self.command("a.sweep", points=500))], cwd=self.folder, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for _ in range(600):  # until a first point is on record
            time.sleep(0.1)
            if (self.folder / "a.sweep").exists() and sqlite3.connect(self.folder / "a.sweep").execute(
                    "SELECT count(*) FROM points").fetchone()[0] > 0:
                break
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=60)
        self.assertEqual(running.returncode, 1)
        self.assertIn("resumes from here", said)

    def test_seeds_follow_from_the_sweeps_seed_and_the_point_alone(self):
        print_point = lambda point, *more: json.loads(self.palpate(*self.command("a", "--print-point", point, *more)))
        a, b, c = print_point(1), print_point(2), print_point(1, "--seed", 2)
        self.assertEqual(a, print_point(1, "--jobs", 2))
        self.assertEqual(len({p["seed"] for p in (a, b, c)} | {p["protocol"]["seed"] for p in (a, b, c)}), 6)

    def test_a_failed_point_has_its_reason_and_the_others_continue(self):
        space = json.loads(json.dumps(SPACE))
        space["parameters"].append({"name": "grip", "of": "protocol", "path": "/stylus/grip_m", "distribution": "choice",
                                    "values": [0.05, 0.3]})
        self.write("s.json", space)
        out = self.sweep("a.sweep", "--design", "lhs")
        rows = self.rows("a.sweep")
        failed = [row for row in rows if row["status"] == "failed"]
        self.assertEqual(len(failed), 3)
        self.assertIn("3 of them failed", out)
        for row in failed:
            self.assertEqual(row["grip"], "0.3")
            self.assertIn("/stylus/grip_m: expected a grip on the stylus", row["reason"])
            self.assertEqual(row["gain_ball"] + row["time_ray_hat"], "")
        self.assertTrue(all(row["status"] == "ok" and row["gain_ball"] for row in rows if row["grip"] == "0.05"))

    def test_invalid_pointers_are_all_named_with_similar_ones(self):
        space = {"version": 1, "parameters": [
            {"name": "a", "of": "participant", "path": "/motor/reaction_delay", "distribution": "uniform", "low": 0, "high": 1},
            {"name": "b", "of": "protocol", "path": "/stimuli/4/radius_m", "distribution": "uniform", "low": 0.02, "high": 0.03},
            {"name": "c", "of": "protocol", "path": "/stimuli/0/radius", "distribution": "uniform", "low": 0.02, "high": 0.03},
            {"name": "d", "of": "protocol", "path": "/repetitions", "distribution": "uniform", "low": 2, "high": 3},
            {"name": "e", "of": "participant", "path": "/observer/beta", "distribution": "choice", "values": ["much"]},
            {"name": "f", "of": "protocol", "path": "/stimuli/0/name", "distribution": "choice", "values": ["x", "y"]},
            {"name": "good", "of": "protocol", "path": "/material/stiffness_n_per_m", "distribution": "uniform", "low": 500, "high": 900}]}
        self.write("s.json", json.dumps(space, indent=1))
        said = self.sweep("a.sweep", status=2)
        lines = said.strip().splitlines()
        self.assertEqual([line.split(": ")[1] for line in lines], [f"/parameters/{i}/path" for i in range(6)], said)
        self.assertTrue(all(line.startswith("s.json:") for line in lines))
        self.assertIn("/motor/reaction_delay_s", lines[0])
        self.assertIn("radius_m", lines[2])
        self.assertIn("expected an integer", lines[3])
        self.assertIn("name the columns", lines[5])
        self.assertFalse((self.folder / "a.sweep").exists())

    def refused_space(self, *parameters):
        """The fault lines of a space of these parameters."""
        self.write("s.json", {"version": 1, "parameters": [dict(name=f"p{i}", **one) for i, one in enumerate(parameters)]})
        said = self.sweep("a.sweep", status=2)
        self.assertFalse((self.folder / "a.sweep").exists())
        return said.strip().splitlines()

    def test_values_that_a_setting_cannot_have_are_refused(self):
        lines = self.refused_space(
            {"of": "participant", "path": "/hand/mass_kg", "distribution": "uniform", "low": -0.2, "high": -0.1},
            {"of": "participant", "path": "/motor/reaction_delay_s", "distribution": "uniform", "low": -9, "high": -1},
            {"of": "participant", "path": "/observer/places_along", "distribution": "uniform", "low": 4, "high": 20},
            {"of": "protocol", "path": "/repetitions", "distribution": "uniform", "low": 1, "high": 3},
            {"of": "participant", "path": "/percept/place", "distribution": "choice", "values": ["tip", "nose"]})
        self.assertEqual([line.split(": ")[1] for line in lines], [f"/parameters/{i}/path" for i in range(5)])
        for line, word in zip(lines, ("must be above 0", "must be 0 to 10", "whole number, 2 to 64", "expected an integer",
                                      "tip or surface")):
            self.assertIn(word, line)

    def test_groups_vary_and_have_figures_of_their_own(self):
        self.write("p.json", {
            "version": 2, "name": "groups", "renderers": ["ray"], "seed": 5, "groups": {"names": ["young", "old"]},
            "factors": [{"name": "size", "levels": [{"name": "small", "set": {"/stimuli/*/radius_m": 0.02}}, {"name": "large", "set": {}}]}],
            "stimuli": PROTOCOL["stimuli"],
            "blocks": [{"name": "which", "task": "identify", "stimuli": ["ball", "hat"], "factors": ["size"], "repetitions": 2}]})
        self.write("s.json", {"version": 1, "parameters": [
            {"name": "delay", "of": "group:old", "path": "/motor/reaction_delay_s", "distribution": "uniform", "low": 0.2, "high": 0.6}]})
        arguments = ["sweep", "p.json", "--space", "s.json", "--points", 2, "--participants", 2, "--db", "a.sweep"]
        self.palpate(*arguments)
        for row in self.rows("a.sweep"):
            self.assertEqual((row["status"], row["reason"]), ("ok", ""))
            for shape in ("ball", "hat"):
                for size in ("small", "large"):
                    of_all, young, old = (float(row[f"accuracy_which_{shape}_{size}_ray{group}"]) for group in ("", "_young", "_old"))
                    self.assertAlmostEqual(of_all, (young + old) / 2)
        # The point run again by simulate: participant 2 is the old one.
        point = json.loads(self.palpate(*arguments, "--print-point", 2))
        self.assertEqual(point["settings"]["groups"], {"old": {"motor": {"reaction_delay_s": float(row["delay"])}}})
        self.write("point.json", point["protocol"])
        self.write("patch.json", {"groups": point["settings"]["groups"]})
        self.palpate("simulate", "point.json", "--db", "study.db", "--participants", 2, "--seed", point["seed"], "--settings", "patch.json")
        self.palpate("export", "--db", "study.db", "--format", "csv", "--out", "study.csv")
        with open(self.folder / "study.csv", newline="") as text:
            trials = [one for one in csv.DictReader(text) if one["group"] == "old" and one["size"] == "small" and one["shape"] == "hat"]
        self.assertEqual(len(trials), 2)
        self.assertAlmostEqual(sum(int(one["correct"]) for one in trials) / 2, float(row["accuracy_which_hat_small_ray_old"]))
        self.write("s.json", {"version": 1, "parameters": [
            {"name": name, "of": of, "path": "/motor/reaction_delay_s", "distribution": "uniform", "low": 0.2, "high": 0.6}
            for name, of in (("a", "group:young"), ("b", "group:older"))]})
        said = self.palpate(*arguments[:-1], "b.sweep", status=2)
        self.assertEqual([line.split(": ")[1] for line in said.strip().splitlines()], ["/parameters/1/of"], said)
        self.assertIn("young, old; found 'older'", said)

    def test_integers_beyond_a_doubles_precision_are_refused(self):
        line, = self.refused_space({"of": "protocol", "path": "/seed", "distribution": "choice",
                                    "values": [2 ** 53 - 1, 2 ** 53 + 1]})
        self.assertIn("/parameters/0/values/1", line)
        self.assertIn("2^53", line)

    def test_a_shard_fails_if_all_its_points_fail(self):
        self.write("s.json", {"version": 1, "parameters": [
            {"name": "mass", "of": "participant", "path": "/hand/mass_kg", "distribution": "choice", "values": [-0.1, 0.1]}]})
        ends = []
        for shard in ("1/2", "2/2"):  # a point each
            done = subprocess.run([PALPATE, *map(str, self.command("shard" + shard[0], "--shard", shard, points=2))],
                                  cwd=self.folder, capture_output=True, text=True, timeout=600)
            ends.append((done.returncode, "every point failed" in done.stderr))
        self.assertEqual(sorted(ends), [(0, False), (1, True)])

    def test_a_link_to_a_new_file_creates_it(self):
        os.symlink("later.sweep", self.folder / "link.sweep")
        os.symlink("later.db", self.folder / "link.db")
        self.sweep("link.sweep", points=1)
        self.palpate("simulate", "p.json", "--db", "link.db", "--participants", 1)
        for name in ("later.sweep", "later.db"):
            self.assertTrue((self.folder / name).is_file() and not (self.folder / name).is_symlink(), name)
            self.assertTrue((self.folder / name.replace("later", "link")).is_symlink())

    def test_merging_names_a_missing_file(self):
        self.sweep("a.sweep", points=1)
        said = self.palpate("merge", "--out", "m.sweep", "a.sweep", "missing.sweep", status=2)
        self.assertIn("missing.sweep: there is no such file", said)

    def test_another_plan_is_refused_with_the_differences(self):
        self.sweep("a.sweep", points=1)
        said = self.sweep("a.sweep", "--seed", 2, points=2, status=2)
        self.assertIn("points: 1 and 2", said)
        self.assertIn("seed: 1 and 2", said)
        changed = json.loads(json.dumps(PROTOCOL))
        changed["stimuli"][0]["radius_m"] = 0.031
        self.write("p.json", json.dumps(changed))
        self.sweep("b.sweep", points=1)
        said = self.palpate("merge", "--out", "c.sweep", "a.sweep", "b.sweep", status=2)
        self.assertIn("protocol: /stimuli/0/radius_m 0.03 and 0.031", said)
        self.assertFalse((self.folder / "c.sweep").exists())
        self.write("p.json", json.dumps(PROTOCOL, indent=3))  # only its layout
        self.sweep("a.sweep", points=1)

    def test_sweeps_and_studies_are_not_confused(self):
        self.sweep("a.sweep", points=1)
        self.palpate("simulate", "p.json", "--db", "study.db", "--participants", 1)
        before = self.bytes("a.sweep"), self.bytes("study.db")
        self.assertIn("is not a sweep's file", self.sweep("study.db", points=1, status=2))
        for command in (["simulate", "p.json", "--db", "a.sweep"], ["analyze", "--db", "a.sweep"],
                        ["forget", "--db", "a.sweep", "--participant", "S001", "--yes"]):
            self.assertIn("is the file of a sweep", self.palpate(*command, status=2), command)
        self.assertIn("cannot be put together", self.palpate("merge", "--out", "x.db", "a.sweep", "study.db", status=2))
        self.assertIn("--format csv alone", self.palpate("export", "--db", "a.sweep", "--format", "bids", "--out", "x", status=2))
        self.assertEqual((self.bytes("a.sweep"), self.bytes("study.db")), before)
        (self.folder / "broken.sweep").write_bytes(before[0][:5000])
        self.assertIn("damaged", self.sweep("broken.sweep", points=1, status=2))

    def test_a_full_disk_loses_nothing_that_was_recorded(self):
        space = json.loads(json.dumps(SPACE))
        space["parameters"].append({"name": "grip", "of": "protocol", "path": "/stylus/grip_m", "distribution": "choice",
                                    "values": [0.05, 0.3]})
        self.write("s.json", space)
        command = [PALPATE, "sweep", "p.json", "--space", "s.json", "--points", "60", "--participants", "1", "--repetitions", "1"]

        subprocess.run([*command, "--db", "a.sweep", "--shard", "1/2"], cwd=self.folder, check=True,
                       stdout=subprocess.DEVNULL)
        room = (self.folder / "a.sweep").stat().st_size + 1024

        def little_room():  # a limit on the file's size replaces a full disk
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

        done = subprocess.run([*command, "--db", "a.sweep"], cwd=self.folder, capture_output=True, text=True,
                              preexec_fn=little_room)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("not saved", done.stderr)
        with sqlite3.connect(self.folder / "a.sweep") as file:
            before = file.execute("SELECT count(*) FROM points").fetchone()[0]
        file.close()
        self.assertTrue(30 <= before < 60, before)
        for name in ("a.sweep", "b.sweep"):
            subprocess.run([*command, "--db", name], cwd=self.folder, check=True, stdout=subprocess.DEVNULL)
        self.assertEqual(self.bytes("a.sweep"), self.bytes("b.sweep"))

    def test_two_writers_at_once_are_refused(self):
        running = subprocess.Popen([PALPATE, *map(str, self.command("a.sweep", points=500))], cwd=self.folder,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(running.wait)
        self.addCleanup(running.kill)
        while not (self.folder / "a.sweep").exists():
            time.sleep(0.05)
        self.assertIn(f"process {running.pid}", self.sweep("a.sweep", points=500, status=2))
        self.assertIn(f"process {running.pid}", self.palpate("merge", "--out", "b.sweep", "a.sweep", status=2))
        self.rows("a.sweep")  # reading is allowed

    def test_shards_of_a_slurm_array(self):
        variables = {"SLURM_ARRAY_TASK_ID": "12", "SLURM_ARRAY_TASK_COUNT": "3", "SLURM_ARRAY_TASK_MIN": "10"}
        self.sweep("a.sweep", "--shard", "auto", env=variables)
        self.sweep("b.sweep", "--shard", "3/3")
        self.assertEqual(self.bytes("a.sweep"), self.bytes("b.sweep"))
        self.assertIn("SLURM_ARRAY_TASK_COUNT is not set", self.sweep("c.sweep", "--shard", "auto", status=2))
        variables["SLURM_ARRAY_TASK_ID"] = "13"
        self.assertIn("is not a shard", self.sweep("c.sweep", "--shard", "auto", status=2, env=variables))

    def test_designs(self):
        for design, points, expected in (("sobol", 5, 5), ("grid", 7, 6), ("saltelli", 9, 5)):
            self.sweep(f"{design}.sweep", "--design", design, "--shard", "1/1000000", points=points)
            with sqlite3.connect(self.folder / f"{design}.sweep") as file:
                self.assertEqual(file.execute("SELECT points FROM sweep").fetchone()[0], expected, design)
        self.assertIn("5 points for each base point", self.sweep("x", "--design", "saltelli", points=4, status=2))
        self.assertIn("there are: lhs, sobol, grid, saltelli", self.sweep("x", "--design", "random", status=2))

    def test_wrong_usage(self):
        for change, said in ((("--points", "0"), "--points"), (("--points", "x"), "points"), (("--jobs", "0"), "--jobs"),
                             (("--participants", "0"), "--participants"), (("--repetitions", "0"), "--repetitions"),
                             (("--shard", "0/3"), "1 <= K <= N"), (("--shard", "4/3"), "1 <= K <= N"),
                             (("--shard", "3"), "K/N"), (("--seed", "-1"), "--seed"), (("--space", "none.json"), "none.json"),
                             (("--print-point", "7"), "6 points"), (("--print-point", "0"), "--print-point")):
            arguments = {"--space": "s.json", "--points": "6", "--db": "x.sweep", change[0]: change[1]}
            message = self.palpate("sweep", "p.json", *sum(arguments.items(), ()), status=2)
            self.assertIn(said, message)
        self.assertIn("missing --db", self.palpate("sweep", "p.json", "--space", "s.json", "--points", "3", status=2))
        self.assertEqual([path.name for path in self.folder.iterdir() if "sweep" in path.name], [])
        space = json.loads(json.dumps(SPACE))
        for name in ("Gain_ball", "hat", "Ball"):
            space["parameters"][0]["name"] = name
            self.write("s.json", space)
            self.assertIn("the name of another column or of a shape", self.sweep("x.sweep", status=2))

    def test_the_published_spaces_fit_to_the_papers_protocol(self):
        for path in sorted(PROTOCOLS.glob("spaces/*.json")):
            self.palpate("sweep", PROTOCOLS / "ho2000.json", "--space", path, "--points", "1000", "--print-point", "1000")


if __name__ == "__main__":
    unittest.main()
