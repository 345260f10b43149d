"""palpate stability from outside. Usage: stability_command_test.py PALPATE"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

PALPATE = sys.argv[1]


class Stability(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)

    def stability(self, *args, status=0):
        done = subprocess.run([PALPATE, "stability", *map(str, args)], capture_output=True, text=True, timeout=600)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def test_answers_in_text_numbers_and_pictures(self):
        numbers, figure, page = self.dir / "s.json", self.dir / "s.svg", self.dir / "s.html"
        done = self.stability("--json", numbers, "--figure", figure, "--report", page)
        self.assertIn("is the theory's", done.stdout)
        result = json.loads(numbers.read_text())
        self.assertLess(result["worst_disagreement"], 0.05)
        self.assertEqual(result["unsafe_points"], 0)
        rates = {curve["loop"]["rate_hz"] for curve in result["curves"]}
        self.assertEqual(rates, {500, 1000, 2000, 5000, 10000})
        self.assertEqual({(c["loop"]["scene"], c["loop"]["renderer"]) for c in result["curves"] if c["panel"].startswith("scenes")},
                         {(s, r) for s in ("wall", "edge", "sphere", "two objects") for r in ("point", "ray")})
        # Theory, worked out again, for the stiffness that is felt: of surface and layer together; through a reach of
        # 5, one end moves the virtual tip by its lever and the other by one less the other way.
        felt = {"a layer as stiff as the surface": 2, "reach 5 about the tail": 5**2 + 4**2,
                "reach 5 about the middle": 3**2 + 2**2}
        self.assertLessEqual(set(felt), {curve["name"] for curve in result["theory"] + result["curves"]})
        for curve in result["theory"] + result["curves"]:
            loop = curve["loop"]
            for point in curve["points"]:
                stiffness = felt.get(curve["name"], 1) * point["stiffness_n_per_m"]
                theory = stiffness / loop["rate_hz"] * (0.5 + loop["delay_ticks"]) + loop["virtual_damping_ns_per_m"]
                self.assertAlmostEqual(point["theory_ns_per_m"] / theory, 1, 12)
        extras = {curve["name"]: (curve["loop"]["layer_stiffness_of_surface"], curve["loop"]["reach"])
                  for curve in result["theory"] + result["curves"]}
        self.assertEqual({name: extra for name, extra in extras.items() if extra != (0, None)},
                         {"a layer as stiff as the surface": (1, None),
                          "reach 5 about the tail": (0, {"factor": 5, "pivot_share_of_stylus": 1}),
                          "reach 5 about the middle": (0, {"factor": 5, "pivot_share_of_stylus": 0.5})})
        # A dot or a triangle for every point, a dot for every name.
        root = xml.etree.ElementTree.parse(figure).getroot()
        svg = "{http://www.w3.org/2000/svg}"
        points = sum(len(curve["points"]) for curve in result["curves"])
        self.assertEqual(len(list(root.iter(svg + "circle"))) + len(list(root.iter(svg + "polygon"))), points + len(result["curves"]))
        xml.etree.ElementTree.fromstring(re.sub(r"<!DOCTYPE html>|<script>.*?</script>", "", page.read_text(), flags=re.S))

    def test_refuses_what_it_should(self):
        kept = self.dir / "kept.json"
        kept.write_text("mine")
        for args in (["--json", kept], ["--jobs", "0"], ["extra"]):
            self.assertTrue(self.stability(*args, status=2).stderr)
        self.assertEqual(kept.read_text(), "mine")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
