"""Breaks the files beside a study in many ways: each reply names the file, a place and what is expected there.

A broken file is accepted, or refused with "FILE:LINE: /place: expected ..."; never the words of a library, a crash, or
gigabytes of memory. Usage: broken_files_test.py PALPATE SOURCE_DIR. PALPATE_ROUNDS times as many mutations by hand.
"""

import copy
import json
import os
import pathlib
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import unittest

PALPATE, SOURCE = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
ROUNDS = 20 * int(os.environ.get("PALPATE_ROUNDS", "1"))  # mutations of each file
MOST_MEMORY = 3 << 30  # bytes of addresses; a build with sanitizers needs far more and is not limited
VALUES = (None, True, False, -1, 0, 1e8, 1e300, -1e300, 5e-324, 18446744073709551615, 0.5, "", "x", "NaN", "Infinity", "\\u0000",
          "\u202e", "a" * 5000, [], {}, [[]], {"a": {"b": []}}, [1, 2, 3], ["x"] * 2000, json.loads("[" * 50 + "]" * 50))


def places(value, path=()):
    """Every place within a JSON value."""
    yield path
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in children:
        yield from places(inner, path + (key,))


def at(value, path):
    for key in path:
        value = value[key]
    return value


def mutated(text, draw):
    """The text with one fault."""
    value = json.loads(text)
    if draw.random() < 0.2:
        kind = draw.randrange(5)
        cut = draw.randrange(1, len(text))
        if kind == 0:
            return text[:cut].encode()
        if kind == 1:
            return text.encode()[:cut] + bytes([draw.randrange(256)]) + text.encode()[cut + 1:]
        if kind == 2:
            return text.replace("{", '{"version": 1, ', 1).encode()  # a key twice
        if kind == 3:
            return ("[" * 100_000).encode()
        return re.sub(r"\d+", lambda m: draw.choice(("NaN", "1e999", "-0", m[0] * 30)), text, count=draw.randrange(1, 5)).encode()
    path = draw.choice([one for one in places(value) if one])
    whole = copy.deepcopy(value)
    parent, key = at(whole, path[:-1]), path[-1]
    kind = draw.randrange(4)
    if kind == 0:
        del parent[key]
    elif kind == 1 and isinstance(parent, dict):
        parent[str(key) + "x"] = parent.pop(key)
    else:
        parent[key] = draw.choice(VALUES)
    return json.dumps(whole, ensure_ascii=False).encode("utf-8", "surrogatepass")


class BrokenFiles(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.dir = base = pathlib.Path(scratch.name)
        shutil.copy(SOURCE / "protocols/quick.json", base / "quick.json")
        (base / "h.json").write_text(json.dumps([
            {"id": "H1", "text": "Faster.", "corroborated": "paired.cone.p_holm < 0.05", "refuted": "paired.cone.ci95_high < 5"}]))
        (base / "about.json").write_text(json.dumps(
            {"version": 1, "authors": [{"name": "Ada", "orcid": "0000-0002-1825-0097"}, "Bo"], "license": "CC-BY-4.0",
             "funding": [{"funder": "A Fund", "grant": "7"}], "references": ["A paper"], "doi": "10.5281/zenodo.1234"}))
        seeds = SOURCE / "tests/fuzz/corpus/study_files"
        for name in ("lab.json", "lab.timing.json", "cluster.json"):
            (base / "cluster").mkdir(exist_ok=True)
            shutil.copy(seeds / name, base / ("cluster" if name == "cluster.json" else ".") / name)
        cls.say("plan", "--gain-sd", "0.1", "--residual-sd", "0.3", "--effect", "cone=50", "--participants", "2-4",
                "--trials", "3", "--studies", "100", "--json", "plan.json")
        cls.say("register", "quick.json", "--plan", "plan.json", "--hypotheses", "h.json", "--out", "registration",
                "--studies", "20", "--participants", "2")
        cls.say("simulate", "quick.json", "--db", "study.db", "--participants", "2")
        cls.say("analyze", "--db", "study.db", "--json", "analysis.json")
        cls.say("bundle", "--db", "study.db", "--registration", "registration", "--about", "about.json", "--out", "bundle")
        (base / "quick.texts.de.json").write_text(cls.say("validate", "quick.json", "--texts").stdout)

    @classmethod
    def say(cls, *words, status=0):
        done = cls.reply(*words)
        assert done.returncode == status, f"{words}: {done.returncode}\n{done.stdout}{done.stderr}"
        return done

    @classmethod
    def reply(cls, *words):
        def limit():
            resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))

        sanitized = b"__asan_init" in pathlib.Path(PALPATE).read_bytes() or b"__tsan_init" in pathlib.Path(PALPATE).read_bytes()
        return subprocess.run([PALPATE, *map(str, words)], capture_output=True, text=True, errors="replace", cwd=cls.dir,
                              timeout=600, preexec_fn=None if sanitized else limit)

    def break_each(self, name, *words, accepted=(0, 2), rounds=ROUNDS, least=None):
        """Breaks a file and runs the command. A refusal (2) names the file and a place."""
        path = self.dir / name
        whole = path.read_bytes()
        draw = random.Random(name)
        refused = 0
        try:
            for index in range(rounds):
                path.write_bytes(mutated(whole.decode(), draw))
                done = self.reply(*words)
                said = done.stdout + done.stderr
                about = f"{name}, mutation {index}: {path.read_bytes()[:3000]!r}\n{done.returncode}\n{said[:3000]}"
                self.assertIn(done.returncode, accepted, about)
                self.assertNotIn("json.exception", said, about)
                if done.returncode == 2 or "DIFFERS" in said and name.split("/")[-1] + ":" in said:
                    refused += 1
                    self.assertRegex(said, rf"{re.escape(path.name)}(:\d+)?: (/|line \d+, column \d+: |\(file\))", about)
        finally:
            path.write_bytes(whole)
        self.assertGreater(refused, rounds // 4 if least is None else least, name)

    def test_registration(self):
        for name in ("registration.json", "form.json", "plan.json", "hypotheses.json", "protocol.json"):
            self.break_each(f"registration/{name}", "check", "registration", "--db", "study.db", accepted=(1, 2))

    def test_analysis(self):
        self.break_each("analysis.json", "check", "registration", "--db", "study.db", "--analysis", "analysis.json",
                        accepted=(0, 1, 2), rounds=3 * ROUNDS, least=ROUNDS // 4)  # most of its values are not read

    def test_plan(self):
        self.break_each("plan.json", "plan", "--gain-sd", "0.1", "--residual-sd", "0.3", "--effect", "cone=50",
                        "--participants", "2-4", "--trials", "3", "--studies", "100", "--reuse", "plan.json")

    def test_hypotheses(self):
        shutil.rmtree(self.dir / "out", ignore_errors=True)
        self.break_each("h.json", "register", "quick.json", "--plan", "plan.json", "--hypotheses", "h.json", "--out", "out",
                        "--studies", "20", "--participants", "2", "--force")

    def test_terms_of_use(self):
        self.break_each("about.json", "export", "--db", "study.db", "--format", "psych-ds", "--about", "about.json", "--out",
                        "data", "--force")

    def test_translation(self):
        self.break_each("quick.texts.de.json", "validate", "quick.json", "--language", "de")

    def test_bundle(self):
        for name in ("check.json", "about.json", "data/record.json"):
            self.break_each(f"bundle/{name}", "bundle", "--verify", "bundle", accepted=(1,))

    def test_cluster(self):
        self.break_each("cluster/cluster.json", "cluster", "status", "cluster", accepted=(0, 1, 2))

    def test_calibration(self):
        self.break_each("lab.json", "run", "quick.json", "--db", "none.db", "--participant", "P1", "--device", "falcon2",
                        "--serial", "A1", "--serial", "B2", "--calibration", "lab.json", accepted=(1, 2))

    def test_delays(self):
        self.break_each("lab.timing.json", "validate", "quick.json", "--calibration", "lab.json")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
