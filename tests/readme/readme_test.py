"""Holds what the READMEs say against the house: links, files, pictures, commands and their options, shown commands
run, tables of columns and fields, the path from main() to a force.

Usage: readme_test.py PALPATE [unittest's arguments]
       readme_test.py --list     the blocks that are not run, each with its reason
"""

import csv
import json
import pathlib
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest

from markdown import READMES, ROOMS, ROOT, Page, broken_links, cells, codes

PALPATE = None
PAGES = {name: Page(name) for name in READMES}
KINDS = ("Tutorial: ", "How to ", "Reference: ", "Explanation: ")  # of documentation, kept apart
SHELL = ("sh", "bash", "shell", "console")
RUN, NOT_RUN = "sh test", "sh not tested: "
LARGEST_PICTURE = 300_000


def run(*arguments, folder=None):
    return subprocess.run([PALPATE, *map(str, arguments)], capture_output=True, text=True, cwd=folder, timeout=600)


def output_of(*arguments, folder=None):
    done = run(*arguments, folder=folder)
    assert done.returncode == 0, f"palpate {arguments}: {done.stderr}"
    return done.stdout


class Links(unittest.TestCase):
    def test_every_link_leads_somewhere(self):
        faults, followed = broken_links(ROOT, READMES)
        self.assertEqual(faults, [])
        self.assertGreater(followed, 40)

    def test_they_do_in_the_installed_package_too(self):
        with tempfile.TemporaryDirectory() as prefix:
            subprocess.run(["bash", ROOT / "runner/install/documentation.sh", prefix], check=True)
            faults, followed = broken_links(pathlib.Path(prefix) / "share/doc/palpate")
        self.assertEqual(faults, [], "name what is not installed as code, without a link")
        self.assertEqual(followed, broken_links(ROOT, READMES)[1])

    def test_a_broken_link_is_noticed(self):
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "README.md"
            page.write_text("# One two\n[a](#one-two) [b](README.md#one-two) [c](https://example.org/x) `[d](none)`\n")
            self.assertEqual(broken_links(page.parent), ([], 3))
            page.write_text("# One\n[a](#two) [b](none.md) ![c](../x.png) [d](http:/e) [e](README.md#One)\n")
            self.assertEqual(len(broken_links(page.parent)[0]), 5)

    def test_every_folder_that_is_named_exists(self):
        faults = []
        for page in PAGES.values():
            text = page.prose + "\n".join(block.text for block in page.blocks if block.language() in SHELL)
            for path in re.findall(rf"(?<![\w./-])((?:{'|'.join(ROOMS)}|\.ci|\.github)/[\w./*-]*[\w/*])", text):
                if not any(ROOT.glob(path.rstrip("/"))):
                    faults.append(f"{page.name}: {path} does not exist")
            # A file without a folder is one of the page's own room.
            for line, code in page.spans():
                if re.fullmatch(r"[a-z_0-9-]+\.(h|cpp|sql|py)", code) and not any(page.path.parent.rglob(code)) \
                        and not any(ROOT.glob(f"*/**/{code}")):
                    faults.append(f"{page.name}:{line}: no file {code}")
        self.assertEqual(faults, [])


class Pictures(unittest.TestCase):
    def test_every_picture_is_shown_small_and_made_by_a_command(self):
        shown = {(page.path.parent / target).resolve() for page in PAGES.values()
                 for _, _, target in page.links() if ".github/images/" in target}
        there = set((ROOT / ".github" / "images").iterdir())
        self.assertEqual({p.name for p in shown}, {p.name for p in there})
        for picture in there:
            self.assertLess(picture.stat().st_size, LARGEST_PICTURE, picture.name)

    def test_the_command_that_makes_it_stands_beside_it(self):
        made = subprocess.run([sys.executable, ROOT / "tests/readme/make_images.py", "--list"], capture_output=True,
                              text=True, check=True).stdout.split()
        for page in PAGES.values():
            for match in re.finditer(r"!\[[^\]]*\]\((?:\.\./)*\.github/images/([\w-]+)\.\w+\)", page.text):
                self.assertIn(match.group(1), made)
                before = page.text[:match.start()]
                commands = re.findall(r"make_images\.py \S+ ([^\n>]*)", before)
                self.assertTrue(any(match.group(1) in names.split() for names in commands),
                                f"{page.name}: no command makes {match.group(1)}")

    def test_a_picture_says_in_words_what_it_shows(self):
        for page in PAGES.values():
            for line, text, target in page.links():
                if ".github/images/" in target:
                    self.assertGreater(len(text), 40, f"{page.name}:{line}")

    def test_figures_of_simulated_data_say_so(self):
        for path in (ROOT / ".github" / "images").glob("*.svg"):
            self.assertIn("SIMULATED", path.read_text(), path.name)


class Form(unittest.TestCase):
    def test_the_first_page_is_short(self):
        self.assertLess(len(PAGES["README.md"].text.splitlines()), 125)

    def test_tutorials_how_to_reference_and_explanation_are_kept_apart(self):
        for name, page in PAGES.items():
            if name == "README.md":
                continue
            kinds = [words for level, words in page.headings() if level == 2]
            self.assertGreater(len(kinds), 2, name)
            order = []
            for words in kinds:
                kind = [i for i, kind in enumerate(KINDS) if words.startswith(kind)]
                self.assertEqual(len(kind), 1, f"{name}: is '{words}' tutorial, how-to, reference or explanation?")
                order += kind
            self.assertEqual(order, sorted(order), f"{name}: {kinds}")

    def test_every_shell_block_is_run_or_says_why_not(self):
        for page in PAGES.values():
            for block in page.blocks:
                if block.language() in SHELL or not block.language():
                    place = f"{page.name}:{block.line}"
                    self.assertTrue(block.words in (RUN, "console") or len(block.words) > len(NOT_RUN) + 10
                                    and block.words.startswith(NOT_RUN), f"{place}: '{block.words}'")

    def test_code_stands_on_one_line(self):
        for page in PAGES.values():
            for number, line in enumerate(page.prose.splitlines(), 1):
                self.assertEqual(line.count("`") % 2, 0, f"{page.name}:{number}: {line}")

    def test_python_that_is_shown_is_python(self):
        for page in PAGES.values():
            for block in page.blocks:
                if block.language() == "python":
                    compile(block.text, f"{page.name}:{block.line}", "exec")

    def test_no_command_hides_in_an_indented_block(self):
        for page in PAGES.values():
            self.assertEqual(re.findall(r"^(?:    |\t)\s*(?:\$ |palpate |bash |python3 |cmake )", page.prose, re.M), [], page.name)

    def test_first_page_names_every_room(self):
        rooms = {code.rstrip("/") for row in cells(PAGES["README.md"].section("The house")) for code in codes(row[0])}
        folders = {p.name for p in ROOT.iterdir() if p.is_dir() and not p.name.startswith(".")} - {"results"}
        self.assertEqual(rooms, folders)

    def test_rooms_within_are_those_that_are_there(self):
        for row in cells(PAGES["README.md"].section("The house")):
            room = codes(row[0])[0].rstrip("/")
            for code in codes(row[1]):
                if code.endswith("/"):
                    self.assertTrue((ROOT / room / code).is_dir(), f"{room}/{code}")


class Commands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        words = re.findall(r"^  ([a-z]+)  ", output_of("--help"), re.M)
        cls.options = {word: set(re.findall(r"^  (?:-h \[ )?(--[a-z-]+)", output_of(word, "--help"), re.M))
                       for word in words}

    def named(self):
        """(place, line of a shell or code span) wherever palpate may be named."""
        for page in PAGES.values():
            for block in page.blocks:
                if block.language() in SHELL:
                    for line in block.text.replace("\\\n", " ").splitlines():
                        yield f"{page.name}:{block.line}", line.removeprefix("$ ")
            for line, code in page.spans():
                yield f"{page.name}:{line}", code

    def test_every_command_that_is_named_exists_and_has_the_options(self):
        faults, seen = [], set()
        for place, line in self.named():
            for call in re.split(r"\||&&|;|#", line):
                match = re.match(r"\s*(?:man palpate-|(?:[\w./]*/)?palpate )(\S*)(.*)$", call)
                if not match or match.group(1).startswith(("--", "COMMAND")):
                    continue
                command, rest = match.groups()
                if command not in self.options:
                    faults.append(f"{place}: palpate has no command {command}")
                    continue
                seen.add(command)
                faults += [f"{place}: palpate {command} has no option {option}"
                           for option in re.findall(r"(?<![\w-])--[a-z-]+", rest) if option not in self.options[command]]
        self.assertEqual(faults, [])
        self.assertEqual(seen, set(self.options), "commands that no README names")

    def test_every_option_that_stands_alone_is_one_of_some_command(self):
        known = set().union(*self.options.values()) | {"--version"}
        faults = [f"{place}: {code}" for place, code in self.named()
                  if code.startswith("--") and code.split()[0].split("=")[0] not in known]
        self.assertEqual([fault for fault in faults if not fault.startswith("tests/")], [])


class Shown(unittest.TestCase):
    """Runs what is shown, one scratch folder a page, blocks in order."""

    def scratch(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        shutil.copytree(ROOT / "protocols", path / "protocols", ignore=shutil.ignore_patterns("*.cpp", "*.h"))
        (path / "bin").mkdir()
        (path / "bin" / "palpate").symlink_to(PALPATE)
        return path

    def shell(self, text, folder):
        environment = {"PATH": f"{folder}/bin:/usr/local/bin:/usr/bin:/bin", "HOME": str(folder), "LC_ALL": "C.UTF-8"}
        return subprocess.run(["bash", "-euo", "pipefail", "-c", text], cwd=folder, env=environment, text=True,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=1200)

    def check_console(self, block, folder, place):
        calls = re.split(r"^\$ ", block.text, flags=re.M)[1:]
        self.assertTrue(calls, f"{place}: no '$ '")
        for call in calls:
            command, _, expected = call.partition("\n")
            done = self.shell(command, folder)
            self.assertEqual(done.returncode, 0, f"{place}: {command}\n{done.stdout}")
            lines = [line.rstrip() for line in done.stdout.splitlines()]
            at = 0
            for line in filter(lambda line: line.strip() not in ("", "..."), expected.splitlines()):
                self.assertIn(line.rstrip(), lines[at:], f"{place}: {command} does not show this line there")
                at = lines.index(line.rstrip(), at) + 1

    def check_page(self, name):
        folder, ran = self.scratch(), 0
        for block in PAGES[name].blocks:
            place = f"{name}:{block.line}"
            if block.words == RUN:
                done = self.shell(block.text, folder)
                self.assertEqual(done.returncode, 0, f"{place}:\n{block.text}\n{done.stdout}")
            elif block.language() == "console":
                self.check_console(block, folder, place)
            else:
                continue
            ran += 1
        return ran

    def test_a_command_that_fails_and_a_line_that_is_not_there_are_noticed(self):
        folder = self.scratch()
        self.assertNotEqual(self.shell("palpate validate protocols/none.json\ntrue", folder).returncode, 0)
        page = Page("README.md")
        page.blocks[0].text = "$ palpate --version\npalpate 99\n"
        with self.assertRaises(AssertionError):
            self.check_console(page.blocks[0], folder, "here")


for _name in READMES:
    def _check(self, name=_name):
        ran = self.check_page(name)
        if name not in ("README.md", "tests/README.md"):
            self.assertGreater(ran, 0, "nothing is run")
    setattr(Shown, "test_what_is_shown_works_" + re.sub(r"\W", "_", _name.removesuffix(".md")), _check)


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
        with sqlite3.connect(self.folder / "one.db") as connection:
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

    def test_columns_of_samples_with_their_units(self):
        output_of("export", "--db", "one.db", "--format", "bids", "--out", "bids", folder=self.folder)
        about = json.loads(next(self.folder.glob("bids/sub-*/ses-1/beh/*_physio.json")).read_text())
        documented = self.documented("samples")
        self.assertEqual({"trial", *documented}, set(about["Columns"]))
        for column, unit in documented.items():
            self.assertEqual(about[column].get("Units", ""), unit, column)
        output_of("export", "--db", "one.db", "--format", "psych-ds", "--out", "psychds", folder=self.folder)
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
            (folder / "s.json").write_text('{"objects": [{"shape": "cube", "edge_m": 0.05}]}')
            (folder / "t.csv").write_text("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n0,0,0,1,0,0,2\n")
            output_of("render", "--scene", "s.json", "--renderer", "ray", "--trajectory", "t.csv", "--out", "o.csv",
                      folder=folder)
            header = (folder / "o.csv").read_text().split("\n")[0].split(",")
        section = PAGES["rendering/README.md"].section("Reference: columns of palpate render")
        self.assertEqual([column for row in cells(section) for column in codes(row[0])], header)

    def test_fields_of_analysis_json_and_figures(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            output_of("simulate", ROOT / "protocols/quick.json", "--db", "q.db", "--participants", 3, folder=folder)
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
        settings = json.loads((ROOT / "runner/participants/simulated_v2.json").read_text())
        group, documented = "", {}
        for row in cells(PAGES["runner/participants/README.md"].section("Reference: the model")):
            group = codes(row[0])[0] if codes(row[0]) else group
            names, values = codes(row[1]), [float(value) for value in row[2].split(", ")]
            self.assertEqual(len(names), len(values), row)
            documented.setdefault(group, {}).update(zip(names, values))
        self.assertEqual(documented, {key: value for key, value in settings.items() if key not in ("version", "note")})

    def test_faults_of_meshes(self):
        given = set()
        for path in (ROOT / "stimuli").glob("*.cpp"):
            given |= set(re.findall(r'faults_?\.add\("([a-z ]{3,})",', path.read_text()))
        told = {kind for row in cells(PAGES["stimuli/README.md"].section("Reference: what is refused"))
                for kind in re.findall(r"\*([a-z ]+)\*", row[0])}
        self.assertEqual(told, given - {"byte "})

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


def list_not_run():
    for page in PAGES.values():
        for block in page.blocks:
            if block.words.startswith(NOT_RUN):
                print(f"{page.name}:{block.line}: {block.words[len(NOT_RUN):]}")
                print("    " + block.text.strip().replace("\n", "\n    "))


if __name__ == "__main__":
    if sys.argv[1:] == ["--list"]:
        list_not_run()
        sys.exit()
    PALPATE = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
