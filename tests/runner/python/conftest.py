"""The program and its protocols, from the environment: PALPATE, PROTOCOLS, and PYTHONPATH at the module."""

import os
import pathlib
import subprocess

import pytest


@pytest.fixture(scope="session")
def protocols():
    return pathlib.Path(os.environ["PROTOCOLS"]).resolve()


@pytest.fixture(scope="session")
def program():
    """Runs the program in a folder; its standard output and error."""
    file = pathlib.Path(os.environ["PALPATE"]).resolve()

    def run(folder, *arguments, status=0):
        done = subprocess.run([file, *map(str, arguments)], cwd=folder, capture_output=True, text=True, timeout=600)
        assert done.returncode == status, f"{arguments}\n{done.stdout}{done.stderr}"
        return done.stdout + done.stderr

    return run
