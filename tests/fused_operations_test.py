"""The program has the same bits on processors with and without fused multiply-add: it uses none but where the source
asks for one. A compiler may make them in spite of -ffp-contract=off.

Usage: fused_operations_test.py PALPATE
"""

import re
import subprocess
import sys
import unittest

# Exact products by std::fma, in stimuli/exact_side.cpp and rendering/surface_patch.cpp.
ASKED_FOR = ("side_of", "rendering5meets")


class FusedOperations(unittest.TestCase):
    def test_there_are_none_that_the_source_does_not_ask_for(self):
        shown = subprocess.run(["objdump", "--disassemble", "--no-show-raw-insn", PALPATE], capture_output=True, text=True,
                               check=True).stdout
        function, functions, found = "", 0, set()
        for line in shown.splitlines():
            if (title := re.match(r"[0-9a-f]+ <(.*)>:$", line)) is not None:
                function, functions = title[1], functions + 1
            elif re.search(r"\tvfn?m(add|sub)", line) is not None and not any(name in function for name in ASKED_FOR):
                found.add(function)
        self.assertGreater(functions, 1000, "the program's own functions were not looked at")
        self.assertEqual(found, set())


if __name__ == "__main__":
    PALPATE = sys.argv.pop(1)
    unittest.main()
