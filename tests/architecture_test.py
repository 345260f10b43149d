"""Holds every #include of ours against who may include whom; finds cycles between files."""

import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
ROOMS = ["stimuli", "rendering", "protocols", "data", "analysis", "runner"]
MAY_INCLUDE = {
    "stimuli": set(),
    "rendering": {"stimuli"},
    # Stimuli are scene objects in orientations: their types, rotations and generator live there.
    "protocols": {"stimuli"},
    "data": set(),
    "analysis": {"data", "protocols", "stimuli"},
    "runner": {"stimuli", "rendering", "protocols", "data"},
}
# The commands and main() may include everything.
EVERYTHING = ("runner/commands/", "runner/main.cpp")
# rendering/ is pure: no device, clock, thread, file or global.
IMPURE = re.compile(r"<(chrono|thread|mutex|atomic|fstream|iostream|filesystem|cstdio|ctime|random)>")


def includes(path):
    return re.findall(r'^\s*#\s*include\s+["<]([^">]+)[">]', path.read_text(), re.M)


def sources():
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                yield room, path.relative_to(ROOT).as_posix(), path


class Architecture(unittest.TestCase):
    def test_includes_point_one_way(self):
        faults = []
        for room, name, path in sources():
            for include in includes(path):
                if ".." in include:
                    faults.append(f"{name}: includes {include}")
                target = include.split("/")[0]
                if target not in ROOMS or target == room or name.startswith(EVERYTHING):
                    continue
                if target not in MAY_INCLUDE[room]:
                    faults.append(f"{name}: {room}/ may not include {include}")
        self.assertEqual(faults, [])

    def test_rooms_form_no_cycle(self):
        order = []
        while len(order) < len(ROOMS):
            ready = [r for r in ROOMS if r not in order and MAY_INCLUDE[r] <= set(order)]
            self.assertTrue(ready, "the rooms include each other in a circle")
            order += ready

    def test_headers_form_no_cycle(self):
        graph = {name: [i for i in includes(path) if (ROOT / i).is_file()] for _, name, path in sources()}
        state = {}

        def visit(name, trail):
            if state.get(name) == "done":
                return
            self.assertNotIn(name, trail, " > ".join(trail + [name]))
            for target in graph.get(name, []):
                visit(target, trail + [name])
            state[name] = "done"

        for name in graph:
            visit(name, [])

    def test_own_headers_are_included_from_the_root(self):
        faults = [f"{name}: {include}" for _, name, path in sources() for include in includes(path)
                  if (path.parent / include).is_file() and not (ROOT / include).is_file()]
        self.assertEqual(faults, [])

    def test_rendering_is_pure(self):
        faults = [name for room, name, path in sources() if room == "rendering" and IMPURE.search(path.read_text())]
        self.assertEqual(faults, [])

    def test_top_level_holds_nothing_else(self):
        allowed = set(ROOMS) | {"tests", "CMakeLists.txt", "CMakePresets.json", "README.md", "LICENSE", "results"}
        found = {p.name for p in ROOT.iterdir() if not p.name.startswith(".")}
        self.assertEqual(found - allowed, set())


if __name__ == "__main__":
    sys.exit(unittest.main())
