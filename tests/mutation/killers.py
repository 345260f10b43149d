"""The tests that a mutant meets: GoogleTest's programs, and ctest's tests of the built program."""
import hashlib
import json
import re
import resource
import time

from tree_copy import Failed

PATIENCE = 300  # s; a machine that others use must not look like a test that hangs


def processor_seconds():
    """Used so far by what was run and has ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def digest(path):
    return hashlib.sha1(path.read_bytes()).hexdigest()


class Program:
    """A GoogleTest program with those of its tests that pass and are not slow."""

    QUICK = 0.5  # s; such tests of all programs come before the others

    def __init__(self, copy, name, path, tested):
        """`tested`: paths of its sources, from the room's folder of tests."""
        self.copy, self.name, self.path, self.tested = copy, name, path, tested
        self.out, self.times, self.hash = [], {}, digest(path)

    @property
    def seconds(self):
        return sum(self.times.values())

    def likelihood(self, inside):
        """How near its tests stand to a source, a path from the room's folder: 2 beside it, 1 in its folder."""
        beside = str(inside.with_suffix("")) + "_"
        return max([2 * str(path).startswith(beside) or path.parent == inside.parent for path in self.tested], default=0)

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
                name, seconds = f"{suite['name']}.{test['name']}", float(test["time"].rstrip("s")) * busy
                if test.get("failures") or seconds > longest:
                    self.out.append(name)
                else:
                    self.times[name] = seconds
        left_out = f"; left out: {', '.join(self.out)}" if self.out else ""
        print(f"  {self.name}: {time.monotonic() - begin:.0f} s, {self.seconds:.0f} s used{left_out}", flush=True)

    def killer(self, quick):
        """The test that notices, or None. \param quick  those tests; else the others"""
        slow = [name for name, seconds in self.times.items() if seconds > self.QUICK]
        if not quick and not slow:
            return None
        left = slow + self.out
        chosen = ("*" + ("-" + ":".join(left) if left else "")) if quick else ":".join(slow)
        limit = PATIENCE + 10 * self.seconds

        def run(tests, *options):
            return self.copy.run([self.path, f"--gtest_filter={tests}", *options], limit, self.path.parent)

        code, output = run(chosen, "--gtest_fail_fast")
        if code is None:
            return f"{self.name} (time-out)"
        if code == 0:
            return None
        named = re.findall(r"\[  FAILED  \] ([\w/.]+)", output)
        if not named:  # crashed: GoogleTest names no test
            return f"{self.name} (crash)" if run(chosen)[0] else None
        return named[0] if run(named[0])[0] != 0 else None


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
