"""The rules of the formats, and that every check of them can fail."""

import gzip
import json
import shutil

import bids_checks
import psychds_checks
from study import Study

BEH = "sub-S001/ses-1/beh/sub-S001_ses-1_task-quick_beh"


class Rules(Study):
    def test_a_codebook_goes_with_the_csv(self):
        self.export("csv", self.dir / "with-book.csv", "--codebook", self.dir / "book.csv", "--force")
        book = bids_checks.read_csv(self.dir / "book.csv")
        header = (self.dir / "with-book.csv").read_text().split("\n")[0].strip().split(",")
        self.assertEqual([row["column"] for row in book if row["table"] == "trials" and not row["value"]], header)
        bits = {int(row["value"]): row["meaning"] for row in book
                if row["table"] == "trials" and row["column"] == "faults" and row["value"]}
        self.assertEqual(sorted(bits), [1 << i for i in range(len(bits))])
        seen = 0
        for row in bids_checks.read_csv(self.dir / "with-book.csv"):
            seen |= int(row["faults"])
        self.assertTrue(seen & 16)
        self.assertIn("slips off an edge", bits[16])
        self.assertIn("--codebook is for csv",
                      self.export("bids", self.dir / "no", "--codebook", self.dir / "no.csv", status=2).stderr)

    def test_who_made_the_study_stands_in_the_description(self):
        about = self.dir / "study.json"
        about.write_text(json.dumps({
            "version": 1, "authors": [{"name": "Example, Ada", "orcid": "0000-0002-1825-0097", "affiliation": "Ü"}, "Bo"],
            "license": "CC-BY-4.0", "funding": ["Own means", {"funder": "Council", "grant": "C-1"}, {"funder": "Council", "grant": "C-2"}],
            "ethics_approvals": ["Committee, 2026-17"], "references": ["https://osf.io/abcde", "Bo (2026)"],
            "doi": "https://doi.org/10.5281/zenodo.1234", "acknowledgements": "Thanks.", "how_to_acknowledge": "Cite."}))
        said = {}
        for form in ("bids", "psych-ds"):
            self.export(form, self.dir / f"about-{form}", "--about", about)
            self.export(form, self.dir / f"about-{form}", "--force")  # and away again
            without = json.loads((self.dir / f"about-{form}" / "dataset_description.json").read_text())
            self.export(form, self.dir / f"about-{form}", "--about", about, "--force")
            whole = json.loads((self.dir / f"about-{form}" / "dataset_description.json").read_text())
            self.assertEqual({key: whole[key] for key in without}, without)
            said[form] = {key: value for key, value in whole.items() if key not in without}
            readme = (self.dir / f"about-{form}" / ("README" if form == "bids" else "README.md")).read_text()
            for words in ("Authors: Example, Ada (Ü); Bo\n\n", "License: CC-BY-4.0\n\n",
                          "Funding: Own means; Council, C-1; Council, C-2\n\n", "Ethics approvals: Committee, 2026-17\n\n",
                          "References: https\\://osf.io/abcde; Bo (2026)\n\n", "DOI: https\\://doi.org/10.5281/zenodo.1234\n\n",
                          "Acknowledgements: Thanks.\n\n", "How to acknowledge: Cite.\n\n"):
                self.assertIn(words, readme)
        self.assertEqual(said["bids"], {
            "License": "CC-BY-4.0", "Authors": ["Example, Ada", "Bo"], "Acknowledgements": "Thanks.",
            "HowToAcknowledge": "Cite.", "Funding": ["Own means", "Council, C-1", "Council, C-2"],
            "EthicsApprovals": ["Committee, 2026-17"], "ReferencesAndLinks": ["https://osf.io/abcde", "Bo (2026)"],
            "DatasetDOI": "doi:10.5281/zenodo.1234"})
        council = {"@type": "Organization", "name": "Council"}
        self.assertEqual(said["psych-ds"], {
            "author": [{"@type": "Person", "@id": "https://orcid.org/0000-0002-1825-0097", "name": "Example, Ada",
                        "affiliation": {"@type": "Organization", "name": "Ü"}}, {"@type": "Person", "name": "Bo"}],
            "license": "https://spdx.org/licenses/CC-BY-4.0.html",
            "funder": [{"@type": "Organization", "name": "Own means"}, council],
            "funding": [{"@type": "Grant", "identifier": grant, "funder": council} for grant in ("C-1", "C-2")],
            "citation": ["https://osf.io/abcde", "Bo (2026)"], "identifier": "https://doi.org/10.5281/zenodo.1234",
            "creditText": "Cite."})
        self.assertEqual(bids_checks.bids_faults(self.dir / "about-bids"), [])
        self.assertEqual(psychds_checks.psychds_faults(self.dir / "about-psych-ds"), [])

    def test_a_wrong_file_of_a_study_is_refused_before_anything_is_written(self):
        about = self.dir / "wrong.json"
        about.write_text('{"version": 1,\n "authors": ["A"],\n "licence": "CC0-1.0"}')
        said = self.export("bids", self.dir / "wrong", "--about", about, status=2).stderr
        self.assertIn("wrong.json:3: /licence: unknown key; did you mean 'license'?", said)
        self.assertIn("none.json: (file)", self.export("psych-ds", self.dir / "wrong", "--about", self.dir / "none.json", status=2).stderr)
        self.assertFalse((self.dir / "wrong").exists())
        about.write_text('{"version": 1, "authors": ["A"]}')
        self.assertIn("--about is for bids", self.export("csv", self.dir / "no.csv", "--about", about, status=2).stderr)

    def test_protocols_come_with_the_data(self):
        text = (self.dir / "sampled.json").read_bytes()
        self.assertEqual((self.dir / "sampled-bids" / "sourcedata" / "withsamples_protocol.json").read_bytes(), text)
        self.assertEqual((self.dir / "sampled-psychds" / "materials" / "withsamples_protocol.json").read_bytes(), text)

    def test_simulated_data_say_so(self):
        for name in ("plain", "sampled"):
            for form, key, readme in (("bids", "Name", "README"), ("psychds", "name", "README.md")):
                folder = self.dir / f"{name}-{form}"
                self.assertIn("SIMULATED", json.loads((folder / "dataset_description.json").read_text())[key])
                self.assertIn("SIMULATED", (folder / readme).read_text())
            _, rows = bids_checks.read_tsv(self.dir / f"{name}-bids" / "participants.tsv")
            self.assertTrue(all(row[1] == "1" for row in rows))
            self.assertTrue(all(beh["simulated"] == "1" for beh in bids_checks.tables(self.dir / f"{name}-bids").values()))

    def test_only_the_owner_may_read_an_export(self):
        for path in (self.dir / "sampled-bids").rglob("*"):
            self.assertEqual(path.stat().st_mode & 0o077 if path.is_file() else 0, 0, path)
        self.assertEqual((self.dir / "sampled-bids").stat().st_mode & 0o077, 0)

    def copy(self, name):
        target = self.dir / "broken"
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(self.dir / name, target)
        return target

    def change(self, path, old, new, count=1):
        text = path.read_bytes()
        self.assertIn(old.encode(), text, path)
        path.write_bytes(text.replace(old.encode(), new.encode(), count))

    def test_bids_keeps_the_rules_that_the_validator_does_not_look_at(self):
        for name in ("plain", "sampled"):
            self.assertEqual(bids_checks.bids_faults(self.dir / f"{name}-bids"), [])

    def faults_of(self, folder):
        return " ".join(bids_checks.bids_faults(folder))

    def test_every_bids_check_of_participants_and_descriptions_can_fail(self):
        folder = self.copy("plain-bids")
        self.change(folder / "participants.tsv", "\nsub-S001", "\nsub-S009")
        self.assertIn("participants.tsv lists", self.faults_of(folder))
        folder = self.copy("plain-bids")
        self.change(folder / f"{BEH}.json", '"max_force"', '"mux_force"')
        self.assertIn("max_force is not described", self.faults_of(folder))
        (folder / f"{BEH}.json").unlink()
        self.assertIn("no sidecar", self.faults_of(folder))

    def test_every_bids_check_of_a_table_can_fail(self):
        folder = self.copy("plain-bids")
        header, rows = bids_checks.read_tsv(folder / f"{BEH}.tsv")
        def write(changed):
            (folder / f"{BEH}.tsv").write_text("".join("\t".join(row) + "\n" for row in [header] + changed))
            return self.faults_of(folder)
        self.assertIn("not sorted", write([rows[0], *rows[:0:-1]]))
        self.assertIn("onset is not 0", write(rows[1:]))
        self.assertIn("no number: soon", write([["0", "soon", *rows[0][2:]]]))
        self.assertIn("no number: nan", write([["0", "nan", *rows[0][2:]]]))
        self.assertIn("duration is missing", write([["0", "n/a", *rows[0][2:]]]))
        self.assertIn("fields for", write([rows[0][:-1]]))
        self.assertIn("is empty", write([["0", "", *rows[0][2:]]]))
        self.assertIn("no level", write([[x.replace("point", "pin").replace("ray", "pin") for x in rows[0]]]))

    def test_every_bids_check_of_a_recording_can_fail(self):
        folder = self.copy("sampled-bids")
        physio = folder / "sub-S001/ses-1/beh/sub-S001_ses-1_task-withsamples_run-1_recording-haptic_physio.tsv.gz"
        lines = gzip.open(physio, "rt").read().splitlines(keepends=True)
        twice = lines[-1].split("\t")
        twice[1] = "999999"
        for changed, fault in ((lines[:5] + lines[6:], "does not stand"), (lines[:5] + [lines[4]] + lines[6:], "order"),
                               (["\t".join(twice)] * 2 + lines, "not stand at its onset"),
                               (lines + ["\t".join(twice)], "more samples"),
                               (["x\t" + lines[0]] + lines[1:], "fields"),
                               ([lines[0].replace("\t0", "\tnull")] + lines[1:], "no number")):
            with gzip.open(physio, "wt") as file:
                file.writelines(changed)
            self.assertIn(fault, self.faults_of(folder))
        self.change(physio.with_name(physio.name[: -len(".tsv.gz")] + ".json"), '"SamplingFrequency"', '"Rate"')
        self.assertIn("no SamplingFrequency", self.faults_of(folder))

    def test_psychds_keeps_its_rules(self):
        for name in ("plain", "sampled"):
            self.assertEqual(psychds_checks.psychds_faults(self.dir / f"{name}-psychds"), [])

    def test_every_psychds_check_can_fail(self):
        table = "data/subject-S001/study-quick_subject-S001_data.csv"
        for path, old, new, fault in (
            ("dataset_description.json", '"https://schema.org/"', '"schema"', "@context"),
            ("dataset_description.json", '"Dataset"', '"Thing"', "@type"),
            ("dataset_description.json", '"description"', '"about"', "no description"),
            ("dataset_description.json", '"name": "block"', '"name": "blocks"', "column block is not in"),
            ("dataset_description.json", '"name": "block"', '"name": "trial"', "twice"),
            ("dataset_description.json", "{", "\ufeff{", "BOM"),
            (table, "participant_id", "\ufeffparticipant_id", "BOM"),
            (table, ",block", ",trial", "a header that is empty or twice"),
            (table, ",max_force", "", "other lengths"),
            (table, "S001,", "S002,", "another participant"),
        ):
            folder = self.copy("plain-psychds")
            self.change(folder / path, old, new)
            self.assertIn(fault, " ".join(psychds_checks.psychds_faults(folder)))
        folder = self.copy("plain-psychds")
        (folder / table).rename(folder / "data" / "quick.csv")
        self.assertIn("no Psych-DS name", " ".join(psychds_checks.psychds_faults(folder)))
