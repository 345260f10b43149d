"""What commands list: a schedule is the same as table, CSV and JSON, and the one that is run; --explain counts what
the scene holds.

Usage: listings_test.py PALPATE PROTOCOLS_FOLDER
"""

import csv
import hashlib
import io
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PALPATE, PROTOCOLS = sys.argv[1], pathlib.Path(sys.argv[2])
TURN = ("orientation_w", "orientation_x", "orientation_y", "orientation_z")


def palpate(*arguments):
    done = subprocess.run([PALPATE, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def cell(value):
    """A JSON value as CSV has it."""
    if value is None:
        return ""
    return str(int(value)) if isinstance(value, bool) else value if isinstance(value, str) else float(value)


class Schedules(unittest.TestCase):
    def listed(self, protocol, participant):
        """(rows of the CSV, JSON document, table)"""
        command = ["schedule", protocol, "--participant", participant, "--format"]
        return (list(csv.DictReader(io.StringIO(palpate(*command, "csv")))), json.loads(palpate(*command, "json")),
                palpate(*command, "table"))

    def check(self, protocol, participant):
        rows, document, table = self.listed(protocol, participant)
        self.assertEqual(document["participant_number"], participant)
        self.assertEqual(document["protocol"], json.loads(protocol.read_text())["name"])
        self.assertEqual(document["protocol_sha256"], hashlib.sha256(protocol.read_bytes()).hexdigest())
        self.assertEqual(len(document["trials"]), len(rows))
        last = (0, 0)
        for row, one in zip(rows, document["trials"]):
            self.assertEqual(int(row["participant_id"]), participant)
            self.assertEqual(row["protocol_sha256"], document["protocol_sha256"])
            self.assertEqual(row["program_version"], document["program_version"])
            self.assertEqual([float(row[name]) for name in TURN], one.pop("orientation_wxyz"))
            self.assertEqual(set(row) - set(one), {"participant_id", "protocol_sha256", "program_version", *TURN})
            for name, value in one.items():
                shown = cell(value)
                self.assertEqual(float(row[name]) if isinstance(shown, float) else row[name], shown, name)
            place = (one["session"], one["trial"])  # trials count within a session
            self.assertEqual(place, (last[0], last[1] + 1) if place[0] == last[0] else (last[0] + 1, 1))
            last = place
        return rows, table

    def test_of_identification(self):
        for participant in (1, 2, 5):
            rows, table = self.check(PROTOCOLS / "quick.json", participant)
            lines = table.splitlines()
            self.assertEqual(lines[0].split()[:5], ["session", "block", "trial", "renderer", "shape"])
            self.assertEqual(len(lines), 1 + len(rows))
            for row, line in zip(rows, lines[1:]):
                self.assertEqual(line.split()[:5], [row[k] for k in ("session", "block", "trial", "renderer", "shape")])
                self.assertEqual(line.split()[5:9], [f"{float(row[k]):.3f}" for k in TURN])

    def test_of_tasks(self):
        for name in ("stiffness-2afc.json", "size-questplus.json", "roughness-magnitude.json"):
            rows, table = self.check(PROTOCOLS / name, 3)
            shown = iter(rows)
            session = block = None
            for line in table.splitlines():
                if head := re.match(r"session (\d+), block (\d+), (.*)", line):
                    session, block, block_name = head.groups()
                elif re.match(r" +\d+ +\d+  (point|ray) ", line):
                    row = next(shown)
                    self.assertEqual((row["session"], row["block"], row["block_name"]), (session, block, block_name))
                    wanted = [row["trial"], row["track"], row["renderer"], "catch" if row["catch_trial"] == "1" else row["level"],
                              row["comparison_interval"], row["shape"]]
                    self.assertEqual(line.split(), [text for text in wanted if text])
            self.assertIsNone(next(shown, None), "the table has every trial")

    def test_the_session_follows_the_listed_schedule(self):
        with tempfile.TemporaryDirectory() as folder:
            study = pathlib.Path(folder) / "study.db"
            palpate("simulate", PROTOCOLS / "quick.json", "--db", study, "--participants", 2, "--seed", 4)
            palpate("export", "--db", study, "--format", "csv", "--out", study.with_suffix(".csv"))
            with open(study.with_suffix(".csv"), newline="") as file:
                run = list(csv.DictReader(file))
        people = sorted({row["participant_id"] for row in run})
        self.assertEqual(len(people), 2)
        for number, who in enumerate(people, 1):
            rows, _, _ = self.listed(PROTOCOLS / "quick.json", number)
            own = [row for row in run if row["participant_id"] == who]
            names = ("session", "block", "trial", "renderer", "shape", "practice")
            self.assertEqual([[row[k] for k in names] for row in own], [[row[k] for k in names] for row in rows])
            self.assertEqual([[float(row[k]) for k in TURN] for row in own], [[float(row[k]) for k in TURN] for row in rows])


class Durations(unittest.TestCase):
    def said(self, time_out_s=60, **changes):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "p.json"
            protocol = json.loads((PROTOCOLS / "quick.json").read_text()) | changes  # 24 trials, each after 0.5 s of rest
            protocol["response"]["time_out_s"] = time_out_s
            path.write_text(json.dumps(protocol))
            return re.search("duration +(.*)", palpate("validate", path))[1]

    def test_no_trial_lasts_longer_than_its_limit(self):
        self.assertEqual(self.said(), "about 4 min at 10 s a trial, at most 24 min; breaks besides")
        self.assertEqual(self.said(time_out_s=1.5), "about 48 s at 1.5 s a trial, at most 48 s; breaks besides")

    def test_practice_until_a_criterion_comes_besides(self):
        self.assertEqual(self.said(practice={"repetitions": 1, "criterion": 0.9}),
                         "about 6 min at 10 s a trial, at most 32 min; breaks and further rounds of practice besides")


class Explained(unittest.TestCase):
    def explained(self, scene, renderer):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "scene.json"
            path.write_text(json.dumps(scene))
            text = palpate("render", "--scene", path, "--renderer", renderer, "--explain", "--json", path.with_name("e.json"))
            return text, json.loads(path.with_name("e.json").read_text())

    def test_counts_are_the_solids_faces_edges_and_corners(self):
        cube = {"shape": "cube", "edge_m": 0.02}  # 6 faces, 12 edges
        scene = {"objects": [cube, {**cube, "position_m": [0.2, 0, 0]},
                             {"shape": "compound", "position_m": [0, 0.3, 0], "parts": [cube, {**cube, "position_m": [0.01, 0, 0]}]}]}
        for renderer in ("point", "ray"):
            text, document = self.explained(scene, renderer)
            self.assertTrue(text.startswith(f"{renderer} renderer; objects: 3, convex parts: 4, facets: 24, edges: 48\n"), text[:200])
            self.assertEqual([document[k] for k in ("renderer", "objects", "parts", "facets", "edges")], [renderer, 3, 4, 24, 48])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
