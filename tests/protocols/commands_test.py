"""Runs `palpate validate` and `palpate schedule` as a user does.

Usage: commands_test.py PALPATE SOURCE_DIR
"""

import csv
import io
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import unittest

PALPATE, SOURCE = sys.argv.pop(1), pathlib.Path(sys.argv.pop(1)).resolve()
HO2000 = str(SOURCE / "protocols" / "ho2000.json")
BAD = SOURCE / "tests" / "protocols" / "bad"
COLUMNS = ("participant_id session block trial renderer shape orientation_w orientation_x "
           "orientation_y orientation_z practice protocol_sha256 program_version").split()


def run(*args):
    return subprocess.run([PALPATE, *args], capture_output=True, check=False)


class Validate(unittest.TestCase):
    def test_summarises_the_published_protocols(self):
        for path in (SOURCE / "protocols").glob("*.json"):
            if ".schema" in path.name or ".texts." in path.name:
                continue
            done = run("validate", str(path))
            self.assertEqual((done.returncode, done.stderr), (0, b""), path)
            self.assertIn(json.loads(path.read_text(encoding="utf-8"))["title"].encode(), done.stdout)

    def test_lists_all_faults_on_stderr(self):
        path = BAD / "out-of-range.json"
        done = run("validate", str(path))
        self.assertEqual((done.returncode, done.stdout), (2, b""))
        lines = done.stderr.decode().splitlines()
        places = path.with_suffix(".faults").read_text(encoding="utf-8").split()
        self.assertEqual(len(lines), len(places))
        for place in places:
            self.assertTrue(any(f": {place}: expected" in line for line in lines), place)

    def test_says_who_can_show_it_and_why_not_all_at_once(self):
        fit = run("validate", HO2000).stdout.decode()
        self.assertRegex(fit, r"\n +falcon +no:\n +renderer 'ray' needs a device that senses 5")
        self.assertRegex(fit, r"\n +simulate +yes\n")
        mesh = SOURCE / "tests" / "protocols" / "good" / "tetrahedron.obj"
        protocol = {"version": 1, "name": "own", "renderers": ["point"], "repetitions": 1, "stimuli": [
            {"name": "ball", "shape": "sphere", "radius_m": 0.02},
            {"name": "piece", "shape": "mesh", "file": str(mesh)},
            {"name": "pair", "shape": "compound", "parts": [{"shape": "cube", "edge_m": 0.02}]},
            {"name": "hard", "shape": "cube", "edge_m": 0.02, "stiffness_n_per_m": 3000}],
            "response": {"keys": {"1": "ball", "2": "piece", "3": "pair", "4": "hard"}}}
        with tempfile.TemporaryDirectory() as folder:
            path, database = pathlib.Path(folder) / "own.json", pathlib.Path(folder) / "own.db"
            path.write_text(json.dumps(protocol), "utf-8")
            said = run("validate", str(path))
            self.assertEqual(said.returncode, 0, said.stderr)
            self.assertRegex(said.stdout.decode(), r"\n  mesh +stimulus piece: .*tetrahedron.obj: 20 x 20 x 20 mm, 4 faces\n")
            simulated = said.stdout.decode().split("simulated participants")[1]
            refused = run("simulate", str(path), "--db", str(database))
            self.assertEqual(refused.returncode, 2)
            for text in (simulated, refused.stderr.decode()):
                for words in ("stimulus 'hard' has 3000 N/m", "passivity_controller"):
                    self.assertIn(words, text)
                for explored in ("'ball'", "'piece'", "'pair'"):  # simulated participants know any shape
                    self.assertNotIn(explored, text)
            self.assertEqual(sorted(p.name for p in pathlib.Path(folder).iterdir()), ["own.json"])

    def test_no_text_reaches_the_terminal_as_a_command(self):
        text = pathlib.Path(HO2000).read_text("utf-8")
        title = "A\x1b[31m\x07\u009b2J\u202etxet\u2066\x7f"
        protocol = dict(json.loads(text), title=title)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "\x1b[2Jname.json"
            path.write_text(json.dumps(protocol), "utf-8")
            said = run("validate", str(path))
            self.assertIn(rb"A\u001b[31m\u0007\u009b2J\u202etxet\u2066\u007f", said.stdout)
            path.write_text(json.dumps(dict(protocol, **{"\x1b]0;x\x07": 1})), "utf-8")
            refused = run("validate", str(path))
            self.assertEqual(refused.returncode, 2)
            unknown = run("validate", str(path) + "\u009b")
            for output in (said.stdout, refused.stderr, unknown.stderr, run("\x1b[2J").stderr):
                self.assertNotRegex(output, rb"[\x00-\x09\x0b-\x1f\x7f]|\xc2[\x80-\x9f]|\xe2\x80\xae")

    def test_says_what_needs_a_keyboard_beside_buttons(self):
        said = run("validate", str(SOURCE / "protocols" / "roughness-magnitude.json")).stdout.decode()
        self.assertIn("keyboard    needed beside a device's buttons for numbers of 'estimate', 'age' of page 'about-you'\n", said)
        self.assertNotIn("keyboard", run("validate", str(SOURCE / "protocols" / "stiffness-2afc.json")).stdout.decode())

    def test_json_has_faults_summary_devices_and_duration(self):
        def found(path, *options, status=0):
            done = run("validate", str(path), "--json", *options)
            self.assertEqual((done.returncode, done.stderr), (status, b""))
            return json.loads(done.stdout)

        study = found(SOURCE / "protocols" / "stiffness-2afc.json")
        self.assertEqual(study["faults"], [])
        self.assertEqual([one["name"] for one in study["summary"]["blocks"]], ["practice", "constant", "staircases"])
        self.assertEqual(study["summary"]["stimuli"], ["standard", "comparison"])
        devices = {one["name"]: one for one in study["devices"]}
        self.assertTrue(devices["simulated"]["can"] and devices["simulate"]["can"])
        touch = devices["touch"]
        self.assertFalse(touch["can"])
        self.assertEqual(len({one["text"] for one in touch["reasons"]}), len(touch["reasons"]))
        self.assertLessEqual(len(touch["reasons"]), 3)  # causes, not stimuli and levels
        for reason in touch["reasons"]:
            for place in reason["where"]:
                self.assertRegex(place, r"^/(stimuli|renderers)/\d+$")
        # 4 + 70 + about 50 trials of two intervals of 5 s, each after 0.5 s of rest, 0.5 s apart
        self.assertTrue(1000 < study["duration_s"] < 2200 < study["longest_s"], study["duration_s"])
        with tempfile.TemporaryDirectory() as folder:
            protocol, hasty = json.loads((SOURCE / "protocols" / "stiffness-2afc.json").read_text()), pathlib.Path(folder) / "hasty.json"
            for block in protocol["blocks"]:
                block["time_out_s"] = 1  # to judge takes 5 s
            hasty.write_text(json.dumps(protocol))
            hurried = found(hasty)
            self.assertLessEqual(hurried["duration_s"], hurried["longest_s"])
            self.assertLess(hurried["duration_s"], study["duration_s"] / 2)
        shapes = found(HO2000)
        self.assertEqual((shapes["summary"]["trials"], shapes["summary"]["version"]), (608, 1))
        self.assertEqual(shapes["duration_s"], 608 * 10.5)

        broken = found(SOURCE / "tests" / "protocols" / "bad" / "v2-groups.json", status=2)
        self.assertEqual([(one["pointer"], one["line"]) for one in broken["faults"]][:2], [("/groups/names/1", 30), ("/groups/names/2", 31)])
        self.assertTrue(all(one["text"] for one in broken["faults"]))
        self.assertEqual(found(SOURCE / "nowhere.json", status=2)["faults"][0]["pointer"], "(file)")
        with tempfile.TemporaryDirectory() as folder:
            scene, cut = pathlib.Path(folder) / "scene.json", pathlib.Path(folder) / "cut.json"
            scene.write_text('{"objects": [{"shape": "cube", "edge_m": 0.03, "stiffness_n_per_m": 90000}]}')
            told = found(scene)
            self.assertEqual(told["summary"], {"kind": "scene", "objects": 1})
            falcon, = [one for one in told["devices"] if one["name"] == "falcon2"]
            self.assertEqual((falcon["can"], falcon["reasons"][0]["where"]), (False, ["/objects/0"]))
            cut.write_text('{"version": 2,')
            self.assertEqual(found(cut, status=2)["faults"][0]["pointer"], "line 1, column 15")
        self.assertEqual(run("validate", HO2000, "--json", "--texts").returncode, 2)

    def test_a_scene_or_a_mesh_alone_is_checked(self):
        mesh = SOURCE / "tests" / "protocols" / "good" / "tetrahedron.obj"
        with tempfile.TemporaryDirectory() as folder:
            scene, part = pathlib.Path(folder) / "scene.json", pathlib.Path(folder) / "part.obj"
            scene.write_text(json.dumps({"objects": [{"shape": "mesh", "file": str(mesh)}]}), "utf-8")
            part.write_bytes(mesh.read_bytes())
            for path in (scene, part):
                done = run("validate", str(path))
                self.assertEqual((done.returncode, done.stderr), (0, b""))
                self.assertRegex(done.stdout.decode(), r"/objects/0: .*tetrahedron.obj: 20 x 20 x 20 mm, 4 faces\n"
                                 if path == scene else r"/objects/0: part.obj: 20 x 20 x 20 mm, 4 faces\n")
                self.assertIn(f"palpate explore {path}\n", done.stdout.decode())
                self.assertEqual(run("validate", str(path), "--texts").returncode, 2)
            part.write_text("".join(line for line in part.read_text().splitlines(True) if line != "f 1 2 4\n"))
            scene.write_text('{"objects": [{"shape": "cube"}]}')
            unnamed = os.path.join(os.fsencode(folder), b"bad\xff.obj")
            pathlib.Path(os.fsdecode(unnamed)).write_bytes(mesh.read_bytes())
            refused = run("validate", unnamed)
            self.assertEqual((refused.returncode, refused.stdout), (2, b""))
            self.assertIn(b"a name in UTF-8", refused.stderr)
            for path, words in ((part, b"part.obj: /objects/0/file: open: edge "), (scene, b"scene.json:1: /objects/0/edge_m: "),
                                (pathlib.Path(folder) / "no.stl", b"there is no ")):
                refused = run("validate", str(path))
                self.assertEqual((refused.returncode, refused.stdout), (2, b""))
                self.assertIn(words, refused.stderr)

    def test_a_scene_that_would_buzz_is_told(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "scene.json"
            plate = {"shape": "box", "size_m": [0.1, 0.1, 0.01]}
            def told(scene):
                path.write_text(json.dumps(scene))
                done = run("validate", str(path))
                self.assertEqual((done.returncode, done.stderr), (0, b""))
                return done.stdout.decode()
            self.assertRegex(told({"objects": [plate]}), r"falcon2 +yes\n")
            stiff = {"shape": "compound", "parts": [plate, {**plate, "stiffness_n_per_m": 100000}]}
            self.assertRegex(told({"objects": [plate, stiff]}),
                             r"falcon2 +no:\n +/objects/1/parts/1 has 100000 N/m, and 'falcon2' shows up to 3000 N/m at 1000 Hz\n")
            self.assertIn("/objects/0 has 800 N/m (8e+06 N/m at the hand)",
                          told({"objects": [plate], "reach": {"factor": 100, "pivot": "grip"}}))

    def test_soft_objects_of_tetrahedra_are_checked(self):
        solid = SOURCE / "tests" / "protocols" / "good" / "tetrahedra.msh"
        soft = {"shape": "mesh", "file": str(solid), "soft": {"young_pa": 50000}}
        protocol = {"version": 1, "name": "own", "renderers": ["point"], "repetitions": 1, "stimuli": [
            {"name": "organ", **soft}, {"name": "ball", "shape": "sphere", "radius_m": 0.02}],
            "response": {"keys": {"1": "organ", "2": "ball"}}}
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "own.json"
            for document in (protocol, {"objects": [soft]}):
                path.write_text(json.dumps(document), "utf-8")
                done = run("validate", str(path))
                self.assertEqual((done.returncode, done.stderr), (0, b""))
            alone = run("validate", str(solid))
            self.assertEqual((alone.returncode, alone.stderr), (0, b""))
            self.assertRegex(alone.stdout.decode(), r"tetrahedra.msh: [0-9.]+ x [0-9.]+ x [0-9.]+ mm, 1 tetrahedron, 10 nodes\n")
            path.write_text(json.dumps({"version": 1, "name": "own", "objects": [soft]}), "utf-8")
            self.assertIn(b"/stimuli: missing", run("validate", str(path)).stderr)

    def test_missing_file_and_wrong_usage(self):
        self.assertEqual(run("validate", "nowhere.json").returncode, 2)
        self.assertEqual(run("validate").returncode, 2)
        self.assertEqual(run("validate", "--help").returncode, 0)


class Recover(unittest.TestCase):
    def recovered(self, name, *more, seed=1):
        done = run("schedule", str(SOURCE / "protocols" / name), "--recover", "200", "--seed", str(seed), *more)
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        return done.stdout.decode()

    def test_staircases_and_quest_plus_are_tried_with_known_thresholds(self):
        found = json.loads(self.recovered("stiffness-2afc.json", "--format", "json"))
        self.assertTrue(found["simulated"])
        self.assertEqual([(one["block"], one["procedure"]) for one in found["procedures"]], [("staircases", 1), ("staircases", 2)])
        for one, down in zip(found["procedures"], (2, 3)):
            # A cumulative normal with its middle in the middle of 300 to 600: the level of 0.5^(1 / down) successes.
            share = (0.5 ** (1 / down) - one["guess"]) / (1 - one["guess"] - one["lapse"])
            truth = 450 + statistics.NormalDist().inv_cdf(share) / one["slope"]
            self.assertAlmostEqual(one["true_threshold"], truth, places=6)
            self.assertEqual(one["guess"], 0.5)
            self.assertAlmostEqual(one["bias_se"] * 200 ** 0.5 / one["spread"], 1, delta=0.01)
            self.assertLess(one["without_estimate"], 10)  # those with fewer than four reversals in 40 trials
            self.assertLess(abs(one["bias"]), one["spread"])
            self.assertLessEqual(one["mean_trials"], 40)
        quest, = json.loads(self.recovered("size-questplus.json", "--format", "json"))["procedures"]
        self.assertIn(quest["true_threshold"], json.loads(
            (SOURCE / "protocols" / "size-questplus.json").read_text())["blocks"][1]["procedure"]["threshold"])
        self.assertEqual(quest["mean_trials"], 32)
        self.assertLess(abs(quest["bias"]), 4 * quest["bias_se"])  # the truth is on its grid

    def test_formats_agree_a_seed_repeats_and_another_does_not(self):
        found = json.loads(self.recovered("stiffness-2afc.json", "--format", "json"))
        rows = list(csv.DictReader(io.StringIO(self.recovered("stiffness-2afc.json", "--format", "csv"), newline="")))
        table = self.recovered("stiffness-2afc.json")
        head, *lines = table.splitlines()
        self.assertRegex(head, "^200 SIMULATED .*, seed 1; bias and spread on the scale of the procedure$")
        self.assertEqual(len(lines), 2 * len(found["procedures"]))
        for one, row in zip(found["procedures"], rows, strict=True):
            self.assertEqual({key: float(row[key]) for key in ("bias", "spread", "true_threshold", "mean_trials")},
                             {key: one[key] for key in ("bias", "spread", "true_threshold", "mean_trials")})
            self.assertIn(f"bias {one['bias']:.4g} ", table)
        self.assertEqual(self.recovered("stiffness-2afc.json"), table)
        self.assertNotEqual(self.recovered("stiffness-2afc.json", seed=2), table)

    def test_what_cannot_be_recovered_is_refused(self):
        stairs = str(SOURCE / "protocols" / "stiffness-2afc.json")
        for protocol, count, said in ((HO2000, "200", "version 2"), (str(SOURCE / "protocols" / "roughness-magnitude.json"), "200",
                                      "staircase, QUEST+ or limits"), (stairs, "1", "2 to 100000"), (stairs, "100001", "2 to 100000"),
                                      (stairs, "many", "--recover")):
            done = run("schedule", protocol, "--recover", count)
            self.assertEqual((done.returncode, done.stdout), (2, b""), said)
            self.assertIn(said, done.stderr.decode())


class Schedule(unittest.TestCase):
    def test_csv_is_the_same_as_json(self):
        done = run("schedule", HO2000, "--participant", "2", "--format", "csv")
        self.assertEqual(done.returncode, 0)
        text = done.stdout.decode()
        self.assertEqual(text.count("\r\n"), 609)
        rows = list(csv.DictReader(io.StringIO(text, newline="")))
        self.assertEqual(list(rows[0]), COLUMNS)
        document = json.loads(run("schedule", HO2000, "--participant", "2", "--format", "json").stdout)
        self.assertEqual(document["participant_number"], 2)
        self.assertEqual(len(document["trials"]), len(rows))
        for row, trial in zip(rows, document["trials"]):
            self.assertEqual(row["participant_id"], "2")
            self.assertEqual(row["protocol_sha256"], document["protocol_sha256"])
            self.assertEqual([float(row["orientation_" + c]) for c in "wxyz"],
                             trial["orientation_wxyz"])
            for key in ("session", "block", "trial", "renderer", "shape"):
                self.assertEqual(row[key], str(trial[key]))
            self.assertEqual(row["practice"], "0")

    def test_table_has_a_row_for_each_trial(self):
        done = run("schedule", HO2000, "--participant", "1")
        self.assertEqual(len(done.stdout.splitlines()), 609)

    def test_wrong_usage(self):
        for args in ([], ["--participant", "0"], ["--participant", "x"],
                     ["--participant", "1", "--format", "xml"]):
            done = run("schedule", HO2000, *args)
            self.assertEqual((done.returncode, done.stdout), (2, b""), args)
            self.assertNotEqual(done.stderr, b"")


if __name__ == "__main__":
    unittest.main()
