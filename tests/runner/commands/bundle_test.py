"""Bundles a study: what the folder holds, that it reproduces elsewhere, and its description by the rules of RO-Crate.

Usage: bundle_test.py PALPATE SOURCE_DIR
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
import urllib.parse

PALPATE, SOURCE = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2])
ABOUT = {"version": 1, "authors": [{"name": "Ada Example", "orcid": "0000-0002-1825-0097", "affiliation": "A University"},
                                   "Bo Example"],
         "license": "CC-BY-4.0", "funding": [{"funder": "A Fund", "grant": "7"}], "references": ["A paper"],
         "doi": "10.5281/zenodo.1234"}


def run(*arguments, status=0, folder=None):
    done = subprocess.run([PALPATE, *map(str, arguments)], capture_output=True, text=True, cwd=folder, timeout=600)
    assert done.returncode == status, f"{arguments}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done


def files(folder):
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}


class CrateFaults:
    """What RO-Crate 1.2 says that a crate must be, and is not (https://w3id.org/ro/crate/1.2, root-data-entity,
    data-entities, appendix on JSON-LD)."""

    def __init__(self, folder):
        self.folder, self.found = folder, []
        document = json.loads((folder / "ro-crate-metadata.json").read_text(encoding="utf-8"))
        self.expect(set(document) == {"@context", "@graph"}, "only @context and @graph")
        self.expect(document["@context"] == "https://w3id.org/ro/crate/1.2/context", "the context by reference")
        self.entities = {}
        for entity in document["@graph"]:
            self.expect(isinstance(entity.get("@id"), str) and entity.get("@type"), f"@id and @type: {entity}")
            self.expect(entity["@id"] not in self.entities, f"each @id once: {entity['@id']}")
            self.entities[entity["@id"]] = entity
        self.of_the_root()
        linked = self.linked_from(self.entities["./"])
        for identity, entity in self.entities.items():
            self.of_an_entity(identity, entity, linked)
        described = {urllib.parse.unquote(i) for i, e in self.entities.items() if e["@type"] == "File"}
        self.expect(described | {"ro-crate-metadata.json"} == files(folder), "every file is described")

    def expect(self, holds, what):
        if not holds:
            self.found.append(what)

    def of_the_root(self):
        descriptor = self.entities["ro-crate-metadata.json"]
        self.expect(descriptor["@type"] == "CreativeWork", "type of the descriptor")
        self.expect(descriptor["about"] == {"@id": "./"}, "about the root")
        self.expect(descriptor["conformsTo"] == {"@id": "https://w3id.org/ro/crate/1.2"}, "conformsTo")
        root = self.entities["./"]
        self.expect(root["@type"] == "Dataset", "type of the root")
        for key in ("name", "description", "datePublished", "license"):
            self.expect(root.get(key), f"root has {key}")
        self.expect(re.fullmatch(r"\d{4}-\d\d-\d\d", root["datePublished"]), "date to the day")
        license = self.entities.get(root["license"]["@id"], {})
        self.expect(license.get("name") and license.get("description"), "license with name and description")

    def linked_from(self, root):
        linked, open_ends = set(), [root]
        while open_ends:
            parts = {part["@id"] for part in open_ends.pop().get("hasPart", [])} - linked
            linked |= parts
            open_ends += [self.entities.get(part, {}) for part in parts]
        return linked

    def of_an_entity(self, identity, entity, linked):
        flat = {key: value if isinstance(value, list) else [value] for key, value in entity.items()}
        for key, values in flat.items():
            for value in values:
                if isinstance(value, dict):
                    self.expect(set(value) == {"@id"}, f"{identity}: {key} is nested")
                    absolute = re.match(r"[a-z]+:", value["@id"])
                    self.expect(value["@id"] in self.entities or absolute, f"{identity}: {key} leads nowhere")
        path = self.folder / urllib.parse.unquote(identity)
        if "File" in flat["@type"]:
            self.expect(identity in linked, f"{identity} is linked from the root")
            self.expect(path.is_file(), f"{identity} is there")
            self.expect(entity.get("encodingFormat"), f"{identity}: encodingFormat")
            if "contentSize" in entity:
                self.expect(entity["contentSize"] == str(path.stat().st_size), f"{identity}: contentSize")
        if "Dataset" in flat["@type"] and identity != "./":
            self.expect(identity in linked and identity.endswith("/"), f"{identity}: a folder, linked")
            self.expect(path.is_dir(), f"{identity} is there")
        if "Person" in flat["@type"]:
            self.expect(entity.get("name"), f"{identity}: name")


def crate_faults(folder):
    return CrateFaults(folder).found


class Bundle(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.base = base = pathlib.Path(scratch.name)
        shutil.copy(SOURCE / "protocols/quick.json", base / "quick.json")
        run("plan", "--gain-sd", "0.1", "--residual-sd", "0.3", "--effect", "cone=50", "--participants", "2-6",
            "--trials", "3", "--studies", "100", "--json", base / "plan.json")
        (base / "h.json").write_text(json.dumps([
            {"id": "H1", "text": "Cones <b>faster</b> | [x](y).", "refuted": "paired.cone.ci95_high < 5",
             "corroborated": "paired.cone.p_holm < 0.05 && paired.cone.reduction > 0"}]))
        run("register", base / "quick.json", "--plan", base / "plan.json", "--hypotheses", base / "h.json",
            "--out", base / "registration", "--studies", "20", "--participants", "3")
        run("simulate", base / "quick.json", "--db", base / "study.db", "--participants", "3")
        (base / "study.json").write_text(json.dumps(ABOUT))
        cls.make(base)

    @staticmethod
    def make(folder, *more, out="bundle", about="study.json", status=0):
        return run("bundle", "--db", "study.db", "--registration", "registration", "--about", about, "--out", out, *more,
                   status=status, folder=folder)

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        for name in ("study.db", "study.json"):
            shutil.copy(self.base / name, self.dir / name)
        for name in ("registration", "bundle"):
            shutil.copytree(self.base / name, self.dir / name)
        self.bundle = self.dir / "bundle"

    def test_contents_of_the_folder(self):
        there = files(self.bundle)
        for name in ("data/trials.csv", "data/codebook.csv", "data/psych-ds/dataset_description.json",
                     "registration/registration.md", "check.json", "check.html", "report.html", "figures/figure15.svg",
                     "analysis.json", "about.json", "ro-crate-metadata.json", "reproduce.sh", "README.md", "SHA256SUMS"):
            self.assertIn(name, there)
        checked = subprocess.run(["sha256sum", "-c", "--quiet", "SHA256SUMS"], cwd=self.bundle, capture_output=True)
        self.assertEqual(checked.returncode, 0, checked.stdout)
        self.assertEqual(len((self.bundle / "SHA256SUMS").read_text().splitlines()), len(there) - 1)
        for name in there:
            mode = stat.S_IMODE((self.base / "bundle" / name).stat().st_mode)
            self.assertEqual(mode, 0o700 if name == "reproduce.sh" else 0o600, name)
        self.assertIn('href="check.html"', (self.bundle / "report.html").read_text())
        for name in ("README.md", "report.html", "check.html", "ro-crate-metadata.json"):
            self.assertIn("SIMULATED PARTICIPANTS", (self.bundle / name).read_text(), name)
        with open(self.bundle / "data/trials.csv", newline="") as file:
            self.assertEqual({row["onset_utc"][:4] for row in csv.DictReader(file)}, {"1900"})

    def test_numbers_equal_those_of_the_database(self):
        run("analyze", "--db", "study.db", "--json", "db.json", folder=self.dir)
        ours = json.loads((self.bundle / "analysis.json").read_text())
        theirs = json.loads((self.dir / "db.json").read_text())
        # A table does not name the protocol and the settings of simulated participants.
        for key in ("source", "protocol", "observer_sha256"):
            ours.pop(key), theirs.pop(key)
        self.assertEqual(ours, theirs)

    def test_the_rules_of_ro_crate(self):
        self.assertEqual(crate_faults(self.bundle), [])
        graph = json.loads((self.bundle / "ro-crate-metadata.json").read_text())["@graph"]
        root = next(entity for entity in graph if entity["@id"] == "./")
        self.assertEqual(root["author"], [{"@id": "https://orcid.org/0000-0002-1825-0097"}, {"@id": "#author-2"}])
        self.assertEqual(root["identifier"], {"@id": "https://doi.org/10.5281/zenodo.1234"})

    def test_a_fault_of_a_crate_is_noticed(self):
        path = self.bundle / "ro-crate-metadata.json"
        good = json.loads(path.read_text())
        for change in ({"license": None}, {"datePublished": "soon"}, {"hasPart": []}):
            bad = json.loads(path.read_text())
            next(e for e in bad["@graph"] if e["@id"] == "./").update(change)
            path.write_text(json.dumps(bad))
            try:
                self.assertNotEqual(crate_faults(self.bundle), [], change)
            except TypeError:
                pass  # a license that is none
            path.write_text(json.dumps(good))

    def test_it_reproduces_in_another_folder(self):
        elsewhere = self.dir / "a folder's \"name\" $x"
        shutil.copytree(self.bundle, elsewhere)
        shutil.rmtree(self.bundle)
        (self.dir / "study.db").unlink()
        done = run("bundle", "--verify", elsewhere)
        self.assertNotIn("DIFFERS", done.stdout)
        for name in ("analysis.json", "check.json", "check.html", "report.html", "README.md", "reproduce.sh",
                     "ro-crate-metadata.json", "figures/", "data/psych-ds/"):
            self.assertIn(f"same     {name}", done.stdout)
        before = files(elsewhere)
        script = subprocess.run(["sh", elsewhere / "reproduce.sh"], capture_output=True, text=True,
                                env=os.environ | {"PALPATE": PALPATE})
        self.assertEqual((script.returncode, script.stdout), (0, "analysis.json is reproduced\n"), script.stderr)
        self.assertEqual(files(elsewhere), before)

    @unittest.skipUnless(os.geteuid() == 0, "only root can become another user")
    def test_it_reproduces_as_another_user(self):
        with tempfile.TemporaryDirectory(dir="/tmp") as scratch:
            os.chmod(scratch, 0o755)
            program = pathlib.Path(scratch) / "palpate"
            shutil.copy(PALPATE, program)
            os.chmod(program, 0o755)
            shutil.copytree(self.bundle, pathlib.Path(scratch) / "b")
            for path in (pathlib.Path(scratch) / "b").rglob("*"):
                os.chmod(path, 0o755 if path.is_dir() else 0o444)
            os.chmod(pathlib.Path(scratch) / "b", 0o755)

            def nobody():
                os.setgroups([])
                os.setgid(65534)
                os.setuid(65534)

            done = subprocess.run([program, "bundle", "--verify", "b"], cwd=scratch, capture_output=True, text=True,
                                  preexec_fn=nobody, env={"PATH": "/usr/bin:/bin", "LC_ALL": "C"})
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_changes_are_named(self):
        trials = self.bundle / "data/trials.csv"
        text = trials.read_bytes()
        time = list(csv.reader(text.decode().splitlines()))[1][8]
        trials.write_bytes(text.replace(f",{time},".encode(), f",{float(time) + 0.5},".encode(), 1))
        done = run("bundle", "--verify", self.bundle, status=1)
        self.assertIn("data/trials.csv has changed", done.stdout)
        self.assertIn("DIFFERS  analysis.json", done.stdout)
        self.assertIn("DIFFERS  data/psych-ds/", done.stdout)
        trials.write_bytes(text)
        run("bundle", "--verify", self.bundle)
        (self.bundle / "more.txt").write_text("x")
        (self.bundle / "about.json").unlink()
        done = run("bundle", "--verify", self.bundle, status=1)
        self.assertIn("more.txt is not listed", done.stdout)
        self.assertIn("about.json is missing", done.stdout)

    def forge(self, name, change, bundle=None):
        """Changes a file and makes the checksums again, also those of the crate."""
        folder = bundle or self.bundle
        path = folder / name
        before = path.read_text(encoding="utf-8")
        after = change(before)
        self.assertNotEqual(before, after, name)
        path.write_text(after, encoding="utf-8", newline="")
        crate = folder / "ro-crate-metadata.json"
        if name != crate.name:
            graph = json.loads(crate.read_text())
            for entity in graph["@graph"]:
                if "sha256" in entity:
                    content = (folder / urllib.parse.unquote(entity["@id"])).read_bytes()
                    entity |= {"contentSize": str(len(content)), "sha256": hashlib.sha256(content).hexdigest()}
            crate.write_text(json.dumps(graph, indent=2, ensure_ascii=False) + "\n")
        (folder / "SHA256SUMS").write_text("".join(
            f"{hashlib.sha256((folder / one).read_bytes()).hexdigest()}  {one}\n"
            for one in sorted(files(folder) - {"SHA256SUMS"}, key=os.fsencode)))

    def refused(self, words, folder=None):
        done = run("bundle", "--verify", folder or self.bundle, status=1)
        self.assertIn("same     every file, by its checksum", done.stdout)
        self.assertIn(words, done.stdout)

    def again(self):
        shutil.rmtree(self.bundle)
        shutil.copytree(self.base / "bundle", self.bundle)

    def test_forgeries_with_new_checksums_are_named(self):
        verdict = json.loads((self.bundle / "check.json").read_text())["hypotheses"][0]["verdict"]
        other = "refuted" if verdict == "corroborated" else "corroborated"
        table = "data/psych-ds/data/subject-S001/study-quick_subject-S001_data.csv"
        for name, change, words in (
                ("check.json", lambda t: t.replace(f'"verdict": "{verdict}"', f'"verdict": "{other}"'), "check.json, made"),
                ("check.json", lambda t: t.replace('"deviations": 0', '"deviations": 1'), "check.json, made again"),
                ("check.json", lambda t: t.replace("nobody was removed", "nobody was ever removed"), "check.json, made"),
                ("check.html", lambda t: t.replace(verdict, other), "check.html, made again"),
                ("README.md", lambda t: t.replace(verdict, other), "README.md, made again"),
                ("report.html", lambda t: re.sub(r"(\d)(?=\d* %)", lambda m: str((int(m[1]) + 1) % 10), t, count=1), "report.html"),
                ("report.html", lambda t: t.replace(f"is {verdict}", f"is {other}"), "report.html, made again"),
                ("figures/figure15.svg", lambda t: t.replace("</svg>", "<!-- --></svg>"), "figures/figure15.svg"),
                ("reproduce.sh", lambda t: t.replace("cmp ", "true "), "reproduce.sh, made again"),
                ("analysis.json", lambda t: t.replace('"n_trials": 72', '"n_trials": 73'), "analysis.json, made again"),
                (table, lambda t: t.replace(",sphere,sphere,1,", ",sphere,cone,0,", 1), "response is cone"),
                (table, lambda t: "".join(t.splitlines(True)[:-1]), "is not in the dataset"),
                (table, lambda t: t + t.splitlines(True)[-1], "twice in the dataset"),
                ("about.json", lambda t: t.replace("CC-BY-4.0", "CC0-1.0"), "by about.json"),
                ("data/psych-ds/dataset_description.json", lambda t: t.replace("CC-BY-4.0", "CC0-1.0"), "by about.json"),
                ("data/psych-ds/README.md", lambda t: t.replace("CC-BY-4.0", "CC0-1.0"), "authors or terms"),
                ("data/psych-ds/materials/quick_protocol.json", lambda t: t + " ", "is no protocol of"),
                ("data/codebook.csv", lambda t: t.replace("point,only its tip", "point,tip and side"), "renderer: its values have other meanings"),
                ("data/codebook.csv", lambda t: t.replace("trials,correct,,0,", "trials,correct,,2,"), "correct: its values have other meanings"),
                ("data/codebook.csv", lambda t: t.replace("trials,response_time,s", "trials,response_time,ms"), "response_time: has another meaning or unit"),
                ("data/codebook.csv", lambda t: t + "trials,trial,1,,In another order\r\n", "describes trial a second time"),
                ("data/codebook.csv", lambda t: t + "trials\r\n", "data/codebook.csv"),
                ("data/codebook.csv", lambda t: t.replace("value,meaning", "value,sense"), "has other columns than a codebook"),
                ("data/psych-ds/dataset_description.json", lambda t: t.replace('"unitText": "s"', '"unitText": 5'), "is described in another way"),
                ("data/psych-ds/dataset_description.json", lambda t: t.replace('"name": "correct"', '"name": "renderer"'), "describes renderer twice"),
                ("data/psych-ds/dataset_description.json", lambda t: t.replace('"variableMeasured"', '"variables"'), "has no list variableMeasured"),
                ("data/codebook.csv", lambda t: t + "trials,mood,,,How it felt\r\n", "mood: is no column"),
                ("data/psych-ds/dataset_description.json", lambda t: t.replace("point = only its tip", "point = tip and side"), "renderer is described in another way"),
                ("data/psych-ds/dataset_description.json", lambda t: t.replace("0 = wrong", "0 = right"), "correct is described in another way"),
                ("ro-crate-metadata.json", lambda t: t.replace("CC-BY-4.0", "CC0-1.0"), "ro-crate-metadata.json, made"),
                ("data/record.json", lambda t: t.replace('"removed": 0', '"removed": 1'), "check.json, made again"),
                ("data/record.json", lambda t: t.replace('"devices"', '"devises"'), "did you mean 'devices'"),
                ("registration/hypotheses.json", lambda t: t.replace("> 0", "> -99"), "check.json, made again")):
            with self.subTest(name=name, words=words):
                self.forge(name, change)
                self.refused(words)
            self.again()
        (self.bundle / "figures/more.svg").write_text("<svg/>")
        self.forge("README.md", lambda t: t + " ")
        self.refused("figures/more.svg is none of the analysis")

    def test_forgeries_of_bids_are_named(self):
        self.make(self.dir, "--format", "bids", out="bids")
        table = "data/bids/sub-S001/ses-1/beh/sub-S001_ses-1_task-quick_run-1_beh.tsv"
        for name, change, words in (
                (table, lambda t: t.replace("\tsphere\tsphere\t1\t", "\tsphere\tcone\t0\t", 1), "response is cone"),
                (table, lambda t: "".join(t.splitlines(True)[:-1]), "is not in the dataset"),
                (table, lambda t: re.sub(r"(?m)^0\t", "9\t", t, count=1), "onset is"),
                (table.replace(".tsv", ".json"), lambda t: t.replace('"point": "only its tip"', '"point": "tip and side"'), "renderer is described in another way"),
                (table.replace(".tsv", ".json"), lambda t: t.replace('"Levels": {', '"Levers": {', 1), "is described in another way"),
                (table.replace(".tsv", ".json"), lambda t: t.replace('"Units": "s"', '"Units": ["s"]'), "is described in another way"),
                (table.replace(".tsv", ".json"), lambda t: "[]", "is no object"),
                ("data/bids/participants.tsv", lambda t: t.replace("\t1", "\t0", 1), "other participants"),
                ("data/bids/dataset_description.json", lambda t: t.replace("Bo Example", "Cy Example"), "Authors is"),
                ("data/bids/sourcedata/quick_protocol.json", lambda t: t + " ", "is no protocol of")):
            with self.subTest(name=name, words=words):
                self.forge(name, change, self.dir / "bids")
                self.refused(words, self.dir / "bids")
            shutil.rmtree(self.dir / "bids")
            self.make(self.dir, "--format", "bids", out="bids")

    def test_a_bundle_with_a_pilot_and_a_removal_verifies(self):
        quick = json.loads((self.base / "quick.json").read_text())
        (self.dir / "pilot.json").write_text(json.dumps({**quick, "name": "pilot", "repetitions": 4}))
        run("simulate", "pilot.json", "--db", "study.db", "--participants", 2, "--seed", 5, folder=self.dir)
        run("forget", "--db", "study.db", "--participant", "S003", "--yes", folder=self.dir)
        for format in ("psych-ds", "bids"):
            self.make(self.dir, "--format", format, out=format)
            done = run("bundle", "--verify", self.dir / format)
            self.assertIn("1 deviation", done.stdout.replace("2 deviations", "1 deviation"))

    def test_the_digest_is_compared(self):
        digest = hashlib.sha256((self.dir / "registration/SHA256SUMS").read_bytes()).hexdigest()
        self.assertIn(digest, self.make(self.dir, "--digest", digest, out="new").stdout)
        for name in ("README.md", "report.html", "check.html", "check.json"):
            self.assertIn(digest, (self.dir / "new" / name).read_text(), name)
        done = run("bundle", "--verify", self.dir / "new", "--digest", digest)
        self.assertIn(digest, done.stdout)
        run("bundle", "--verify", self.dir / "new", "--digest", "0" * 64, status=1)
        run("bundle", "--verify", self.dir / "new", "--digest", "0", status=2)
        self.make(self.dir, "--digest", "0" * 64, out="other")
        self.assertEqual(json.loads((self.dir / "other/check.json").read_text())["deviations"], 1)
        run("bundle", "--verify", self.dir / "other")

    def test_links_are_not_followed(self):
        (self.bundle / "about.json").unlink()
        (self.bundle / "about.json").symlink_to(self.dir / "study.json")
        run("bundle", "--verify", self.bundle, status=2)
        (self.dir / "registration/plan.json").rename(self.dir / "plan.json")
        (self.dir / "registration/plan.json").symlink_to(self.dir / "plan.json")
        self.make(self.dir, out="new", status=2)
        self.assertFalse((self.dir / "new").exists())

    def test_as_bids(self):
        self.make(self.dir, "--format", "bids", out="new")
        self.assertIn("data/bids/participants.tsv", files(self.dir / "new"))
        self.assertEqual(crate_faults(self.dir / "new"), [])
        run("bundle", "--verify", self.dir / "new")

    def test_withdrawn_participants_are_absent(self):
        self.make(self.dir, out="first")
        done = run("forget", "--db", "study.db", "--participant", "S002", "--yes", folder=self.dir)
        self.assertIn("first/data/trials.csv", done.stdout)
        self.assertIn("first/data/psych-ds", done.stdout)
        self.make(self.dir, out="second")
        for name in files(self.dir / "second"):
            if not name.startswith("registration/simulated/"):  # whose codes are of nobody
                self.assertNotIn(b"S002", (self.dir / "second" / name).read_bytes(), name)
        check = json.loads((self.dir / "second/check.json").read_text())
        self.assertEqual(check["deviations"], 1)
        run("bundle", "--verify", self.dir / "second")

    def test_nothing_is_overwritten(self):
        self.assertIn("--force", self.make(self.dir, status=2).stderr)
        self.make(self.dir, "--force")
        (self.bundle / "mine.txt").write_text("mine")
        self.assertIn("mine.txt", self.make(self.dir, "--force", status=2).stderr)
        self.assertEqual((self.bundle / "mine.txt").read_text(), "mine")
        self.make(self.dir, "--force", out="registration", status=2)
        self.make(self.dir, "--force", out="study.db", status=2)

    def test_hostile_texts(self):
        (self.dir / "evil.json").write_text(json.dumps(ABOUT | {"authors": [
            {"name": "<script>alert(1)</script> [x](javascript:y)", "affiliation": "=1+1"}]}))
        self.make(self.dir, out="new", about="evil.json")
        text = (self.dir / "new/README.md").read_text()
        self.assertNotRegex(text, r"(?<!\\)<(script|b)>|(?<!\\)\[x")
        for name in ("report.html", "check.html"):
            self.assertNotRegex((self.dir / "new" / name).read_text(), r"<script>alert|<b>faster")
        self.assertEqual(crate_faults(self.dir / "new"), [])

    def test_an_unregistered_study_says_so(self):
        for form in ("psych-ds", "bids"):
            out = self.dir / form
            made = run("bundle", "--db", "study.db", "--about", "study.json", "--out", out, "--format", form,
                       folder=self.dir)
            self.assertIn("not registered", made.stdout)
            there = files(out)
            self.assertFalse({name for name in there if name.startswith(("registration/", "check."))})
            for name in ("README.md", "report.html", "ro-crate-metadata.json"):
                self.assertIn("not registered", (out / name).read_text(), name)
                self.assertIn("SIMULATED PARTICIPANTS", (out / name).read_text(), name)
            self.assertNotIn("check.html", (out / "report.html").read_text())
            self.assertEqual(crate_faults(out), [])
            self.assertIn("not registered", run("bundle", "--verify", out).stdout)
            script = subprocess.run(["sh", "reproduce.sh"], cwd=out, capture_output=True, text=True,
                                    env={**os.environ, "PALPATE": PALPATE})
            self.assertEqual(script.returncode, 0, script.stderr)
        run("analyze", "--db", "study.db", "--json", "a.json", folder=self.dir)
        mine, theirs = (json.loads(p.read_text()) for p in (self.dir / "a.json", self.dir / "bids/analysis.json"))
        self.assertEqual(mine["paired_by_shape"], theirs["paired_by_shape"])

    def test_a_registration_taken_away_is_named(self):
        shutil.rmtree(self.bundle / "registration")
        done = run("bundle", "--verify", self.bundle, status=1)
        self.assertIn("check.html is there without a registration", done.stdout)
        self.assertIn("DIFFERS  README.md", done.stdout)

    def test_what_is_refused(self):
        no_license = {key: value for key, value in ABOUT.items() if key != "license"}
        (self.dir / "a.json").write_text(json.dumps(no_license))
        self.assertIn("license", self.make(self.dir, out="new", about="a.json", status=2).stderr)
        (self.dir / "b.json").write_text("{}")
        self.make(self.dir, out="new", about="b.json", status=2)
        self.make(self.dir, "--format", "csv", out="new", status=2)
        run("bundle", "--db", "study.db", status=2, folder=self.dir)
        run("bundle", "--verify", "bundle", "--db", "study.db", status=2, folder=self.dir)
        run("bundle", "--verify", "nowhere", status=2, folder=self.dir)
        run("bundle", "--verify", "bundle", "--registration", "registration", status=2, folder=self.dir)
        digest = run("bundle", "--db", "study.db", "--about", "study.json", "--out", "new", "--digest", "0" * 64,
                     status=2, folder=self.dir)
        self.assertIn("--registration", digest.stderr)
        shutil.copy(SOURCE / "protocols/stiffness-2afc.json", self.dir / "other.json")
        run("simulate", "other.json", "--db", "study.db", "--participants", "1", folder=self.dir)
        two = run("bundle", "--db", "study.db", "--about", "study.json", "--out", "new", status=2, folder=self.dir)
        self.assertIn("the trials of one protocol", two.stderr)
        self.assertFalse((self.dir / "new").exists())
        self.assertEqual([p.name for p in self.dir.iterdir() if p.name.startswith(".")], [])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
