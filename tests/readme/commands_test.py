"""Runs the commands that the READMEs show, and holds every command and option that they name against the program.

Usage: commands_test.py PALPATE
       commands_test.py --list     the blocks that are not run, each with its reason
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from markdown import NOT_RUN, PAGES, READMES, ROOT, RUN, SHELL, Page
from program import PALPATE, output_of


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


def list_not_run():
    for page in PAGES.values():
        for block in page.blocks:
            if block.words.startswith(NOT_RUN):
                print(f"{page.name}:{block.line}: {block.words[len(NOT_RUN):]}")
                print("    " + block.text.strip().replace("\n", "\n    "))


if __name__ == "__main__":
    if sys.argv[1:] == ["--list"]:
        list_not_run()
    else:
        unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
