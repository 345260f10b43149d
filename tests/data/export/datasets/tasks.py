"""Datasets of protocols of version 2: several intervals a trial, levels, answers that are no stimuli."""

import gzip
import json

import bids_checks
import psychds_checks
from study import PROTOCOLS, Study, run_palpate

SHORT = {"kind": "constant", "levels": [200, 400], "repetitions": 2}


def simulate_tasks(folder, name, blocks):
    """`blocks`: changes to the block of constant levels of protocols/stiffness-2afc.json, with samples."""
    protocol = json.loads((PROTOCOLS / "stiffness-2afc.json").read_text())
    protocol.pop("$schema")
    block = {key: value for key, value in protocol["blocks"][1].items() if key not in ("keys", "confidence", "order")}
    whole = [block | {"procedure": SHORT} | change for change in blocks]
    protocol |= {"name": name, "samples": True,
                 "blocks": [{key: value for key, value in one.items() if value is not None} for one in whole]}
    (folder / f"{name}.json").write_text(json.dumps(protocol))
    run_palpate("simulate", folder / f"{name}.json", "--db", folder / f"{name}.db", "--participants", 1)
    for form in ("bids", "psych-ds"):
        run_palpate("export", "--db", folder / f"{name}.db", "--format", form, "--out", folder / f"{name}-{form}")
    run_palpate("export", "--db", folder / f"{name}.db", "--format", "csv", "--out", folder / f"{name}.csv")
    return bids_checks.read_csv(folder / f"{name}.csv")


class Tasks(Study):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        rate = {"name": "hardness", "task": "rate", "question": "How hard?", "min": 0, "max": 1000}
        cls.pairs = simulate_tasks(cls.dir, "pairs", [{}, {"name": "three", "intervals": 3}])
        cls.mixed = simulate_tasks(cls.dir, "mixed", [{}, rate | {"standard": None}])

    def sidecar(self, name, what):
        return json.loads(next((self.dir / f"{name}-bids").glob(f"sub-*/ses-1/beh/*{what}.json")).read_text())

    def test_the_rules_of_the_formats_hold(self):
        for name in ("pairs", "mixed"):
            self.assertEqual(bids_checks.bids_faults(self.dir / f"{name}-bids"), [])
            self.assertEqual(psychds_checks.psychds_faults(self.dir / f"{name}-psych-ds"), [])

    def test_a_trial_begins_with_its_first_interval_and_lasts_to_the_answer(self):
        beh = bids_checks.tables(self.dir / "pairs-bids")
        self.assertEqual(len(beh), len(self.pairs))
        for row in self.pairs:
            trial = beh[row["participant_id"], row["session"], row["trial"]]
            before_the_last = [float(x) for x in row["interval_onsets"].split(";")][-1]
            self.assertGreater(before_the_last, 0)
            self.assertAlmostEqual(float(trial["duration"]), before_the_last + float(row["response_time"]), delta=1e-6)

    def test_samples_stand_where_their_interval_was(self):
        """Against the intervals' times in the CSV: each tick of an interval is a row, and none lies between them."""
        about = self.sidecar("pairs", "physio")
        with gzip.open(next((self.dir / "pairs-bids").glob("sub-*/ses-1/beh/*physio.tsv.gz")), "rt") as file:
            samples = [line.rstrip("\n").split("\t") for line in file]
        self.assertEqual(about["Columns"][:3], ["trial", "interval", "tick"])
        for row, trial in zip(self.pairs, about["Trials"], strict=True):
            onsets, ends = ([float(x) for x in row[key].split(";")] for key in ("interval_onsets", "interval_ends"))
            self.assertEqual(len(trial["intervals"]), len(onsets))
            self.assertIn(len(onsets), (2, 3))
            block = samples[trial["first_row"] : trial["first_row"] + trial["rows"]]
            for k, (onset, end) in enumerate(zip(onsets, ends), 1):
                rows = [i for i, sample in enumerate(block) if sample[1] == str(k)]
                self.assertAlmostEqual(rows[0] / 1000, onset, delta=1e-9)
                self.assertAlmostEqual(rows[-1] / 1000, end, delta=1.5e-3)
                self.assertEqual([int(block[i][2]) for i in rows], list(range(len(rows))))
                self.assertEqual({sample[0] for sample in (block[i] for i in rows)}, {row["trial"]})
            levels = ["" if one["level"] is None else repr(one["level"]).removesuffix(".0") for one in trial["intervals"]]
            self.assertEqual(";".join(levels), row["interval_levels"])

    def test_psychds_samples_name_their_interval(self):
        path = next((self.dir / "pairs-psych-ds").glob("data/subject-*/*haptic_data.csv"))
        last = {}
        for sample in bids_checks.read_csv(path):
            key = sample["trial"]
            now = (int(sample["interval"]), float(sample["time"]))
            self.assertGreater(now, last.get(key, (0, -1.0)))
            self.assertGreater(now[1], last.get(key, (0, -1.0))[1], "time goes on through the intervals")
            last[key] = now
        self.assertEqual(len(last), len(self.pairs))

    def test_answers_levels_and_blocks_are_described(self):
        beh = self.sidecar("pairs", "beh")
        self.assertEqual({row["response"] for row in self.pairs} - set(beh["response"]["Levels"]), set())
        self.assertEqual(beh["level"]["Units"], "N/m")
        self.assertEqual(beh["block_name"]["Levels"]["three"], "compare; levels of /stiffness_n_per_m in N/m")
        self.assertNotIn("Levels", self.sidecar("mixed", "beh")["response"], "numbers are no codes")
        self.assertIn("Judgements", (self.dir / "pairs-bids" / "README").read_text())
