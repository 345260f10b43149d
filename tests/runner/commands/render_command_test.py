"""palpate render from outside: forces by hand calculation, paths of all kinds, bad input.

Usage: render_command_test.py PALPATE PROTOCOLS
"""

import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import unittest

from command_case import PALPATE, CommandCase

PROTOCOLS = pathlib.Path(sys.argv[1])


class Render(CommandCase):
    HEADER = "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n"
    CUBE = '{"objects": [{"shape": "cube", "edge_m": 0.05, "stiffness_n_per_m": 800}]}'

    def render(self, scene, renderer, rows):
        path = self.HEADER + "".join(",".join(map(repr, row)) + "\n" for row in rows)
        out = self.dir / "out.csv"
        self.palpate("render", "--scene", self.file("scene.json", scene), "--renderer", renderer, "--trajectory",
                     self.file("path.csv", path), "--out", out, "--force")
        with open(out, newline="") as file:
            words = ("contact_type", "faults")
            return [{k: v if k in words else float(v) for k, v in row.items()} for row in csv.DictReader(file)]

    def test_explain_lists_the_active_and_omitted_parts(self):
        scene, out = self.file("scene.json", self.CUBE), self.dir / "stages.json"
        explain = ["render", "--scene", scene, "--renderer", "point", "--explain"]
        text = self.palpate(*explain, "--json", out).stdout
        report = json.loads(out.read_text())
        stages = {stage["stage"]: stage for stage in report["stages"]}
        for name, stage in stages.items():
            self.assertIn(name, text)
            self.assertTrue(stage["why"])
            if not stage["runs"]:
                self.assertIsNone(stage["ns"], name)
        for name in ("tree of edges", "several parts", "side contact", "friction", "torque and second device"):
            self.assertFalse(stages[name]["runs"], name)
        for name in ("pose check", "neighbourhood watch", "spring"):
            self.assertTrue(stages[name]["runs"], name)
            self.assertGreater(stages[name]["ns"], 0)
        self.assertGreater(report["contact_ns"], 0)
        self.palpate(*explain, "--out", "x.csv", status=2)
        self.palpate(*explain[:-1], "--json", out, status=2)
        self.palpate(*explain[:-1], status=2)

    def test_a_tip_pressed_into_a_cube_gives_the_springs_force(self):
        rows = self.render(self.CUBE, "point", [[0, 0.01, 0, 0.03, 0.01, 0, 0.15], [0.001, 0.01, 0, 0.024, 0.01, 0, 0.144]])
        self.assertEqual(rows[0]["contact_type"], "none")
        self.assertEqual((rows[0]["contacts"], rows[0]["object"], rows[0]["depth"]), (0, -1, 0))
        self.assertEqual(rows[0]["ideal_tip_z"], 0.03)
        self.assertEqual(rows[1]["contact_type"], "point-polygon")
        self.assertAlmostEqual(rows[1]["force_z"], 0.8, 12)
        self.assertAlmostEqual(rows[1]["ideal_tip_z"], 0.025, 12)
        self.assertAlmostEqual(rows[1]["device1_z"], 0.8, 12)
        self.assertEqual([rows[1][f"torque_{k}"] for k in "xyz"], [0, 0, 0])

    def test_a_mesh_file_is_a_scene_of_one_object(self):
        mesh = self.file("engine.obj", (PROTOCOLS / "scenes" / "engine.obj").read_text())
        path = self.file("flange.csv", self.HEADER + "0,0.061,0.031,0.01,0.061,0.031,0.13\n0.01,0.061,0.031,0.004,0.061,0.031,0.124\n")
        scene, out = self.file("scene.json", '{"objects": [{"shape": "mesh", "file": "engine.obj"}]}'), self.dir / "out.csv"
        rows = []
        for name in (scene, mesh):
            self.palpate("render", "--scene", name, "--renderer", "ray", "--trajectory", path, "--out", out, "--force")
            with open(out, newline="") as file:
                rows.append(list(csv.DictReader(file)))
        self.assertTrue(rows[0] == rows[1])
        self.assertAlmostEqual(float(rows[0][1]["force_z"]), 800 * 0.002, 9)

    def test_a_file_in_millimetres_is_scaled(self):
        text = (PROTOCOLS / "scenes" / "engine.obj").read_text()
        self.file("metres.obj", text)
        self.file("millimetres.obj", re.sub(r"(?m)^v (\S+) (\S+) (\S+)", lambda v: "v " + " ".join(repr(1000 * float(c)) for c in v.groups()), text))
        press = [[0, 0.061, 0.031, 0.01, 0.061, 0.031, 0.13], [0.01, 0.061, 0.031, 0.004, 0.061, 0.031, 0.124]]
        in_metres = self.render('{"objects": [{"shape": "mesh", "file": "metres.obj"}]}', "ray", press)
        scaled = self.render('{"objects": [{"shape": "mesh", "file": "millimetres.obj", "scale": 0.001}]}', "ray", press)
        for key in ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "depth"):
            self.assertAlmostEqual(scaled[1][key], in_metres[1][key], 9)
        self.assertAlmostEqual(scaled[1]["force_z"], 800 * 0.002, 6)
        said = self.palpate("validate", self.dir / "millimetres.obj").stdout
        self.assertIn('give "scale": 0.001 beside "file"', said)
        for scale in ("0", "-1", '"mm"'):
            scene = self.file("bad.json", '{"objects": [{"shape": "mesh", "file": "metres.obj", "scale": ' + scale + '}]}')
            self.assertIn("/objects/0/scale: expected", self.palpate("validate", scene, status=2).stderr)

    def test_a_stick_laid_across_an_edge_is_split_by_equation_1(self):
        d = 0.12 / 2 ** 0.5  # the stick in the x = 0 plane, at 45 degrees over the edge (y, z) = (0.025, 0.025)

        def stick(gap):
            centre = 0.025 + gap / 2 ** 0.5  # along (0, 1, 1) / sqrt 2 from the edge, contact at 0.04 from the tip
            return [0, centre - 0.04 / 0.12 * d, centre + 0.04 / 0.12 * d, 0, centre + 0.08 / 0.12 * d, centre - 0.08 / 0.12 * d]

        row = self.render(self.CUBE, "ray", [[0, *stick(0.004)], [0.001, *stick(-0.001)]])[1]
        self.assertEqual(row["contact_type"], "segment-edge")
        self.assertAlmostEqual(row["depth"], 0.001, 12)
        self.assertAlmostEqual(row["force_y"], 0.8 / 2 ** 0.5, 10)
        self.assertAlmostEqual(row["device1_y"] / row["force_y"], 2 / 3, 9)
        self.assertAlmostEqual(row["device2_y"] / row["force_y"], 1 / 3, 9)
        self.assertAlmostEqual(abs(row["torque_x"]), 0.8 * 0.04, 10)
        self.assertAlmostEqual(row["contact_y"], 0.025, 12)

    def test_a_path_that_starts_inside_gives_no_force_until_it_has_left(self):
        z = [0.02, 0.021, 0.03, 0.024]
        rows = self.render(self.CUBE, "ray", [[0.001 * i, 0, 0, h, 0, 0, h + 0.12] for i, h in enumerate(z)])
        self.assertEqual([row["contacts"] for row in rows], [0, 0, 0, 1])
        self.assertEqual([row["faults"] for row in rows], ["started-inside", "started-inside", "", ""])
        self.assertEqual(list(rows[0])[-1], "faults")

    def test_nan_poses_are_faults_and_counted(self):
        path = self.file("path.csv", self.HEADER + "0,0,0,0.03,0,0,0.15\n1,nan,0,0.024,0,0,0.15\n"
                          "2,0,0,0.024,inf,0,0.15\n3,0,0,-1e308,0,0,0.15\n4,0,0,0.024,0,0,0.15\n")
        for renderer in ("point", "ray"):
            out = self.dir / f"{renderer}.csv"
            done = self.palpate("render", "--scene", self.file("scene.json", self.CUBE), "--renderer", renderer,
                                "--trajectory", path, "--out", out)
            with open(out, newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertEqual([row["faults"] for row in rows], ["", "non-finite", "non-finite", "non-finite", ""])
            self.assertEqual([float(row["force_z"]) > 0 for row in rows], [False, False, False, False, True])
            self.assertIn("non-finite in 3 of 5 rows, first on line 3", done.stderr)

    def test_the_extended_probe_does_the_work_of_its_contact(self):
        cube = self.CUBE[:-1]
        real = [[0, 0.3, 0, 0.046, 0.42, 0, 0.05], [0.001, 0.3, 0, 0.0345, 0.42, 0, 0.0385]]
        plain, far = (self.render(cube + more + "}", "ray", real)[1]
                      for more in ("", ', "reach": {"factor": 5, "pivot": "tail"}'))
        self.assertEqual(plain["contacts"], 0)
        self.assertEqual(far["contacts"], 1)
        # The same with the virtual stylus given: five times as long, from the same tail.
        virtual = [[t, *(t5 - 5 * (t5 - t1) for t1, t5 in zip(row[:3], row[3:])), *row[3:]] for t, *row in real]
        held = self.render(cube + "}", "ray", virtual)[1]
        for k in "xyz":
            for name in ("force", "torque", "ideal_tip", "contact"):
                self.assertAlmostEqual(far[f"{name}_{k}"], held[f"{name}_{k}"], 12)
            self.assertAlmostEqual(far[f"device1_{k}"], 5 * held[f"device1_{k}"], 12)
            self.assertAlmostEqual(far[f"device2_{k}"], held[f"device2_{k}"] - 4 * held[f"device1_{k}"], 12)
        # About the grip, by default 0.06 m from the tip along the stylus.
        grip = self.render(cube + ', "reach": {"factor": 7}}', "ray", real)[0]
        length = (0.12 ** 2 + 0.004 ** 2) ** 0.5
        at = 0.3 + 0.06 * 0.12 / length
        self.assertAlmostEqual(grip["ideal_tip_x"], at - 7 * (at - 0.3), 12)
        self.assertAlmostEqual(grip["ideal_tail_x"], at + 7 * (0.42 - at), 12)

    def test_sides_need_three_columns_or_none(self):
        scene, out = self.file("scene.json", self.CUBE), self.dir / "out.csv"
        for header, row, words in (("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z,side_x,side_y", "0,0,0,1,0,0,2,1,0", "side_z"),
                                   (self.HEADER.strip() + ",side_x,side_y,side_z", "0,0,0,1,0,0,2", "ten numbers"),
                                   (self.HEADER.strip(), "0,0,0,1,0,0,2,1,0,0", "seven numbers")):
            path = self.file("path.csv", f"{header}\n{row}\n")
            done = self.palpate("render", "--scene", scene, "--renderer", "ray", "--trajectory", path, "--out", out, status=2)
            self.assertIn(words, done.stderr)

    def test_a_layer_that_is_too_deep_is_refused_with_the_possible_depth(self):
        layers = '[{"depth_m": 0.02, "stiffness_n_per_m": 100}, {"depth_m": 0.025, "stiffness_n_per_m": 100}]'
        scene = self.file("scene.json", '{"objects": [{"shape": "cube", "edge_m": 0.05, "layers": ' + layers + "}]}")
        done = self.palpate("render", "--scene", scene, "--renderer", "ray", "--explain", status=2)
        self.assertIn("/objects/0/layers/1/depth_m: nothing of the object is left at a depth of 0.025 m", done.stderr)
        self.assertIn("expected less than 0.025 m", done.stderr)
        self.assertNotIn("layers/0", done.stderr)

    def test_forty_objects_are_rendered_without_a_fault(self):
        """Apart from each other: those that touch are one solid."""
        cubes = [f'{{"shape": "cube", "edge_m": 0.004, "stiffness_n_per_m": 100, "position_m": [{-0.117 + 0.006 * i:.3f}, 0, 0]}}'
                 for i in range(40)]
        scene = '{"objects": [' + ", ".join(cubes) + "]}"
        row = self.render(scene, "ray", [[0, -0.125, 0, 0.012, 0.125, 0, 0.012], [1, -0.125, 0, 0.001, 0.125, 0, 0.001]])[1]
        self.assertEqual((row["contacts"], row["faults"]), (40, ""))
        self.assertAlmostEqual(row["force_z"], 4.0, 9)

    def test_paths_without_end_or_writer_are_refused(self):
        scene, out, pipe = self.file("scene.json", self.CUBE), self.dir / "out.csv", self.dir / "pipe"
        os.mkfifo(pipe)
        long = self.file("long.csv", self.HEADER + "0," * 800_000 + "\n")
        def render(path):
            return ["render", "--scene", scene, "--renderer", "ray", "--trajectory", path, "--out", out]

        empty = "nothing was written into this pipe for 10 s"
        cases = [(render("/dev/zero"), "1 MiB"), (render(long), "1 MiB"), (render("/dev/null"), "at least one row"),
                 (["validate", "/dev/zero"], "16 MB"), (["analyze", "--csv", "/dev/zero"], "1 MiB"),
                 (["analyze", "--db", pipe], "is not a file"), (render(pipe), empty), (["validate", pipe], empty),
                 (["analyze", "--csv", pipe], empty), (["plan", "--csv", pipe], empty),
                 (["simulate", PROTOCOLS / "quick.json", "--db", self.dir / "s.db", "--settings", pipe], empty),
                 (["render", "--scene", pipe, *render(long)[3:]], empty)]
        running = [subprocess.Popen([PALPATE, *map(str, args)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
                   for args, _ in cases]
        for (args, words), done in zip(cases, running):
            message = done.communicate(timeout=300)[1]
            self.assertEqual(done.returncode, 2, (args, message))
            self.assertIn(words, message, args)
        self.assertFalse(out.exists())

    def test_a_path_can_be_read_from_a_pipe(self):
        pipe, out = self.dir / "pipe", self.dir / "out.csv"
        os.mkfifo(pipe)
        with subprocess.Popen(["sh", "-c", f"sleep 0.2; printf '{self.HEADER}0,0,0,1,0,0,2\n' > {pipe}"]):
            self.palpate("render", "--scene", self.file("scene.json", self.CUBE), "--renderer", "ray", "--trajectory",
                         pipe, "--out", out)
        self.assertEqual(len(out.read_text().splitlines()), 2)

    def test_bad_input_lists_every_fault_and_writes_nothing(self):
        scene = self.file("scene.json", '{"objects": [{"shape": "cube", "edge_m": -1, "colour": 3}, {"shape": "egg"}]}')
        good = self.file("good.csv", self.HEADER + "0,0,0,1,0,0,2\n")
        out = self.dir / "out.csv"
        done = self.palpate("render", "--scene", scene, "--renderer", "ray", "--trajectory", good, "--out", out, status=2)
        for place in ("/objects/0/edge_m", "/objects/0/colour", "/objects/1/shape"):
            self.assertIn(place, done.stderr)
        self.file("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n")
        self.file("empty.stl", "")
        scene = self.file("scene.json", '{"objects": [{"shape": "cube", "edge_m": 1}, {"shape": "mesh", "file": "open.obj"},'
                          ' {"shape": "mesh", "file": "empty.stl"}]}')
        done = self.palpate("render", "--scene", scene, "--renderer", "ray", "--trajectory", good, "--out", out, status=2)
        for word in ("scene.json: /objects/1", "open.obj", "open", "scene.json: /objects/2", "empty.stl"):
            self.assertIn(word, done.stderr)
        scene = self.file("scene.json", self.CUBE)
        for text, place in (("t,x\n", "line 1"), (self.HEADER, "row"), (self.HEADER + "0,0,0,1,0,0\n1,a\n", "line 3"),
                            (self.HEADER + "1,0,0,1,0,0,2\n1,0,0,1,0,0,2\n", "line 3")):
            done = self.palpate("render", "--scene", scene, "--renderer", "ray", "--trajectory",
                                self.file("bad.csv", text), "--out", out, status=2)
            self.assertIn(place, done.stderr)
        self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
