"""Registers studies of tasks, checks and bundles them, from outside. Usage: task_registration_test.py PALPATE"""

import csv
import hashlib
import json
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from command_case import PALPATE, CommandCase

STANDARD = {"name": "standard", "shape": "sphere", "radius_m": 0.03, "subdivisions": 2, "stiffness_n_per_m": 300}
SCALE = [{"label": label} for label in ("very soft", "soft", "rather soft", "medium", "rather hard", "hard", "very hard")]
CONSTANT = {"kind": "constant", "levels": [230, 265, 300, 335, 370], "repetitions": 2}
STAIRCASE = {"kind": "staircase", "start": 450, "min": 300, "max": 600, "steps": [50, 25], "down": 2, "stop": {"trials": 10}}


def compare(name, procedure, **more):
    return {"name": name, "task": "compare", "question": "Which one was stiffer?", "stimuli": ["comparison"],
            "standard": "standard", "level": {"path": "/stiffness_n_per_m"}, "procedure": procedure} | more


def protocol(name, blocks, renderers=("point", "ray"), **more):
    return {"version": 2, "name": name, "renderers": list(renderers), "orientation": "fixed", "home": {"rest_s": 0.05},
            "seed": 4, "stimuli": [STANDARD, STANDARD | {"name": "comparison"}], "blocks": blocks} | more


RATING = {"name": "hardness", "task": "rate", "question": "How hard was it?", "stimuli": ["standard"], "repetitions": 3,
          "scale": SCALE}
PROTOCOLS = {
    "rating": protocol("rating", [RATING]),
    "stairs": protocol("stairs", [compare("practice", CONSTANT | {"repetitions": 1}, practice=True),
                                  compare("early", [STAIRCASE, STAIRCASE | {"start": 400}]), compare("late", CONSTANT)],
                       renderers=["point"], block_order="counterbalanced"),
    "magnitude": protocol("magnitude", [{"name": "estimate", "task": "rate", "question": "How hard?", "stimuli": ["comparison"],
                                         "level": {"path": "/stiffness_n_per_m"}, "min": 0.001,
                                         "procedure": {"kind": "constant", "levels": [100, 220, 500], "repetitions": 3}}]),
    "which": protocol("which", [{"name": "name", "task": "identify", "stimuli": ["standard", "comparison"], "repetitions": 10,
                                 "keys": {"1": "standard", "2": "comparison"}}]),
}
PLANS = {"rating": ["--rating-effect", 2, "--trials", 3], "stairs": ["--jnd-effect", 50, "--trials", 10],
         "magnitude": ["--exponent-effect", 40, "--trials", 9],
         "which": ["--accuracy-effect", 10, "--accuracy", 0.7, "--trials", 20]}
PARTICIPANTS = {"rating": 6, "stairs": 4, "magnitude": 6, "which": 6}
HYPOTHESES = {
    "rating": [{"id": "H1", "text": "It feels harder with the ray.", "refuted": "rating.hardness.ci95_high < 0.5",
                "corroborated": "rating.hardness.p < alpha && rating.hardness.difference > 0"}],
    "stairs": [{"id": "H1", "text": "JNDs are smaller later.", "refuted": "between.jnd.early.late.ci95_low > 1",
                "corroborated": "between.jnd.early.late.p < alpha && jnd.early.point.estimate > 0"}],
    "magnitude": [{"id": "H1", "text": "Exponents are smaller.", "refuted": "exponent.estimate.ci95_low > 0.9",
                   "corroborated": "exponent.estimate.ratio < 1 && exponent.estimate.p < alpha"}],
    "which": [{"id": "H1", "text": "More are right.", "refuted": "accuracy.ci95_high < 0.05",
               "corroborated": "accuracy.p < alpha && accuracy.difference > 0"}]}


class Study(CommandCase):
    """The studies are registered once for all tests of all classes; each test gets copies."""
    made = tempfile.TemporaryDirectory()

    def study(self, name):
        """Writes protocol, plan, hypotheses, registration and database of a study into the test's folder."""
        participants = PARTICIPANTS[name]
        kept = pathlib.Path(self.made.name) / name
        if not kept.exists():
            kept.mkdir()
            (kept / "p.json").write_text(json.dumps(PROTOCOLS[name]))
            (kept / "h.json").write_text(json.dumps(HYPOTHESES[name]))
            self.palpate("plan", *PLANS[name], "--participants", f"{participants}-{participants}", "--studies", 100,
                         "--json", kept / "plan.json")
            self.palpate(
                "register", kept / "p.json", "--plan", kept / "plan.json", "--hypotheses", kept / "h.json",
                "--participants", participants, "--out", kept / "registration", "--studies", 20)
            self.palpate("simulate", kept / "p.json", "--db", kept / "study.db", "--participants", participants)
        shutil.copytree(kept, self.dir / name)
        return self.dir / name

    def points(self, study, *more, status=0, database="study.db"):
        self.palpate("check", study / "registration", "--db", study / database, "--json", study / "check.json", "--force",
                     *more, status=status)
        check = json.loads((study / "check.json").read_text())
        return check, {p["id"]: p for p in check["points"]}

    def deviations(self, study, **how):
        _, points = self.points(study, status=1, **how)
        return {key: p for key, p in points.items() if p["finding"] == "deviation"}


class Register(Study):
    def test_every_question_is_answered(self):
        for name, words in (("rating", "paired t-test"), ("stairs", "1 + t^2 / (n - 1)"), ("magnitude", "Stevens"),
                            ("which", "logit(p)")):
            folder = self.study(name) / "registration"
            osf = json.loads((folder / "osf.json").read_text())
            self.assertEqual(list(osf), [f"q{i}" for i in range(2, 24)])
            for key in ("q6", "q7", "q11", "q12", "q14", "q15", "q16", "q17", "q18", "q19"):
                self.assertNotIn("FILL IN", osf[key], (name, key))
            self.assertIn(words, osf["q16"] + osf["q17"], name)
            for block in PROTOCOLS[name]["blocks"]:
                self.assertIn(block["name"], osf["q6"])
            text = (folder / "registration.md").read_text()
            self.assertIn("20 SIMULATED studies with the planned effect", text)
            self.assertNotIn("nan", text)

    def test_orders_are_those_that_schedule_prints(self):
        for name in ("rating", "stairs"):
            study = self.study(name)
            made = json.loads((study / "registration/registration.json").read_text())
            self.assertEqual(len(made["orders"]), PARTICIPANTS[name])
            self.assertEqual(len({one["sha256"] for one in made["orders"]}), PARTICIPANTS[name])
            for one in made["orders"]:
                lines = self.palpate("schedule", study / "p.json", "--participant", one["participant_number"], "--format",
                                     "order").stdout
                self.assertEqual(hashlib.sha256(lines.encode()).hexdigest(), one["sha256"])
        self.assertIn("block,1,", lines)
        self.assertIn("\nround,1,", lines)

    def test_the_planned_effect_is_in_the_simulated_study(self):
        for name, place in (("rating", ("rating", "hardness", "difference")), ("magnitude", ("exponent", "estimate", "ratio"))):
            both = json.loads((self.study(name) / "registration/analysis-simulated.json").read_text())
            self.assertIs(both["planned_effect"]["simulated"], True)
            with_effect, none = (both[key][place[0]][place[1]][place[2]] for key in ("planned_effect", "no_effect"))
            if name == "rating":
                self.assertGreater(with_effect, 1)
                self.assertLess(abs(none), 1)
            else:
                self.assertLess(with_effect, 0.8)
                self.assertGreater(none, 0.8)
            with open(self.dir / name / "registration/simulated/planned-effect.csv", newline="") as file:
                self.assertEqual({row["simulated"] for row in csv.DictReader(file)}, {"1"})

    def test_rehearsals_tell_effect_from_none(self):
        study = self.study("rating")
        counts = json.loads((study / "registration/registration.json").read_text())["hypotheses"][0]
        self.assertGreater(counts["with_planned_effect"]["corroborated"], 14)
        self.assertLess(counts["with_no_effect"]["corroborated"], 6)
        self.assertEqual(sum(counts["with_no_effect"].values()), 20)

    def test_the_result_does_not_depend_on_the_jobs(self):
        study = self.study("rating")
        for jobs in (1, 3):
            self.palpate("register", study / "p.json", "--plan", study / "plan.json", "--hypotheses", study / "h.json",
                         "--participants", 6, "--out", study / f"j{jobs}", "--studies", 20, "--jobs", jobs)
        one, three = (json.loads((study / f"j{jobs}/registration.json").read_text()) for jobs in (1, 3))
        self.assertEqual(one["hypotheses"], three["hypotheses"])
        self.assertEqual((study / "j1/simulated/no-effect.csv").read_bytes(), (study / "j3/simulated/no-effect.csv").read_bytes())

    def test_what_is_refused(self):
        study = self.study("rating")
        other = self.study("magnitude")
        wrong = json.loads((study / "h.json").read_text())
        wrong[0]["refuted"] = "rating.hardnes.ci95_high < 0.5"
        (study / "wrong.json").write_text(json.dumps(wrong))
        plan = json.loads((study / "plan.json").read_text())
        for one in plan["needed"] + plan["curves"]:
            one["trials_per_cell"] = 5
        (study / "trials.json").write_text(json.dumps(plan))
        (study / "external.json").write_text(json.dumps(protocol("e", [
            {"name": "x", "task": "external", "stimuli": ["standard"], "trials": 3, "keys": {"1": {"answer": "a"}, "2": {"answer": "b"}}}])))
        for words, plan_file, hypotheses in (("rating.hardness.ci95_high", study / "plan.json", study / "wrong.json"),
                                             ("--rating-effect", other / "plan.json", study / "h.json"),
                                             ("--trials 3", study / "trials.json", study / "h.json")):
            said = self.palpate("register", study / "p.json", "--plan", plan_file, "--hypotheses", hypotheses,
                                "--participants", 6, "--out", study / "new", "--studies", 20, status=2).stderr
            self.assertIn(words, said)
            self.assertFalse((study / "new").exists())


class Check(Study):
    def test_a_study_as_registered_passes(self):
        for name in PROTOCOLS:
            study = self.study(name)
            check, points = self.points(study)
            self.assertEqual(check["deviations"], 0, [p for p in points.values() if p["finding"] == "deviation"])
            self.assertIn(check["hypotheses"][0]["verdict"], ("corroborated", "refuted", "undecided"))
            # Simulated participants may be all alike, so a test of them is undefined; values are not.
            numbers = check["hypotheses"][0]["numbers"]
            self.assertTrue([n for n in numbers if n != "alpha" and numbers[n] is not None], numbers)

    def test_a_removed_participant_is_a_deviation(self):
        study = self.study("rating")
        self.palpate("forget", "--db", study / "study.db", "--participant", "S003", "--yes")
        found = self.deviations(study)
        self.assertEqual(set(found), {"participants"})
        self.assertIn("no participant has number 3", " ".join(found["participants"]["evidence"]))

    def test_another_seed_is_another_order(self):
        study = self.study("stairs")
        (study / "p2.json").write_text(json.dumps(PROTOCOLS["stairs"] | {"seed": 5}))
        self.palpate("simulate", study / "p2.json", "--db", study / "other.db", "--participants", PARTICIPANTS["stairs"])
        self.assertLessEqual({"protocol", "order"}, set(self.deviations(study, database="other.db")))

    def test_levels_that_do_not_follow_from_the_answers_are_named(self):
        study = self.study("stairs")
        edited = json.loads(json.dumps(PROTOCOLS["stairs"]))
        edited["blocks"][1]["procedure"][0]["steps"] = [60, 25]
        (study / "p2.json").write_text(json.dumps(edited))
        self.palpate("simulate", study / "p2.json", "--db", study / "other.db", "--participants", PARTICIPANTS["stairs"])
        found = self.deviations(study, database="other.db")
        self.assertIn("order", found)
        self.assertIn("registered", found["order"]["evidence"][0])

    def test_an_edited_registration_is_named(self):
        study = self.study("rating")
        path = study / "registration/hypotheses.json"
        path.write_text(path.read_text().replace("< 0.5", "< 5"))
        self.assertIn("registration", self.deviations(study))

    def test_the_digest_and_the_reported_numbers_are_compared(self):
        study = self.study("rating")
        digest = hashlib.sha256((study / "registration/SHA256SUMS").read_bytes()).hexdigest()
        self.palpate("analyze", "--db", study / "study.db", "--json", study / "a.json")
        _, points = self.points(study, "--digest", digest, "--analysis", study / "a.json")
        self.assertEqual(points["digest"]["finding"], "as registered")
        self.assertEqual(points["analysis"]["finding"], "as registered")
        forged = json.loads((study / "a.json").read_text())
        forged["rating"]["hardness"]["p"] = 0.001
        (study / "forged.json").write_text(json.dumps(forged))
        _, points = self.points(study, "--analysis", study / "forged.json", status=1)
        self.assertIn("rating.hardness.p: reported 0.001", points["analysis"]["evidence"][0])


class Bundle(Study):
    def bundle(self, name, *more):
        study = self.study(name)
        (study / "about.json").write_text(json.dumps({"version": 1, "authors": [{"name": "Ada"}], "license": "CC0-1.0"}))
        self.palpate("bundle", "--db", study / "study.db", "--registration", study / "registration", "--about",
                     study / "about.json", "--out", study / "out", *more)
        return study / "out"

    def test_it_verifies_and_reproduces(self):
        for name, more in (("stairs", ("--format", "bids")), ("rating", ())):
            out = self.bundle(name, *more)
            self.assertNotIn("DIFFERS", self.palpate("bundle", "--verify", out).stdout)
            done = subprocess.run(["sh", out / "reproduce.sh"], env={"PALPATE": str(PALPATE), "PATH": "/usr/bin:/bin"},
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            check = json.loads((out / "check.json").read_text())
            _, points = self.points(self.dir / name)
            self.assertEqual({p["id"]: p["finding"] for p in check["points"]}, {k: p["finding"] for k, p in points.items()})

    def test_numbers_are_those_of_the_database(self):
        out = self.bundle("stairs")
        self.palpate("analyze", "--db", self.dir / "stairs/study.db", "--json", self.dir / "a.json")
        ours, theirs = json.loads((out / "analysis.json").read_text()), json.loads((self.dir / "a.json").read_text())
        for key in set(ours) - {"source"}:
            self.assertEqual(ours[key], theirs[key], key)

    def test_forgeries_are_named(self):
        out = self.bundle("rating")
        check = json.loads((out / "check.json").read_text())
        check["hypotheses"][0]["verdict"] = "undecided" if check["hypotheses"][0]["verdict"] != "undecided" else "refuted"
        (out / "check.json").write_text(json.dumps(check, indent=2))
        analysis = (out / "analysis.json").read_text()
        (out / "analysis.json").write_text(analysis.replace('"n_trials": 36', '"n_trials": 37'))
        sums = subprocess.run("find . -type f ! -name SHA256SUMS | sed 's#^./##' | LC_ALL=C sort | xargs -d '\\n' sha256sum > SHA256SUMS",
                              shell=True, cwd=out)
        self.assertEqual(sums.returncode, 0)
        said = self.palpate("bundle", "--verify", out, status=1).stdout
        for name in ("check.json", "analysis.json"):
            self.assertIn(f"DIFFERS  {name}", said)


if __name__ == "__main__":
    unittest.main()
