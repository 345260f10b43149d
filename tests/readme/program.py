"""The program that the tests of the READMEs run: the first argument of the test."""

import pathlib
import subprocess
import sys

PALPATE = str(pathlib.Path(sys.argv[1]).resolve()) if len(sys.argv) > 1 else None


def output_of(*arguments, folder=None):
    done = subprocess.run([PALPATE, *map(str, arguments)], capture_output=True, text=True, cwd=folder, timeout=600)
    assert done.returncode == 0, f"palpate {arguments}: {done.stderr}"
    return done.stdout
