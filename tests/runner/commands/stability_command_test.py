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

    def assert_aligned(self, text):
        """In each table names begin or end below their header, numbers end there. A table is as many cells a line."""
        cells = [[match.span() for match in re.finditer(r"\S+(?: \S+)*", line)] for line in text.splitlines()]
        lines, checked, header = text.splitlines(), 0, None
        for number, spans in enumerate(cells):
            if header is None or len(spans) != len(cells[header]) or len(spans) < 3:
                header = number if len(spans) >= 3 else None
                continue
            words = [lines[number][begin:end] for begin, end in spans]
            numeric = [re.fullmatch(r"-?[\d.]+(e[+-]\d+)?", word) is not None for word in words]
            for (begin, end), (from_, to), is_number, word in zip(spans, cells[header], numeric, words):
                self.assertTrue(end == to or begin == from_ and not is_number, (lines[header], lines[number], word))
            checked += 1
        self.assertGreater(checked, 50)

    def test_results_as_text_numbers_and_pictures(self):
        numbers, figure, page = self.dir / "s.json", self.dir / "s.svg", self.dir / "s.html"
        done = self.stability("--json", numbers, "--figure", figure, "--report", page)
        self.assertIn("is the theory's", done.stdout)
        self.assert_aligned(done.stdout)
        result = json.loads(numbers.read_text())
        self.assertLess(result["worst_disagreement"], 0.05)
        self.assertEqual(result["unsafe_points"], 0)
        rates = {curve["loop"]["rate_hz"] for curve in result["curves"]}
        self.assertEqual(rates, {500, 1000, 2000, 5000, 10000})
        scenes = {(c["loop"]["scene"], c["loop"]["renderer"]) for c in result["curves"]
                  if c["panel"].startswith("scenes")}
        self.assertEqual(scenes, {(s, r) for s in ("wall", "edge", "sphere", "two objects", "body on a wall")
                                  for r in ("point", "ray")})
        concave = {(c["loop"]["scene"], c["loop"]["renderer"]) for c in result["curves"] if c["panel"].startswith("concave")}
        self.assertEqual(concave, {("groove", "point"), ("groove", "ray"), ("concave edge", "point"), ("concave edge", "ray"),
                                   ("tool across two edges", "ray")})
        for renderer in ("point", "ray"):
            self.check_a_held_body(result, renderer)
        self.check_theory(result["theory"] + result["curves"])
        # A symbol with its numbers for every point; curves of a panel differ in more than colour.
        root = xml.etree.ElementTree.parse(figure).getroot()
        svg = "{http://www.w3.org/2000/svg}"
        points = sum(len(curve["points"]) for curve in result["curves"])
        titles = [title.text for title in root.iter(svg + "title")]
        said = [text for text in titles if text.endswith((" N s/m", ": stable without any damping"))]
        self.assertEqual(len(said), points)
        kinds = {}
        for group in root.iter(svg + "g"):
            title = group.find(svg + "title")
            if title is None or not title.text.endswith(" N s/m"):
                continue
            for mark in group:
                if mark.tag != svg + "title":
                    form = (mark.tag, len(mark.get("points", "").split()), mark.get("fill") == "#ffffff")
                    kinds.setdefault(form, set()).add(title.text.split(",")[0])
        self.assertGreater(len(kinds), 3, "circles, squares, triangles, crosses")
        self.assertLessEqual(float(root.get("width")), 1040, "letters of 9 px on a page of 920 px")
        as_xml = re.sub(r"<!DOCTYPE html>|<script>.*?</script>", "", page.read_text(), flags=re.S)
        xml.etree.ElementTree.fromstring(as_xml)

    def check_a_held_body(self, result, renderer):
        """A movable object held against a wall has the wall's boundary, with and without passivity controller; one that
        slipped or bounced would not."""
        wall, body = ([point["measured_ns_per_m"] for point in curve["points"]]
                      for name in ("wall", "body on a wall") for curve in result["curves"]
                      if (curve["panel"], curve["loop"]["scene"]) == (f"scenes, {renderer}", name))
        wall_gain, body_gain = ([gain[f"stiffest_{which}_n_per_m"] for which in ("without", "with")]
                                for name in ("wall", "body on a wall")
                                for gain in result["passivity_controller"][:10]  # of the scenes
                                if (gain["loop"]["renderer"], gain["loop"]["scene"]) == (renderer, name))
        for found, expected in zip(body + body_gain, wall + wall_gain, strict=True):
            self.assertAlmostEqual(found / expected, 1, delta=0.01)

    def check_theory(self, curves):
        """Computed again, for the effective stiffness: of surface and layer together. With a reach of 5, one end moves
        the virtual tip by its lever, the other by one less in the opposite direction."""
        felt = {"a layer as stiff as the surface": 2, "reach 5 about the tail": 5**2 + 4**2,
                "reach 5 about the middle": 3**2 + 2**2, "a layer, edge": 2, "a layer, groove": 2,
                "reach 5, edge": 5**2 + 4**2, "reach 5, groove": 5**2 + 4**2}
        self.assertLessEqual(set(felt), {curve["name"] for curve in curves})
        for curve in curves:
            loop = curve["loop"]
            for point in curve["points"]:
                stiffness = felt.get(curve["name"], 1) * point["stiffness_n_per_m"]
                theory = stiffness / loop["rate_hz"] * (0.5 + loop["delay_ticks"]) + loop["virtual_damping_ns_per_m"]
                self.assertAlmostEqual(point["theory_ns_per_m"] / theory, 1, 12)
        extras = {curve["name"]: (curve["loop"]["layer_stiffness_of_surface"], curve["loop"]["reach"])
                  for curve in curves}
        self.assertEqual({name: extra for name, extra in extras.items() if extra != (0, None)},
                         {"a layer as stiff as the surface": (1, None), "a layer, edge": (1, None), "a layer, groove": (1, None),
                          "reach 5, edge": (0, {"factor": 5, "pivot_share_of_stylus": 1}),
                          "reach 5, groove": (0, {"factor": 5, "pivot_share_of_stylus": 1}),
                          "reach 5 about the tail": (0, {"factor": 5, "pivot_share_of_stylus": 1}),
                          "reach 5 about the middle": (0, {"factor": 5, "pivot_share_of_stylus": 0.5})})

    def test_a_tool_comes_to_rest_on_all_soft_bodies_that_scenes_allow(self):
        figure = self.dir / "soft.svg"
        said = self.stability("--soft", "--figure", figure).stdout
        header, *lines = re.search(r"^ +Pa .*?(?=\n\n)", said, re.S | re.M).group().split("\n")
        self.assertEqual(re.findall(r"([\d.]+) Hz", header), ["62.5", "125", "250", "500", "1000"])
        swings = {float(line.split()[0]): line.split()[1:] for line in lines}
        self.assertEqual(list(swings), [1e3, 1e4, 1e5, 1e6, 1e7])
        # Without damping (a third of the cases) and with: the slowest allowed rate of a modulus.
        rates = [62.5, 125, 250, 500, 1000]
        least = {1e3: (500, 500), 1e4: (250, 250), 1e5: (250, 125), 1e6: (62.5, 62.5), 1e7: (62.5, 62.5)}
        # Soft bodies with too slow steps are refused; all others come to rest, within 1 % of the force.
        for modulus, row in swings.items():
            self.assertEqual([cell == "-" for cell in row], [rate < min(least[modulus]) for rate in rates], modulus)
            for cell in row:
                if cell != "-":
                    self.assertLessEqual(float(cell), 1)
        settled, accepted = map(int, re.search(r"(\d+) of (\d+) cases", said).groups())
        self.assertEqual(settled, accepted)
        self.assertEqual(accepted, sum(3 * (rate >= undamped) + 6 * (rate >= damped)
                                       for undamped, damped in least.values() for rate in rates))
        self.assertLessEqual(float(re.search(r"the slowest in ([\d.]+) s", said)[1]), 12.5)
        # The figure's tooltips have every case; the table has the worst.
        tips = [" ".join(title.itertext()) for title in
                xml.etree.ElementTree.parse(figure).getroot().iter("{http://www.w3.org/2000/svg}title")]
        cells = [re.search(r", ([\d.]+) ([kM])Pa, [\d.]+ kN/m, ([\d.]+) Hz: ([\d.e+-]+) %(, refused)?$", tip) for tip in tips]
        cells = [(float(c[1]) * {"k": 1e3, "M": 1e6}[c[2]], float(c[3]), float(c[4]), c[5]) for c in cells if c]
        self.assertEqual(len(cells), 5 * 5 * 3 * 3)
        self.assertEqual(sum(refused is None for *_, refused in cells), accepted)
        for modulus, row in swings.items():
            for rate, cell in zip([62.5, 125, 250, 500, 1000], row):
                worst = [swing for young, at, swing, refused in cells if (young, at) == (modulus, rate) and not refused]
                self.assertEqual(cell == "-", not worst)
                if worst:
                    self.assertAlmostEqual(max(worst), float(cell), delta=0.01 + 0.01 * max(worst))

    def test_textures_and_fields_are_stable_where_theory_promises_it(self):
        said = self.stability("--effects").stdout
        rows = [line for line in said.splitlines() if re.match("  (sine|viscous|curl|knock)", line)]
        self.assertEqual(len(rows), 20)
        for row in rows:
            measured, theory = map(float, row.split()[-2:])
            self.assertLessEqual(measured, 1.02 * theory, row)
        self.assertIn("20 of 20", said)
        self.stability("--effects", "--full", status=2)

    def test_wrong_usage_is_refused(self):
        kept = self.dir / "kept.json"
        kept.write_text("mine")
        for args in (["--json", kept], ["--jobs", "0"], ["extra"], ["--soft", "--full"], ["--soft", "--json", self.dir / "new.json"], ["--seed", "1"],
                     ["--soft", "--jobs", "257"]):
            self.assertTrue(self.stability(*args, status=2).stderr)
        self.assertEqual(kept.read_text(), "mine")
        self.assertFalse((self.dir / "new.json").exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
