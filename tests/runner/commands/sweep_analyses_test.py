"""palpate analyze of sweeps, from outside. Usage: sweep_analyses_test.py PALPATE PROTOCOLS"""

import json
import random
import sqlite3
import unittest
import xml.etree.ElementTree as xml

from sweep_case import PROTOCOL, SPACE, SweepCase
from sweep_seals import reseal


class SweepAnalyses(SweepCase):
    """Of sweeps whose rows are made up, so that what must come out is known."""

    def made(self, name, design, rows, of=None):
        """A file with the plan of a sweep of `of` points, and these (noise, size, gain_ball, gain_hat), None where failed."""
        self.sweep(name, "--design", design, "--shard", "1/1000000", points=of or len(rows))
        with sqlite3.connect(self.folder / name) as file:
            columns = [row[1] for row in file.execute("PRAGMA table_info(points)")]
            file.execute("DELETE FROM points")
            for i, row in enumerate(rows):
                values = dict.fromkeys(columns, 1.0) | {"point": i + 1, "seed": 1, "order_seed": 1, "reason": "", "status": "ok",
                                                        "noise": row[0], "size": row[1], "order": "interleaved",
                                                        "gain_se_ball": 0.0, "gain_se_hat": 0.0}
                if len(row) == 2:
                    values |= dict.fromkeys(columns[8:]) | {"status": "failed", "reason": "why"}
                else:
                    values |= {"gain_ball": row[2], "gain_hat": row[3]}
                values["seal"] = bytes(32)
                file.execute(f"INSERT INTO points VALUES ({', '.join('?' * len(columns))})", [values[c] for c in columns])
            reseal(file)
        file.close()

    def analysis(self, name, *more):
        self.palpate("analyze", "--sweep", name, "--json", "a.json", "--force", *more)
        return json.loads((self.folder / "a.json").read_text())

    def test_share_of_settings_with_wilsons_interval(self):
        rows = [(i / 10, 0.03, i, 50 - i) for i in range(40)] + [(4.0, 0.03, None, 60), (4.1, 0.03)]
        self.made("a.sweep", "lhs", rows)
        got = self.analysis("a.sweep", "--pattern", "ball > 20 && hat > 15 || hat > 55")
        holds = [row for row in rows if len(row) == 4 and (row[3] > 55 or row[2] > 20 and row[3] > 15)]
        pattern = got["pattern"]
        self.assertEqual((pattern["holds"], pattern["n"], pattern["undefined"]), (len(holds), 41, 1))
        n, p, z = 41, len(holds) / 41, 1.959963984540054
        centre, half = (p + z * z / 2 / n) / (1 + z * z / n), z / (1 + z * z / n) * (p * (1 - p) / n + z * z / 4 / n / n) ** 0.5
        for found, expected in zip(pattern["wilson_ci95"], (centre - half, centre + half)):
            self.assertAlmostEqual(found, expected, 12)
        self.assertEqual(got["sweep"]["failed"], 1)
        self.assertEqual(got["sweep"]["reasons"], [{"points": 1, "reason": "why"}])
        self.assertEqual((got["gains"]["ball"]["n"], got["gains"]["ball"]["q50"]), (40, 19.5))
        self.assertEqual(self.analysis("a.sweep", "--pattern", "noise < 1")["pattern"]["holds"], 10)
        self.assertIsNone(self.analysis("a.sweep")["pattern"])  # not the paper's shapes

    def test_rank_correlations_of_a_known_order(self):
        self.made("a.sweep", "lhs", [(i, (7 * i) % 30, -i ** 3, ((7 * i) % 30) ** 2) for i in range(30)])
        drivers = self.analysis("a.sweep")["drivers"]
        self.assertAlmostEqual(drivers["gain_ball"]["parameters"]["noise"]["spearman"], -1, 12)
        self.assertAlmostEqual(drivers["gain_hat"]["parameters"]["size"]["spearman"], 1, 12)
        order = drivers["gain_hat"]["parameters"]["order"]
        self.assertEqual((order["spearman"], order["status"]), (None, "undefined"))

    def test_sobol_indices_of_a_linear_model(self):
        seed = 2
        draw, rows = random.Random(seed), []
        for _ in range(400):
            a, b = [draw.random() for _ in range(3)], [draw.random() for _ in range(3)]
            for x in (a, b, [b[0], a[1], a[2]], [a[0], b[1], a[2]], [a[0], a[1], b[2]]):
                rows.append((x[0], x[1], 3 * x[0] + x[1], 20 * x[1]))
        self.made("a.sweep", "saltelli", rows)
        drivers = self.analysis("a.sweep")["drivers"]
        for output, truth in (("gain_ball", (0.9, 0.1, 0)), ("gain_hat", (0, 1, 0))):
            self.assertEqual(drivers[output]["base_points"], 400)
            for name, expected in zip(("noise", "size", "order"), truth):
                found = drivers[output]["parameters"][name]
                self.assertAlmostEqual(found["total"], expected, delta=0.12)
                for kind in ("first_order", "total"):
                    low, high = found[kind + "_ci95"]
                    self.assertTrue(low - 1e-9 <= expected <= high + 1e-9, (output, name, kind, found))

    def test_the_report_and_the_figures(self):
        self.made("a.sweep", "lhs", [(i, (7 * i) % 30, i % 13, i % 7) for i in range(30)], of=40)
        text = self.palpate("analyze", "--sweep", "a.sweep", "--report", "r.html", "--figures", "f", "--pattern", "ball > hat")
        self.assertIn("SIMULATED PARTICIPANTS", text)
        self.assertIn("30 of 40 points", text)
        page = (self.folder / "r.html").read_text()
        self.assertIn("ball &gt; hat", page)
        self.assertEqual({path.name for path in (self.folder / "f").iterdir()}, {"gains.svg", "drivers.svg", "scatter.svg"})
        for figure in ("gains", "drivers", "scatter"):
            self.assertIn(f'id="{figure}"', page)
        for path in (self.folder / "f").iterdir():
            xml.parse(path)
        self.assertIn("exist", self.palpate("analyze", "--sweep", "a.sweep", "--report", "r.html", status=2))

    def test_blocks_have_no_repetitions_in_common(self):
        ball = PROTOCOL["stimuli"][0]
        self.write("p.json", {"version": 2, "name": "blocks", "renderers": ["point"], "stimuli": [ball],
                              "blocks": [{"name": "hard", "task": "rate", "stimuli": ["ball"], "repetitions": 1, "min": 0, "max": 10}]})
        self.write("s.json", {"version": 1, "parameters": SPACE["parameters"][:1]})
        self.palpate("sweep", "p.json", "--space", "s.json", "--points", 2, "--participants", 2, "--db", "a.sweep")
        said = self.palpate("analyze", "--sweep", "a.sweep")
        self.assertIn("a sweep of blocks, 2 points (lhs, seed 1), 2 participants\n", said)
        self.assertNotIn("Less time with", said)

    def test_wrong_usage_of_analyze(self):
        self.made("a.sweep", "lhs", [(1, 1, 1, 1)])
        self.palpate("simulate", "p.json", "--db", "study.db", "--participants", 1)
        for arguments, said in ((["--sweep", "a.sweep", "--pattern", "bal > 5"], "column 1: expected a name that the sweep has; did you mean ball?"),
                                (["--sweep", "a.sweep", "--pattern", "ball >"], "  ball >\n        ^"),
                                (["--sweep", "a.sweep", "--db", "study.db"], "expected one of"),
                                (["--db", "study.db", "--pattern", "ball > 5"], "--sweep"),
                                (["--sweep", "a.sweep", "--too-fast-s", "1"], "--too-fast-s"),
                                (["--sweep", "study.db"], "is not a sweep's file"), (["--sweep", "none"], "no such file"),
                                (["--sweep", "a.sweep", "--json", "a.sweep", "--force"], "--sweep reads it")):
            self.assertIn(said, self.palpate("analyze", *arguments, status=2), arguments)
        with sqlite3.connect(self.folder / "a.sweep") as file:
            file.execute("DELETE FROM points")
        file.close()
        self.assertIn("at least one point", self.palpate("analyze", "--sweep", "a.sweep", status=2))


if __name__ == "__main__":
    unittest.main()
