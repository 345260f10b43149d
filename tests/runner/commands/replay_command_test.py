"""palpate replay from outside. Usage: replay_command_test.py PALPATE"""

import csv
import hashlib
import json
import math
import pathlib
import sqlite3
import sys
import unittest
import zlib

from command_case import CommandCase

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "data" / "store"))
import seals  # noqa: E402
from sample_planes import planes_of  # noqa: E402

# kg, 1/s, m/s^2, s. Heavy and slow enough to stay within the hand's reach; lighter ones float away before some trials
# touch them.
MASS, DAMPING, GRAVITY, TICK = 2, 10, -0.02, 0.001


def protocol(samples=True, **material):
    return {"version": 1, "name": "short", "renderers": ["point", "ray"], "samples": samples,
            "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": 0.03, "subdivisions": 2},
                        {"name": "cube", "shape": "cube", "edge_m": 0.05}],
            "repetitions": 1, "material": {"stiffness_n_per_m": 800, **material},
            "response": {"keys": {"1": "sphere", "2": "cube"}, "time_out_s": 5}, "seed": 7}


class Replay(CommandCase):
    @staticmethod
    def replace_samples(db, data):
        with sqlite3.connect(db) as base:
            attempt, count = base.execute("SELECT attempt_id, count FROM samples LIMIT 1").fetchone()
            packing = 4  # zlib
            base.execute("UPDATE samples SET packing = ?, data = ? WHERE attempt_id = ?", (packing, data, attempt))
            checksum = hashlib.sha256(packing.to_bytes(4, "little") + count.to_bytes(8, "little") + data).digest()
            base.execute("UPDATE attempts SET samples_sha256 = ? WHERE id = ?", (checksum, attempt))
            seals.seal_again(base)
        base.close()

    def study(self, name="study", **wanted):
        path, db = self.dir / f"{name}.json", self.dir / f"{name}.db"
        path.write_text(json.dumps(protocol(**wanted)))
        self.palpate("simulate", path, "--db", db, "--participants", 1, "--seed", 3)
        with sqlite3.connect(db) as base:
            trials = base.execute("SELECT p.code, s.number, a.trial, a.renderer FROM attempts a JOIN runs r ON r.id = a.run_id "
                                  "JOIN sessions s ON s.id = r.session_id JOIN participants p ON p.id = s.participant_id "
                                  "ORDER BY a.trial").fetchall()
        base.close()
        return db, [(f"{code}/{session}/{trial}", renderer) for code, session, trial, renderer in trials]

    def moving_study(self):
        design = protocol()
        design["gravity_m_per_s2"] = [0, 0, GRAVITY]
        for stimulus in design["stimuli"]:
            stimulus["body"] = {"mass_kg": MASS, "damping_per_s": DAMPING}
        path, db = self.file("moves.json", design), self.dir / "moves.db"
        self.palpate("simulate", path, "--db", db, "--participants", 1, "--seed", 3)
        return db

    def test_poses_of_moving_stimuli_are_recorded_and_replayed(self):
        db, out = self.moving_study(), self.dir / "moves.csv"
        touched_by = set()
        for trial in range(1, 5):
            done = self.palpate("replay", "--db", db, "--trial", f"S001/1/{trial}", "--out", out, "--force")
            self.assertIn("equal the record, bit by bit", done.stdout)
            touched_by.add(next(name for name in ("point", "ray") if f", {name}, " in done.stdout))
            with out.open() as file:
                rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
            self.check_fall(rows)
            self.check_momentum(rows)
            self.assertGreater(max(abs(row["recorded_body_x"]) for row in rows), 1e-4)
            for row in rows[:: len(rows) // 20]:
                self.assertAlmostEqual(sum(row[f"recorded_body_q{k}"] ** 2 for k in "wxyz"), 1, delta=1e-12)
        self.assertEqual(touched_by, {"point", "ray"})

    def check_fall(self, rows):
        """Before contact it falls as in a fluid."""
        self.assertGreater(len(rows), 100)
        touched = next(i for i, row in enumerate(rows) if row["recorded_depth"] > 0)
        self.assertGreater(touched, 100)
        for i in range(0, touched, 50):
            t = (i + 1) * TICK  # its pose is the one after the tick
            fallen = GRAVITY / DAMPING * (t - (1 - math.exp(-DAMPING * t)) / DAMPING)
            self.assertAlmostEqual(rows[i]["recorded_body_z"], fallen, delta=1e-12)

    def check_momentum(self, rows):
        """It is the impulse of hand and weight less the fluid's, to first order in the step."""
        for axis, weight in (("x", 0), ("y", 0), ("z", GRAVITY)):
            given, bound = 0, 1e-12
            for row in rows:
                given += weight * TICK - row[f"recorded_force_{axis}"] / MASS * TICK
                bound += abs(row[f"recorded_force_{axis}"]) / MASS * TICK * DAMPING * TICK
                held = row[f"recorded_body_v{axis}"] + DAMPING * row[f"recorded_body_{axis}"]
                self.assertAlmostEqual(held, given, delta=bound)

    def test_one_wrong_bit_of_a_recorded_pose_is_reported(self):
        db = self.moving_study()
        with sqlite3.connect(db) as base:
            packing, count, data = base.execute("SELECT packing, count, data FROM samples LIMIT 1").fetchone()
        base.close()
        self.assertEqual(packing, 6)
        planes = bytearray(planes_of(data))
        self.assertEqual(len(planes), count * (4 + 8 + 2 * 8 + 19 * 8 + 3 + 4 + 1 + 13 * 8))
        body_x_low = (4 + 8 + 2 * 8 + 19 * 8 + 3 + 4 + 1) * count + 7 * count
        planes[body_x_low + count - 1] ^= 1
        changed = zlib.compress(bytes(planes)) + zlib.crc32(bytes(planes)).to_bytes(4, "big")
        self.replace_samples(db, changed)
        done = self.palpate("replay", "--db", db, "--trial", "S001/1/1", status=1)
        self.assertIn("1 of ", done.stdout)

    def test_every_trial_is_equal_bit_by_bit_whatever_the_material(self):
        for name, material in [("plain", {}), ("rough", {"friction_static": 0.4, "friction_dynamic": 0.3, "damping_ns_per_m": 0.05})]:
            db, trials = self.study(name, **material)
            self.assertEqual({renderer for _, renderer in trials}, {"point", "ray"})
            for trial, renderer in trials:
                out = self.dir / "out.json"
                done = self.palpate("replay", "--db", db, "--trial", trial, "--json", out, "--force")
                self.assertIn("equal the record, bit by bit", done.stdout)
                self.assertIn("SIMULATED", done.stdout)
                result = json.loads(out.read_text())
                self.assertEqual(result["ticks"], result["equal_ticks"])
                self.assertGreater(result["ticks"], 100)
                self.assertGreater(result["recorded"]["share_in_contact"], 0)
                self.assertEqual(result["recorded"]["renderer"], renderer)

    def test_a_material_that_was_limited_to_the_device_is_limited_again(self):
        stiff = {"stiffness_n_per_m": 60000, "damping_ns_per_m": 0.3}
        path, db = self.dir / "stiff.json", self.dir / "stiff.db"
        path.write_text(json.dumps(protocol(**stiff) | {"servo": {"material_limit": "limit"}}))
        said = self.palpate("simulate", path, "--db", db, "--participants", 1, "--seed", 3).stderr
        self.assertIn("limited to", said)
        with sqlite3.connect(db) as base:
            events = [json.loads(text) for (text,) in base.execute("SELECT text FROM notes")]
        base.close()
        (event,) = events
        self.assertEqual([one["stimulus"] for one in event["material_limited"]], ["sphere", "cube"])
        for one in event["material_limited"]:
            self.assertEqual((one["asked_stiffness_n_per_m"], one["asked_damping_ns_per_m"]), (60000, 0.3))
            self.assertLess(one["shown_stiffness_n_per_m"], 60000)
            self.assertAlmostEqual(one["shown_damping_ns_per_m"], 0.3 * one["shown_stiffness_n_per_m"] / 60000)
        self.assertEqual(event["rate_hz"], 1000)
        out = self.dir / "out.json"
        for trial in range(1, 5):
            done = self.palpate("replay", "--db", db, "--trial", f"S001/1/{trial}", "--json", out, "--force")
            self.assertIn("equal the record, bit by bit", done.stdout)
            self.assertIn("as they were limited", done.stdout)
            result = json.loads(out.read_text())
            self.assertTrue(result["material_limited"])
            self.assertGreater(result["recorded"]["max_force_n"], 0)
        with sqlite3.connect(db) as base:
            base.execute("UPDATE notes SET text = replace(text, '60000', '50000')")
            seals.seal_again(base)
        base.close()
        refused = self.palpate("replay", "--db", db, "--trial", "S001/1/1", status=2)
        self.assertIn("the recorded limit does not match", refused.stderr)

    def test_compares_with_the_other_renderer_tick_by_tick(self):
        db, trials = self.study()
        trial = next(trial for trial, renderer in trials if renderer == "ray")
        out, figures = self.dir / "both.csv", self.dir / "both.json"
        done = self.palpate("replay", "--db", db, "--trial", trial, "--compare", "--out", out, "--json", figures)
        self.assertIn("their forces differ by", done.stdout)
        result = json.loads(figures.read_text())
        self.assertEqual(result["other"]["renderer"], "point")
        rows = list(csv.DictReader(out.read_text().splitlines()))
        self.assertEqual(len(rows), result["ticks"])

        def size(row, name):
            return sum(float(row[f"{name}_{axis}"]) ** 2 for axis in "xyz") ** 0.5
        for name, figure in [("recorded_force", result["recorded"]), ("other_force", result["other"])]:
            self.assertAlmostEqual(max(size(row, name) for row in rows), figure["max_force_n"], 12)
        # The point has no side contact: no torque, and less contact.
        self.assertTrue(all(size(row, "other_torque") == 0 for row in rows))
        self.assertLess(result["other"]["share_in_contact"], result["recorded"]["share_in_contact"])
        for row in rows:
            for axis in "xyz":
                self.assertEqual(row[f"recorded_force_{axis}"], row[f"again_force_{axis}"])

    def test_a_record_that_was_changed_differs(self):
        db, trials = self.study()
        with sqlite3.connect(db) as base:
            self.assertEqual(seals.faults(base), [])
            base.execute("UPDATE attempts SET orientation_w = orientation_x, orientation_x = orientation_w")
            self.assertEqual(len(seals.faults(base)), len(trials))
        base.commit()
        refused = self.palpate("replay", "--db", db, "--trial", trials[-1][0], status=2)
        self.assertIn(f"{db}: participant S001, session 1, trial 1, attempt 1: was changed", refused.stderr)
        seals.seal_again(base)
        self.assertEqual(seals.faults(base), [])
        base.close()
        done = self.palpate("replay", "--db", db, "--trial", trials[-1][0], status=1)
        self.assertRegex(done.stdout, r"ticks differ from the record, the first is tick \d+")

    def test_a_shape_that_the_protocol_does_not_have_is_refused(self):
        db, trials = self.study()
        with sqlite3.connect(db) as base:
            base.execute("UPDATE attempts SET shape = 'torus'")
            seals.seal_again(base)
        base.close()
        done = self.palpate("replay", "--db", db, "--trial", trials[0][0], status=2)
        for said in (str(db), trials[0][0], "'torus'"):
            self.assertIn(said, done.stderr)

    def test_missing_data_is_named(self):
        db, trials = self.study()
        bare, names = self.study("bare", samples=False)
        for args, message in [((db, "P9/1/1"), "not on record"), ((db, "nonsense"), "CODE/SESSION/TRIAL"),
                              ((db, trials[0][0] + "x"), "CODE/SESSION/TRIAL"), ((db, "/1/1"), "CODE/SESSION/TRIAL"),
                              ((bare, names[0][0]), "without servo samples"), ((self.dir / "no.db", "P1/1/1"), "no.db")]:
            done = self.palpate("replay", "--db", args[0], "--trial", args[1], status=2)
            self.assertIn(message, done.stderr)
            self.assertEqual(done.stdout, "")
        done = self.palpate("replay", "--db", db, "--trial", trials[0][0], "--protocol", "other", status=2)
        self.assertIn("is not on record in protocol other; it has no finished trial", done.stderr)
        kept = self.dir / "kept.csv"
        kept.write_text("mine")
        self.palpate("replay", "--db", db, "--trial", trials[0][0], "--out", kept, status=2)
        self.assertEqual(kept.read_text(), "mine")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
