"""Exports from outside: the same numbers in every format, what the formats demand, complete or not at all.

Usage: datasets_test.py PALPATE PROTOCOLS
"""

import pathlib
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from contents import Contents  # noqa: E402, F401
from folders import Folders, WithdrawalAndMerge  # noqa: E402, F401
from rules import Rules  # noqa: E402, F401
from tasks import Tasks  # noqa: E402, F401

if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
