"""palpate plan of thresholds and palpate sweep of a protocol of version 2. Usage: task_plans_test.py PALPATE"""

import csv
import json
import unittest

from command_case import CommandCase

BALL = {"name": "ball", "shape": "sphere", "radius_m": 0.03, "subdivisions": 2, "stiffness_n_per_m": 300}
DIE = {"name": "die", "shape": "cube", "edge_m": 0.05, "stiffness_n_per_m": 300}
PROTOCOL = {
    "version": 2, "name": "swept", "renderers": ["point"], "orientation": "fixed", "home": {"rest_s": 0.1}, "seed": 4,
    "stimuli": [BALL, DIE],
    "blocks": [
        {"name": "stiffer", "task": "compare", "stimuli": ["ball"], "standard": "ball", "level": {"path": "/stiffness_n_per_m"},
         "procedure": {"kind": "constant", "levels": [200, 250, 300, 350, 400], "repetitions": 8}},
        {"name": "rough", "task": "rate", "stimuli": ["ball"], "min": 0.001, "level": {"path": "/stiffness_n_per_m"},
         "procedure": {"kind": "constant", "levels": [100, 400], "repetitions": 4}},
        {"name": "which", "task": "identify", "stimuli": ["ball", "die"], "repetitions": 2, "keys": {"1": "ball", "2": "die"}}]}
SPACE = {"version": 1, "parameters": [
    {"name": "delay", "of": "participant", "path": "/motor/reaction_delay_s", "distribution": "uniform", "low": 0.05, "high": 0.3}]}


class TaskPlans(CommandCase):
    def powers(self, *more, name="plan.json"):
        out = self.dir / name
        said = self.palpate("plan", *more, "--studies", 100, "--json", out, "--force").stdout
        self.assertIn("SIMULATED STUDIES", said)
        plan = json.loads(out.read_text())
        self.assertEqual([one["trials_per_cell"] for one in plan["needed"]],
                         [one["trials_per_cell"] for one in plan["curves"]])
        found = [point for curve in plan["curves"] for point in curve["points"]]
        for one in found:
            low, high = one["power_ci95"]
            self.assertLessEqual(low, one["power"])
            self.assertGreaterEqual(high, one["power"])
            self.assertEqual(one["studies"], 100)
        return {(one["trials_per_cell"], one["participants"]): one for one in found}

    def test_power_for_a_difference_of_jnds_grows_with_participants(self):
        arguments = "--jnd-effect", 50, "--trials", "84", "--participants", "4-8"
        found = self.powers(*arguments)
        self.assertGreater(found[84, 8]["power"], 0.6)
        self.assertGreater(found[84, 8]["power"], found[84, 4]["power"] + 0.1)
        self.assertEqual(self.powers(*arguments, name="b.json"), found)

    def test_other_measures_have_a_power_as_well(self):
        found = self.powers("--accuracy-effect", 15, "--trials", "80", "--participants", "8-8")[80, 8]
        self.assertGreater(found["power"], 0.5)
        self.assertEqual(found["n_not_determined"], 0)
        found = self.powers("--rating-effect", 0, "--equivalence", 2, "--trials", "4", "--participants", "12-12")[4, 12]
        self.assertGreater(found["power"], 0.8)
        found = self.powers("--exponent-effect", 40, "--trials", "28", "--participants", "8-12")
        self.assertGreater(found[28, 12]["power"], 0.9)
        self.assertLess(abs(found[28, 12]["bias"]), 0.1)
        found = self.powers("--pse-effect", 0, "--trials", "42", "--participants", "6-6")[42, 6]
        self.assertLessEqual(found["power"], 0.12)  # 0.05, apart from the error of 100 studies

    def test_wrong_usage_is_refused(self):
        for wrong in (["--jnd-effect", 99], ["--jnd-effect", "nan"], ["--jnd-effect", 20, "--weber", 0],
                      ["--jnd-effect", 20, "--gain-sd", 1], ["--jnd-effect", 20, "--participants", "1-4"],
                      ["--jnd-effect", 20, "--trials", "0"], ["--jnd-effect", 20, "--pse-effect", 1],
                      ["--accuracy-effect", 30], ["--equivalence", 1], ["--rating-effect", 0, "--equivalence", 0]):
            self.palpate("plan", *wrong, status=2)

    def test_a_sweep_has_the_figures_of_every_cell(self):
        protocol, space, db = self.dir / "swept.json", self.dir / "space.json", self.dir / "a.sweep"
        protocol.write_text(json.dumps(PROTOCOL))
        space.write_text(json.dumps(SPACE))
        arguments = ["sweep", protocol, "--space", space, "--points", 3, "--participants", 2]
        self.palpate(*arguments, "--db", db)
        table = self.dir / "a.csv"
        self.palpate("export", "--db", db, "--format", "csv", "--out", table)
        rows = list(csv.DictReader(table.read_text().splitlines()))
        self.assertEqual(len(rows), 3)
        for row in rows:
            self.assertEqual(row["status"], "ok", row["reason"])
            self.assertAlmostEqual(float(row["threshold_stiffer_ball_point"]), 300, delta=45)
            self.assertGreater(float(row["jnd_stiffer_ball_point"]), 5)
            self.assertGreater(float(row["threshold_se_stiffer_ball_point"]), 0)
            self.assertAlmostEqual(float(row["exponent_rough_ball_point"]), 0.8, delta=0.4)
            for stimulus in ("ball", "die"):
                self.assertTrue(0 <= float(row[f"accuracy_which_{stimulus}_point"]) <= 1)
            self.assertLessEqual(float(row["bits_which_point"]), 1)
        # As found by simulate and analyze: the point's seeds are recorded.
        said = self.palpate("analyze", "--sweep", db, "--pattern", "threshold_stiffer_ball_point > 200",
                            "--json", self.dir / "a.json", "--report", self.dir / "a.html").stdout
        self.assertIn("threshold_stiffer_ball_point", said)
        self.palpate(*arguments, "--db", self.dir / "b.sweep")
        self.palpate("export", "--db", self.dir / "b.sweep", "--format", "csv", "--out", self.dir / "b.csv")
        self.assertEqual((self.dir / "b.csv").read_text(), table.read_text())
        self.palpate(*arguments, "--db", self.dir / "c.sweep", "--repetitions", 2, status=2)


if __name__ == "__main__":
    unittest.main()
