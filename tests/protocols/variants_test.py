"""Spoils every key of the good files: the program refuses what the published schema refuses, at the same place.

Usage: variants_test.py PALPATE SOURCE_DIR
"""

import concurrent.futures
import copy
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from schema_test import load_schemas, load_version_2, read

SOURCE = pathlib.Path(sys.argv.pop()) if len(sys.argv) > 2 else None
PALPATE = sys.argv.pop() if len(sys.argv) > 1 else None
GOOD = SOURCE / "tests" / "protocols" / "good" if SOURCE else None
STRANGE = "no_such_key"  # in each file, so that it is refused before meshes and schedules are built
# Names that the file chooses, not the schema.
OWN_NAMES = re.compile(r"/(keys|box|joystick|texts|feedback_sounds)$")


def escaped(key):
    return str(key).replace("~", "~0").replace("/", "~1")


def nodes(value, pointer="", path=()):
    """(pointer, path, value) of every value in a document."""
    yield pointer, path, value
    members = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, member in members:
        yield from nodes(member, f"{pointer}/{escaped(key)}", path + (key,))


def changed(document, path, value=None, delete=False):
    out = copy.deepcopy(document)
    at = out
    for key in path[:-1]:
        at = at[key]
    if delete:
        del at[path[-1]]
    else:
        at[path[-1]] = value
    return out


def variants(document):
    """(change, pointer, document): another type, too small or large, an unknown key, a missing key."""
    for pointer, path, value in nodes(document):
        if path and isinstance(value, dict) and not OWN_NAMES.search(pointer):
            yield "unknown key", f"{pointer}/{STRANGE}", changed(document, path + (STRANGE,), 1)
        if not path:
            continue
        if isinstance(path[-1], str):
            yield "left out", pointer, changed(document, path, delete=True)
        # One of these, to save time: each kind of value occurs in many places.
        others = [one for one in ("?!", 0.5, [], {}, True) if not isinstance(value, type(one)) or one == "?!"]
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            others += [-1e12, 1e12]
        other = others[sum(map(ord, pointer)) % len(others)]
        yield f"{other!r} at", pointer, changed(document, path, other)


class Variants(unittest.TestCase):
    def setUp(self):
        keep = tempfile.TemporaryDirectory()
        self.addCleanup(keep.cleanup)
        self.folder = pathlib.Path(keep.name)
        for file in GOOD.iterdir():
            if file.suffix != ".json":
                (self.folder / file.name).symlink_to(file)

    def refused(self, number, document):
        """{pointer: message}"""
        file = self.folder / f"{number}.json"
        document[STRANGE] = 1
        file.write_text(json.dumps(document))
        done = subprocess.run([PALPATE, "validate", file], capture_output=True, text=True)
        file.unlink()
        self.assertEqual(done.returncode, 2, done.stderr)
        found = {}
        for line in done.stderr.splitlines():
            match = re.search(rf"{number}\.json:\d+: (/.*?): (.*)", line)
            if match:
                found[match[1]] = match[2]
        self.assertIn(f"/{STRANGE}", found, done.stderr)
        del found[f"/{STRANGE}"]
        return found

    def check(self, name, validator):
        document = read(GOOD / name)
        self.assertTrue(validator.is_valid(document))
        self.assertEqual(self.refused("good", copy.deepcopy(document)), {})
        every = [(what, pointer, one, not validator.is_valid(one)) for what, pointer, one in variants(document)]
        self.assertGreater(sum(bad for *_, bad in every), 200)

        def look(index):
            what, pointer, one, bad = every[index]
            found = self.refused(index, one)
            # The schema leaves the keys of a procedure to protocols/README.md.
            bad = bad or (what == "unknown key" and "/procedure" in pointer)
            if not bad:  # if it is refused, then because of its relation to other values
                said = found.get(pointer, "")
                if said.startswith(("missing", "unknown key")) and "/procedure/" not in pointer:
                    return f"{what} {pointer}: the schema allows it, but: {said}"
                return None
            # Reported at the place itself, within it, beside it, or for the whole that contains it.
            above = pointer.rsplit("/", 1)[0]
            if any(place.startswith(above + "/") or (above + "/").startswith(place + "/") for place in found):
                return None
            return f"{what} {pointer}: told at {sorted(found)}" if found else f"{what} {pointer}: taken"

        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            wrong = [line for line in pool.map(look, range(len(every))) if line]
        self.assertFalse(wrong, f"of {len(every)} variants:\n" + "\n".join(wrong))

    def test_of_version_1(self):
        self.check("everything.json", load_schemas(SOURCE / "protocols")[1])

    def test_of_version_2(self):
        _, protocol = load_schemas(SOURCE / "protocols")
        self.check("everything-v2.json", load_version_2(SOURCE / "protocols", protocol.schema))


if __name__ == "__main__":
    unittest.main()
