"""The plan command: output, exit codes and reproducibility.

Usage: plan_command_test.py PALPATE FIXTURES
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

PALPATE, FIXTURES = sys.argv[1], pathlib.Path(sys.argv[2])
GIVEN = ["--gain-sd", "0.15", "--residual-sd", "0.4"]
QUICK = ["--studies", "200", "--trials", "20,40", "--participants", "4-30"]


class Plan(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)

    def run_palpate(self, *args):
        return subprocess.run([PALPATE, "plan", *map(str, args)], capture_output=True, text=True,
                              encoding="utf-8")

    def refused(self, words, *args):
        done = self.run_palpate(*args)
        self.assertEqual(done.returncode, 2, done)
        self.assertEqual(done.stdout, "")
        self.assertIn(words, done.stderr)

    def test_help_has_an_example(self):
        done = self.run_palpate("--help")
        self.assertEqual(done.returncode, 0)
        self.assertIn("palpate plan --db pilot.db", done.stdout)

    def test_coverage_of_intervals(self):
        out = self.dir / "coverage.json"
        done = self.run_palpate("--coverage", "--studies", 1, "--seed", 3, "--jobs", 2, "--json", out)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertTrue(done.stdout.startswith("SIMULATED STUDIES"))
        found = json.loads(out.read_text())
        self.assertEqual((found["n_studies"], found["seed"], len(found["designs"])), (1, 3, 36))
        for design in found["designs"]:
            self.assertIn(design["task"] + "\n", done.stdout)
            self.assertIn(f"\n  {design['procedure']} ", done.stdout)
            self.assertEqual(design["n_fitted"] + design["n_without_fit"], 1)
        self.refused("--studies", "--coverage", "--studies", "0")
        self.refused("not with --coverage", "--coverage", "--effect", "cone=25")

    def test_from_figures_given(self):
        out, figure = self.dir / "plan.json", self.dir / "power.svg"
        done = self.run_palpate(*GIVEN, *QUICK, "--effect", "cone=25", "--json", out, "--figure",
                                figure)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        plan = json.loads(out.read_text("utf-8"))
        self.assertEqual([curve["trials_per_cell"] for curve in plan["curves"]], [20, 40])
        for needed in plan["needed"]:
            self.assertTrue(4 <= needed["participants"] <= 30)
            self.assertIn(f"{needed['participants']} participants with", done.stdout)
        self.assertAlmostEqual(plan["model"]["percent_reduction"]["cone"], 25)
        self.assertEqual(plan["model"]["percent_reduction"]["cube"], 0)
        self.assertTrue(xml.fromstring(figure.read_text("utf-8")).tag.endswith("svg"))
        self.refused("--force", *GIVEN, *QUICK, "--json", out)
        again = self.run_palpate(*GIVEN, *QUICK, "--effect", "cone=25", "--json", out, "--force",
                                 "--jobs", 3)
        self.assertEqual(again.returncode, 0)
        self.assertEqual(json.loads(out.read_text("utf-8")), plan)

    def test_from_a_pilot(self):
        out = self.dir / "plan.json"
        analysis = self.dir / "a.json"
        pilot = FIXTURES / "balanced.csv"
        done = self.run_palpate("--csv", pilot, *QUICK, "--json", out)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        model = json.loads(out.read_text("utf-8"))["model"]
        subprocess.run([PALPATE, "analyze", "--csv", pilot, "--json", analysis], check=True,
                       capture_output=True)
        fit = json.loads(analysis.read_text("utf-8"))["mixed_model"]["variance_components"]
        self.assertAlmostEqual(model["intercept_sd"], fit["participant_intercept_sd"])
        self.assertLessEqual(model["gain_sd"], fit["participant_renderer_slope_sd"] + 1e-12)
        self.assertAlmostEqual(model["percent_reduction"]["cone"], 22)
        more = self.run_palpate("--csv", pilot, *QUICK, "--gain-sd", "0.5", "--json", out,
                                "--force")
        self.assertEqual(more.returncode, 0)
        self.assertEqual(json.loads(out.read_text("utf-8"))["model"]["gain_sd"], 0.5)

    def test_a_pilot_of_tasks_is_no_pilot_of_times(self):
        pilot, table = self.dir / "tasks.db", self.dir / "tasks.csv"
        protocol = FIXTURES.parents[2] / "protocols" / "size-questplus.json"
        subprocess.run([PALPATE, "simulate", protocol, "--db", pilot, "--participants", "2"], check=True,
                       capture_output=True)
        subprocess.run([PALPATE, "export", "--db", pilot, "--format", "csv", "--out", table], check=True,
                       capture_output=True)
        self.refused("--jnd-effect", "--db", pilot, *QUICK)
        self.refused("--jnd-effect", "--csv", table, *QUICK)

    def test_simulated_pilots_are_named(self):
        figure, out = self.dir / "power.svg", self.dir / "plan.json"
        done = self.run_palpate("--csv", FIXTURES / "full.csv", *QUICK, "--figure", figure,
                                "--json", out)
        for text in (done.stdout, figure.read_text("utf-8"), out.read_text("utf-8")):
            self.assertIn("SIMULATED PARTICIPANTS", text)

    def six_shapes(self):
        """A pilot with other shapes, all slower with the point."""
        rows = ["participant_id,session,block,trial,renderer,shape,response,correct,response_time"]
        trial = 0
        for participant in range(4):
            for shape in ["kugel", "kugel-gross", "platte", "winkel", "kegel", "wuerfel-hart"]:
                for renderer in ["point", "ray"]:
                    for repeat in range(4):
                        trial += 1
                        time = 5 + participant + (trial * 7 % 13) / 5 - (renderer == "ray") * 0.8
                        rows.append(f"P{participant},1,1,{trial},{renderer},{shape},{shape},1,{time}")
        path = self.dir / "six.csv"
        path.write_text("\n".join(rows) + "\n", "utf-8")
        return path

    def test_every_shape_has_a_column_those_with_an_effect_first(self):
        done = self.run_palpate("--csv", self.six_shapes(), *QUICK, "--effect", "wuerfel-hart=20")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        heads = [line.split() for line in done.stdout.splitlines()
                 if line.startswith("  participants")]
        self.assertEqual(heads[0][:3], ["participants", "goal", "wuerfel-hart"])
        self.assertEqual({name for head in heads for name in head[2:]},
                         {"kugel", "kugel-gross", "platte", "winkel", "kegel", "wuerfel-hart"})
        self.assertLessEqual(max(len(line) for line in done.stdout.splitlines()), 100)
        self.assertIn("standard error of a power at most", done.stdout)

    def test_without_effects_says_what_was_taken_and_lists_the_shapes(self):
        done = self.run_palpate("--csv", self.six_shapes(), *QUICK)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        words = " ".join(done.stdout.split())
        self.assertIn("No effects were given", words)
        self.assertIn("11 % for every shape", words)
        self.assertIn("kugel, kugel-gross, platte, winkel, kegel, wuerfel-hart", words)
        done = self.run_palpate("--csv", FIXTURES / "balanced.csv", *QUICK)
        self.assertIn("assumed: the paper's", " ".join(done.stdout.split()))
        self.refused("a shape of kugel, kugel-gross", "--csv", self.six_shapes(), "--effect", "0")

    def test_refuses_with_the_reason(self):
        self.refused("--residual-sd", "--gain-sd", "0.1")
        self.refused("one participant", "--csv", FIXTURES / "one_person.csv")
        self.refused("only one renderer", "--csv", FIXTURES / "one_renderer.csv")
        self.refused("nothing.csv", "--csv", self.dir / "nothing.csv")
        self.refused("one of --db", "--csv", "a.csv", "--db", "a.db")
        self.refused("sphere, cone, cylinder, cube", *GIVEN, "--effect", "torus=10")
        for option, value in [("--effect", "100"), ("--effect", "cone=nan"), ("--effect", "cone"),
                              ("--effect", "0"), ("--effect", "=3"), ("--participants", "1-4"),
                              ("--participants", "9-4"), ("--participants", "4-"),
                              ("--participants", "4-99999999999999999999"), ("--trials", "0"),
                              ("--trials", "10,,20"), ("--studies", "-5"), ("--jobs", "0"),
                              ("--power", "1"), ("--alpha", "0"), ("--goal", "most"),
                              ("--test", "anova"), ("--correlation", "1.5"),
                              ("--share-used", "0"), ("--shape-gain-sd", "-1"),
                              ("--shape-gain-sd", "nan"), ("--json", self.dir),
                              ("--seed", "-1"), ("--seed", "-0"), ("--seed", "1.5"),
                              ("--power", "nan"), ("--alpha", "inf"),
                              ("--effect", "cone=10,cone=20")]:
            with self.subTest(option=option, value=value):
                self.refused(option[2:], *GIVEN, option, value)
        self.refused("variation", "--gain-sd", "0", "--residual-sd", "0")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
