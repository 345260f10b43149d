"""The paper's floating dumbbell and flying rocket as stimuli of a simulated study. Usage: moving_stimuli_test.py PALPATE PROTOCOLS"""

import csv
import gzip
import json
import pathlib
import shutil
import sqlite3
import sys
import unittest

from command_case import CommandCase

PROTOCOLS = pathlib.Path(sys.argv[1])
BODY = [f"body_{what}" for what in ("x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz")]


class MovingStimuli(CommandCase):
    def stimulus(self, scene, name):
        """The first object of a scene, heavy and slow enough to be found again."""
        found = json.loads((PROTOCOLS / "scenes" / f"{scene}.json").read_text())["objects"][0]
        self.assertIn("body", found)
        found["body"] |= {"mass_kg": 4, "damping_per_s": 10}
        found["body"].pop("velocity_m_per_s", None)
        del found["position_m"]
        if "file" in found:
            source = PROTOCOLS / "scenes" / found["file"]
            shutil.copy(source, self.dir)
            found["file"] = source.name
        return {"name": name, **found}

    def exported(self, db):
        """The samples of BIDS and of Psych-DS, each column described."""
        self.palpate("export", "--db", db, "--format", "bids", "--out", self.dir / "bids")
        (samples,) = (self.dir / "bids").rglob("*_physio.tsv.gz")
        about = json.loads((samples.parent / samples.name.replace(".tsv.gz", ".json")).read_text())
        for name in BODY:
            self.assertIn("Description", about[name])
        with gzip.open(samples, "rt") as file:
            bids = list(csv.DictReader(file, about["Columns"], delimiter="\t"))
        self.palpate("export", "--db", db, "--format", "psych-ds", "--out", self.dir / "psych-ds")
        (samples,) = (self.dir / "psych-ds").rglob("*_description-haptic_data.csv")
        about = json.loads((self.dir / "psych-ds" / "dataset_description.json").read_text())
        self.assertLessEqual(set(BODY), {variable["name"] for variable in about["variableMeasured"]})
        with samples.open(newline="") as file:
            psych_ds = list(csv.DictReader(file))
        return bids, psych_ds

    def test_moving_scenes_are_simulated_stored_and_replayed(self):
        path, db, out = (self.dir / f"flying.{end}" for end in ("json", "db", "csv"))
        path.write_text(json.dumps({
            "version": 1, "name": "flying", "renderers": ["point", "ray"], "samples": True, "repetitions": 1, "seed": 16,
            "stimuli": [self.stimulus("fig14-dumbbells", "dumbbell"), self.stimulus("fig16-rocket", "rocket")],
            "response": {"keys": {"1": "dumbbell", "2": "rocket"}, "time_out_s": 5}}))
        self.palpate("validate", path)
        self.palpate("simulate", path, "--db", db, "--participants", 1, "--seed", 3)
        base = sqlite3.connect(db)
        self.addCleanup(base.close)
        trials = base.execute("SELECT trial, renderer, shape FROM attempts WHERE state = 'completed'").fetchall()
        self.assertEqual({trial[1:] for trial in trials},
                         {(renderer, shape) for renderer in ("point", "ray") for shape in ("dumbbell", "rocket")})
        exported = self.exported(db)
        pushed = set()
        for trial, renderer, shape in trials:
            done = self.palpate("replay", "--db", db, "--trial", f"S001/1/{trial}", "--out", out, "--force")
            self.assertIn("equal the record, bit by bit", done.stdout)
            with out.open() as file:
                rows = list(csv.DictReader(file))
            for form in exported:
                beside = [row for row in form if row["trial"] == str(trial)]
                self.assertEqual(len(beside), len(rows))
                for at, row in zip(beside, rows, strict=True):
                    for name in BODY:
                        self.assertAlmostEqual(float(at[name]), float(row[f"recorded_{name}"]), delta=0.51e-9)
            place = [[float(row[f"recorded_body_{axis}"]) for axis in "xyz"] for row in rows]
            felt = [float(row["recorded_depth"]) > 0 for row in rows]
            # Only the hand moves it.
            first = felt.index(True) if any(felt) else len(rows)
            for at in place[:first]:
                self.assertEqual(at, place[0])
            if place[-1] != place[0]:
                pushed.add(shape)
        self.assertEqual(pushed, {"dumbbell", "rocket"})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
