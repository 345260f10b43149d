"""Holds the READMEs' links, the files, folders and pictures that they name, and their form against the repository.

Usage: links_test.py
"""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from markdown import CONTRIBUTING, NOT_RUN, PAGES, READMES, ROOMS, ROOT, RUN, SHELL, Page, broken_links, cells, codes

KINDS = ("Tutorial: ", "How to ", "Reference: ", "Explanation: ")  # of documentation, kept apart
LARGEST_PICTURE = 300_000  # bytes


class Links(unittest.TestCase):
    def test_every_link_leads_somewhere(self):
        faults, followed = broken_links(ROOT, READMES + [CONTRIBUTING])
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
        of_no_participants = {"soft-stability.svg", "contact-patches.svg"}
        for path in (ROOT / ".github" / "images").glob("*.svg"):
            if path.name not in of_no_participants:
                self.assertIn("SIMULATED", path.read_text(), path.name)


class Form(unittest.TestCase):
    def test_the_first_page_is_short(self):
        self.assertLess(len(PAGES["README.md"].text.splitlines()), 145)  # with a whole study

    def test_tutorials_how_to_reference_and_explanation_are_kept_apart(self):
        for name, page in PAGES.items():
            if name in ("README.md", CONTRIBUTING):
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
        rooms = {code.rstrip("/") for row in cells(PAGES["README.md"].section("Source tree")) for code in codes(row[0])}
        folders = {p.name for p in ROOT.iterdir() if p.is_dir() and not p.name.startswith(".")} - {"results"}
        self.assertEqual(rooms, folders)

    def test_rooms_within_are_those_that_are_there(self):
        for row in cells(PAGES["README.md"].section("Source tree")):
            room = codes(row[0])[0].rstrip("/")
            for code in codes(row[1]):
                if code.endswith("/"):
                    self.assertTrue((ROOT / room / code).is_dir(), f"{room}/{code}")


if __name__ == "__main__":
    unittest.main()
