"""Soft objects from outside: simulated people on soft blocks, replay, refusals. Usage: soft_command_test.py PALPATE"""

import csv
import json
import unittest

from command_case import CommandCase


def block(young, **soft):
    return {"shape": "box", "size_m": [0.06, 0.06, 0.04], "soft": {"young_pa": young, **soft}}


class Soft(CommandCase):
    def test_simulated_participants_discriminate_soft_blocks(self):
        levels = [5000, 9000, 45000, 80000]
        protocol = self.file("blocks.json", {
            "version": 2, "name": "blocks", "renderers": ["ray"], "orientation": "fixed", "samples": True, "seed": 5,
            "stimuli": [{"name": "standard", **block(20000, resolution=3)},
                        {"name": "comparison", **block(20000, resolution=3)}],
            "blocks": [{"name": "four", "task": "compare", "question": "Which one was stiffer?",
                        "stimuli": ["comparison"], "standard": "standard", "level": {"path": "/soft/young_pa"},
                        "procedure": {"kind": "constant", "levels": levels, "repetitions": 1}}]})
        self.palpate("simulate", protocol, "--participants", 1, "--seed", 3, "--db", self.dir / "study.db")
        self.palpate("analyze", "--db", self.dir / "study.db", "--json", self.dir / "found.json")
        found = json.loads((self.dir / "found.json").read_text())
        self.assertEqual(found["n_trials"], 4)
        curve = found["cells"][0]["psychometric_functions"][0]["levels"]
        self.assertEqual([point["level"] for point in curve], levels)
        # More than twice as soft or as stiff as the standard: always discriminated.
        self.assertEqual([point["successes"] for point in curve], [0, 0, 1, 1])

    def test_objects_that_fall_through_soft_ones_are_reported(self):
        path = self.file("path.csv", "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n0,1,0,0,1,0,0.1\n0.01,1,0,0,1,0,0.1\n")
        soft = block(20000, resolution=3)
        ball = {"shape": "sphere", "radius_m": 0.01, "position_m": [0, 0, 0.05], "body": {"mass_kg": 0.1}}
        loose = block(20000, resolution=3, fixed="none")
        for objects, said in (([soft, ball], "/objects/1: moves through soft objects"),
                              ([loose, {"shape": "sphere", "radius_m": 0.01, "position_m": [0, 0, -1]}], "/objects/0: is soft, not fixed"),
                              ([soft, {"shape": "sphere", "radius_m": 0.01, "position_m": [0, 0, -1]}], "")):
            scene = self.file("scene.json", {"objects": objects, "gravity_m_per_s2": [0, 0, -9.81]})
            done = self.palpate("render", "--scene", scene, "--renderer", "ray", "--trajectory", path,
                                "--out", self.dir / "out.csv", "--force")
            falls = [line for line in done.stderr.splitlines() if "touch only the tool" in line]
            self.assertEqual(len(falls), 1 if said else 0)
            self.assertIn(said, done.stderr)
            explained = self.palpate("render", "--scene", scene, "--renderer", "ray", "--explain").stdout
            self.assertIn(said, explained)

    def test_elements_larger_than_the_tool_are_reported(self):
        path = self.file("path.csv", "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n0,1,0,0,1,0,0.1\n0.01,1,0,0,1,0,0.1\n")
        hand = {"segments": [{"from_m": [0, 0, 0], "to_m": [0, 0, 0.1]}]}
        # A cube of 60 mm with n x n squares a side has 6 n^2 + 2 nodes on 21,600 mm^2.
        for n, radius, spacing in ((3, 0.002, "19.6"), (3, 0.019, "19.6"), (3, 0.0197, ""), (6, 0.009, "10.0"), (6, 0.0101, "")):
            cube = {"shape": "cube", "edge_m": 0.06, "soft": {"young_pa": 20000, "resolution": n}}
            scene = self.file("scene.json", {"objects": [cube], "tool": {**hand, "radius_m": radius}})
            protocol = self.file("study.json", {
                "version": 2, "name": "study", "renderers": ["ray"], "orientation": "fixed", "seed": 1, "tool": {**hand, "radius_m": radius},
                "stimuli": [{"name": "one", **cube}, {"name": "hard", "shape": "cube", "edge_m": 0.06}],
                "blocks": [{"name": "which", "task": "identify", "stimuli": ["one", "hard"], "keys": {"1": "one", "2": "hard"}, "repetitions": 1}]})
            felt = f"the nodes of its elements are {spacing} mm apart and the tool has a radius of {1000 * radius:.1f} mm"
            for command in (["render", "--scene", scene, "--renderer", "ray", "--explain"],
                            ["render", "--scene", scene, "--renderer", "ray", "--trajectory", path, "--out", self.dir / "out.csv", "--force"],
                            ["explore", scene, "--trajectory", path, "--frames", self.dir / "frames", "--size", "320x200", "--force"],
                            ["validate", protocol]):
                done = self.palpate(*command)
                self.assertEqual((done.stdout + done.stderr).count("mm apart"), 1 if spacing else 0, (n, radius, command[0]))
                if spacing:
                    self.assertIn(felt, done.stdout + done.stderr)

    def test_a_soft_blocks_trial_is_replayed_bit_by_bit(self):
        protocol = self.file("felt.json", {
            "version": 1, "name": "felt", "renderers": ["ray"], "orientation": "fixed", "samples": True, "seed": 7,
            "stimuli": [{"name": "soft", **block(15000, resolution=3)}, {"name": "hard", "shape": "cube", "edge_m": 0.05}],
            "repetitions": 1, "response": {"keys": {"1": "soft", "2": "hard"}, "time_out_s": 4}})
        self.palpate("simulate", protocol, "--participants", 1, "--seed", 2, "--db", self.dir / "felt.db")
        for trial in (1, 2):
            self.palpate("replay", "--db", self.dir / "felt.db", "--trial", f"S001/1/{trial}")

    def render(self, scene, status=0):
        rows = "".join(f"{0.001 * i},0.001,0.002,{0.023 - 1e-5 * i},0.001,0.002,{0.143 - 1e-5 * i}\n" for i in range(400))
        path = self.file("path.csv", "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n" + rows)
        out = self.dir / "forces.csv"
        done = self.palpate("render", "--scene", self.file("scene.json", scene), "--trajectory", path, "--renderer", "ray",
                            "--out", out, "--force", status=status)
        if status:
            return done.stderr
        with out.open(newline="") as table:
            return list(csv.DictReader(table))

    def test_a_block_without_a_resolution_is_rendered(self):
        forces = [float(row["force_z"]) for row in self.render({"objects": [block(20000)]})]
        self.assertGreater(forces[-1], 0.05)
        self.assertGreaterEqual(min(forces), 0)

    def test_points_in_millimetres_are_refused(self):
        message = self.render({"objects": [block(20000, resolution=3, fixed=[[30, 30, -20]])]}, status=2)
        self.assertIn("/objects/0/soft/fixed/0: ", message)


if __name__ == "__main__":
    unittest.main()
