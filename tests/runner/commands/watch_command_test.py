"""palpate watch from outside. Usage: watch_command_test.py PALPATE PROTOCOLS"""

import base64
import csv
import hashlib
import json
import math
import pathlib
import re
import sys
import unittest

import watch_page
from command_case import CommandCase

PROTOCOLS = pathlib.Path(sys.argv.pop(1))
FIXED, A_TICK = 100_000, 60  # bytes of a page
METRE, NEWTON, SECOND = 0.51e-8, 0.51e-5, 0.51e-6  # half a step of the page's numbers
HOSTILE = "</script><script>alert(1)</script>"


def protocol(**more):
    return {"version": 1, "name": "short", "title": HOSTILE, "renderers": ["point", "ray"], "samples": True,
            "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": 0.03},
                        {"name": "cube", "shape": "cube", "edge_m": 0.05}],
            "repetitions": 1, "response": {"keys": {"1": "sphere", "2": "cube"}, "time_out_s": 5}, "seed": 7, **more}


class Watch(CommandCase):
    def study(self, name="study", **more):
        db = self.dir / f"{name}.db"
        self.palpate("simulate", self.file(f"{name}.json", protocol(**more)), "--db", db, "--participants", 1, "--seed", 3)
        return db

    def page(self, db, *trials, more=(), out="page.html"):
        asked = [word for trial in trials for word in ("--trial", trial)]
        self.palpate("watch", "--db", db, *asked, *more, "--out", self.dir / out, "--force")
        text = (self.dir / out).read_text()
        document = watch_page.read(text)
        ticks = sum(part["ticks"] for show in document["shows"] for part in show["parts"])
        self.assertLessEqual(len(text.encode()), FIXED + A_TICK * ticks)
        return text, document

    def replayed(self, db, trial, *more):
        out = self.dir / "replayed.csv"
        self.palpate("replay", "--db", db, "--trial", trial, *more, "--out", out, "--force")
        with out.open() as file:
            return [{name: float(value) for name, value in row.items() if value} for row in csv.DictReader(file)]

    def assert_column(self, found, expected, step):
        self.assertEqual(len(found), len(expected))
        self.assertLessEqual(max(abs(a - b) for a, b in zip(found, expected)), step)

    def assert_shows(self, show, rows, whose, depth):
        c = show["columns"]
        self.assert_column(c["t"], [row["t"] for row in rows], SECOND)
        self.assert_column(c["depth"], [row[depth] for row in rows], METRE)
        for axis in "xyz":
            self.assert_column(c[f"tip_{axis}"], [row[f"tip_{axis}"] for row in rows], METRE)
            self.assert_column(c[f"tail_{axis}"], [row[f"tail_{axis}"] for row in rows], METRE)
            self.assert_column(c[f"force_{axis}"], [row[f"{whose}_force_{axis}"] for row in rows], NEWTON)

    def test_the_pages_numbers_equal_a_replays(self):
        db = self.study()
        for trial in ("S001/1/1", "S001/1/2", "S001/1/3", "S001/1/4"):
            _, document = self.page(db, trial, more=["--compare"])
            rows = self.replayed(db, trial, "--compare")
            recorded, other = document["shows"]
            self.assert_shows(recorded, rows, "recorded", "recorded_depth")
            self.assert_shows(other, rows, "other", "other_depth")
            self.assertGreater(max(map(abs, recorded["columns"]["force_x"])), 0)
            self.assertIn(f"all {len(rows)} ticks equal the record", " ".join(recorded["facts"]))
            self.assertIn("SIMULATED", recorded["facts"][0])
            self.assertIn("SIMULATED COMPARISON", other["facts"][0])

    def test_ideal_tool_and_contact_equal_those_of_render(self):
        db = self.study()
        (trials := list(csv.DictReader(self.exported(db)[0].splitlines())))
        for row in trials:
            trial = f"S001/1/{row['trial']}"
            _, document = self.page(db, trial)
            c = document["shows"][0]["columns"]
            turn = [float(row[f"orientation_{k}"]) for k in "wxyz"]
            stimulus = next(s for s in protocol()["stimuli"] if s["name"] == row["shape"])
            scene = {"objects": [{**{k: v for k, v in stimulus.items() if k != "name"}, "orientation_wxyz": turn}]}
            path = self.dir / "path.csv"
            names = ["t"] + [f"{end}_{axis}" for end in ("tip", "tail") for axis in "xyz"]
            with path.open("w") as file:
                out = csv.DictWriter(file, names, extrasaction="ignore")
                out.writeheader()
                out.writerows(self.replayed(db, trial))
            self.palpate("render", "--scene", self.file("scene.json", scene), "--renderer", row["renderer"], "--trajectory",
                         path, "--out", self.dir / "forces.csv", "--force")
            with (self.dir / "forces.csv").open() as file:
                rendered = list(csv.DictReader(file))
            types = [document["types"][int(k)] for k in c["type"]]
            self.assertEqual(types, [r["contact_type"] for r in rendered])
            self.assertGreater(len(set(types)), 1)
            self.assertEqual(c["contacts"], [int(r["contacts"]) for r in rendered])
            for axis in "xyz":
                tip = [a + b for a, b in zip(c[f"tip_{axis}"], c[f"lag_tip_{axis}"])]
                tail = [a + b + d for a, b, d in zip(c[f"tail_{axis}"], c[f"lag_tip_{axis}"], c[f"lag_turn_{axis}"])]
                self.assert_column(tip, [float(r[f"ideal_tip_{axis}"]) for r in rendered], 2 * METRE)
                self.assert_column(tail, [float(r[f"ideal_tail_{axis}"]) for r in rendered], 3 * METRE)
                touched = [i for i, count in enumerate(c["contacts"]) if count > 0]
                self.assert_column([tip[i] + c[f"contact_{axis}"][i] for i in touched],
                                   [float(rendered[i][f"contact_{axis}"]) for i in touched], 3 * METRE)

    def test_the_picture_has_the_objects_surface(self):
        _, document = self.page(self.study(), "S001/1/1", "S001/1/2", "S001/1/3", "S001/1/4")
        self.assertEqual(len(document["meshes"]), 2, "equal objects are there once")
        for show in document["shows"]:
            (part,) = show["parts"]
            mesh = document["meshes"][part["mesh"]]["columns"]
            corners = list(zip(mesh["x"], mesh["y"], mesh["z"]))
            if "cube" in show["title"]:
                self.assertEqual({tuple(round(abs(v), 7) for v in p) for p in corners}, {(0.025,) * 3})
                self.assertEqual((len(corners), len(mesh["corner"])), (8, 36))
            else:
                for p in corners:
                    self.assertAlmostEqual(math.hypot(*p), 0.03, delta=2e-4)
            # Closed: every edge occurs once in each direction; outward: the volume is positive.
            at = list(map(int, mesh["corner"]))
            triangles = [at[i:i + 3] for i in range(0, len(at), 3)]
            edges = [(t[k], t[(k + 1) % 3]) for t in triangles for k in range(3)]
            self.assertEqual(len(edges), len(set(edges)))
            self.assertEqual(set(edges), {(b, a) for a, b in edges})
            volume = 0
            for t in triangles:
                (a, b, c) = (corners[k] for k in t)
                volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
                           + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6
            true = 0.05 ** 3 if "cube" in show["title"] else 4 / 3 * math.pi * 0.03 ** 3
            self.assertAlmostEqual(volume / true, 1, delta=0.02)
            self.assertAlmostEqual(sum(q * q for q in part["pose"][3:]), 1, delta=1e-12)

    def test_moving_stimuli_move_in_the_picture(self):
        design = protocol(gravity_m_per_s2=[0, 0, -0.02])
        for stimulus in design["stimuli"]:
            stimulus["body"] = {"mass_kg": 2, "damping_per_s": 10}
        db = self.study("moves", gravity_m_per_s2=[0, 0, -0.02], stimuli=design["stimuli"])
        _, document = self.page(db, "S001/1/1")
        rows = self.replayed(db, "S001/1/1")
        c = document["shows"][0]["columns"]
        self.assertGreater(abs(c["moved_z"][-1]), 1e-5)
        # Sphere and cube are centred, so their origin is their centre of mass.
        for axis in "xyz":
            self.assert_column(c[f"moved_{axis}"], [row[f"recorded_body_{axis}"] for row in rows], METRE)

    def test_omissions_of_the_drawing_are_stated(self):
        layers = [{"depth_m": 0.001, "stiffness_n_per_m": 50}, {"depth_m": 0.004, "stiffness_n_per_m": 50}]
        stimuli = [{"name": "sphere", "shape": "sphere", "radius_m": 0.03, "material": {"layers": layers}},
                   {"name": "cube", "shape": "cube", "edge_m": 0.05}]
        db = self.study("layers", stimuli=stimuli, renderers=["point"])
        said = [self.page(db, f"S001/1/{k}")[0] for k in (1, 2)]
        words = "Of sphere the surface is drawn; it has 2 layers below it, from a depth of 1.0 mm and 4.0 mm."
        self.assertEqual(sorted(words in page for page in said), [False, True])

    def test_intervals_of_a_task_each_have_their_object(self):
        design = json.loads((PROTOCOLS / "size-questplus.json").read_text())
        design.pop("$schema")
        design["samples"] = True
        db = self.dir / "task.db"
        self.palpate("simulate", self.file("task.json", design), "--db", db, "--participants", 1, "--seed", 3)
        trial = "S001/1/1"
        _, document = self.page(db, trial)
        (show,) = document["shows"]
        rows = self.replayed(db, trial)
        self.assertEqual([part["ticks"] for part in show["parts"]],
                         [sum(row["interval"] == k for row in rows) for k in (1, 2)])
        self.assert_shows(show, rows, "recorded", "recorded_depth")
        self.assertNotEqual(show["parts"][0]["mesh"], show["parts"][1]["mesh"])

    def test_only_its_own_script_may_run_and_texts_stay_texts(self):
        text, _ = self.page(self.study(name="hostile"), "S001/1/1")
        self.assertNotIn(HOSTILE, text)
        scripts = re.findall(r"<script>(.*?)</script>", text, re.S)
        self.assertEqual(len(scripts), 1)
        digest = base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
        self.assertIn(f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src data:;", text)
        self.assertNotRegex(re.sub(r"http://www\.w3\.org/2000/svg", "", text), r"https?://")
        self.assertIn("SIMULATED PARTICIPANT", text)

    def test_wrong_use_is_reported(self):
        db = self.study()
        watch = ["watch", "--db", db, "--out", self.dir / "page.html"]
        said = self.palpate(*watch, "--trial", "S001/1/9", status=2).stderr
        self.assertIn("S001/1/9 is not on record; there are S001/1/1 to 4", said)
        said = self.palpate(*watch, "--trial", "P07/1/1", status=2).stderr
        self.assertIn("P07/1/1 is not on record; finished trials are of S001", said)
        self.assertIn("CODE/SESSION/TRIAL", self.palpate(*watch, "--trial", "S001/1", status=2).stderr)
        self.assertIn("twice", self.palpate(*watch, "--trial", "S001/1/1", "--trial", "S001/1/1", status=2).stderr)
        five = [word for k in range(1, 6) for word in ("--trial", f"S001/1/{k}")]
        self.assertIn("at most 4", self.palpate(*watch, *five, status=2).stderr)
        self.assertIn("at most 2", self.palpate(*watch, *five[:6], "--compare", status=2).stderr)
        self.assertFalse((self.dir / "page.html").exists())
        self.palpate(*watch, "--trial", "S001/1/1")
        before = (self.dir / "page.html").read_bytes()
        self.assertIn("--force", self.palpate(*watch, "--trial", "S001/1/2", status=2).stderr)
        self.assertEqual((self.dir / "page.html").read_bytes(), before)
        self.palpate(*watch, "--trial", "S001/1/1", "--force")
        self.assertEqual((self.dir / "page.html").read_bytes(), before, "the same trial, the same page")
        database = db.read_bytes()
        self.palpate("watch", "--db", db, "--trial", "S001/1/1", "--out", db, "--force", status=2)
        self.assertEqual(db.read_bytes(), database)
        db = self.study("without", samples=False)
        said = self.palpate("watch", "--db", db, "--trial", "S001/1/1", "--out", self.dir / "no.html", status=2).stderr
        self.assertIn("without servo samples", said)
        self.assertFalse((self.dir / "no.html").exists())


unittest.main()
