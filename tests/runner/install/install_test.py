"""What is installed beside the program, held against the program: completion, man pages, rules and limits.

Usage: install_test.py PALPATE SOURCES
"""

import gzip
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PALPATE, SOURCES = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
INSTALL = SOURCES / "runner" / "install"
# Types WORDS, the last of which is being completed, and prints what bash would offer.
TYPED = r"""
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
_palpate
((${#COMPREPLY[@]} == 0)) || printf '%s\n' "${COMPREPLY[@]}"
"""


def help_of(*command):
    done = subprocess.run([PALPATE, *command, "--help"], capture_output=True, text=True, check=True, timeout=60)
    return done.stdout


def commands():
    return re.findall(r"^  ([a-z]+)  ", help_of(), re.M)


def options(command):
    return set(re.findall(r"^  (?:-h \[ )?(--[a-z-]+)", help_of(command), re.M))


class Completion(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        for name in ("quick.json", "my study.db", "notes.txt"):
            (self.folder / name).touch()
        (self.folder / "meshes").mkdir()

    def offered(self, *words):
        done = subprocess.run(["bash", "--norc", "-c", TYPED, "bash", INSTALL / "completion.bash", PALPATE, *words],
                              capture_output=True, text=True, cwd=self.folder, timeout=60)
        self.assertEqual((done.returncode, done.stderr), (0, ""), words)
        return done.stdout.splitlines()

    def test_commands_are_completed_from_a_prefix(self):
        self.assertGreaterEqual(len(commands()), 15)
        self.assertEqual(set(self.offered("")), set(commands()) | {"--help", "--version"})
        self.assertEqual(self.offered("an"), ["analyze"])
        self.assertEqual(sorted(self.offered("re")), ["register", "render", "replay"])
        self.assertEqual(self.offered("xyz"), [])

    def test_every_option_of_every_command(self):
        for command in commands():
            self.assertIn("--help", options(command))
            self.assertEqual(set(self.offered(command, "-")), options(command), command)
        self.assertEqual(self.offered("run", "quick.json", "--full"), ["--full-screen"])
        self.assertIn("--csv", self.offered("analyze", ""))

    def test_values_of_an_option_are_completed(self):
        self.assertEqual(self.offered("run", "quick.json", "--hand", ""), ["left", "right"])
        self.assertEqual(self.offered("run", "quick.json", "--device", "fal"), ["falcon", "falcon2"])
        self.assertEqual(self.offered("render", "--renderer", ""), ["point", "ray"])
        self.assertEqual(self.offered("export", "--format", ""), ["csv", "bids", "psych-ds"])
        self.assertEqual(self.offered("schedule", "quick.json", "--format", ""), ["table", "csv", "json"])
        self.assertEqual(self.offered("plan", "--test", "=", "m"), ["model"])
        self.assertEqual(self.offered("plan", "--goal", "="), ["all", "any"])
        self.assertEqual(self.offered("simulate", "quick.json", "--participants", ""), [])

    def test_completed_values_are_accepted_by_the_program(self):
        for command, option, wrong in (("render", "--renderer", ["--scene", "x", "--trajectory", "x", "--out", "y"]),
                                       ("export", "--format", ["--db", "x", "--out", "y"]),
                                       ("export", "--times", ["--db", "x", "--format", "csv", "--out", "y"]),
                                       ("schedule", "--format", ["quick.json", "--participant", "1"])):
            refused = subprocess.run([PALPATE, command, *wrong, option, "nonsense"], capture_output=True, text=True,
                                     cwd=self.folder, timeout=60)
            self.assertEqual(refused.returncode, 2)
            for word in self.offered(command, option, ""):
                self.assertIn(word, help_of(command) + refused.stderr, f"{command} {option}")

    def test_files_are_completed_where_expected(self):
        self.assertEqual(sorted(self.offered("validate", "")), ["meshes", "quick.json"])
        self.assertEqual(sorted(self.offered("analyze", "--db", "")), ["meshes", "my study.db", "notes.txt", "quick.json"])
        self.assertEqual(self.offered("analyze", "--db", "=", "my"), ["my study.db"])
        self.assertEqual(sorted(self.offered("merge", "--out", "all.db", "m")), ["meshes", "my study.db"])

    def test_unknown_commands_offer_nothing(self):
        self.assertEqual(self.offered("conjure", ""), [])


class ManPages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.scratch.cleanup)
        subprocess.run(["bash", INSTALL / "man_pages.sh", PALPATE, "0.1.0", cls.scratch.name], check=True, timeout=300)
        cls.pages = {path.name.removesuffix(".1.gz"): gzip.decompress(path.read_bytes()).decode().replace("\\-", "-")
                     for path in pathlib.Path(cls.scratch.name).iterdir()}

    def test_every_command_has_a_page_with_its_options_and_examples(self):
        self.assertEqual(set(self.pages), {"palpate"} | {f"palpate-{command}" for command in commands()})
        for command in commands():
            page = self.pages[f"palpate-{command}"]
            for section in ("NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXAMPLES", '"SEE ALSO"'):
                self.assertIn(f".SH {section}\n", page, command)
            for option in options(command):
                # A separate paragraph, followed by a description.
                self.assertRegex(page, rf"\.TP\n.*\\fB{option}\\fR[^\n]*\n[^.\n]", f"{command} {option}")
                self.assertNotRegex(page, rf"\\fB{option}\\fR[^\n]*\n[^.\n][^\n]*\n\.IP", f"{command} {option}: torn")
            examples = help_of(command).split("Examples:\n")[1]
            for line in filter(None, examples.splitlines()):
                self.assertIn("\\&" + line.replace("\\", "\\e"), page)

    def test_the_usage_is_complete(self):
        self.assertIn("--force", self.pages["palpate-render"].split(".SH DESCRIPTION")[0])
        self.assertIn("--explain", self.pages["palpate-render"].split(".SH DESCRIPTION")[0])

    def test_the_first_page_names_all_others(self):
        for command in commands():
            self.assertIn(f".BR palpate-{command} (1)", self.pages["palpate"])
            self.assertIn(f"\n{command}\n", self.pages["palpate"])

    def test_man_reads_the_pages_without_warnings(self):
        for name in self.pages:
            path = pathlib.Path(self.scratch.name) / f"{name}.1.gz"
            done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", path], capture_output=True,
                                  text=True, timeout=60, env=os.environ | {"MANROFFSEQ": "", "LC_ALL": "C.UTF-8"})
            self.assertEqual((done.returncode, done.stderr), (0, ""), name)


class Rights(unittest.TestCase):
    def test_the_rules_name_the_devices_and_give_no_general_access(self):
        rules = (INSTALL / "60-palpate.rules").read_text()
        parameters = (SOURCES / "runner/devices/falcon/parameters.h").read_text()
        vendor, product = re.search(r"kVendor = 0x(\w+), kProduct = 0x(\w+);", parameters).groups()
        self.assertIn(f'ATTR{{idVendor}}=="{vendor.lower()}", ATTR{{idProduct}}=="{product.lower()}"', rules)
        self.assertIn('TAG+="uaccess"', rules)
        self.assertIn('ATTR{idVendor}=="1451"', rules)  # Force Dimension
        modes = re.findall(r'MODE="(\d+)"', rules)
        self.assertEqual(len(modes), 3)
        self.assertTrue(all(mode[-1] == "0" for mode in modes), modes)

    def test_the_limits_are_enough_for_the_servo_and_its_guard(self):
        limits = dict(re.findall(r"^@palpate - (\w+) (\w+)$", (INSTALL / "limits.conf").read_text(), re.M))
        self.assertEqual(limits["memlock"], "unlimited")
        asked = [int(re.search(r"\bint priority = (\d+);", (SOURCES / "runner" / header).read_text()).group(1))
                 for header in ("servo/realtime.h", "safety/guarded_device.h")]
        self.assertEqual(int(limits["rtprio"]), max(asked))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
