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
import contextlib
import hashlib
import json
import math
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
REPOSITORY = HERE.parent.parent
ROOMS = ("stimuli", "protocols", "data", "rendering", "runner", "analysis")
# Folders of tests that try a room: its own, and these.
TESTED_ALSO_IN = {"rendering": ["regressions"]}
COMMAND_TESTS_ALSO_IN = {"rendering": ["golden"], "stimuli": ["golden"]}

# ---- Mutants -----------------------------------------------------------------------------------

TOKEN = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)
      | (?P<raw>R"(?P<mark>\w*)\(.*?\)(?P=mark)")
      | (?P<preprocessor>^[ ]*\#(?:\\\n|[^\n])*)
      | (?P<string>"(?:\\.|[^"\\\n])*")
      | (?P<character>'(?:\\.|[^'\\\n])+')
      | (?P<number>(?:0[xXbB][\da-fA-F']+|(?:\d[\d']*)?\.?\d[\d']*\.?(?:[eE][+-]?\d+)?)[uUlLfF]*)
      | (?P<word>[A-Za-z_]\w*)
      | (?P<operator><=>|<<=|>>=|->|::|\+\+|--|<<|>>|[<>=!+\-*/%&|^]=|&&|\|\||.)""",
    re.VERBOSE | re.DOTALL | re.MULTILINE)
SPACED = {"<": ("<=", ">="), ">": (">=", "<="), "<=": ("<", ">="), ">=": (">", "<="), "==": ("!=",),
          "!=": ("==",), "&&": ("||",), "||": ("&&",), "+": ("-",), "-": ("+",), "*": ("/",),
          "/": ("*",), "%": ("*",), "|": ("&",), "&": ("|",), "+=": ("-=",), "-=": ("+=",),
          "*=": ("/=",), "/=": ("*=",), "|=": ("&=",), "&=": ("|=",)}
PAIRS = (("true", "false"), ("min", "max"), ("front", "back"), ("begin", "end"), ("sin", "cos"),
         ("floor", "ceil"), ("first", "second"), ("any_of", "all_of"), ("lower_bound", "upper_bound"),
         ("break", "continue"), ("tip", "tail"), ("left", "right"), ("width", "height"))
OTHER = {a: b for pair in PAIRS for a, b in (pair, pair[::-1])}
NOT_IN_STATEMENTS = re.compile(r"\b(static_assert|assert|using|operator|add_options|friend|requires|throw_with_nested)\b")
DELETABLE = re.compile(r"^\s*(?:[\w.:\[\]>*()-]+ (?:=|\+=|-=|\*=|/=|\|=|&=) .*|[\w.:\[\]>-]+\(.*\)|(?:\+\+|--)[\w.\[\]>-]+"
                       r"|break|continue|return|if \([^;]*\) (?:return|break|continue))\s*;\s*$")
ARGUMENTS = re.compile(r"\b(\w+)\(([\w.\[\]>-]+), ([\w.\[\]>-]+)\)")
SYMMETRIC = {"min", "max", "hypot", "dot", "if", "while", "for", "switch", "return", "swap", "distance", "min_element"}


def tokens(text):
    return [(m.lastgroup if m.lastgroup != "mark" else "raw", m.start(), m.group())
            for m in TOKEN.finditer(text) if not m.group().isspace()]


def number_mutants(literal):
    body = literal.rstrip("uUlLfF")
    if literal[:2].lower() in ("0x", "0b"):
        return ()
    if re.fullmatch(r"\d[\d']*", body):
        value, suffix = int(body.replace("'", "")), literal[len(body):]
        return (f"{value + 1}{suffix}",) if value == 0 else (f"{value + 1}{suffix}", f"{value - 1}{suffix}")
    value = float(body.replace("'", ""))
    return ("1.0",) if value == 0 else (f"({literal} * 2)", f"({literal} * 0.5)")


def excluded_spans(text, all_tokens):
    """Statements that hold an assertion, a declaration of options or an alias; template heads."""
    spans, begin, words, depth = [], 0, False, 0
    for kind, at, token in all_tokens:
        if kind in ("comment", "preprocessor", "raw"):
            continue
        depth += (token in ("(", "[")) - (token in (")", "]"))
        if token in (";", "{", "}") and depth <= 0:
            if words:
                spans.append((begin, at + 1))
            begin, words, depth = at + 1, False, 0
        elif kind == "word" and NOT_IN_STATEMENTS.fullmatch(token):
            words = True
    spans += [m.span() for m in re.finditer(r"^\s*template <[^\n]*", text, re.MULTILINE)]
    return spans


def sites(text):
    """[(line index, [(column, old, new, is_text)])]: what may be changed, a line a row."""
    every = tokens(text)
    code = [t for t in every if t[0] not in ("comment", "preprocessor")]
    spans = excluded_spans(text, every)
    starts = [0] + [m.end() for m in re.finditer("\n", text)]
    lines = text.split("\n")
    rows = {}

    def place(at):
        low, high = 0, len(starts)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if starts[middle] <= at else (low, middle)
        return low, at - starts[low]

    def add(at, old, new, is_text=False):
        if old == new or any(a <= at < b for a, b in spans):
            return
        row, column = place(at)
        rows.setdefault(row, []).append((column, old, new, is_text))

    in_line = {}
    for index, (kind, at, token) in enumerate(code):
        row, column = place(at)
        in_line.setdefault(row, []).append(index)
        before, after = text[at - 1:at], text[at + len(token):at + len(token) + 1]
        neighbours = [code[i][0] for i in (index - 1, index + 1) if 0 <= i < len(code)]
        last = code[index - 1][2] if index else ""
        declared = token not in ("true", "false", "break", "continue") and last != "return" and \
            re.match(r"[\w>&*]", last[-1:])
        if kind == "operator":
            spaced = before in " \n" and after in " \n"
            if token in SPACED and spaced and "string" not in neighbours:
                for new in SPACED[token]:
                    add(at, token, new)
            elif token == "!" or (token == "-" and after.strip() and before in " ([{" and
                                  (last in "([{,?:=<>&|+*/" or last in ("return", "&&", "||", "==", "<="))):
                add(at, token, "")
            elif token in ("++", "--") and "for (" not in lines[row]:
                add(at, token, "--" if token == "++" else "++")
        elif kind == "number" and after != ">":
            for new in number_mutants(token):
                add(at, token, new)
        elif kind == "word" and token in OTHER and not declared:
            add(at, token, OTHER[token])
        elif kind == "string" and last != "extern":
            add(at, token, '""' if len(token) > 2 else '"?"', True)
    for row, members in in_line.items():
        line, first = lines[row], members[0]
        end_before = code[first - 1][2] if first else ";"
        plain = all(code[i][0] != "raw" for i in members)
        if plain and end_before in (";", "{", "}", ")", ":", "else") and DELETABLE.match(line) and \
                line.count("(") == line.count(")"):
            column = len(line) - len(line.lstrip())
            add(starts[row] + column, line.strip(), ";")
        for match in ARGUMENTS.finditer(line) if plain else ():
            name, one, two = match.groups()
            if name not in SYMMETRIC and one != two:
                add(starts[row] + match.start(), match.group(), f"{name}({two}, {one})")
    return sorted(rows.items())


def sources(tree, folder):
    return sorted(p for ending in ("*.cpp", "*.h") for p in (tree / folder).rglob(ending))


def draw(tree, folder, seed):
    """All mutants of a folder that this seed would try, in its order."""
    chance = random.Random(f"{folder} {seed}")
    rows = []
    for path in sources(tree, folder):
        text = path.read_text()
        lines = text.split("\n")
        for row, options in sites(text):
            rows.append((str(path.relative_to(tree)), row, lines[row], options))
    chance.shuffle(rows)
    for name, row, line, options in rows:
        if all(is_text for *_, is_text in options) and chance.random() >= 0.25:
            continue
        column, old, new, is_text = chance.choice(options)
        assert line[column:column + len(old)] == old, (name, row, old)
        yield {"file": name, "line": row + 1, "before": line, "text": is_text,
               "after": line[:column] + new + line[column + len(old):]}


def locate(tree, mutant):
    """(path, line index) of a mutant whose file may have moved or changed since, or None."""
    path = tree / mutant["file"]
    if not path.exists():
        same = [p for room in ROOMS for p in sources(tree, room) if p.name == path.name]
        if len(same) != 1:
            return None
        path = same[0]
    lines = path.read_text().split("\n")
    rows = [i for i, line in enumerate(lines) if line == mutant["before"]]
    return (path, min(rows, key=lambda i: abs(i + 1 - mutant["line"]))) if rows else None


@contextlib.contextmanager
def applied(tree, mutant, before=""):
    """The mutant stands in the copy, with `before` put before its file."""
    path, row = locate(tree, mutant)
    original = path.read_bytes()
    lines = original.decode().split("\n")
    lines[row] = mutant["after"]
    try:
        path.write_text(before + "\n".join(lines))
        yield
    finally:
        path.write_bytes(original)


def equivalents():
    """equivalent.txt: blocks of `file`, `- before`, `+ after` and the reason, parted by empty lines."""
    known = {}
    path = HERE / "equivalent.txt"
    for block in path.read_text().split("\n\n") if path.exists() else ():
        lines = [line for line in block.strip().split("\n") if not line.startswith("#")]
        if len(lines) >= 4 and lines[1].startswith("- ") and lines[2].startswith("+ "):
            known[(pathlib.Path(lines[0]).name, lines[1][2:].strip(), lines[2][2:].strip())] = " ".join(lines[3:])
        elif any(lines):
            sys.exit(f"{path}: a block must be file, '- before', '+ after', reason; not:\n{block}")
    return known


def key(mutant):
    return pathlib.Path(mutant["file"]).name, mutant["before"].strip(), mutant["after"].strip()


# ---- The copy, its build and its tests ---------------------------------------------------------

# The room's libraries compiled file by file, without --together: a mutant then costs one object, not twelve
# sources. Other rooms' objects are ccache's.
APART = """function(palpate_apart folder)
  get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "STATIC_LIBRARY")
      set_target_properties(${target} PROPERTIES UNITY_BUILD OFF)
    endif()
  endforeach()
  get_property(folders DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(inner IN LISTS folders)
    palpate_apart(${inner})
  endforeach()
endfunction()
cmake_language(DEFER CALL palpate_apart ${CMAKE_SOURCE_DIR}/ROOM)
"""
SANDBOX = ["unshare", "--user", "--map-root-user", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc",
           "sh", "-c", 'mount --bind "$0" "$0" && mount -t tmpfs tmpfs /tmp && mount -o remount,bind,ro / &&'
           ' cd "$PWD" && exec "$@"']


PATIENCE = 300  # s; a machine that others use must not look like a test that hangs


class Failed(Exception):
    pass


class Copy:
    def __init__(self, folder, jobs, together):
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.jobs, self.together = folder, jobs, together
        # Laid out like a working tree, so that ccache knows the objects of others with the same sources.
        self.source = (folder / "tree").resolve()  # may be a link
        self.build = self.source / ".build/release"
        self.environment = {"CCACHE_BASEDIR": str(self.source), "CCACHE_NOHASHDIR": "1", **os.environ, "GTEST_BRIEF": "1"}
        self.sandbox = SANDBOX + [str(folder)]
        if self.run(["true"], 20)[0] != 0:
            print("No sandbox here (unshare and mount are refused): mutants run unconfined.", file=sys.stderr)
            self.sandbox = []

    def update(self):
        """Brings the copy to the state of the repository's working tree; equal files keep their time."""
        listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                                cwd=REPOSITORY, check=True, capture_output=True).stdout.split(b"\0")
        wanted = {os.fsdecode(name) for name in listed if name and (REPOSITORY / os.fsdecode(name)).is_file()}
        for name in wanted:
            here, there = REPOSITORY / name, self.source / name
            if not there.exists() or here.read_bytes() != there.read_bytes():
                there.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(here, there)
                os.utime(there)
        for path in list(self.source.rglob("*")):
            name = str(path.relative_to(self.source))
            if path.is_file() and name not in wanted and not name.startswith(".build/"):
                path.unlink()

    def configure(self, room):
        (self.folder / "apart.cmake").write_text("" if self.together else APART.replace("ROOM", room))
        command = ["cmake", "--preset", "release", "-DPALPATE_TESTS=ON",
                   f"-DCMAKE_PROJECT_palpate_INCLUDE={self.folder / 'apart.cmake'}"]
        if shutil.which("ccache"):
            command.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
        if shutil.which("ld.lld"):
            command.append("-DCMAKE_EXE_LINKER_FLAGS=-fuse-ld=lld")
        done = subprocess.run(command, cwd=self.source, capture_output=True, text=True)
        if done.returncode != 0:
            raise Failed("The copy could not be configured:\n" + done.stderr)

    def make(self, targets):
        """Whether it could be built, and what was printed."""
        code, output = self.run(["ninja", "-C", self.build, "-j", str(self.jobs), *targets], None, confined=False)
        return code == 0, output

    def dependants(self, targets):
        """How many objects the next build would compile."""
        done = subprocess.run(["ninja", "-C", self.build, "-n", *targets], capture_output=True, text=True)
        return done.stdout.count("Building CXX object")

    def run(self, command, limit, folder=None, confined=True):
        """(exit code, output); the code is None when the time was up."""
        def confine():
            resource.setrlimit(resource.RLIMIT_FSIZE, (2 ** 31, 2 ** 31))
            resource.setrlimit(resource.RLIMIT_DATA, (2 ** 33, 2 ** 33))
        sandbox = self.sandbox if confined else []
        process = subprocess.Popen(["nice", *sandbox, *map(str, command)], cwd=folder or self.folder,
                                   env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, start_new_session=True, preexec_fn=confine if confined else None)
        try:
            output, _ = process.communicate(timeout=limit)
            return process.returncode, output.decode(errors="replace")
        except subprocess.TimeoutExpired:
            return None, ""
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def processor_seconds():
    """Used so far by what was run and has ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def digest(path):
    return hashlib.sha1(path.read_bytes()).hexdigest()


class Program:
    """A GoogleTest program with those of its tests that pass and are not slow."""

    def __init__(self, copy, name, path):
        self.copy, self.name, self.path = copy, name, path
        self.out, self.seconds, self.hash = [], 0.0, digest(path)

    def filter(self, only=None):
        return "--gtest_filter=" + (only or "*" + ("-" + ":".join(self.out) if self.out else ""))

    def measure(self, longest):
        """Leaves out what fails or is slow without a mutant."""
        report = self.copy.folder / "report.json"
        report.unlink(missing_ok=True)
        begin, used = time.monotonic(), processor_seconds()
        self.copy.run([self.path, f"--gtest_output=json:{report}"], 1200, self.path.parent)
        if not report.exists():
            raise Failed(f"{self.name} does not end well without a mutant: run it by hand")
        # A busy machine makes every test slower by the same factor.
        busy = min(1.0, (processor_seconds() - used) / max(1e-3, time.monotonic() - begin))
        for suite in json.loads(report.read_text())["testsuites"]:
            for test in suite["testsuite"]:
                seconds = float(test["time"].rstrip("s"))
                if test.get("failures") or seconds * busy > longest:
                    self.out.append(f"{suite['name']}.{test['name']}")
                else:
                    self.seconds += seconds
        left_out = f"; left out: {', '.join(self.out)}" if self.out else ""
        print(f"  {self.name}: {time.monotonic() - begin:.0f} s, {self.seconds:.0f} s used{left_out}", flush=True)

    def killer(self):
        """The test that notices, or None."""
        limit = PATIENCE + 10 * self.seconds
        code, output = self.copy.run([self.path, self.filter(), "--gtest_fail_fast"], limit, self.path.parent)
        if code is None:
            return f"{self.name} (time-out)"
        if code == 0:
            return None
        named = re.findall(r"\[  FAILED  \] ([\w/.]+)", output)
        if not named:  # crashed: GoogleTest names no test
            return f"{self.name} (crash)" if self.copy.run([self.path, self.filter()], limit, self.path.parent)[0] else None
        again, _ = self.copy.run([self.path, self.filter(named[0])], limit, self.path.parent)
        return named[0] if again != 0 else None


class CommandTest:
    """A test of the built program by ctest."""

    def __init__(self, copy, name):
        self.copy, self.name, self.seconds = copy, name, 0.0

    def passes(self, limit):
        command = ["ctest", "--test-dir", self.copy.build, "-R", f"^{re.escape(self.name)}$", "--no-tests=error"]
        return self.copy.run(command, limit)[0] == 0

    def measure(self, longest):
        begin, used = time.monotonic(), processor_seconds()
        good = self.passes(600)
        self.seconds, used = time.monotonic() - begin, processor_seconds() - used
        kept = good and used <= longest
        print(f"  {self.name}: {self.seconds:.0f} s{'' if kept else ', left out'}{'' if good else ' (fails)'}", flush=True)
        return kept

    def killer(self):
        limit = PATIENCE + 10 * self.seconds
        return None if self.passes(limit) or self.passes(limit) else self.name


# ---- A run --------------------------------------------------------------------------------------

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
                text = lists.read_text()
                for name, arguments in re.findall(r"palpate_test\((\w+)([^)]*)", text):
                    if "CLOCK" not in arguments.split() and name in (self.options.programs or [name]):
                        yield name, lists.parent.relative_to(self.copy.source)

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
        self.targets = [name for name, _ in programs] + (["palpate"] if self.options.with_commands else [])
        print(f"{self.folder}: building {' '.join(self.targets)} ...", flush=True)
        good, output = self.copy.make(self.targets)
        if not good:
            raise Failed("Without a mutant the copy cannot be built:\n" + output[-3000:])
        self.programs = [Program(self.copy, name, self.copy.build / folder / name) for name, folder in programs]
        known = self.results.parent / "measured.json"  # of programs that have not changed since
        measured = json.loads(known.read_text()) if known.exists() else {}
        for program in self.programs:
            name = f"{program.name} {program.hash} {self.options.longest}"
            if name in measured:
                program.out, program.seconds = measured[name]
            else:
                program.measure(self.options.longest)
                measured[name] = program.out, program.seconds
                known.write_text(json.dumps(measured))
        self.programs.sort(key=lambda p: p.seconds)
        self.commands = []
        if self.options.with_commands:
            self.palpate = digest(self.copy.build / "runner/palpate")
            self.commands = [t for t in self.command_tests() if t.measure(10 * self.options.longest)]
            self.commands.sort(key=lambda t: t.seconds)
        self.objects = {path: digest(path) for path in self.copy.build.rglob("*.o")}

    def killer(self):
        for program in self.programs:
            if digest(program.path) != program.hash:  # others do not contain the mutant
                if name := program.killer():
                    return name
        if self.commands and digest(self.copy.build / "runner/palpate") != self.palpate:
            for command in self.commands:
                if name := command.killer():
                    return name
        return None

    def attempt(self, mutant):
        """(result, by which test or why)"""
        asserting = "#define _GLIBCXX_ASSERTIONS\n" if mutant["file"].endswith(".cpp") else ""
        with applied(self.copy.source, mutant, asserting):
            count = self.copy.dependants(self.targets)
            if count > self.options.most_objects:
                return "skipped", f"{count} objects depend on it"
            if not self.copy.make(self.targets)[0]:
                return "not compiled", ""
            if killer := self.killer():
                return "killed", killer
        with applied(self.copy.source, mutant):
            begin = time.time()
            self.copy.make(self.targets)
            fresh = [p for p in self.copy.build.rglob("*.o") if p.stat().st_mtime >= begin - 1]
            if fresh and all(digest(p) == self.objects.get(p) for p in fresh):
                return "equivalent", "the same machine code"
        return "survived", "" if fresh else "not in a test program"

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


def main():
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
    results = options.tree / "results"
    if options.report:
        for path in sorted(results.glob("*.jsonl")) if results.is_dir() else ():
            if not options.folders or any(path.stem.startswith(f.replace("/", "-") + "-") for f in options.folders):
                report(path, True)
        return
    if not options.folders:
        parser.error("name a room: " + ", ".join(ROOMS))
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
