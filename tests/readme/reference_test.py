"""Holds the reference parts of the READMEs against what they describe: tables and columns of the database and of the
exports, fields of files, keys, settings, faults, messages, devices, and the path from main() to a force.

Usage: reference_test.py PALPATE
"""

import csv
import json
import pathlib
import re
import sqlite3
import sys
import tempfile
import unittest

from markdown import PAGES, ROOT, cells, codes
from program import output_of


class Dictionary(unittest.TestCase):
    """Every table and column of the database and of the exports is in data/README.md, and nothing else is."""

    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.folder = folder = pathlib.Path(scratch.name)
        protocol = {"version": 1, "name": "one", "renderers": ["point", "ray"], "repetitions": 2, "samples": True,
                    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03}],
                    "response": {"keys": {"1": "ball"}, "time_out_s": 5}}
        (folder / "one.json").write_text(json.dumps(protocol))
        output_of("simulate", "one.json", "--db", "one.db", "--participants", 3, folder=folder)
        output_of("export", "--db", "one.db", "--format", "csv", "--out", "trials.csv", "--codebook", "codebook.csv",
                  folder=folder)
        with open(folder / "codebook.csv", newline="") as file:
            cls.codebook = list(csv.DictReader(file))
        cls.page = PAGES["data/README.md"]

    def documented(self, heading):
        """{column: its unit} of the exports' tables."""
        out = {}
        for row in cells(self.page.section(heading)):
            for column in codes(row[0]):
                self.assertNotIn(column, out, f"{heading}: twice")
                out[column] = row[1]
        return out

    def test_tables_of_the_database(self):
        made_when_needed = []
        for name in ("frames", "unmaskings"):
            source = (ROOT / f"data/store/{name}.cpp").read_text()
            table = source[source.index("constexpr LateTable"):]
            made_when_needed.append("".join(re.findall(r'"(.*)"', table[table.index("CREATE") - 1:table.index("};")])))
        with sqlite3.connect(self.folder / "one.db") as connection:
            for sql in made_when_needed:  # which most databases do not have
                connection.execute(sql)
            there = {table: {row[1] for row in connection.execute(f"PRAGMA table_info({table})")}
                     for (table,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        tables = [words for level, words in self.page.headings() if words.startswith("table ")]
        self.assertEqual({codes(words)[0] for words in tables}, set(there))
        for words in tables:
            named = [column for row in cells(self.page.section(words)) for column in codes(row[0])]
            self.assertEqual(len(named), len(set(named)), words)
            self.assertEqual(set(named), there[codes(words)[0]], words)

    def test_columns_of_trials_and_attempts_with_their_units(self):
        for table in ("trials", "attempts"):
            units = {row["column"]: row["unit"] for row in self.codebook if row["table"] == table}
            documented = self.documented(table)
            self.assertEqual(set(documented), set(units) | {"elapsed"}, table)
            for column, unit in units.items():
                if table == "trials":
                    self.assertEqual(documented[column], unit, column)

    def test_the_header_of_the_file(self):
        with open(self.folder / "trials.csv") as file:
            header = file.readline().strip().split(",")
        self.assertEqual(set(header), set(self.documented("trials")) - {"elapsed"})

    def units_of(self, protocol):
        """{column: its unit} of a study's trials, as its codebook has them."""
        name = protocol.split(".")[0]
        output_of("simulate", ROOT / "protocols" / protocol, "--db", f"{name}.db", "--participants", 1, folder=self.folder)
        output_of("export", "--db", f"{name}.db", "--format", "csv", "--out", f"{name}.csv", "--codebook",
                  f"{name}-codebook.csv", folder=self.folder)
        with open(self.folder / f"{name}-codebook.csv", newline="") as file:
            return {row["column"]: row["unit"] for row in csv.DictReader(file) if row["table"] == "trials"}

    def test_columns_of_tasks_with_their_units(self):
        units = self.units_of("stiffness-2afc.json")
        documented = self.documented("trials of tasks")
        self.assertEqual(set(documented), set(units) - set(self.documented("trials")))
        for varied in ("level", "standard_level"):  # the unit of what this protocol varies
            self.assertEqual((documented.pop(varied), units[varied]), ("", "N/m"))
        self.assertEqual(documented, {column: units[column] for column in documented})

    def test_columns_of_reaching_with_their_units(self):
        units = self.units_of("force-field.json")
        documented = self.documented("trials of reaching")
        others = set(self.documented("trials")) | set(self.documented("trials of tasks"))
        self.assertEqual(set(documented), set(units) - others)
        self.assertEqual(documented, {column: units[column] for column in documented})

    def test_columns_of_pages(self):
        output_of("simulate", ROOT / "protocols/roughness-magnitude.json", "--db", "pages.db", "--participants", 1,
                  folder=self.folder)
        output_of("export", "--db", "pages.db", "--format", "csv", "--out", "rough.csv", "--pages", folder=self.folder)
        header = (self.folder / "rough_pages.csv").read_text().split("\n", 1)[0].split(",")
        self.assertEqual(set(header), set(self.documented("pages")))

    def test_columns_of_samples_with_their_units(self):
        output_of("export", "--db", "one.db", "--format", "bids", "--contacts", "--out", "bids", folder=self.folder)
        about = json.loads(next(self.folder.glob("bids/sub-*/ses-1/beh/*_physio.json")).read_text())
        documented = {column: unit for column, unit in self.documented("samples").items()
                      if not column.startswith("body_")}  # where something moves: moving_stimuli_test.py
        self.assertEqual({"trial", *documented}, set(about["Columns"]))
        for column, unit in documented.items():
            self.assertEqual(about[column].get("Units", ""), unit, column)
        output_of("export", "--db", "one.db", "--format", "psych-ds", "--contacts", "--out", "psychds", folder=self.folder)
        table = next(self.folder.glob("psychds/data/*/*description-haptic_data.csv"))
        header = table.read_text().split("\n", 1)[0].split(",")
        self.assertEqual(set(header), {"participant_id", "session", "trial", "time", *documented})

    def test_fault_bits(self):
        named = {row["value"]: row["meaning"].split(":")[0] for row in self.codebook
                 if row["table"] == "trials" and row["column"] == "faults" and row["value"]}
        documented = {row[0]: codes(row[1])[0] for row in cells(self.page.section("fault bits"))}
        self.assertEqual(documented, named)


class Reference(unittest.TestCase):
    def test_columns_of_render(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            tool = '"tool": {"segments": [{"from_m": [0, 0, 0], "to_m": [0, 0, 0.1]}]}, '
            for name, keys in (("plain", ""), ("tool", tool)):
                (folder / f"{name}.json").write_text(f'{{{keys}"objects": [{{"shape": "cube", "edge_m": 0.05}}]}}')
            (folder / "t.csv").write_text("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n0,0,0,1,0,0,2\n")
            headers = {}
            for name in ("plain", "tool"):
                output_of("render", "--scene", f"{name}.json", "--renderer", "ray", "--trajectory", "t.csv", "--out",
                          f"{name}.csv", folder=folder)
                headers[name] = (folder / f"{name}.csv").read_text().split("\n")[0].split(",")
        section = PAGES["rendering/README.md"].section("Reference: columns of palpate render")
        told = [column for row in cells(section) for column in codes(row[0])]
        self.assertEqual(told, headers["tool"])
        of_tools = {"segment", "ideal_side_x", "ideal_side_y", "ideal_side_z"}
        self.assertEqual([column for column in told if column not in of_tools], headers["plain"])

    def test_columns_of_movement(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            protocol = {"version": 1, "name": "one", "renderers": ["point"], "repetitions": 1, "samples": True,
                        "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03}],
                        "response": {"keys": {"1": "ball"}, "time_out_s": 5}}
            (folder / "one.json").write_text(json.dumps(protocol))
            output_of("simulate", "one.json", "--db", "one.db", "--participants", 1, folder=folder)
            output_of("analyze", "--db", "one.db", "--movement", "--movement-csv", "m.csv", folder=folder)
            header = (folder / "m.csv").read_text().split("\n")[0].split(",")
        section = PAGES["analysis/README.md"].section("Reference: columns of movement.csv")
        self.assertEqual([column for row in cells(section) for column in codes(row[0])], header)

    def test_fields_of_analysis_json_and_figures(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            output_of("simulate", ROOT / "protocols/quick.json", "--db", "q.db", "--participants", 3,
                      "--participant-version", 2, folder=folder)  # some time out
            output_of("analyze", "--db", "q.db", "--json", "a.json", "--figures", "figures", folder=folder)
            analysis = json.loads((folder / "a.json").read_text())
            figures = {path.name for path in (folder / "figures").iterdir()}
        page = PAGES["analysis/README.md"]
        named = set(codes(page.section("Reference: numbers in analysis.json"))) | {"status", "reason"}
        levels = {"point", "ray", "sphere", "cone", "cylinder", "cube", "renderer", "shape", "renderer:shape"}

        def names(value):
            if isinstance(value, dict):
                for key, below in value.items():
                    yield key
                    yield from names(below)
            elif isinstance(value, list):
                for below in value:
                    yield from names(below)

        fields = {name for name in names(analysis) if name not in levels and not re.match(r"\(|rendererray|shapec", name)}
        self.assertEqual(fields - named, set(), "fields that analysis/README.md does not name")
        top = {row_codes for row in cells(page.section("Reference: numbers in analysis.json"))
               for row_codes in codes(row[0]) if not row[0].startswith("...")}
        self.assertEqual(top, set(analysis))
        drawn = {code for row in cells(page.section("Reference: figures")) for code in codes(row[0])}
        self.assertLessEqual(figures, drawn)
        self.assertLessEqual(drawn - figures, {"servo.svg"}, "figures that are not drawn")

    def test_keys_of_protocols_and_scenes(self):
        schema = json.loads((ROOT / "protocols/protocol.schema.json").read_text())
        page = PAGES["protocols/README.md"]
        rows = cells(page.section("Reference: keys of a protocol"))
        self.assertEqual({code for row in rows for code in codes(row[0])}, set(schema["properties"]) - {"$schema"})
        within = {codes(row[0])[0]: " ".join(row[1:]) for row in rows}
        for key, value in schema["properties"].items():
            for inner in value.get("properties", {}):
                self.assertIn(f"`{inner}`", within[key], f"{key} has a key {inner}")
        # What is said of defaults is what the parser takes: a protocol that says it is the same one.
        scene = json.loads((ROOT / "protocols/scene.schema.json").read_text())["$defs"]["object"]
        keys = set(scene["properties"]).union(*(case["then"]["properties"] for case in scene["allOf"]))
        named = set(codes(page.section("Reference: objects of a scene")))
        self.assertEqual(keys - named, set())

    def test_settings_of_the_simulated_participant(self):
        def value_of(text):
            return json.loads(text) if re.fullmatch(r"[-0-9.e]+|true|false", text) else text

        frozen = {version: json.loads((ROOT / f"runner/participants/simulated_v{version}.json").read_text())
                  for version in (1, 2, 3)}
        page = PAGES["runner/participants/README.md"]
        group, documented = "", {}
        for row in cells(page.section("Reference: the model")):
            group = codes(row[0])[0] if codes(row[0]) else group
            names, values = codes(row[1]), [value_of(value) for value in row[2].split(", ")]
            self.assertEqual(len(names), len(values), row)
            documented.setdefault(group, {}).update(zip(names, values))
        self.assertEqual(documented, {key: value for key, value in frozen[3].items() if key not in ("version", "note")})
        rows = cells(page.section("Reference: the versions"))
        differ = {f"{name}/{key}" for name, keys in frozen[3].items() if isinstance(keys, dict)
                  for key, value in keys.items()
                  if isinstance(value, (str, bool)) and frozen[2].get(name, {}).get(key) != value}
        self.assertLessEqual(differ, {codes(row[0])[0] for row in rows})
        for row in rows:
            name, key = codes(row[0])[0].split("/")
            for version, value in enumerate(row[1:], 1):
                self.assertEqual(frozen[version].get(name, {}).get(key, value_of(value)), value_of(value), row)

    def test_faults_of_meshes(self):
        given = set()
        for path in (ROOT / "stimuli").rglob("*.cpp"):
            given |= set(re.findall(r'faults_?\.add\("([a-z ]{3,})",', path.read_text()))
        told = {kind for row in cells(PAGES["stimuli/README.md"].section("Reference: what is refused"))
                for kind in re.findall(r"\*([a-z ]+)\*", row[0])}
        # "byte" and "end" are places. Separate pieces of a file become parts: only who builds a ConvexMesh directly is told of them.
        self.assertEqual(told, given - {"byte ", "end", "separate pieces"})

    def test_messages_and_buttons_that_are_quoted(self):
        sources = "".join(path.read_text() for path in sorted((ROOT / "runner").rglob("*.cpp")) +
                          sorted((ROOT / "runner").rglob("*.h")) + sorted((ROOT / "data").rglob("*.cpp")))
        sources = re.sub(r'"\s*\n\s*"', "", sources)  # literals that continue
        page = PAGES["runner/README.md"]
        quoted = [phrase for section in ("How to deal with trouble", "Reference: what each screen shows")
                  for row in cells(page.section(section)) for cell in row for phrase in re.findall(r"\*([^*]+)\*", cell)]
        self.assertGreater(len(quoted), 20)
        self.assertEqual([phrase for phrase in quoted if phrase not in sources], [])

    def test_devices(self):
        listed = set(re.findall(r"^([a-z0-9]+): ", output_of("devices"), re.M))
        told = {codes(row[0])[0] for row in cells(PAGES["runner/README.md"].section("Reference: devices"))}
        self.assertEqual(told, listed)


class Hypotheses(unittest.TestCase):
    """Short names of numbers and points of a check are those of the program."""

    def test_short_names(self):
        defined = re.findall(r'\{"([^"]+)",\s*"([^"]+)"\}', (ROOT / "analysis/report/hypotheses.h").read_text())
        told = [tuple(codes(cell)[0] for cell in row)
                for row in cells(PAGES["analysis/README.md"].section("Reference: names in hypotheses"))]
        self.assertEqual(told, defined)

    def test_points_of_a_check(self):
        source = (ROOT / "runner/registration/deviations.cpp").read_text()
        made = set(re.findall(r'CheckPoint out\{\s*"([a-z]+)"', source)) | set(re.findall(r'left_out\(\s*"([a-z]+)"', source))
        told = {code for row in cells(PAGES["analysis/README.md"].section("Reference: points of a check"))
                for code in codes(row[0])}
        self.assertEqual(told, made)


class Path(unittest.TestCase):
    """From main() to a force: each file exists and calls what the table says of the next."""

    @staticmethod
    def seen_by(name):
        """The text of a file, and of all headers of ours that it sees."""
        text = (ROOT / name).read_text()
        seen, waiting = {}, [text]
        while waiting:
            for header in re.findall(r'#include "([^"]+)"', waiting.pop()):
                if header not in seen and (ROOT / header).is_file():
                    seen[header] = (ROOT / header).read_text()
                    waiting.append(seen[header])
        return text, "".join(seen.values())

    def test_each_file_uses_the_next(self):
        rows = cells(PAGES["runner/README.md"].section("Explanation: from main() to a force"))
        files = [codes(row[1])[0] for row in rows]
        self.assertEqual([row[0] for row in rows], [str(i + 1) for i in range(len(rows))])
        self.assertEqual(files[0], "runner/main.cpp")
        self.assertTrue(files[-1].startswith("rendering/"))
        for name in files:
            self.assertTrue((ROOT / name).is_file(), name)
        for row, name, following in zip(rows, files, files[1:]):
            called = re.compile(rf"\b{codes(row[3])[0]}\b")
            text, headers = self.seen_by(name)
            said = f"{name} > {called.pattern} > {following}"
            self.assertTrue(called.search(text), f"{said}: the file does not name it")
            self.assertTrue(called.search(headers), f"{said}: no header that the file sees declares it")
            self.assertTrue(called.search("".join(self.seen_by(following))), f"{said}: the next has nothing to do with it")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
