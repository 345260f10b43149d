"""palpate accuracy, stability and render --explain of a user's own scene. Usage: scene_studies_test.py PALPATE"""

import csv
import json
import math
import unittest
import xml.etree.ElementTree

from command_case import CommandCase

CUBE = {"objects": [{"shape": "cube", "edge_m": 0.05}]}
# A block with a valley of 90 degrees along y.
VALLEY = """v -0.03 -0.03 -0.02
v 0.03 -0.03 -0.02
v 0.03 -0.03 0.03
v 0 -0.03 0
v -0.03 -0.03 0.03
v -0.03 0.03 -0.02
v 0.03 0.03 -0.02
v 0.03 0.03 0.03
v 0 0.03 0
v -0.03 0.03 0.03
f 1 2 3 4 5
f 10 9 8 7 6
f 1 6 7 2
f 2 7 8 3
f 3 8 9 4
f 4 9 10 5
f 5 10 6 1
"""


def pressed(depth):
    """The tip comes down into the valley and stays."""
    lines = ["t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z"]
    for i in range(300):
        z = max(0.01 - 1e-4 * i, -depth)
        lines.append(f"{i / 1000},0,0,{z},0,0,{z + 0.12}")
    return "\n".join(lines) + "\n"


def gear():
    """Twelve teeth round a bore: a stylus that turns between two of them jams."""
    n, lines = 48, []
    for z in (-0.006, 0.006):
        for outside in (True, False):
            for i in range(n):
                radius = (0.03 if i % 4 < 2 else 0.024) if outside else 0.008
                angle = 2 * math.pi * i / n
                lines.append(f"v {radius * math.cos(angle)!r} {radius * math.sin(angle)!r} {z}")
    for i in range(n):
        j = (i + 1) % n
        for face in ((i, j, 2 * n + j, 2 * n + i), (n + j, n + i, 3 * n + i, 3 * n + j),
                     (2 * n + i, 2 * n + j, 3 * n + j, 3 * n + i), (j, i, n + i, n + j)):
            lines.append("f " + " ".join(str(k + 1) for k in face))
    return "\n".join(lines) + "\n"


class Accuracy(CommandCase):
    def study(self, scene, *args):
        out = self.dir / "a.json"
        done = self.palpate("accuracy", scene, "--quick", "--json", out, "--force", *args)
        return json.loads(out.read_text()), done.stdout

    def valley(self):
        self.file("valley.obj", VALLEY)
        return self.file("valley.json", {"objects": [{"shape": "mesh", "file": "valley.obj"}]})

    def test_the_law_is_exact_in_a_valley_and_its_hull_is_not(self):
        path = self.file("p.csv", pressed(0.002))
        result, text = self.study(self.valley(), "--renderer", "point", "--trajectory", path)
        rows = {row["method"]: row for row in result["rows"]}
        self.assertEqual(result["ticks"], 300)
        self.assertGreater(result["ticks_touching"], 150)
        self.assertEqual((result["ticks_unknown"], result["truth_inside"]), (0, 0))
        self.assertLess(rows["law"]["force_error_max_n"], 1e-6)
        self.assertLess(rows["law"]["tip_error_max_m"], 1e-8)
        # Over the valley the hull has a lid, 30 mm higher: the tip begins inside it.
        self.assertGreater(rows["hull"]["force_error_max_n"], 1)
        self.assertIn('Choose "law"', result["choose"])
        self.assertIn(result["choose"].split(":")[0], text)

    def test_the_exact_tool_is_outside_or_unknown(self):
        result, _ = self.study(self.file("gear.obj", gear()), "--ticks", 1500)
        self.assertGreater(result["truth_tried"], 20)
        self.assertEqual(result["truth_inside"], 0)
        self.assertLess(result["ticks_unknown"], result["ticks"] / 4)

    def test_every_row_has_times_warm_and_cold(self):
        result, text = self.study(self.file("cube.json", CUBE), "--ticks", 400)
        for row in result["rows"]:
            self.assertLess(0, row["median_ns"])
            self.assertLessEqual(row["median_ns"], row["p99_ns"])
            self.assertLessEqual(row["p99_ns"], row["worst_ns"])
            self.assertLess(0, row["cold_median_ns"])
        law = result["rows"][0]
        self.assertEqual(law["method"], "law")
        self.assertLess(law["force_error_max_n"], 1e-5)
        self.assertLess(law["torque_error_max_nm"], 1e-5)
        self.assertTrue(any(row["best"] for row in result["rows"]))
        self.assertIn("Force error", text)

    def test_a_coarser_sphere_is_farther_off(self):
        scene = self.file("ball.json", {"objects": [{"shape": "sphere", "radius_m": 0.03, "subdivisions": 4}]})
        rows = {row["method"]: row for row in self.study(scene, "--ticks", 600)[0]["rows"]}
        error = [rows[name]["force_error_rms_n"] for name in ("law", "law, a quarter", "law, a sixteenth")]
        self.assertLess(error[0], error[1])
        self.assertLess(error[1], error[2])
        self.assertEqual([rows[n]["triangles"] for n in ("law", "law, a quarter")], [5120, 1280])

    def test_layers_add_up(self):
        scene = self.file("l.json", {"objects": [{"shape": "cube", "edge_m": 0.05, "stiffness_n_per_m": 300, "layers": [
            {"depth_m": 0.001, "stiffness_n_per_m": 700}]}]})
        path = self.file("p.csv", "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n" + "".join(
            f"{i / 1000},0,0,{0.03 - 1e-4 * i:.6f},0,0,{0.15 - 1e-4 * i:.6f}\n" for i in range(80)))
        law = self.study(scene, "--renderer", "point", "--trajectory", path)[0]["rows"][0]
        self.assertGreater(law["ticks_compared"], 20)
        self.assertLess(law["force_error_max_n"], 1e-6)

    def test_textures_fields_and_knocks_are_left_out_of_errors(self):
        cube = dict(CUBE["objects"][0], texture={"kind": "sine", "period_m": 0.002, "depth_m": 0.0002},
                    fields=[{"kind": "viscous", "damping_ns_per_m": 2}], damping_ns_per_m=1)
        result, _ = self.study(self.file("t.json", {"objects": [cube]}), "--ticks", 300)
        self.assertLess(result["rows"][0]["force_error_max_n"], 1e-5)
        self.assertTrue(any(note.endswith("not of the times: damping, fields, texture.") for note in result["notes"]))

    def test_a_fine_ball_is_held_against_a_ball(self):
        radius, depth, stiffness = 0.03, 0.0015, 700
        scene = self.file("b.json", {"objects": [{"shape": "sphere", "radius_m": radius, "subdivisions": 6,
                                                  "stiffness_n_per_m": stiffness}]})
        tips = []
        for i in range(300):
            height = radius + 1e-3 - 1e-4 * i if i < 25 else radius - depth
            angle = max(0, i - 25) * 3e-3
            tips.append([height * math.sin(angle), 0.2 * height * math.sin(angle), height * math.cos(angle)])
        path = self.file("p.csv", "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n" + "".join(
            f"{i / 1000},{x!r},{y!r},{z!r},{x!r},{y!r},{z + 0.12!r}\n" for i, (x, y, z) in enumerate(tips)))
        law = self.study(scene, "--renderer", "point", "--trajectory", path)[0]["rows"][0]
        self.palpate("render", "--scene", scene, "--renderer", "point", "--trajectory", path, "--out", self.dir / "f.csv")
        squares = []
        with open(self.dir / "f.csv") as file:
            for tip, row in zip(tips, csv.DictReader(file)):
                force = [float(row["force_" + axis]) for axis in "xyz"]
                far = math.hypot(*tip)
                exact = [stiffness * max(0, radius - far) * x / far for x in tip]
                if any(force) or any(exact):
                    squares.append(sum((a - b) ** 2 for a, b in zip(force, exact)))
        rms = math.sqrt(sum(squares) / len(squares))
        self.assertGreater(rms, 1e-3)
        self.assertAlmostEqual(law["force_error_rms_n"] / rms, 1, delta=0.1)

    def test_poses_that_no_hand_has_are_refused(self):
        scene = self.file("cube.json", CUBE)
        for last in ("nan", "1e308"):
            path = self.file("p.csv", f"t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n0,0,0,1,0,0,2\n0.001,0,0,1,0,0,{last}\n")
            done = self.palpate("accuracy", scene, "--trajectory", path, status=2)
            self.assertIn("p.csv: line 3: expected tip and tail within 1e6 m", done.stderr)

    def test_a_path_that_stays_inside_leaves_nothing_to_choose(self):
        path = self.file("p.csv", "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n" + "".join(
            f"{i / 1000},0,0,{i * 1e-6},0,0,{0.01 + i * 1e-6}\n" for i in range(50)))
        result, _ = self.study(self.file("cube.json", CUBE), "--trajectory", path)
        self.assertEqual(result["choose"], "Nothing to choose: nothing is touched on this path.")

    def test_what_moves_or_gives_is_held_against_finer_steps(self):
        loose = {"objects": [{"shape": "cube", "edge_m": 0.05, "body": {"mass_kg": 1, "damping_per_s": 20}}]}
        result, _ = self.study(self.file("m.json", loose), "--ticks", 400)
        self.assertIn("eighth of a tick", result["truth"])
        self.assertLess(result["rows"][0]["force_error_rms_n"], 0.2)
        soft = {"objects": [{"shape": "cube", "edge_m": 0.05, "soft": {"young_pa": 20000, "resolution": 3}}]}
        result, _ = self.study(self.file("s.json", soft), "--ticks", 300)
        self.assertIn("twice as many elements", result["truth"])
        self.assertGreater(result["rows"][0]["force_error_rms_n"], 0)
        # Twice as many elements a side would not step in time: times alone.
        soft["objects"][0]["soft"]["resolution"] = 8
        result, _ = self.study(self.file("s.json", soft), "--ticks", 100)
        self.assertEqual(result["truth"], "none")
        self.assertIsNone(result["rows"][0]["force_error_rms_n"])
        self.assertGreater(result["rows"][0]["median_ns"], 0)
        self.assertTrue(any("finer scene is refused" in note for note in result["notes"]))

    def test_as_near_the_quicker_one_is_chosen(self):
        ball = {"shape": "sphere", "radius_m": 0.02, "subdivisions": 3}
        result, _ = self.study(self.file("b.json", {"objects": [ball]}), "--renderer", "point", "--ticks", 500)
        least = min(row["force_error_rms_n"] for row in result["rows"])
        near = [row for row in result["rows"] if row["force_error_rms_n"] <= 1.05 * least]
        self.assertIn(f'Choose "{min(near, key=lambda row: row["median_ns"])["method"]}"', result["choose"])

    def test_pictures_and_page(self):
        figure, page = self.dir / "f.svg", self.dir / "p.html"
        self.study(self.file("cube.json", CUBE), "--ticks", 200, "--figure", figure, "--report", page)
        xml.etree.ElementTree.parse(figure)
        self.assertIn("law: this program", page.read_text())

    def test_fields_alone_have_no_contact_to_compare(self):
        fields = {"shape": "none", "fields": [{"kind": "constant", "force_n": [0, 0, 1]}]}
        scene = self.file("fields.json", {"objects": [*CUBE["objects"], fields]})
        said = self.palpate("accuracy", scene, status=2).stderr
        self.assertIn("/objects/1/shape: expected an object with a surface", said)

    def test_options_that_do_not_go_together_are_refused(self):
        scene = self.file("cube.json", CUBE)
        self.assertIn("--search", self.palpate("accuracy", scene, "--search", 100, status=2).stderr)
        self.assertIn("--trajectory", self.palpate("accuracy", "--trajectory", "p.csv", status=2).stderr)
        self.assertIn("point or ray", self.palpate("accuracy", scene, "--renderer", "line", status=2).stderr)
        self.palpate("accuracy", self.dir / "none.json", status=2)


class Stability(CommandCase):
    def boundary(self, scene, *args):
        out = self.dir / "b.json"
        done = self.palpate("stability", scene, "--json", out, "--force", *args)
        return json.loads(out.read_text()), " ".join(done.stdout.split())

    def test_a_stiffer_faster_or_later_loop_needs_what_theory_says(self):
        result, text = self.boundary(self.file("cube.json", CUBE), "--renderer", "point")
        self.assertGreaterEqual(len(result["places"]), 1)
        for place in result["places"]:
            self.assertAlmostEqual(place["stiffness_n_per_m"], 800, delta=8)
            points = {(p["rate_hz"], p["delay_ticks"]): p for p in place["points"]}
            self.assertEqual(len(points), 7 * 4)
            self.assertEqual({rate for rate, _ in points}, {100, 200, 500, 1000, 2000, 5000, 10000})
            for (rate, delay), point in points.items():
                self.assertAlmostEqual(point["theory_ns_per_m"], place["stiffness_n_per_m"] / rate * (0.5 + delay), places=9)
                self.assertLessEqual(point["damping_needed_ns_per_m"], 1.03 * point["theory_ns_per_m"])
            needed = [points[1000, delay]["damping_needed_ns_per_m"] for delay in range(4)]
            self.assertEqual(needed, sorted(needed))
            self.assertLess(needed[0], needed[3])
        self.assertIn("damping", text)

    def test_a_device_is_told_whether_it_buzzes(self):
        scene = {"objects": [{"shape": "cube", "edge_m": 0.05, "stiffness_n_per_m": 50000}]}
        result, text = self.boundary(self.file("stiff.json", scene), "--device", "simulated", "--renderer", "point")
        self.assertIn("the scene buzzes", text)
        self.assertEqual(result["device"]["name"], "simulated")
        self.assertTrue(any(place["buzzes_on_device"] for place in result["places"]))
        _, text = self.boundary(self.file("cube.json", CUBE), "--device", "simulated", "--renderer", "point")
        self.assertNotIn("the scene buzzes", text)

    def test_options_that_do_not_go_together_are_refused(self):
        scene = self.file("cube.json", CUBE)
        self.assertIn("--soft", self.palpate("stability", scene, "--soft", status=2).stderr)
        self.assertIn("--device", self.palpate("stability", "--device", "simulated", status=2).stderr)
        self.assertIn("no device", self.palpate("stability", scene, "--device", "none", status=2).stderr)
        self.assertIn("--calibration", self.palpate("stability", scene, "--calibration", "lab.json", status=2).stderr)

    def test_a_reach_that_no_device_can_show_is_named(self):
        scene = {"objects": [{"shape": "cube", "edge_m": 0.05, "stiffness_n_per_m": 100000}],
                 "reach": {"factor": 100, "pivot": "tail"}}
        told = self.palpate("validate", self.file("reach.json", scene)).stdout
        self.assertIn("/objects/0 has 100000 N/m (1.9801e+09 N/m at the hand)", told)


class Explain(CommandCase):
    def explained(self, scene, renderer="ray"):
        out = self.dir / "e.json"
        text = self.palpate("render", "--scene", scene, "--renderer", renderer, "--explain", "--json", out, "--force").stdout
        return json.loads(out.read_text()), text

    def test_every_kind_of_scene_has_times(self):
        self.file("valley.obj", VALLEY)
        scenes = {
            "concave meshes": {"objects": [{"shape": "mesh", "file": "valley.obj"}]},
            "layers": {"objects": [{"shape": "cube", "edge_m": 0.05, "layers": [{"depth_m": 0.001, "stiffness_n_per_m": 700}]}]},
            "moving bodies": {"objects": [{"shape": "cube", "edge_m": 0.05, "body": {"mass_kg": 1}}]},
            "soft bodies": {"objects": [{"shape": "cube", "edge_m": 0.05, "soft": {"young_pa": 20000, "resolution": 3}}]},
            "tool": {"objects": [{"shape": "cube", "edge_m": 0.05}],
                     "tool": {"segments": [{"from_m": [0, 0, 0], "to_m": [0, 0, 0.12]}, {"from_m": [0, 0, 0], "to_m": [0.01, 0, 0]}]}}}
        for feature, scene in scenes.items():
            with self.subTest(feature):
                result, text = self.explained(self.file("s.json", scene))
                self.assertGreater(result["contact_ns"], 0)
                more = {one["feature"]: one["more_ns"] for one in result["features"]}
                self.assertTrue(math.isfinite(more[feature]))
                self.assertIn(feature, text)

    def test_what_is_left_out_is_listed_with_what_it_saved(self):
        cube = self.file("cube.json", CUBE)
        result, text = self.explained(cube, "point")
        saved = {one["feature"]: one["instructions"] for one in result["left_out"]}
        self.assertEqual(set(saved), {"side contact and torque", "several objects", "unions and tools",
                                      "closed surfaces", "damping", "friction"})
        self.assertTrue(all(count > 0 for count in saved.values()))
        self.assertIn("measured", result["left_out_measured"])
        self.assertIn(result["left_out_measured"], text)
        rough = {"objects": [{"shape": "cube", "edge_m": 0.05, "friction_static": 0.3, "friction_dynamic": 0.2}]}
        result, _ = self.explained(self.file("r.json", rough))
        self.assertEqual({one["feature"] for one in result["left_out"]},
                         {"several objects", "unions and tools", "closed surfaces", "damping"})


if __name__ == "__main__":
    unittest.main()
