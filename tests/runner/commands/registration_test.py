"""Registers a study, checks it and bundles it, from outside.

Usage: registration_test.py PALPATE SOURCE_DIR
"""

import csv
import hashlib
import json
import os
import pathlib
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import unittest

import jsonschema

PALPATE, SOURCE = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2])
# Literally from the specification.
HYPOTHESES = [{"id": "H1", "text": "Cones are found faster with the ray.",
               "corroborated": "paired.cone.p_holm < 0.05 && paired.cone.reduction > 0",
               "refuted": "paired.cone.ci95_high < 5"}]
QUESTIONS = [f"q{i}" for i in range(2, 24)]


def run(*arguments, status=0, folder=None, env=None):
    done = subprocess.run([PALPATE, *map(str, arguments)], capture_output=True, text=True, cwd=folder, timeout=600,
                          env=env)
    assert done.returncode == status, f"{arguments}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done


def tree(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


class Study(unittest.TestCase):
    """A protocol, a plan, hypotheses, a registration and a simulated study, shared."""

    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.base = base = pathlib.Path(scratch.name)
        shutil.copy(SOURCE / "protocols/quick.json", base / "quick.json")
        run("plan", "--gain-sd", "0.1", "--residual-sd", "0.3", "--effect", "cone=50", "--participants", "2-6",
            "--trials", "3,5", "--studies", "100", "--json", base / "plan.json")
        (base / "hypotheses.json").write_text(json.dumps(HYPOTHESES))
        cls.participants = {n["trials_per_cell"]: n["participants"]
                            for n in json.loads((base / "plan.json").read_text())["needed"]}[3]
        assert cls.participants
        run("register", base / "quick.json", "--plan", base / "plan.json", "--hypotheses", base / "hypotheses.json",
            "--out", base / "registration", "--studies", "40")
        run("simulate", base / "quick.json", "--db", base / "study.db", "--participants", cls.participants)

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        for name in ("quick.json", "plan.json", "hypotheses.json", "study.db"):
            shutil.copy(self.base / name, self.dir / name)
        shutil.copytree(self.base / "registration", self.dir / "registration")

    def write(self, name, content):
        (self.dir / name).write_text(content if isinstance(content, str) else json.dumps(content))
        return self.dir / name

    def register(self, *more, status=0, protocol="quick.json", out="new", **files):
        arguments = {"plan": "plan.json", "hypotheses": "hypotheses.json", "studies": "40"} | files
        options = [word for key, value in arguments.items() for word in (f"--{key}", value)]
        return run("register", protocol, "--out", out, *options, *more, status=status, folder=self.dir)


class Register(Study):
    def test_contents_of_the_registration(self):
        folder = self.dir / "registration"
        names = set(tree(folder))
        self.assertEqual(names, {
            "registration.md", "osf.json", "registration.json", "protocol.json", "plan.json", "hypotheses.json",
            "form.json", "codebook.csv", "analysis-simulated.json", "simulated/README.md", "simulated/planned-effect.csv",
            "simulated/no-effect.csv", "SHA256SUMS"})
        for name in ("protocol.json", "plan.json", "hypotheses.json"):
            source = self.dir / ("quick.json" if name == "protocol.json" else name)
            self.assertEqual((folder / name).read_bytes(), source.read_bytes())
        checked = subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=folder, capture_output=True, text=True)
        self.assertEqual(checked.returncode, 0, checked.stdout)
        self.assertEqual(len(checked.stdout.splitlines()), len(names) - 3)  # excluding files to fill in, and itself

    def test_all_files_are_private(self):
        folder = self.base / "registration"
        self.assertEqual(stat.S_IMODE(folder.stat().st_mode), 0o700)
        for path in folder.rglob("*"):
            if path.is_file():
                self.assertEqual(stat.S_IMODE(path.stat().st_mode), 0o600, path)

    def test_answers_stand_under_their_questions(self):
        osf = json.loads((self.dir / "registration/osf.json").read_text())
        self.assertEqual(list(osf), QUESTIONS)
        self.assertTrue(osf["q3"].startswith("Experiment - "))
        self.assertEqual(len(osf["q4"]), 1)
        self.assertEqual(osf["q8"], "Registration prior to creation of data")
        for key in ("q2", "q10", "q22", "q23"):
            self.assertIn("FILL IN", osf[key], key)
        for key in ("q6", "q7", "q11", "q14", "q15", "q16", "q17", "q18", "q19"):
            self.assertNotIn("FILL IN", osf[key], key)
        self.assertIn(f"{self.participants} participants", osf["q11"])
        self.assertIn("0.2 s", osf["q20"])
        self.assertIn("censored", osf["q21"])
        text = (self.dir / "registration/registration.md").read_text()
        for number in range(2, 24):
            self.assertIn(f"\n### {number}. ", text)

    def test_orders_can_be_recomputed(self):
        made = json.loads((self.dir / "registration/registration.json").read_text())
        self.assertEqual(len(made["orders"]), self.participants)
        osf = json.loads((self.dir / "registration/osf.json").read_text())
        for order in made["orders"]:
            rows = run("schedule", "quick.json", "--participant", order["participant_number"], "--format", "csv",
                       folder=self.dir).stdout
            lines = "".join(
                ",".join([r["session"], r["renderer"], r["shape"]] + [r[f"orientation_{k}"] for k in "wxyz"]) + "\n"
                for r in csv.DictReader(rows.splitlines()) if r["practice"] == "0")
            self.assertEqual(hashlib.sha256(lines.encode()).hexdigest(), order["sha256"])
            self.assertIn(order["sha256"], osf["q7"])

    def test_simulated_data_and_analysis_are_included(self):
        folder = self.dir / "registration"
        both = json.loads((folder / "analysis-simulated.json").read_text())
        for key, name in (("planned_effect", "planned-effect"), ("no_effect", "no-effect")):
            run("analyze", "--csv", f"simulated/{name}.csv", "--json", self.dir / f"{name}.json", folder=folder)
            self.assertEqual(json.loads((self.dir / f"{name}.json").read_text()), both[key])
            self.assertIs(both[key]["simulated"], True)
            self.assertEqual(both[key]["counts"]["n_participants"], self.participants)
            self.assertEqual(both[key]["counts"]["n_trials"], self.participants * 24)
        self.assertGreater(both["planned_effect"]["paired_by_shape"]["cone"]["percent_reduction_geometric"], 20)
        columns = (folder / "simulated/no-effect.csv").read_text().splitlines()[0].split(",")
        with open(folder / "codebook.csv", newline="") as file:
            explained = {row["column"] for row in csv.DictReader(file) if row["table"] == "trials"}
        self.assertEqual(set(columns), explained)

    def test_registering_again_gives_the_same_files(self):
        self.register("--jobs", "1")
        ours, again = tree(self.dir / "registration"), tree(self.dir / "new")
        self.assertEqual({name for name in ours if ours[name] != again[name]} -
                         {"registration.json", "registration.md", "osf.json", "form.json", "SHA256SUMS"}, set())
        # The date and what follows from it alone.
        date = json.loads(ours["registration.json"])["made_utc"][:10]
        self.assertIn(date, ours["registration.md"].decode())
        self.register(out="other", seed="2")
        self.assertNotEqual(again["simulated/no-effect.csv"], tree(self.dir / "other")["simulated/no-effect.csv"])

    def test_a_hypothesis_that_cannot_be_refuted_is_reported(self):
        self.write("h.json", [HYPOTHESES[0] | {"refuted": "paired.cone.reduction < -1000"},
                              {"id": "H2", "text": "t", "corroborated": "counts.n_trials > 0", "refuted": "alpha > 1"}])
        done = self.register(hypotheses="h.json")
        self.assertIn("H1 cannot be refuted", done.stderr)
        self.assertIn("H2 comes out corroborated in all of 80 simulated studies", done.stderr)
        text = (self.dir / "new/registration.md").read_text()
        self.assertIn("H1 cannot be refuted", text)
        self.assertEqual(json.loads((self.dir / "new/registration.json").read_text())["warnings"],
                         [line.removeprefix("warning: ") for line in done.stderr.splitlines()])

    def test_a_study_without_power_is_reported(self):
        done = self.register("--participants", "2")
        self.assertIn("H1 lacks power", done.stderr)
        if self.participants > 2:
            self.assertIn(f"The plan wants {self.participants} participants; 2 are registered", done.stderr)
        self.assertNotIn("cannot be refuted", done.stderr)

    def test_the_registered_study_has_power_and_can_be_refuted(self):
        made = json.loads((self.dir / "registration/registration.json").read_text())
        self.assertEqual([w for w in made["warnings"] if "H1" in w], [])
        counts = made["hypotheses"][0]
        self.assertGreater(counts["with_planned_effect"]["corroborated"], 20)
        self.assertGreater(counts["with_no_effect"]["refuted"], 0)
        self.assertEqual(sum(counts["with_no_effect"].values()), 40)

    def test_what_is_refused(self):
        bad_name = self.write("h1.json", [HYPOTHESES[0] | {"refuted": "paired.kone.p > 0.5"}])
        wrong = self.write("h2.json", [{"id": "H1"}])
        self.write("jnd.json", {"version": 1, "settings": {}})
        plan = json.loads((self.dir / "plan.json").read_text())
        self.write("other.json", plan | {"needed": plan["needed"][1:]})
        one = json.loads((self.dir / "quick.json").read_text())
        self.write("one.json", one | {"renderers": ["ray"]})
        self.write("three.json", one | {"stimuli": one["stimuli"][:3],
                                        "response": {"keys": {"1": "sphere", "2": "cone", "3": "cylinder"}}})
        for words, files in (("did you mean", {"hypotheses": bad_name}), ("/0/text", {"hypotheses": wrong}),
                             ("'palpate plan --json'", {"plan": "jnd.json"}), ("--trials 3", {"plan": "other.json"}),
                             ("two renderers", {"protocol": "one.json"}), ("protocol's shapes", {"protocol": "three.json"}),
                             ("expected a plan of a measure that the protocol gives", {"protocol": SOURCE / "protocols/stiffness-2afc.json"})):
            done = self.register(status=2, **files)
            self.assertIn(words, done.stderr, files)
            self.assertEqual(done.stdout, "")
        self.assertFalse((self.dir / "new").exists())
        self.assertEqual([p.name for p in self.dir.iterdir() if p.name.startswith(".")], [])

    def test_nothing_is_overwritten(self):
        before = tree(self.dir)
        self.assertIn("--force", self.register(out="registration", status=2).stderr)
        self.write("registration/registration.md", "my answers")
        self.assertIn("filled in", self.register("--force", out="registration", status=2).stderr)
        self.write("registration/mine.txt", "mine")
        self.assertIn("mine.txt", self.register("--force", out="registration", status=2).stderr)
        (self.dir / "registration/mine.txt").unlink()
        self.write("registration/registration.md", before["registration/registration.md"].decode())
        self.register("--force", out="registration")
        (self.dir / "else").mkdir()
        self.write("else/file", "x")
        self.register("--force", out="else", status=2)
        (self.dir / "link").symlink_to(self.dir / "else")
        self.register("--force", out="link", status=2)
        self.assertEqual((self.dir / "else/file").read_text(), "x")

    def test_a_database_with_sessions_is_refused(self):
        self.register("--db", "study.db")
        osf = json.loads((self.dir / "new/osf.json").read_text())
        self.assertIn(f"{self.participants} sessions", osf["q8"])
        self.assertIn("FILL IN", osf["q9"])

    def test_hostile_texts(self):
        title = "<img src=x onerror=alert(1)> [a](javascript:alert(1)) `x` *b* | https://evil.example"
        self.write("p.json", json.loads((self.dir / "quick.json").read_text()) |
                   {"title": title, "description": "# Heading\n\n<script>alert(1)</script>\n* item"})
        self.write("h.json", [HYPOTHESES[0] | {"text": "=cmd|' /C calc'!A0 <script>x</script>\n\n## Heading"}])
        self.register(protocol="p.json", hypotheses="h.json")
        text = (self.dir / "new/registration.md").read_text()
        self.assertNotRegex(text, r"(?<!\\)<(script|img)")
        self.assertNotRegex(text, r"(?<!\\)\[a")
        self.assertNotIn("https://evil", text)
        self.assertNotRegex(text, r"(?m)^# Heading|^## Heading")
        self.assertEqual(json.loads((self.dir / "new/hypotheses.json").read_text())[0]["text"],
                         json.loads((self.dir / "h.json").read_text())[0]["text"])

    def test_only_meshes_below_the_protocols_folder_are_copied(self):
        solid = "v 0 0 0\nv .05 0 0\nv 0 .05 0\nv 0 0 .05\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        (self.dir / "inner/meshes").mkdir(parents=True)
        for name in ("inner/meshes/a.obj", "b.obj"):
            self.write(name, solid)
        quick = json.loads((self.dir / "quick.json").read_text())

        def with_mesh(file):
            self.write("inner/p.json", quick | {"stimuli": quick["stimuli"][:3] + [
                {"name": "cube", "shape": "mesh", "file": file}]})

        with_mesh("meshes/a.obj")
        self.register(protocol="inner/p.json")
        self.assertEqual((self.dir / "new/meshes/a.obj").read_text(), solid)
        run("validate", self.dir / "new/protocol.json")
        for file in ("../b.obj", str(self.dir / "b.obj"), "meshes/../../b.obj"):
            with_mesh(file)
            done = self.register(protocol="inner/p.json", out="other", status=2)
            self.assertIn("below", done.stderr, file)
            self.assertFalse((self.dir / "other").exists())

    def test_the_schema_of_hypotheses(self):
        schema = json.loads((SOURCE / "protocols/hypotheses.schema.json").read_text())
        jsonschema.Draft202012Validator.check_schema(schema)
        validator = jsonschema.Draft202012Validator(schema)
        self.assertTrue(validator.is_valid(HYPOTHESES))
        for bad in ([], {}, [{"id": "H1"}], [HYPOTHESES[0] | {"more": 1}], [HYPOTHESES[0] | {"id": "H 1"}],
                    [HYPOTHESES[0] | {"text": ""}]):
            self.assertFalse(validator.is_valid(bad), bad)
            self.write("h.json", bad)
            self.register(hypotheses="h.json", status=2)


    def test_one_digest_stands_everywhere(self):
        folder = self.dir / "registration"
        digest = hashlib.sha256((folder / "SHA256SUMS").read_bytes()).hexdigest()
        self.assertIn(f"`{digest}`", (folder / "registration.md").read_text())
        said = self.register("--force", out="registration").stdout
        digest = hashlib.sha256((folder / "SHA256SUMS").read_bytes()).hexdigest()
        self.assertIn(f"Digest {digest}\n", said)
        self.assertIn(f"`{digest}`", (folder / "registration.md").read_text())
        self.assertIn(digest, json.loads((folder / "osf.json").read_text())["q23"])


class Check(Study):
    def check(self, *more, status=0, database="study.db"):
        return run("check", "registration", "--db", database, *more, status=status, folder=self.dir)

    def digest(self):
        return hashlib.sha256((self.dir / "registration/SHA256SUMS").read_bytes()).hexdigest()

    def make_checksums_again(self):
        folder = self.dir / "registration"
        names = sorted(set(tree(folder)) - {"registration.md", "osf.json", "SHA256SUMS"})
        (folder / "SHA256SUMS").write_text("".join(
            f"{hashlib.sha256((folder / name).read_bytes()).hexdigest()}  {name}\n" for name in names))

    def fill_in(self, name, answer=lambda prompt: f"Answer to: {prompt}"):
        """Fills in every field as a lab does, with an editor that changes ends of lines."""
        path = self.dir / "registration" / name
        if name == "registration.md":
            text = re.sub(r"\*\*FILL IN:\*\* (.*)", lambda m: answer(m[1]), path.read_text())
            path.write_text(text.replace("\n", "\r\n"))
        else:
            answers = json.loads(path.read_text())
            path.write_text(json.dumps({key: re.sub(r"FILL IN: (.*)", lambda m: answer(m[1]), text)
                                        if isinstance(text, str) else text for key, text in answers.items()}))

    def test_a_selected_sample_is_no_study_as_registered(self):
        n = self.participants
        run("simulate", "quick.json", "--db", "study.db", "--participants", 2 * n, folder=self.dir)
        for number in range(2, 2 * n + 1, 2):
            run("forget", "--db", "study.db", "--participant", f"S{number:03}", "--yes", folder=self.dir)
        done = self.check(status=1)
        self.assertTrue(done.stdout.startswith("1 deviation "), done.stdout)
        self.assertIn("no participant has number 2", done.stdout)
        self.assertIn(f"has number {2 * n - 1}, {n} registered", done.stdout)
        self.assertIn(f"{n} codes were removed", done.stdout)
        self.assertRegex(done.stdout, rf"Order of the renderers: .*: {n} \({(n + 1) // 2} registered\)")
        self.assertRegex(done.stdout, rf": 0 \({n // 2} registered\)")

    def test_filled_in_fields_are_no_change(self):
        for name in ("registration.md", "osf.json"):
            self.fill_in(name)
        done = self.check()
        self.assertIn("Fields filled in as requested: registration.md and osf.json", done.stdout)
        self.fill_in("registration.md")  # nothing is left to fill in
        self.check()

    def test_emptied_fields_are_no_change(self):
        for name in ("registration.md", "osf.json"):
            self.fill_in(name, lambda prompt: "")
        self.check()

    def test_changes_outside_of_the_fields_are_named(self):
        folder = self.dir / "registration"
        before = {name: (folder / name).read_text() for name in ("registration.md", "osf.json")}
        for name in before:
            self.fill_in(name)
            filled = (folder / name).read_text()
            for old, new in (("paired.cone.p_holm < 0.05", "paired.cone.p_holm < 0.15"), ("alpha = 0.05", "alpha = 0.15"),
                             ("0.2 s", "0.5 s")):
                self.assertIn(old, filled, name)
                (folder / name).write_text(filled.replace(old, new))
                done = self.check(status=1)
                self.assertIn("outside of the fields", done.stdout, (name, old))
                self.assertNotIn("as requested", done.stdout)
                self.assertIn(name, done.stdout)
                (folder / name).write_text(filled)
            (folder / name).write_text(before[name])

    def test_a_field_cannot_hide_what_follows(self):
        for answer in ("<!-- hidden", "<details>", "```", "~~~text", "## 19. Inference", "> ```"):
            shutil.rmtree(self.dir / "registration")
            shutil.copytree(self.base / "registration", self.dir / "registration")
            self.fill_in("registration.md", lambda prompt: f"Fine.\n\n{answer}")
            self.assertIn("expected plain text in a field", self.check(status=1).stdout, answer)
        shutil.rmtree(self.dir / "registration")
        shutil.copytree(self.base / "registration", self.dir / "registration")
        self.fill_in("registration.md", lambda prompt: "Age < 40, n > 3.\n\n* a list\n\n1. more")
        self.check()

    def test_added_and_lost_text_is_named(self):
        path = self.dir / "registration/registration.md"
        text = path.read_text()
        for changed in (text + "\nMore.\n", text.replace("# Registration", "More.\n\n# Registration", 1),
                        text.replace("\n### 19", "\nMore.\n\n### 19"), text[:len(text) // 2], ""):
            path.write_text(changed)
            self.assertIn("registration.md", self.check(status=1).stdout)
        path.write_text(text)
        osf = self.dir / "registration/osf.json"
        answers = json.loads(osf.read_text())
        for changed in (answers | {"q24": "x"}, answers | {"q3": "Other"}, answers | {"q4": []}, answers | {"q2": 1},
                        {k: v for k, v in answers.items() if k != "q19"}, [], 3):
            osf.write_text(json.dumps(changed))
            self.assertIn("osf.json", self.check(status=1).stdout)
        osf.write_text("nonsense")
        self.assertIn("osf.json", self.check(status=1).stdout)

    def test_a_relaxed_hypothesis_has_another_digest(self):
        digest = self.digest()
        done = self.check("--digest", digest, "--json", "check.json", "--report", "check.html")
        self.assertIn(digest, done.stdout)
        self.assertEqual(json.loads((self.dir / "check.json").read_text())["registration"]["digest"], digest)
        self.assertIn(digest, (self.dir / "check.html").read_text())
        relaxed = json.loads((self.dir / "registration/hypotheses.json").read_text())
        relaxed[0]["corroborated"] = "paired.cone.reduction > -50"
        self.write("registration/hypotheses.json", relaxed)
        self.make_checksums_again()
        done = self.check("--digest", digest, status=1)
        self.assertIn("given " + digest, done.stdout)
        self.assertIn("found " + self.digest(), done.stdout)
        # Without the digest of the registry the texts betray it.
        self.assertIn("form.json does not say", self.check(status=1).stdout)
        for bad in ("", "abc", digest.upper(), digest + "0"):
            self.assertIn("--digest", self.check("--digest", bad, status=2).stderr)

    def test_more_hypotheses_than_were_registered_are_named(self):
        more = json.loads((self.dir / "registration/hypotheses.json").read_text())
        self.write("registration/hypotheses.json", more + [more[0] | {"id": "H2"}])
        self.make_checksums_again()
        self.assertIn("other hypotheses than registration.json", self.check(status=1).stdout)

    def test_a_changed_plan_with_new_checksums_is_named(self):
        plan = json.loads((self.dir / "registration/plan.json").read_text())
        plan["settings"]["alpha"] = 0.2
        self.write("registration/plan.json", plan)
        self.make_checksums_again()
        self.assertIn("plan.json is not the one", self.check(status=1).stdout)

    def test_a_registration_of_version_1(self):
        folder = self.dir / "registration"
        made = json.loads((folder / "registration.json").read_text()) | {"version": 1, "to_fill_in": [
            {"file": name, "sha256_when_made": hashlib.sha256((folder / name).read_bytes()).hexdigest()}
            for name in ("registration.md", "osf.json")]}
        self.write("registration/registration.json", made)
        (folder / "form.json").unlink()
        self.make_checksums_again()
        self.check()
        self.fill_in("registration.md")
        done = self.check()
        self.assertIn("compare them with what the registry holds", done.stdout)
        self.assertNotIn("as requested", done.stdout)

    def test_a_study_simulated_from_the_plan_passes(self):
        done = self.check("--json", "check.json", "--report", "check.html")
        self.assertTrue(done.stdout.startswith("Run as registered"), done.stdout)
        self.assertIn("SIMULATED PARTICIPANTS", done.stdout)
        self.assertNotIn("DEVIATION", done.stdout)
        check = json.loads((self.dir / "check.json").read_text())
        self.assertEqual((check["deviations"], check["simulated"]), (0, "SIMULATED PARTICIPANTS"))
        self.assertEqual({p["id"] for p in check["points"]}, {
            "registration", "digest", "protocol", "order", "participants", "trials", "people", "dates", "exclusion", "alpha",
            "versions", "calibration", "noise", "sounds", "torque", "levels"})
        self.assertRegex(next(p["sentence"] for p in check["points"] if p["id"] == "people"), r"version \d")
        for one in check["hypotheses"]:
            self.assertIn(one["verdict"], ("corroborated", "refuted", "undecided"))
            self.assertIn("paired.cone.p_holm", one["numbers"])
        for name in ("check.json", "check.html"):
            self.assertEqual(stat.S_IMODE((self.dir / name).stat().st_mode), 0o600)
        page = (self.dir / "check.html").read_text()
        self.assertIn("SIMULATED PARTICIPANTS", page)
        self.assertNotIn("http://", page.replace("http://www.w3.org", ""))

    def test_deviations_are_the_exit_status(self):
        done = self.check("--too-fast-s", "0.5", "--alpha", "0.1", status=1)
        self.assertTrue(done.stdout.startswith("2 deviations"), done.stdout)
        for words in ("used 0.5 s, registered 0.2 s", "used 0.1, registered 0.05"):
            self.assertIn(words, done.stdout)

    def test_the_reported_analysis(self):
        run("analyze", "--db", "study.db", "--json", "a.json", folder=self.dir)
        self.check("--analysis", "a.json")
        run("analyze", "--db", "study.db", "--too-fast-s", "3", "--json", "b.json", folder=self.dir)
        done = self.check("--analysis", "b.json", status=1)
        self.assertIn("used 3.0 s, registered 0.2 s", done.stdout)
        self.assertTrue(done.stdout.startswith("1 deviation "), done.stdout)
        for bad in ("{}", "[]", "nonsense"):
            self.write("bad.json", bad)
            self.check("--analysis", "bad.json", status=2)

    def test_the_reported_analysis_of_the_exported_table(self):
        # A table lists shapes as they appear, a database as the protocol does: the numbers depend on the order.
        quick = json.loads((SOURCE / "protocols/quick.json").read_text())
        names = dict(zip(("sphere", "cone", "cylinder", "cube"), ("ball", "spike", "drum", "box")))
        for stimulus in quick["stimuli"]:
            stimulus["name"] = names[stimulus["name"]]
        keys = {key: names[name] for key, name in quick["response"]["keys"].items()}
        self.write("own.json", {**quick, "name": "own", "response": {**quick["response"], "keys": keys}})
        self.write("own-hypotheses.json", json.loads(json.dumps(HYPOTHESES).replace("cone", "spike")))
        run("simulate", "own.json", "--db", "own.db", "--participants", 3, folder=self.dir)
        run("plan", "--db", "own.db", "--effect", "spike=50", "--participants", "2-3", "--trials", 3, "--studies", 100,
            "--json", "own-plan.json", folder=self.dir)
        run("register", "own.json", "--plan", "own-plan.json", "--hypotheses", "own-hypotheses.json", "--out", "own",
            "--participants", 3, "--studies", 20, folder=self.dir)
        run("export", "--db", "own.db", "--format", "csv", "--out", "own.csv", folder=self.dir)
        orders = []
        for source in "db", "csv":
            run("analyze", f"--{source}", f"own.{source}", "--json", f"{source}.json", folder=self.dir)
            run("check", "own", "--db", "own.db", "--analysis", f"{source}.json", folder=self.dir)
            orders.append(list(json.loads((self.dir / f"{source}.json").read_text())["paired_by_shape"]))
        self.assertNotEqual(*orders)

    def test_a_participant_too_many(self):
        run("simulate", "quick.json", "--db", "study.db", "--participants", self.participants + 1, folder=self.dir)
        done = self.check(status=1)
        self.assertTrue(done.stdout.startswith("1 deviation "), done.stdout)
        self.assertIn(f"S00{self.participants + 1} has number {self.participants + 1}", done.stdout)

    def test_another_protocol(self):
        self.write("quick.json", (self.dir / "quick.json").read_text() + "\n")
        run("simulate", "quick.json", "--db", "other.db", "--participants", self.participants, folder=self.dir)
        done = self.check(status=1, database="other.db")
        self.assertTrue(done.stdout.startswith("1 deviation "), done.stdout)
        self.assertIn("in layout only", done.stdout)

    def test_hypotheses_are_judged_without_the_trials_of_a_pilot(self):
        self.check("--json", "alone.json")
        quick = json.loads((self.dir / "quick.json").read_text())
        self.write("pilot.json", {**quick, "name": "pilot", "repetitions": 4})
        run("simulate", "pilot.json", "--db", "study.db", "--participants", 2, "--seed", 5, folder=self.dir)
        done = self.check("--json", "both.json", status=1)
        self.assertTrue(done.stdout.startswith("1 deviation "), done.stdout)
        self.assertIn("shown with protocol pilot", done.stdout)
        alone, both = (json.loads((self.dir / f"{name}.json").read_text()) for name in ("alone", "both"))
        self.assertEqual(alone["hypotheses"], both["hypotheses"])

    def test_nothing_is_overwritten(self):
        before = tree(self.dir / "registration")
        self.write("check.json", "mine")
        self.check("--json", "check.json", status=2)
        for name in ("registration/plan.json", "registration/new.json", "study.db"):
            self.check("--json", name, "--force", status=2)
        self.assertEqual((self.dir / "check.json").read_text(), "mine")
        self.assertEqual(tree(self.dir / "registration"), before)

    def test_folders_that_are_not_registrations_are_refused(self):
        for name, content in (("registration.json", "{}"), ("registration.json", "nonsense"),
                              ("SHA256SUMS", "nonsense\n"), ("plan.json", "{}"), ("hypotheses.json", "[]"),
                              ("protocol.json", "{}")):
            folder = self.dir / "registration"
            before = (folder / name).read_bytes()
            (folder / name).write_text(content)
            done = self.check(status=2)
            self.assertEqual(done.stdout, "")
            self.assertIn(name, done.stderr)
            (folder / name).write_bytes(before)
        self.check()
        run("check", "nowhere", "--db", "study.db", status=2, folder=self.dir)

    def test_links_and_paths_to_the_outside_are_refused(self):
        (self.dir / "secret.json").write_bytes((self.dir / "registration/plan.json").read_bytes())
        (self.dir / "registration/plan.json").unlink()
        (self.dir / "registration/plan.json").symlink_to(self.dir / "secret.json")
        self.check(status=2)
        (self.dir / "registration/plan.json").unlink()
        shutil.copy(self.dir / "secret.json", self.dir / "registration/plan.json")
        made = json.loads((self.dir / "registration/registration.json").read_text())
        made["protocol"]["files"] = [{"file": "../secret.json", "sha256": "0" * 64}]
        self.write("registration/registration.json", made)
        self.assertIn("below", self.check(status=2).stderr)

    def test_meshes_outside_the_registration_are_not_read(self):
        (self.dir / "outside.obj").write_text("v 0 0 0\nv .05 0 0\nv 0 .05 0\nv 0 0 .05\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        protocol = json.loads((self.dir / "registration/protocol.json").read_text())
        protocol["stimuli"][0] = {"name": protocol["stimuli"][0]["name"], "shape": "mesh", "file": str(self.dir / "outside.obj")}
        self.write("registration/protocol.json", protocol)
        self.assertIn("stored with the protocol", self.check(status=2).stderr)

class Looks(Study):
    """A study that is looked at after 4, 6 and 8 participants."""

    def setUp(self):
        super().setUp()
        self.write("h.json", [HYPOTHESES[0] | {"corroborated": "paired.cone.p_holm < alpha && alpha > 0"}, HYPOTHESES[0] | {"id": "H2"}])
        self.said = self.register("--participants", "8", "--looks", "4,6,8", hypotheses="h.json", studies="20")
        self.levels = {one["participants"]: one["alpha"] for one in json.loads((self.dir / "new/registration.json").read_text())["analysis"]["looks"]}

    def check(self, participants, status):
        database = self.dir / f"{participants}.db"
        if not database.exists():
            run("simulate", "quick.json", "--db", database, "--participants", participants, folder=self.dir)
        run("check", "new", "--db", database, "--json", f"{participants}.json", "--force", status=status, folder=self.dir)
        checked = json.loads((self.dir / f"{participants}.json").read_text())
        return {one["id"]: one for one in checked["points"]}, checked["hypotheses"][0]

    def test_each_look_has_its_own_alpha(self):
        # O'Brien and Fleming's bounds at half, three quarters and all of the information.
        self.assertEqual([round(level, 4) for level in self.levels.values()], [0.0031, 0.0183, 0.0440])
        for n, level in self.levels.items():
            points, hypothesis = self.check(n, 0)
            self.assertEqual(points["participants"]["finding"], "as registered")
            self.assertEqual(points["looks"]["finding"], "as registered")
            self.assertEqual(hypothesis["numbers"]["alpha"], level)

    def test_another_look_is_a_deviation(self):
        points, hypothesis = self.check(5, 1)
        self.assertEqual({points[one]["finding"] for one in ("participants", "looks")}, {"deviation"})
        self.assertEqual(hypothesis["verdict"], "undecided")
        self.assertIsNone(hypothesis["numbers"]["alpha"])

    def test_a_selected_look_is_a_deviation(self):
        run("simulate", "quick.json", "--db", "4.db", "--participants", 5, folder=self.dir)
        run("forget", "--participant", "S002", "--db", "4.db", "--yes", folder=self.dir)
        points, _ = self.check(4, 1)
        self.assertEqual(points["participants"]["finding"], "deviation")

    def test_the_looks_are_registered_in_words(self):
        text = (self.dir / "new/registration.md").read_text()
        for part in ("after 4, 6 and 8 participants", "0.003051, 0.01832 and 0.044", "Fleming", "end the study there"):
            self.assertIn(part, text)
        self.assertNotIn("not planned", text)
        self.assertIn("H2 does not name alpha", self.said.stderr)
        self.assertNotIn("H1 does not name alpha", self.said.stderr)

    def test_a_changed_level_is_named(self):
        path = self.dir / "new/registration.json"
        path.write_text(path.read_text().replace(str(self.levels[6]), "0.05"))
        points, _ = self.check(6, 1)
        self.assertIn("another alpha of the look at 6 participants", json.dumps(points["registration"]))

    def test_looks_that_are_none_are_refused(self):
        for looks, words in (("4,4,8", "numbers of participants that rise"), ("4,x,8", "rise"), ("4,8,", "rise"), ("1,8", "rise"),
                             ("4,6", "the last look at all 8 participants")):
            said = self.register("--participants", "8", "--looks", looks, status=2, out="other").stderr
            self.assertIn(words, said)
        said = self.register("--participants", "8", "--looks", "4,8", "--spending", "all", status=2, out="other").stderr
        self.assertIn("expected obrien-fleming or pocock", said)
        self.assertFalse((self.dir / "other").exists())

    def test_a_bundle_of_a_look(self):
        self.check(6, 0)
        self.write("about.json", {"version": 1, "authors": [{"name": "Ada Example"}], "license": "CC-BY-4.0"})
        run("bundle", "--db", "6.db", "--registration", "new", "--about", "about.json", "--out", "kept", folder=self.dir)
        run("bundle", "--verify", "kept", folder=self.dir)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
