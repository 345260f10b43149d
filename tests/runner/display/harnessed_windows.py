"""Windows without a session, which a program of the tests shows (window_harness.cpp: HARNESS, the tests' argument)."""

import queue
import subprocess
import sys
import threading

from virtual_screen import PATIENCE

HARNESS = sys.argv.pop() if len(sys.argv) > 1 else None


class Windows:
    """The harness, with its output in order."""

    def __init__(self, screen, *options):
        self.program = subprocess.Popen([HARNESS, *options], env=screen.environment, text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.lines = queue.Queue()
        self.listener = threading.Thread(target=self._listen, daemon=True)
        self.listener.start()
        self.before = self.expect("ready")[0]
        self.participant = screen.window("harness")
        self.console = screen.window("harness - console")

    def _listen(self):
        for line in self.program.stdout:
            self.lines.put(line.strip())

    def say(self, line):
        self.program.stdin.write(line + "\n")
        self.program.stdin.flush()

    def expect(self, line):
        """Returns the output before it."""
        seen = []
        while True:
            try:
                heard = self.lines.get(timeout=PATIENCE)
            except queue.Empty:
                raise AssertionError(f"no '{line}', but {seen}") from None
            if heard.startswith(line):
                return seen, heard
            seen.append(heard)

    def where(self):
        """Tip and axis of the mouse's stylus."""
        self.say("where")
        words = self.expect("tip")[1].split()
        return [float(x) for x in words[1:4]], [float(x) for x in words[5:8]]

    def close(self):
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait()
        self.listener.join()
        self.program.stdin.close()
        self.program.stdout.close()
