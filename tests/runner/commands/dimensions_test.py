"""A study of levels of several dimensions, from its registration to its bundle."""

import csv
import io
import json
import math
import unittest

import command_case

BALL = {"shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 300}
STUDY = {
    "version": 2, "name": "weber", "renderers": ["point"], "seed": 5, "orientation": "fixed", "home": {"rest_s": 0.05},
    "stimuli": [{"name": "standard", **BALL}, {"name": "comparison", **BALL}],
    "groups": {"names": ["young", "older"]},
    "blocks": [
        {"name": "field", "task": "compare", "stimuli": ["comparison"], "standard": "standard",
         "level": {"dimensions": [{"name": "reference", "path": "/stiffness_n_per_m", "of": "standard"},
                                  {"name": "stiffness", "path": "/stiffness_n_per_m"}]},
         "procedure": [
             {"kind": "quest_plus", "function": {"form": "weber"},
              "grid": {"reference": [100, 200, 400], "stiffness": {"from": 50, "to": 800, "count": 25, "spacing": "log"}},
              "w": [0.05, 0.1, 0.2, 0.4], "c": [0, 50, 150], "stop": {"trials": 4}},
             {"kind": "constant", "levels": [[100, 75], [100, 135], [200, 150], [200, 270], [400, 300], [400, 540]],
              "repetitions": 1}]},
        {"name": "rated", "task": "rate", "stimuli": ["comparison"], "min": 0.001,
         "level": {"dimensions": [{"name": "stiffness", "path": "/stiffness_n_per_m"}, {"name": "radius", "path": "/radius_m"}]},
         "procedure": {"kind": "sobol", "ranges": {"stiffness": {"min": 200, "max": 800}, "radius": {"min": 0.02, "max": 0.04}},
                       "trials": 4}}]}
ABOUT = {"version": 1, "authors": [{"name": "Ada"}], "license": "CC0-1.0"}
PARTICIPANTS = 4


class Dimensions(command_case.CommandCase):
    def test_registered_checked_and_bundled(self):
        protocol = self.file("p.json", STUDY)
        self.palpate("plan", "--rating-effect", 2, "--trials", 4, "--participants", f"{PARTICIPANTS}-{PARTICIPANTS}", "--studies", 100,
                     "--json", self.dir / "plan.json")
        hypotheses = self.file("h.json", [{"id": "H1", "text": "Older people say more.",
                                           "corroborated": "effects.rating.rated.group.p < alpha", "refuted": "effects.rating.rated.group.p > 0.5"}])
        out = self.dir / "registration"
        self.palpate("register", protocol, "--plan", self.dir / "plan.json", "--hypotheses", hypotheses, "--out", out,
                     "--participants", PARTICIPANTS, "--studies", 20)
        text = (out / "registration.md").read_text()
        for words in ("reference, stiffness of the standard (N/m)", "radius, radius of the stimulus (m)", "by maximum likelihood for each participant"):
            self.assertIn(words, text)
        self.assertNotRegex(text, r"\| H1 \| no effect \|[^|]*\|[^|]*\| 20 of 20 \|")  # it finds the effect's p

        db = self.dir / "study.db"
        self.palpate("simulate", protocol, "--db", db, "--participants", PARTICIPANTS)
        self.palpate("check", out, "--db", db, "--json", self.dir / "check.json")
        found = {one["id"]: one["finding"] for one in json.loads((self.dir / "check.json").read_text())["points"]}
        self.assertEqual((found["order"], found["trials"]), ("as registered", "as registered"))
        self.assertNotIn("deviation", found.values())

        rows = self.exported(db)[1]
        self.assertEqual({(row["reference"] != "", row["stiffness"] != "", row["radius"] != "") for row in rows if row["block_name"] == "field"},
                         {(True, True, False)})
        self.assertEqual({(row["reference"] != "", row["stiffness"] != "", row["radius"] != "") for row in rows if row["block_name"] == "rated"},
                         {(False, True, True)})
        for form in ("bids", "psych-ds"):
            bundle = self.dir / form
            self.palpate("bundle", "--db", db, "--registration", out, "--about", self.file("about.json", ABOUT), "--out", bundle, "--format", form)
            said = self.palpate("bundle", "--verify", bundle).stdout
            self.assertNotIn("DIFFERS", said)
            self.assertIn("Run as registered", said)

    def test_fits_are_those_of_another_program(self):
        """The greatest likelihood over a fine grid, from the exported table alone."""
        field = STUDY["blocks"][0]
        quest, constant = field["procedure"]
        longer = {**field, "procedure": [{**quest, "stop": {"trials": 40}}, {**constant, "repetitions": 4}]}
        protocol = self.file("p.json", {**STUDY, "blocks": [longer]})
        db = self.dir / "study.db"
        self.palpate("simulate", protocol, "--db", db, "--participants", 2, "--seed", 3)
        self.palpate("analyze", "--db", db, "--json", self.dir / "found.json")
        cells = [cell for cell in json.loads((self.dir / "found.json").read_text())["cells"] if cell.get("field")]
        fitted = {one["participant_id"]: one for cell in cells for one in cell["field"]["participants"]}
        rows = [row for row in csv.DictReader(io.StringIO(self.exported(db)[0])) if row["block_name"] == "field" and row["timed_out"] == "0"]
        people = sorted({row["participant_id"] for row in rows})
        self.assertEqual(sorted(fitted), people)
        for person in people:
            answers = [(float(row["reference"]), float(row["stiffness"]), row["success"] == "1") for row in rows if row["participant_id"] == person]

            def log_likelihood(w, c, lapse):
                total = 0
                for standard, x, success in answers:
                    z = 0.6744897501960817 * (x - standard) / (w * (standard + c))
                    p = lapse + (1 - 2 * lapse) * 0.5 * math.erfc(-z / math.sqrt(2))
                    total += math.log(max(p if success else 1 - p, 1e-300))
                return total

            values = {name: one["estimate"] for name, one in fitted[person]["parameters"].items()}
            own = log_likelihood(values["w"], values["c"], max(values["lapse"], 1e-12))
            self.assertAlmostEqual(own, fitted[person]["log_likelihood"], delta=1e-4)
            grid = max(log_likelihood(0.02 * 1.08 ** i, -75 + 15 * k, lapse) for i in range(45) for k in range(30) for lapse in (1e-9, 0.02, 0.04, 0.06))
            self.assertGreaterEqual(own, grid - 1e-6)


if __name__ == "__main__":
    unittest.main()
