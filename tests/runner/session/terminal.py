"""A program on a pseudo-terminal, with functions to read and type."""

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import termios
import time


def end_if_it_hangs(test, seconds=120):
    """A `test` that still waits after that long fails, and says where: a session that a fault has stopped, on a machine
    that stood still, waits for its experimenter for ever."""

    def give_up(*_):
        raise AssertionError(f"still waiting after {seconds} s")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(seconds)
    test.addCleanup(signal.signal, signal.SIGALRM, before)
    test.addCleanup(signal.alarm, 0)


class Terminal:
    """Starts `command` with its own terminal. Its output accumulates in `text`."""

    def __init__(self, command, patience=60, columns=0, **where):
        self.patience = patience
        self.text = ""
        self.read_to = 0  # of text, by wait_for
        self.master, slave = pty.openpty()
        if columns:
            fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        self.process = subprocess.Popen(list(map(str, command)), stdin=slave, stdout=slave, stderr=slave,
                                        start_new_session=True, **where)
        os.close(slave)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        if self.master >= 0:
            os.close(self.master)

    def _gather(self, seconds):
        ready, _, _ = select.select([self.master], [], [], seconds)
        if not ready:
            return True
        try:
            more = os.read(self.master, 65536)
        except OSError:  # the last one has closed it
            return False
        self.text += more.decode("utf-8", "replace").replace("\r\n", "\n")
        return bool(more)

    def wait_for(self, *words):
        """Reads past the first of the words that appears; returns it."""
        end = time.monotonic() + self.patience
        while True:
            found = [(at, word) for word in words if (at := self.text.find(word, self.read_to)) >= 0]
            if found:
                at, word = min(found)
                self.read_to = at + len(word)
                return word
            if time.monotonic() > end or not self._gather(0.2):
                raise AssertionError(f"none of {words} came after:\n{self.text}")

    def trials(self, leave):
        """Yields at each trial until the session is on record. Before it, leave() takes the hand off the object; faults
        are cleared."""
        while True:
            leave()
            came = self.wait_for("[trial, ", "[fault, ", "[paused, ", "on record; ")
            if came == "on record; ":
                return
            if came == "[trial, ":
                yield
            else:
                self.type(":clear\n:go\n")

    def hear(self):
        """All output so far."""
        self._gather(0)
        return self.text

    def type(self, keys):
        os.write(self.master, keys.encode())

    def send_signal(self, which):
        self.process.send_signal(which)

    def hang_up(self):
        os.close(self.master)
        self.master = -1

    def finish(self):
        """Reads to the end. Returns the exit status."""
        end = time.monotonic() + self.patience
        while self.process.poll() is None:
            if time.monotonic() > end:
                raise AssertionError(f"did not end:\n{self.text}")
            self._gather(0.1)
        while self._gather(0) and select.select([self.master], [], [], 0)[0]:
            pass
        return self.process.returncode

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
