"""palpate analyze --movement from outside, against measures computed from their definitions, slowly and apart from the
program: a zero-phase low pass by its gain in the Fourier domain, peaks by their prominences, coverage by other places.
Usage: movement_command_test.py PALPATE"""

import csv
import gzip
import html.parser
import json
import math
import os
import pathlib
import sys
import unittest
import xml.etree.ElementTree

try:
    import numpy as np
except ImportError:
    SYSTEM = "/usr/bin/python3"  # has the system's packages, even if PATH begins with another one
    if pathlib.Path(sys.executable).resolve() == pathlib.Path(SYSTEM).resolve() or not os.access(SYSTEM, os.X_OK):
        sys.exit(77)
    os.execv(SYSTEM, [SYSTEM, *sys.argv])

from command_case import CommandCase

sys.dont_write_bytecode = True
EDGE, RATE, CUTOFF = 0.05, 1000.0, 20.0


def protocol(**wanted):
    return {"version": 1, "name": "short", "renderers": ["point", "ray"], "samples": True,
            "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": 0.03, "subdivisions": 2},
                        {"name": "cube", "shape": "cube", "edge_m": EDGE}],
            "repetitions": 1, "material": {"stiffness_n_per_m": 800},
            "response": {"keys": {"1": "sphere", "2": "cube"}, "time_out_s": 20}, "seed": 7} | wanted


def low_pass(values, cutoff):
    """Butterworth of order 2, forwards and backwards: gain 1 / (1 + (f / fc)^4), frequencies warped as digital filters
    do. The line from the first to the last value passes as it is; the rest is continued by point reflection."""
    n = len(values)
    line = values[0] + (values[-1] - values[0]) * np.arange(n)[:, None] / (n - 1)
    rest = values - line
    spectrum = np.fft.rfft(np.concatenate([rest, -rest[-2:0:-1]]), axis=0)
    f = np.arange(len(spectrum)) / (2 * (n - 1))
    gain = 1 / (1 + (np.tan(np.pi * np.minimum(f, 0.4999999)) / np.tan(np.pi * cutoff / 0.802 / RATE)) ** 4)
    return line + np.fft.irfft(spectrum * gain[:, None], 2 * (n - 1), axis=0)[:n]


def norm(vectors):
    return np.sqrt((vectors ** 2).sum(axis=1))


def runs(wanted):
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(wanted, int), [0]])))
    return list(zip(edges[::2], edges[1::2]))


def prominent(v, least):
    count = 0
    for i in range(1, len(v) - 1):
        if not v[i - 1] < v[i] >= v[i + 1]:
            continue
        higher = np.flatnonzero(v[:i] > v[i])
        left = v[higher[-1] if len(higher) else 0:i].min()
        higher = np.flatnonzero(v[i + 1:] > v[i])
        right = v[i + 1:i + 2 + higher[0] if len(higher) else len(v)].min()
        count += v[i] - max(left, right) >= least
    return count


def sparc(v):
    padded = 2 ** (math.ceil(math.log2(len(v))) + 4)
    spectrum = np.abs(np.fft.rfft(v, padded))
    spectrum /= spectrum.max()
    f = np.arange(len(spectrum)) * RATE / padded
    last = np.flatnonzero((f <= 10) & (spectrum >= 0.05))[-1]
    return -np.sqrt((np.diff(f[:last + 1]) / f[last]) ** 2 + np.diff(spectrum[:last + 1]) ** 2).sum()


def jerk(x):
    third = np.diff(x, 3, axis=0) * RATE ** 3
    v = norm(np.gradient(x, 1 / RATE, axis=0))
    return -math.log((len(x) / RATE) ** 3 / v.max() ** 2 * (third ** 2).sum() / RATE)


def of_motion(tip, contact):
    x = low_pass(tip, CUTOFF)
    velocity = np.gradient(x, 1 / RATE, axis=0)
    v, steps = norm(velocity), norm(np.diff(x, axis=0))
    moves = [(a, b) for a, b in runs(v >= 0.05 * v.max()) if b - a >= 100]
    ways = [steps[a:b - 1].sum() for a, b in moves]
    joined = [list(one) for one in runs(contact)[:1]]
    for a, b in runs(contact)[1:]:
        if a - joined[-1][1] < 50:
            joined[-1][1] = b
        else:
            joined.append([a, b])
    episodes = [b - a for a, b in joined if b - a >= 20]
    stops = [(a, b) for a, b in runs(contact & (v < 0.005)) if b - a >= 50]
    moving = contact.copy()
    for a, b in stops:
        moving[a:b] = False
    strokes = 0
    for a, b in runs(moving):
        if b - a >= 50:
            turns = [(x[i] - x[i - 50]) @ (x[i + 50] - x[i]) < 0 for i in range(a + 50, b - 50)]
            strokes += 1 + len(runs(turns))
    found = {"path_length": steps.sum(), "contact_path": steps[contact[1:] & contact[:-1]].sum(),
             "contact_share": contact.mean(), "approaches": len(episodes), "speed_mean": v.mean(),
             "speed_p95": np.quantile(v, 0.95), "sparc": sparc(v), "movements": len(moves),
             "speed_peaks_per_m": prominent(v, max(0.05 * v.max(), 0.005)) / steps.sum(),
             "sparc_movement": np.average([sparc(v[a:b]) for a, b in moves], weights=ways),
             "ldlj": np.average([jerk(x[a:b]) for a, b in moves], weights=ways),
             "stops": len(stops), "strokes": strokes, "duration": len(x) / RATE}
    if episodes:
        found["episode_time"] = np.mean(episodes) / RATE
    if stops:
        found["stop_time"] = np.mean([b - a for a, b in stops]) / RATE
    return found, velocity, joined


def to_object(trial, vectors):
    q = [float(trial["orientation_" + k]) for k in "wxyz"]
    w, u = q[0], np.array(q[1:])
    return vectors - 2 * w * np.cross(u, vectors) + 2 * np.cross(u, np.cross(u, vectors))


def shares(size, along, on_edge, contact):
    """Of the kinds of exploration, by tenths of a second in contact."""
    kinds = []
    for a, b in runs(contact):
        for i in range(a, b - 99, 100):
            part = slice(i, i + 100)
            if along[part].mean() >= 0.01:
                kinds.append("contour" if on_edge[part].mean() >= 0.5 else "lateral")
            else:
                kinds.append("pressure" if np.ptp(size[part]) > 0.3 * size[part].mean() else "static")
    return {"share_" + kind: kinds.count(kind) / len(kinds)
            for kind in ("static", "pressure", "lateral", "contour") if kinds}


def coverage(points):
    """The share of the cube's surface within 5 mm of a point."""
    seed = 5
    draws = np.random.default_rng(seed)
    places = draws.uniform(-EDGE / 2, EDGE / 2, (10000, 3))
    places[np.arange(10000), draws.integers(0, 3, 10000)] = draws.choice([-EDGE / 2, EDGE / 2], 10000)
    covered = np.zeros(10000, bool)
    for point in points:
        covered |= ((places - point) ** 2).sum(axis=1) <= 0.005 ** 2
    return covered.mean()


def of_touch(trial, tip, velocity, force, depth, contact, episodes):
    """Of a point on a frictionless cube: the force is along the normal, the contact by the depth along it."""
    size = norm(force)
    normal = force / np.where(size > 0, size, 1)[:, None]
    along = norm(velocity - (velocity * normal).sum(axis=1)[:, None] * normal)
    points = to_object(trial, tip + depth[:, None] * normal)
    # On a face; the distance to the nearest edge follows from the larger of the other two coordinates.
    away = np.sort(np.abs(np.abs(points) - EDGE / 2), axis=1)
    on_edge = contact & (norm(away[:, :2]) <= 0.003)
    inner = np.zeros(len(size), bool)
    for a, b in runs(contact):
        inner[a + 1:b - 1] = True
    change = np.gradient(size) * RATE
    return {"force_mean": size[contact].mean(), "force_max": size[contact].max(),
            "force_sd": size[contact].std(ddof=1), "force_mean_n": size[contact].mean(),
            "speed_contact": along[contact].mean(), "edge_dwell": on_edge.sum() / RATE,
            "press_peak": np.mean([size[a:b].max() for a, b in episodes if b - a >= 20]),
            "force_rate": math.sqrt((change[inner] ** 2).mean()), "coverage": coverage(points[contact]),
            **shares(size, along, on_edge, contact)}


def tab_separated(path):
    with path.open() as file:
        return list(csv.DictReader(file, delimiter="\t"))


class Movement(CommandCase):
    def study(self, name="study", participants=2, **wanted):
        path, db = self.file(f"{name}.json", protocol(**wanted)), self.dir / f"{name}.db"
        self.palpate("simulate", path, "--db", db, "--participants", participants, "--seed", 3)
        return db

    def measured(self, db, *args):
        out = self.dir / "movement.csv"
        done = self.palpate("analyze", "--db", db, "--movement", "--movement-csv", out, "--force", *args)
        with out.open() as file:
            return done, list(csv.DictReader(file))

    def test_measures_equal_their_definitions(self):
        self.check_definitions(self.study(), 8)

    def task_study(self, name, *blocks):
        cube = {"shape": "cube", "edge_m": EDGE, "stiffness_n_per_m": 500}
        path = self.file(f"{name}.json", {
            "version": 2, "name": name, "renderers": ["point", "ray"], "samples": True, "orientation": "fixed",
            "stimuli": [{"name": "cube"} | cube, {"name": "other"} | cube], "blocks": blocks, "seed": 4})
        db = self.dir / f"{name}.db"
        self.palpate("simulate", path, "--db", db, "--participants", 2, "--seed", 3)
        return db

    def test_tasks_with_one_object_a_trial_are_measured(self):
        rating = {"name": "soft", "task": "rate", "question": "How soft?", "stimuli": ["cube"],
                  "level": {"path": "/stiffness_n_per_m"}, "procedure": {"kind": "constant", "levels": [300, 600], "repetitions": 1},
                  "scale": [{"label": "hard"}, {"label": "soft"}]}
        db = self.task_study("rated", rating)
        done = self.check_definitions(db, 8)
        self.assertNotIn("contradicts", done.stdout + done.stderr)
        # Of a level that changes the size, nothing is known about the surface.
        sized = rating | {"level": {"path": "/edge_m"}, "procedure": {"kind": "constant", "levels": [0.04, 0.05], "repetitions": 1}}
        db = self.task_study("sized", sized)
        said = self.palpate("analyze", "--db", db, "--movement", status=2).stderr
        self.assertIn("8: its level changes the shape of the object", said)

    def test_trials_of_several_intervals_are_refused_by_name(self):
        compare = {"name": "two", "task": "compare", "question": "Which is harder?", "stimuli": ["cube"],
                   "standard": "other", "level": {"path": "/stiffness_n_per_m"},
                   "procedure": {"kind": "constant", "levels": [300, 600], "repetitions": 1}}
        db = self.task_study("compared", compare)
        said = self.palpate("analyze", "--db", db, "--movement", status=2).stderr
        self.assertIn("has no trial whose movement can be measured (8: a trial of several intervals)", said)
        both = self.task_study("both", compare, {"name": "names", "task": "identify", "stimuli": ["cube", "other"], "repetitions": 2,
                                                 "question": "Which?"})
        done, rows = self.measured(both)
        self.assertEqual([row["missing"] for row in rows].count("a trial of several intervals"), 8)
        self.assertEqual([row["missing"] for row in rows].count(""), 16)
        self.assertNotIn("contradicts", done.stdout + done.stderr)

    def check_definitions(self, db, count):
        done, rows = self.measured(db)
        self.palpate("export", "--db", db, "--format", "psych-ds", "--out", self.dir / "psych")
        _, trials = self.exported(db)
        samples = {}
        for file in sorted((self.dir / "psych" / "data").glob("*/*haptic_data.csv")):
            with file.open() as opened:
                for one in csv.DictReader(opened):
                    samples.setdefault((one["participant_id"], one["trial"]), []).append(one)
        self.assertEqual(len(rows), count)
        touched = 0
        for row, trial in zip(rows, trials, strict=True):
            self.assertEqual((row["participant_id"], row["trial"]), (trial["participant_id"], trial["trial"]))
            self.assertEqual((row["missing"], row["simulated"], row["cutoff_hz"]), ("", "1", "20"))
            ticks = samples[row["participant_id"], row["trial"]]
            self.assertEqual(int(row["samples"]), len(ticks))

            def column(*names):
                return np.array([[float(tick[name]) for name in names] for tick in ticks])
            tip, force = column("tip_x", "tip_y", "tip_z"), column("force_x", "force_y", "force_z")
            contact = column("contacts")[:, 0] > 0
            expected, velocity, episodes = of_motion(tip, contact)
            for name in ("contact_share", "edge_dwell"):
                self.assertAlmostEqual(float(trial[name]), float(row[name]), delta=1e-12, msg=name)  # ticks x period
            if trial["renderer"] == "point" and trial["shape"] == "cube" and contact.any():
                touched += 1
                expected |= of_touch(trial, tip, velocity, force, column("depth")[:, 0], contact, episodes)
            for name, value in expected.items():
                # 10,000 places drawn twice; times and path that begin and end between ticks; a window at a limit.
                delta = (0.015 if name == "coverage" else 0.003 if name == "edge_dwell" else
                         0.005 if name == "ldlj" else 1e-3 * abs(value) + 1e-9)
                self.assertAlmostEqual(float(row[name]), value, delta=delta, msg=f"{name} of trial {row['trial']}")
        self.assertGreaterEqual(touched, 1)
        return done

    def test_results_do_not_depend_on_the_number_of_threads(self):
        db = self.study()
        one, rows = self.measured(db, "--jobs", 1)
        two, again = self.measured(db, "--jobs", 2)
        self.assertEqual((one.stdout, rows), (two.stdout, again))
        self.assertIn("SIMULATED", one.stdout)
        self.assertLessEqual(max(map(len, one.stdout.splitlines())), 100)
        _, smoother = self.measured(db, "--cutoff-hz", 5)
        for row, smooth in zip(rows, smoother, strict=True):
            self.assertLess(float(smooth["path_length"]), float(row["path_length"]))
            self.assertEqual(smooth["coverage"], row["coverage"])

    def test_a_single_renderer_has_means_but_no_comparison(self):
        db = self.study(renderers=["ray"])
        out = self.dir / "movement.json"
        done, rows = self.measured(db, "--json", out)
        numbers = json.loads(out.read_text())
        self.assertEqual(numbers["simulated"], True)
        self.assertEqual(numbers["settings"]["cutoff_hz"], 20)
        for name, measure in numbers["measures"].items():
            self.assertEqual(list(measure["means"]), ["ray"], name)
        path = [float(row["path_length"]) for row in rows if row["shape"] == "cube"]
        mean = numbers["measures"]["path_length"]["means"]["ray"]["cube"]["mean"]
        self.assertAlmostEqual(mean, math.exp(np.log(path).mean()), delta=1e-12)
        self.assertIn("path_length", done.stdout)

    def test_differences_are_paired(self):
        db = self.study(participants=3)
        out = self.dir / "movement.json"
        done, rows = self.measured(db, "--json", out)
        numbers = json.loads(out.read_text())
        (comparison,) = numbers["measures"]["speed_mean"]["comparisons"]
        self.assertEqual((comparison["reference"], comparison["renderer"]), ("point", "ray"))
        for shape in ("sphere", "cube"):
            def logs(renderer):
                return np.array([math.log(float(row["speed_mean"])) for row in rows
                                 if (row["shape"], row["renderer"]) == (shape, renderer)])
            difference = logs("ray") - logs("point")  # one trial each, participants in order
            found = comparison["by_shape"][shape]
            self.assertEqual(found["n_pairs"], 3)
            self.assertAlmostEqual(found["mean_difference"], difference.mean(), delta=1e-12)
            self.assertAlmostEqual(found["t"], difference.mean() / (difference.std(ddof=1) / math.sqrt(3)), delta=1e-9)
        self.assertIn("Gain in time and differences of movement", done.stdout)

    def test_figures_and_page_show_the_trials(self):
        db = self.study(participants=1)
        figures, page = self.dir / "figures", self.dir / "movement.html"
        self.palpate("analyze", "--db", db, "--movement", "--figures", figures, "--report", page)
        names = ["contact", "coverage", "paths", "procedures", "speed"]
        self.assertEqual(sorted(file.name for file in figures.iterdir()), [f"movement-{name}.svg" for name in names])
        for file in figures.iterdir():
            drawing = xml.etree.ElementTree.parse(file).getroot()
            text = " ".join(drawing.itertext())
            self.assertIn("SIMULATED PARTICIPANTS", text)
            self.assertNotIn("nan", text)
            for shape in ("sphere", "cube"):
                self.assertIn(shape, text)
        text = page.read_text()
        for name in names:
            self.assertIn(f'<section id="movement-{name}"', text)
        for said in ("SIMULATED PARTICIPANTS", "low-pass filter of the path", "palpate watch --db", "was rendered again"):
            self.assertIn(said, text)
        html.parser.HTMLParser().feed(text)

    def test_exports_have_contacts_measures_and_motion(self):
        db = self.study(participants=1, sessions={"count": 2})
        exports = {"physio": ["bids"], "motion": ["bids", "--motion"], "psych": ["psych-ds"]}
        for name, args in exports.items():
            self.palpate("export", "--db", db, "--format", *args, "--contacts", "--movement", "--out", self.dir / name)
        _, trials = self.exported(db)
        _, measures = self.measured(db)
        by_point = 0
        for session in (1, 2):
            stem = f"ses-{session}"
            file = next((self.dir / "physio").glob(f"sub-*/{stem}/beh/*physio.tsv.gz"))
            columns = json.loads(file.with_name(file.name.replace(".tsv.gz", ".json")).read_text())["Columns"]
            recorded = gzip.decompress(file.read_bytes()).decode()
            rows = [dict(zip(columns, line.split("\t"), strict=True)) for line in recorded.splitlines()]
            moved = next((self.dir / "motion").glob(f"sub-*/{stem}/motion/*_motion.tsv"))
            self.assertEqual(moved.read_text(), recorded)
            self.check_description(moved, columns, len(rows))
            events = tab_separated(next(moved.parent.glob("*_events.tsv")))
            self.check_events(events, rows, [one for one in trials if one["session"] == str(session)])
            by_point += self.check_contacts(rows, {one["trial"] for one in events if one["renderer"] == "point"})
            derived = self.dir / "motion" / "derivatives" / "palpate"
            self.check_measures(next(derived.glob(f"sub-*/{stem}/beh/*_desc-movement_beh.tsv")),
                                [one for one in measures if one["session"] == str(session)])
        self.assertGreater(by_point, 100)
        self.check_psych_ds(measures)
        self.palpate("export", "--db", db, "--format", "bids", "--out", self.dir / "motion", "--force")

    def check_description(self, moved, columns, count):
        channels = tab_separated(moved.with_name(moved.name.replace("_motion", "_channels")))
        self.assertEqual([one["name"] for one in channels], columns)
        self.assertEqual([one["name"] for one in channels if one["type"] == "POS"],
                         [f"{end}_{axis}" for end in ("tip", "tail") for axis in "xyz"])
        about = json.loads(moved.with_suffix(".json").read_text())
        self.assertEqual((about["RecordingDuration"], about["POSChannelCount"], about["MotionChannelCount"]),
                         (count / RATE, 6, len(columns)))
        scans = tab_separated(moved.parents[1] / f"{moved.name.split('_task')[0]}_scans.tsv")
        self.assertEqual([one["filename"] for one in scans], [f"motion/{moved.name}"])

    def check_events(self, events, rows, trials):
        for event in events:
            row = rows[round(float(event["onset"]) * RATE)]
            self.assertEqual((row["trial"], row["tick"]), (event["trial"], "0"))
            (trial,) = [one for one in trials if one["trial"] == event["trial"]]
            self.assertEqual((event["shape"], event["renderer"]), (trial["shape"], trial["renderer"]))
            self.assertAlmostEqual(float(event["duration"]), float(trial["response_time"]), delta=1e-9)

    def check_measures(self, table, measures):
        told = json.loads(table.with_suffix(".json").read_text())
        for row in tab_separated(table):
            self.assertEqual(set(row), set(told))
            (own,) = [one for one in measures if one["trial"] == row["trial"]]
            for name in ("path_length", "coverage", "share_lateral"):
                self.assertEqual(None if row[name] == "n/a" else float(row[name]),
                                 float(own[name]) if own[name] else None)

    def check_psych_ds(self, measures):
        with next((self.dir / "psych" / "data").glob("*/*_description-movement_data.csv")).open() as opened:
            rows = list(csv.DictReader(opened))
        self.assertEqual([float(row["sparc"]) for row in rows], [float(one["sparc"]) for one in measures])
        description = json.loads((self.dir / "psych" / "dataset_description.json").read_text())
        described = {one["name"] for one in description["variableMeasured"]}
        self.assertLessEqual(set(rows[0]) | {"contact_x", "normal_z"}, described)

    def check_contacts(self, rows, points):
        """On the ideal stylus, which the depth along the normal separates from the recorded one; without friction the
        force is along the normal."""
        def column(name):
            return np.array([[float(row[f"{name}_{k}"]) for k in "xyz"] for row in touching])
        touching = [row for row in rows if row["contacts"] not in ("0", "n/a")]
        for row in rows:
            if row["contacts"] == "0":
                self.assertEqual({row[f"{name}_{k}"] for name in ("contact", "normal") for k in "xyz"}, {"n/a"})
        self.assertGreater(len(touching), 100)
        normal, force, tip = column("normal"), column("force"), column("tip")
        depth = np.array([[float(row["depth"])] for row in touching])
        self.assertLess(np.abs(norm(normal) - 1).max(), 1e-8)
        self.assertLess(np.abs((normal * force).sum(axis=1) - norm(force)).max(), 3e-6)
        touched, along = column("contact") - depth * normal, column("tail") - tip
        share = ((touched - tip) * along).sum(axis=1) / (along ** 2).sum(axis=1)
        self.assertTrue((share > -1e-6).all() and (share < 1 + 1e-6).all())
        self.assertLess(norm(touched - tip - share[:, None] * along).max(), 1e-8)
        of_points = norm(touched - tip)[[row["trial"] in points for row in touching]]
        self.assertTrue((of_points < 1e-8).all())
        return len(of_points)

    def test_without_samples_the_message_gives_the_remedy(self):
        db = self.study(samples=False)
        said = self.palpate("analyze", "--db", db, "--movement", status=2).stderr
        self.assertIn('has no servo samples; a protocol with "samples": true keeps them', said)

    def test_incompatible_options_are_refused(self):
        db = self.study(participants=1)
        for args, why in [(["--movement", "--scale", "log"], "--scale"),
                          (["--movement", "--cutoff-hz", "0"], "--cutoff-hz"),
                          (["--movement", "--cutoff-hz", "nan"], "--cutoff-hz"),
                          (["--movement", "--jobs", "0"], "--jobs"),
                          (["--movement-csv", "m.csv"], "give --movement"),
                          (["--cutoff-hz", "10"], "--movement")]:
            self.assertIn(why, self.palpate("analyze", "--db", db, *args, status=2).stderr)
        for args, why in [(["psych-ds", "--motion"], "--motion"), (["csv", "--contacts"], "--contacts"),
                          (["csv", "--movement"], "--movement"), (["bids", "--meshes", "."], "--meshes")]:
            said = self.palpate("export", "--db", db, "--format", *args, "--out", self.dir / "no", status=2).stderr
            self.assertIn(why, said)
        self.assertIn("--db FILE", self.palpate("analyze", "--csv", "x.csv", "--movement", status=2).stderr)
        taken = self.file("taken.csv", "mine")
        self.palpate("analyze", "--db", db, "--movement", "--movement-csv", taken, status=2)
        self.assertEqual(taken.read_text(), "mine")


if __name__ == "__main__":
    unittest.main()
