"""Controls emulated Falcons and queries their state."""

import csv
import json
import os
import time


def read_record(path):
    with open(path, newline="") as table:
        return [(int(row["t_ns"]), max(abs(int(row[f"motor{i}"])) for i in (1, 2, 3))) for row in csv.DictReader(table)]


class EmulatorControl:
    """For `emulated_falcons --control FIFO`, which it makes in `folder`."""

    def __init__(self, folder, patience):
        self.folder = folder
        self.patience = patience  # s; only a hang reaches it
        self.fifo = folder / "control"
        os.mkfifo(self.fifo)
        # Also open it for reading: no line is lost before the other side opens it.
        self.descriptor = os.open(self.fifo, os.O_RDWR)

    def close(self):
        os.close(self.descriptor)

    def tell(self, line):
        os.write(self.descriptor, (line + "\n").encode())

    def states(self, given_up=lambda: False):
        """One for each Falcon; None where it is given up before they come."""
        path = self.folder / "state.json"
        path.unlink(missing_ok=True)
        self.tell(f"state {path}")
        self.wait_until(lambda: path.exists() or given_up())
        return json.loads(path.read_text()) if path.exists() else None

    def record(self, number=1):
        """The packets of a Falcon, oldest first: time (ns, of time.monotonic_ns), the largest of the motors' counts."""
        path = self.folder / "record.csv"
        path.unlink(missing_ok=True)
        self.tell(f"record {number} {path}")
        self.wait_until(path.exists)
        return read_record(path)

    def wait_until(self, done):
        end = time.monotonic() + self.patience
        while not done():
            if time.monotonic() > end:
                raise AssertionError("nothing came of it")
            time.sleep(0.01)
