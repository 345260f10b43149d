"""The program from outside: help, statuses, simulate through kills.

Usage: commands_test.py PALPATE PROTOCOLS
"""

import csv
import json
import os
import pathlib
import random
import signal
import sqlite3
import subprocess
import sys
import time
import unittest

from command_case import PALPATE, CommandCase

PROTOCOLS = pathlib.Path(sys.argv[1])
COMMANDS = ["accuracy", "analyze", "bench", "bundle", "check", "cluster", "devices", "export", "forget", "merge", "plan", "register", "render", "replay", "run", "schedule", "simulate", "stability", "sweep", "unmask", "validate", "watch"]


class Words(CommandCase):
    """What was misspelt, and help on a command in either order."""

    def said(self, *words, status=2):
        done = subprocess.run([PALPATE, *words], capture_output=True, text=True, timeout=60, cwd=self.dir)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def test_an_unknown_command_names_the_nearest(self):
        self.assertEqual(self.said("analyse"), "palpate: no command 'analyse'; did you mean 'analyze'? 'palpate --help' lists them\n")
        self.assertIn("did you mean 'export'?", self.said("exprot", "--db", "x"))
        self.assertIn("did you mean 'analyze'?", self.said("anal"))
        self.assertEqual(self.said("xyzzy"), "palpate: no command 'xyzzy'; 'palpate --help' lists them\n")

    def test_an_unknown_option_names_the_nearest(self):
        self.assertIn("did you mean '--participants'?", self.said("simulate", "p.json", "--participents=3"))
        self.assertNotIn("did you mean", self.said("simulate", "p.json", "--xyzzy"))

    def test_monitors_count_from_1(self):
        for option in ("--participant-monitor", "--console-monitor"):
            self.assertIn(option + ": must be 1 or more", self.said("run", "p.json", "--db", "x.db", "--participant", "A",
                                                                  "--device", "mouse", option, "0"))

    def test_no_folder_is_made_through_anothers_link(self):
        if os.geteuid() == 0:
            os.symlink(self.dir / "theirs", self.dir / "link")
            os.chown(self.dir / "link", 65534, 65534, follow_symlinks=False)
            rows = [f"P{p},1,1,{t},{renderer},{shape},{shape},1,{2 + p + 0.1 * t}" for p in (1, 2, 3)
                    for renderer in ("point", "ray") for shape in ("ball", "box") for t in (1, 2, 3)]
            self.file("t.csv", "\n".join(["participant_id,session,block,trial,renderer,shape,response,correct,response_time",
                                          *rows]) + "\n")
            self.assertIn("a link of another user", self.said("cluster", "plan", "--csv", "t.csv", "--trials", "10", "--no-submit",
                                                             "--participants", "2-3", "--dir", self.dir / "link/new"))
            self.assertFalse((self.dir / "theirs").exists())

    def test_help_on_a_command(self):
        for command in COMMANDS:
            self.assertEqual(self.said("help", command, status=0), self.said(command, "--help", status=0))
        self.assertEqual(self.said("help", status=0), self.said("--help", status=0))
        self.assertIn("did you mean 'analyze'?", self.said("help", "analyse"))


class Devices(CommandCase):
    def test_devices_without_hardware_are_listed_and_pass_their_test(self):
        out = self.dir / "devices.json"
        text = self.palpate("devices", "--device", "simulated", "--json", out).stdout
        self.assertIn("5 degrees of freedom", text)
        (device,) = json.loads(out.read_text())["devices"]
        self.assertEqual(device["limits"]["sensed_freedom"], 5)
        self.assertTrue(device["self_test"])
        for test in device["self_test"]:
            if "time" not in test["what"]:  # a busy machine
                self.assertTrue(test["passed"], test)

    def test_devices_without_motors_have_no_force_limits(self):
        out = self.dir / "devices.json"
        text = self.palpate("devices", "--device", "mouse", "--json", out).stdout
        self.assertIn("drives none: nothing is felt", text)
        self.assertNotIn(" N,", text)
        (device,) = json.loads(out.read_text())["devices"]
        self.assertIsNone(device["limits"]["max_force_n"])
        self.assertIsNone(device["limits"]["max_stiffness_n_per_m"])

    def test_a_requested_rate_is_not_shown_as_the_devices_own(self):
        out = self.dir / "devices.json"
        text = self.palpate("devices", "--device", "simulated", "--rate", "3210", "--json", out).stdout
        self.assertIsNone(json.loads(out.read_text())["devices"][0]["limits"]["max_rate_hz"])
        self.assertNotIn("3210 Hz;", text)
        self.assertIn("at any rate that is asked for", text)

    def test_the_verdict_on_the_machine_matches_the_figures(self):
        out = self.dir / "timing.json"
        command = [PALPATE, "devices", "--timing", "--seconds", "0.5", "--rate", "2000", "--json", str(out)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        timing = json.loads(out.read_text())["timing"]
        self.assertEqual(timing["ticks"], 1000)
        self.assertEqual(done.returncode, 1 if timing["verdict"] == "unfit" else 0, done.stderr)
        self.assertIn(timing["sentence"], done.stdout)
        self.assertEqual("is fit for" in done.stdout, timing["verdict"] == "fit")
        late = timing["lateness_ns"]
        self.assertLessEqual(0, late["median"])
        self.assertLessEqual(late["median"], late["p99"])
        self.assertLessEqual(late["p99"], late["max"])
        self.assertGreater(timing["compute_cpu_ns"]["median"], 0)

    def test_without_rights_it_runs_and_names_the_consequences(self):
        wish = ["--timing", "--seconds", "0.1"]
        command = ["prlimit", "--rtprio=0:0", "--memlock=0:0", "setpriv", "--bounding-set=-all", "--inh-caps=-all"]
        if os.geteuid() != 0:
            command = []  # an ordinary user's rights
        else:
            command += ["--reuid=65534", "--clear-groups"]
        done = subprocess.run(command + [PALPATE, "devices", *wish], capture_output=True, text=True, timeout=60)
        if done.returncode not in (0, 1):
            self.skipTest(f"rights cannot be dropped here: {done.stderr}")
        if os.geteuid() == 0:
            self.assertIn("No real-time priority", done.stdout)
            self.assertIn("Memory is not locked", done.stdout)

    def test_wrong_usage(self):
        for wrong in (["--device", "phantom"], ["--rate", "0"], ["--rate", "20000"], ["--timing", "--seconds", "0"],
                      ["--timing", "--core", "4096"], ["--calibrate"]):
            self.palpate("devices", *wrong, status=2)


class Usage(CommandCase):
    def test_every_command_has_help_with_an_example(self):
        listed = self.palpate("--help").stdout
        for command in COMMANDS:
            self.assertIn(command, listed)
            text = self.palpate(command, "--help").stdout
            self.assertIn(f"palpate {command}", text)
            self.assertIn("Examples:", text)
        self.assertRegex(self.palpate("--version").stdout, r"^palpate \d+\.\d+\.\d+\n$")

    def test_wrong_usage_is_status_2_and_says_so_on_stderr(self):
        for args in ([], ["no-such"], ["simulate"], ["render", "--renderer", "ray"], ["simulate", "x", "--nope"],
                     ["validate", self.dir / "missing.json"], ["schedule", PROTOCOLS / "quick.json"],
                     ["simulate", PROTOCOLS / "quick.json", "--db", self.dir / "x.db", "--participants", "0"]):
            done = self.palpate(*args, status=2)
            self.assertEqual(done.stdout, "")
            self.assertTrue(done.stderr)
        self.assertEqual(list(self.dir.iterdir()), [])

    def test_unsigned_numbers_refuse_a_sign_and_all_must_be_finite(self):
        quick = PROTOCOLS / "quick.json"
        for args in (["simulate", quick, "--db", self.dir / "s.db", "--seed", "-1"],
                     ["simulate", quick, "--db", self.dir / "s.db", "--seed=-1"],
                     ["accuracy", "--search", "10", "--seed", "-1"], ["plan", "--seed", "-1"],
                     ["devices", "--rate", "nan"], ["analyze", "--csv", "x.csv", "--too-fast-s", "inf"]):
            self.assertIn("expected a", self.palpate(*args, status=2).stderr)
        self.assertEqual(list(self.dir.iterdir()), [])

    def test_merge_refuses_a_folder(self):
        self.assertIn("this is a folder", self.palpate("merge", "--out", self.dir / "all.db", ".", status=2).stderr)

    def test_results_that_cannot_be_written_are_a_failure(self):
        with open("/dev/full", "w") as full:
            done = subprocess.run([PALPATE, "--help"], stdout=full, stderr=subprocess.PIPE)
        self.assertEqual(done.returncode, 1)


class Simulate(CommandCase):
    def simulate(self, db, *more, status=0):
        return self.palpate("simulate", PROTOCOLS / "quick.json", "--db", db, *(more or ["--participants", 3]), status=status)

    def csv_of(self, db):
        out = self.dir / "trials.csv"
        self.palpate("export", "--db", db, "--format", "csv", "--out", out, "--force")
        self.assertFalse((self.dir / "attempts.csv").exists())
        return out.read_bytes()

    def test_the_record_is_the_same_through_kills_and_interrupts(self):
        people = ["--participants", "8"]
        whole = self.dir / "whole.db"
        self.simulate(whole, *people, "--jobs", 1)
        expected = self.csv_of(whole)
        self.assertEqual(expected.count(b"\n"), 1 + 8 * 24)
        seed = 5
        draw = random.Random(seed)
        stopped = 0
        for number in range(100):
            broken = self.dir / f"broken{number}.db"
            for _ in range(4):
                child = subprocess.Popen([PALPATE, "simulate", PROTOCOLS / "quick.json", "--db", broken, *people],
                                         stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                time.sleep(draw.uniform(0, 0.4))
                child.send_signal(draw.choice([signal.SIGKILL, signal.SIGINT, signal.SIGTERM]))
                stopped += child.wait() != 0
            self.simulate(broken, *people)
            self.assertEqual(self.csv_of(broken), expected)
            self.assertIn("192 of 192", self.simulate(broken, *people).stdout)
            if stopped >= 12:
                return
        self.fail(f"only {stopped} interruptions in 100 studies")

    def test_other_seeds_and_settings_do_not_mix_into_one_database(self):
        db = self.dir / "one.db"
        self.simulate(db)
        self.simulate(db, "--participants", 3, "--seed", 2, status=2)
        patch = self.file("patch.json", '{"motor": {"reaction_delay_s": 0.02}}')
        self.simulate(self.dir / "other.db", "--participants", 3, "--settings", patch)
        self.assertNotEqual(self.csv_of(db), self.csv_of(self.dir / "other.db"))

    def test_a_changed_protocol_does_not_mix_into_one_database(self):
        db, text = self.dir / "one.db", json.loads((PROTOCOLS / "quick.json").read_text())
        text["$schema"] = str(PROTOCOLS / "protocol.schema.json")

        def simulate(people, status=0, **changed):
            path = self.file("mine.json", json.dumps({**text, **changed}))
            return self.palpate("simulate", path, "--db", db, "--participants", people, status=status)

        simulate(1)
        before = db.read_bytes()
        for people in (1, 2):
            for changed, words in (({"repetitions": text["repetitions"] + 1}, "stimuli and order: /repetitions"), ({"title": "Once more"}, "only texts: /title")):
                refused = simulate(people, status=2, **changed)
                self.assertIn(words, refused.stderr)
                self.assertIn("give the changed protocol another name", refused.stderr)
        self.assertEqual(db.read_bytes(), before)
        simulate(2)  # the text that it began with
        simulate(1, name="renamed", repetitions=text["repetitions"] + 1)

    def test_versions_are_chosen_and_do_not_mix_into_one_database(self):
        seen = {}
        for version in (1, 2, 3):
            db = self.dir / f"{version}.db"
            text = self.simulate(db, "--participants", 1, "--participant-version", version).stdout
            self.assertIn(f"settings version {version}, ", text)
            with sqlite3.connect(db) as connection:
                (seen[version],) = connection.execute("SELECT DISTINCT observer_sha256 FROM sessions").fetchone()
            connection.close()
        self.assertEqual(len(set(seen.values())), 3)
        # Neither a complete session nor a further participant accepts other settings.
        for people in (1, 2):
            refused = self.simulate(self.dir / "3.db", "--participants", people, "--participant-version", 2, status=2)
            self.assertIn("S001 was simulated with other settings", refused.stderr)
        self.simulate(self.dir / "3.db", "--participants", 2, "--participant-version", 3)
        for wrong in ("0", "4", "-1", "two", "2.5"):
            done = self.simulate(self.dir / "none.db", "--participant-version", wrong, status=2)
            self.assertIn("participant-version", done.stderr)
        self.assertFalse((self.dir / "none.db").exists())

    def test_the_default_is_version_3(self):
        self.assertIn("settings version 3, ", self.simulate(self.dir / "default.db", "--participants", 1).stdout)
        self.simulate(self.dir / "3.db", "--participants", 1, "--participant-version", 3)
        self.assertEqual(self.csv_of(self.dir / "default.db"), self.csv_of(self.dir / "3.db"))

    def test_a_database_keeps_the_version_that_it_began_with(self):
        patch = ["--settings", self.file("patch.json", '{"motor": {"reaction_delay_s": 0.02}}')]
        for version, more in ((1, []), (2, []), (2, patch), (3, patch)):
            whole, begun = (self.dir / f"{version}{len(more)}{name}.db" for name in ("whole", "begun"))
            self.simulate(whole, "--participants", 3, "--participant-version", version, *more)
            self.simulate(begun, "--participants", 1, "--participant-version", version, *more)
            child = subprocess.Popen([PALPATE, "simulate", PROTOCOLS / "quick.json", "--db", begun, "--participants", "3",
                                      *map(str, more)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(0.3)
            child.kill()  # at any moment
            child.wait()
            done = self.simulate(begun, "--participants", 3, *more)
            self.assertIn(f"settings version {version}, ", done.stdout)
            self.assertEqual("continues with version" in done.stderr, version != 3, done.stderr)
            self.assertEqual(self.csv_of(begun), self.csv_of(whole))
        # Settings other than its own are still refused.
        refused = self.simulate(self.dir / "10begun.db", "--participants", 3, *patch, status=2)
        self.assertIn("was simulated with other settings", refused.stderr)

    def test_another_protocol_in_a_database_of_an_earlier_version_has_that_version(self):
        db = self.dir / "one.db"
        self.simulate(db, "--participants", 1, "--participant-version", 2)
        mine = json.loads((PROTOCOLS / "quick.json").read_text())
        other = self.file("other.json", json.dumps({**mine, "name": "other", "$schema": str(PROTOCOLS / "protocol.schema.json")}))
        self.assertIn("settings version 2, ", self.palpate("simulate", other, "--db", db, "--participants", 1).stdout)

    def test_a_database_with_several_versions_requires_a_choice(self):
        db = self.dir / "both.db"
        for shard, version in (("1/2", 1), ("2/2", 2)):
            self.simulate(db, "--participants", 2, "--shard", shard, "--participant-version", version)
        before = self.csv_of(db)
        refused = self.simulate(db, "--participants", 2, status=2)
        self.assertIn("holds versions 1, 2 of the simulated participant", refused.stderr)
        self.assertIn("--participant-version", refused.stderr)
        self.assertEqual(self.csv_of(db), before)

    def test_a_second_writer_is_refused(self):
        db = self.dir / "busy.db"
        child = subprocess.Popen([PALPATE, "simulate", PROTOCOLS / "ho2000.json", "--db", db],
                                 stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            while not db.exists() or db.stat().st_size == 0:
                time.sleep(0.01)
            time.sleep(0.2)
            self.assertIsNone(child.poll())
            done = self.simulate(db, status=2)
            self.assertIn("busy.db", done.stderr)
        finally:
            child.kill()
            child.wait()

    def test_all_outputs_are_labelled_simulated(self):
        db = self.dir / "one.db"
        self.assertIn("SIMULATED", self.simulate(db).stdout)
        rows = list(csv.DictReader(self.csv_of(db).decode().splitlines()))
        self.assertEqual({row["simulated"] for row in rows}, {"1"})
        self.assertIn("SIMULATED", self.palpate("analyze", "--db", db, "--json", self.dir / "a.json").stdout)
        self.assertTrue(json.loads((self.dir / "a.json").read_text())["simulated"])

    def test_database_and_csv_give_the_same_analysis(self):
        db = self.dir / "one.db"
        self.simulate(db)
        self.csv_of(db)
        from_db, from_csv = self.dir / "db.json", self.dir / "csv.json"
        self.palpate("analyze", "--db", db, "--json", from_db)
        self.palpate("analyze", "--csv", self.dir / "trials.csv", "--json", from_csv)
        a, b = json.loads(from_db.read_text()), json.loads(from_csv.read_text())
        for key in ("counts", "accuracy", "confusion", "times", "paired_by_shape"):
            self.assertEqual(a[key], b[key])

    def test_files_are_private(self):
        db = self.dir / "one.db"
        self.simulate(db)
        self.assertEqual(os.stat(db).st_mode & 0o777, 0o600)


class Bench(CommandCase):
    def test_rows_have_the_documented_scenes(self):
        path = self.dir / "bench.json"
        shown = self.palpate("bench", "--ticks", 1000, "--json", path).stdout
        self.assertIn("327680", shown)
        rows = json.loads(path.read_text())["rows"]
        seen = {(r["mesh"], r["triangles"], r["renderer"], r["state"]) for r in rows}
        for triangles in (20, 1280, 20480, 327680):
            for renderer in ("point", "ray"):
                for state in ("contact", "free", "first_contact"):
                    self.assertIn(("icosphere", triangles, renderer, state), seen)
        for renderer in ("point", "ray"):
            concave = {(r["triangles"], r["state"]) for r in rows if r["mesh"] == "bumpy ball, concave" and r["renderer"] == renderer}
            # The mesh of a million triangles is for 20,000 ticks and more.
            self.assertEqual(concave, {(n, state) for n in (1280, 81920) for state in ("contact", "free", "first_contact")})
        scenes = [(r["mesh"], r["triangles"], r["renderer"], r["state"], r["tool_segments"], r["near_parts"]) for r in rows]
        for r, scene in zip(rows, scenes):
            if r["caches"] == "cold":
                self.assertEqual(scenes.count(scene), 2, "one row warm, one cold")
        self.assertEqual(sum(r["caches"] == "cold" for r in rows), 2 * 3 * 10)
        for r in rows:
            self.assertGreaterEqual(r["ticks"], 50, r)
            self.assertEqual(r["allocations"], 0, r)
            self.assertGreater(r["median_ns"], 0)
            self.assertLessEqual(r["median_ns"], r["p99_ns"])
            self.assertLessEqual(r["p99_ns"], r["p99_highest_ns"])
            self.assertLessEqual(r["p99_highest_ns"], r["max_ns"])
            self.assertGreater(r["empty_loop_ns"], 0)
        # Ten near parts and three segments, of every fineness, and with parts out of reach.
        ten = {(r["triangles"], r["parts"]) for r in rows if r["near_parts"] == 10 and r["tool_segments"] == 3}
        self.assertEqual(ten, {(20, 10), (1280, 10), (20480, 10), (327680, 10), (1280, 1000)})
        self.assertIn("Ten near parts and a tool of three segments: median", shown)
        soft = {(r["elements"], r["state"]) for r in rows if r["mesh"] == "soft cube"}
        self.assertEqual(soft, {(n ** 3, state) for n in (4, 6, 8) for state in ("contact", "soft_step")})

    def test_wrong_numbers_of_ticks_are_refused(self):
        for ticks in (0, -5, "many"):
            self.assertIn("ticks", self.palpate("bench", "--ticks", ticks, status=2).stderr)


if __name__ == "__main__":
    sys.exit(unittest.main(argv=sys.argv[:1]))
