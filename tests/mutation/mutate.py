#!/usr/bin/env python3
"""Mutation testing: would the tests notice one wrong token?

Changes one token of a room's sources at a time (a "mutant"), at places that a seed draws, builds what
depends on it, and runs the room's tests until one fails. A mutant that no test notices has survived: it
is either equivalent (no input can tell it from the original; say why in equivalent.txt) or a hole in the
tests. The score is the share of the non-equivalent mutants that were killed, with its 95 % interval
(Wilson). Run by hand, not in CI.

Works on a copy of the sources with a build folder of its own (.build/mutation), so the tree that you edit
is never touched; a mutant is undone in the copy whatever happens, Ctrl-C included. Tests run in a
sandbox in which all but that copy is read-only and no other process can be reached, where the kernel
allows it: a mutant may delete files or send signals.

What counts as a mutant: a relational, arithmetic, logical or bit operator exchanged; an integer one more
or less; another number halved or doubled; true and false exchanged; `!` or unary minus dropped; a
statement of one line deleted; two arguments, or two names such as min and max, exchanged; a string
changed. Not in comments, preprocessor lines, raw strings, assertions, `using`, `operator` and option
declarations. Places are drawn line by line, so a line with many tokens counts once; lines on which only
text could change (messages, labels) count a quarter.

Built as the release is, so that ccache knows the objects, but for the file with the mutant: there the standard
library's assertions are on, as in CI's sanitizer build, so that reading past an end is noticed.
What counts as killed: a test that passes without the mutant fails, twice, or does not end within ten
times its usual time and five minutes. Tests of the clock (label "clock") are left out, as are those
that fail or use the processor longer than --longest seconds without a mutant. With --with-commands what survives the
unit tests also meets the room's command tests and the golden traces.

Examples:
  tests/mutation/mutate.py rendering --seed 1 --count 30
  tests/mutation/mutate.py rendering --seed 1 --count 60    # resumes: the first 30 are kept
  tests/mutation/mutate.py rendering --seed 1 --again       # survivors only, after a test was written
  tests/mutation/mutate.py data protocols --seed 2 --count 25 --with-commands
  tests/mutation/mutate.py runner/devices/falcon --seed 3 --programs falcon_test   # a folder of a room
  tests/mutation/mutate.py analysis --seed 1 --list         # what would be tried
  tests/mutation/mutate.py --report                         # scores of all that was run
"""
import argparse
import json
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

sys.dont_write_bytecode = True  # the tree stays as it is
from killers import CommandTest, Program, digest
from mutants import ROOMS, applied, draw, equivalents, key, locate
from tree_copy import REPOSITORY, Copy, Failed

# Folders of tests that try a room: its own, and these.
TESTED_ALSO_IN = {"rendering": ["regressions"]}
COMMAND_TESTS_ALSO_IN = {"rendering": ["golden"], "stimuli": ["golden"]}


class Run:
    def __init__(self, folder, options):
        self.folder, self.options = folder, options
        self.room = folder.split("/")[0]
        self.copy = Copy(options.tree, options.jobs, options.together)
        self.copy.update()
        self.copy.configure(self.room)
        self.results = options.tree / "results" / f"{folder.replace('/', '-')}-{options.seed}.jsonl"
        self.results.parent.mkdir(parents=True, exist_ok=True)

    def test_programs(self):
        for folder in [self.room] + TESTED_ALSO_IN.get(self.room, []):
            for lists in sorted((self.copy.source / "tests" / folder).rglob("CMakeLists.txt")):
                inside = lists.parent.relative_to(self.copy.source / "tests" / self.room) \
                    if folder == self.room else pathlib.Path()
                for name, arguments in re.findall(r"palpate_test\((\w+)([^)]*)", lists.read_text()):
                    if "CLOCK" not in arguments.split() and name in (self.options.programs or [name]):
                        tested = [inside / word for word in arguments.split() if word.endswith(".cpp")]
                        yield name, lists.parent.relative_to(self.copy.source), tested

    def command_tests(self):
        done = subprocess.run(["ctest", "--test-dir", self.copy.build, "--show-only=json-v1"], capture_output=True, text=True)
        folders = [str(self.copy.source / "tests" / f) + "/" for f in [self.room] + COMMAND_TESTS_ALSO_IN.get(self.room, [])]
        for test in json.loads(done.stdout)["tests"]:
            labels = next((p["value"] for p in test["properties"] if p["name"] == "LABELS"), [])
            command = test.get("command", [])
            if len(command) > 2 and "clock" not in labels and any(str(command[1]).startswith(f) for f in folders):
                if str(self.copy.build / "runner/palpate") in command:
                    yield CommandTest(self.copy, test["name"])

    def prepare(self):
        """Builds and measures everything without a mutant."""
        programs = list(self.test_programs())
        self.targets = [name for name, *_ in programs]
        every = self.targets + (["palpate"] if self.options.with_commands else [])
        print(f"{self.folder}: building {' '.join(every)} ...", flush=True)
        good, output = self.copy.make(every)
        if not good:
            raise Failed("Without a mutant the copy cannot be built:\n" + output[-3000:])
        self.users, self.users_in_program = self.copy.users(self.targets), self.copy.users(["palpate"])
        self.programs = [Program(self.copy, name, self.copy.build / folder / name, tested)
                         for name, folder, tested in programs]
        known = self.results.parent / "times.json"  # of programs that have not changed since
        measured = json.loads(known.read_text()) if known.exists() else {}
        for program in self.programs:
            name = f"{program.name} {program.hash} {self.options.longest}"
            if name in measured:
                program.out, program.times = measured[name]
            else:
                program.measure(self.options.longest)
                measured[name] = program.out, program.times
                known.write_text(json.dumps(measured))
        self.commands = []
        if self.options.with_commands:
            self.palpate = digest(self.copy.build / "runner/palpate")
            self.commands = [t for t in self.command_tests() if t.measure(10 * self.options.longest)]
            self.commands.sort(key=lambda t: t.seconds)
        self.objects = {str(path.relative_to(self.copy.build)): digest(path) for path in self.copy.build.rglob("*.o")}

    def killer(self, mutant):
        inside = pathlib.Path(*pathlib.Path(mutant["file"]).parts[1:])
        # Others do not contain the mutant.
        programs = [p for p in self.programs if digest(p.path) != p.hash]
        programs.sort(key=lambda p: (-p.likelihood(inside), p.seconds))
        for quick in (True, False):
            for program in programs:
                if name := program.killer(quick):
                    return name
        return None

    def killer_by_command(self):
        """Of what the test programs do not notice; the program itself is built for these alone."""
        if not self.copy.make(["palpate"])[0] or digest(self.copy.build / "runner/palpate") == self.palpate:
            return None
        return next(filter(None, (command.killer() for command in self.commands)), None)

    def attempt(self, mutant):
        """(result, by which test or why)"""
        asserting = "#define _GLIBCXX_ASSERTIONS\n" if mutant["file"].endswith(".cpp") else ""
        file = str(locate(self.copy.source, mutant)[0].relative_to(self.copy.source))
        tested, used = self.users.get(file, ()), self.users_in_program.get(file, ()) if self.commands else ()
        if not tested and not used:
            return "survived", "not in a test program"
        if min(len(objects) for objects in (tested, used) if objects) > self.options.most_objects:
            return "skipped", f"{len(tested or used)} objects depend on it"
        with applied(self.copy.source, mutant, asserting):
            if 0 < len(tested) <= self.options.most_objects:
                if not self.copy.make(self.targets)[0]:
                    return "not compiled", ""
                if killer := self.killer(mutant):
                    return "killed", killer
            if 0 < len(used) <= self.options.most_objects and (killer := self.killer_by_command()):
                return "killed", killer
        objects = {*tested, *used}
        if len(objects) > 2 * self.options.most_objects:
            return "survived", ""
        with applied(self.copy.source, mutant):
            self.copy.make(sorted(objects))
            if all(digest(self.copy.build / name) == self.objects.get(name) for name in objects):
                return "equivalent", "the same machine code"
        return "survived", ""

    def read(self):
        return [json.loads(line) for line in self.results.read_text().splitlines()] if self.results.exists() else []

    def write(self, done):
        partial = self.results.with_suffix(".part")
        partial.write_text("".join(json.dumps(m) + "\n" for m in done))
        partial.replace(self.results)

    def one(self, mutant, known):
        begin = time.monotonic()
        mutant = dict(mutant)
        if key(mutant) in known:
            result = "equivalent", known[key(mutant)]
        elif locate(self.copy.source, mutant) is None:
            result = "gone", "the line is no longer there"
        else:
            result = self.attempt(mutant)
        mutant.update(result=result[0], by=result[1], seconds=round(time.monotonic() - begin, 1))
        show(mutant)
        return mutant

    def all(self):
        known, done = equivalents(), self.read()
        if self.options.again:
            self.prepare()
            for index, mutant in enumerate(done):
                if mutant["result"] in ("survived", "skipped"):
                    done[index] = self.one(mutant, known)
                    self.write(done)
            return
        tried = {key(m) + (m["line"],) for m in done}
        todo = []
        counted = sum(m["result"] not in ("not compiled", "skipped") for m in done)
        self.prepare()
        for mutant in draw(self.copy.source, self.folder, self.options.seed):
            if counted >= self.options.count:
                break
            if key(mutant) + (mutant["line"],) in tried:
                continue
            done.append(self.one(mutant, known))
            counted += done[-1]["result"] not in ("not compiled", "skipped")
            self.write(done)


def show(mutant):
    print(f"{mutant.get('result', 'mutant'):>12}  {mutant['file']}:{mutant['line']}"
          f"{'  by ' + mutant['by'] if mutant.get('by') else ''}\n              - {mutant['before'].strip()}"
          f"\n              + {mutant['after'].strip()}", flush=True)


def wilson(good, of, z=1.96):
    if of == 0:
        return 0.0, 1.0
    share, width = good / of, z * z / of
    half = z * math.sqrt(share * (1 - share) / of + width / (4 * of))
    return (share + width / 2 - half) / (1 + width), (share + width / 2 + half) / (1 + width)


def report(path, survivors):
    known = equivalents()
    mutants = [json.loads(line) for line in path.read_text().splitlines()]
    results = ["equivalent" if key(m) in known else m["result"] for m in mutants]
    killed, survived = results.count("killed"), results.count("survived")
    low, high = wilson(killed, killed + survived)
    print(f"{path.stem:24} killed {killed} of {killed + survived} ({100 * killed / max(1, killed + survived):.0f} %, "
          f"95 % interval {100 * low:.0f} to {100 * high:.0f} %); equivalent {results.count('equivalent')}, "
          f"not compiled {results.count('not compiled')}, skipped {results.count('skipped')}")
    for mutant, result in zip(mutants, results):
        if survivors and result == "survived":
            show(mutant)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", metavar="ROOM", help="room, or a folder inside one: " + ", ".join(ROOMS))
    parser.add_argument("--seed", type=int, default=1, help="which places are drawn (1)")
    parser.add_argument("--count", type=int, default=20, help="mutants that compile, in all of this seed (20)")
    parser.add_argument("--again", action="store_true", help="try this seed's survivors once more, e.g. with a new test")
    parser.add_argument("--list", action="store_true", help="show the mutants, try none")
    parser.add_argument("--report", action="store_true", help="scores and survivors of what was run so far")
    parser.add_argument("--with-commands", action="store_true", help="also the command tests and golden traces")
    parser.add_argument("--programs", nargs="+", metavar="NAME",
                        help="only these test programs, e.g. falcon_test (all in the room's folder of tests)")
    parser.add_argument("--longest", type=float, default=3, metavar="SECONDS",
                        help="leave out slower tests (3); ten times as much for a command's")
    parser.add_argument("--most-objects", type=int, default=60, metavar="N",
                        help="skip a mutant, e.g. of a header, that more objects depend on (60)")
    parser.add_argument("--together", action="store_true",
                        help="compile the room's sources as the release does: sooner ready, slower by the mutant")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="compilers at once (all processors)")
    parser.add_argument("--tree", type=pathlib.Path, default=REPOSITORY / ".build/mutation",
                        help="folder of the copy and the results (.build/mutation); one run at a time in each")
    options = parser.parse_args()
    options.tree = options.tree.resolve()
    options.folders = [folder.strip("/") for folder in options.folders]
    for folder in options.folders:
        if folder.split("/")[0] not in ROOMS or not (REPOSITORY / folder).is_dir():
            parser.error(f"{folder} is no room or folder inside one: {', '.join(ROOMS)}")
    if not options.folders and not options.report:
        parser.error("name a room: " + ", ".join(ROOMS))
    return options


def report_all(options):
    results = options.tree / "results"
    for path in sorted(results.glob("*.jsonl")) if results.is_dir() else ():
        if not options.folders or any(path.stem.startswith(f.replace("/", "-") + "-") for f in options.folders):
            report(path, True)


def main():
    options = arguments()
    if options.report:
        return report_all(options)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # as Ctrl-C: `finally` undoes the mutant
    for folder in options.folders:
        if options.list:
            for _, mutant in zip(range(options.count), draw(REPOSITORY, folder, options.seed)):
                show(mutant)
            continue
        run = Run(folder, options)
        run.all()
        report(run.results, False)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("\nInterrupted; what was done is kept, the same command resumes.")
    except Failed as failure:
        sys.exit(str(failure))
