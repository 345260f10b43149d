"""The state that tests share with the stubs of makers' libraries: a file of doubles, laid out as stub_state.h says."""

import mmap
import pathlib
import re
import struct

HEADER = pathlib.Path(__file__).resolve().parent / "forcedimension" / "stub_state.h"


def members():
    """Names of a device's numbers, in order; an array of three is NAME_x, NAME_y, NAME_z."""
    body = HEADER.read_text().split("struct StubDevice {")[1].split("\n};")[0]
    out = []
    for declared in re.findall(r"double ([^;]*);", re.sub(r"//.*", "", body)):
        for name, three in re.findall(r"(\w+)(\[3\])? =", declared):
            out += [f"{name}_{axis}" for axis in "xyz"] if three else [name]
    return out


class StubState:
    """The numbers of two devices by name, of which `count` are there."""

    FIELDS = members()

    def __init__(self, path, count=1):
        path.write_bytes(bytes(8 * (1 + 2 * len(self.FIELDS))))
        self._file = open(path, "r+b")
        self._map = mmap.mmap(self._file.fileno(), 0)
        struct.pack_into("d", self._map, 0, count)

    def _place(self, name, device):
        return 8 * (1 + device * len(self.FIELDS) + self.FIELDS.index(name))

    def set(self, device=0, **numbers):
        for name, number in numbers.items():  # at once: pack_into would write a zero first
            at = self._place(name, device)
            self._map[at:at + 8] = struct.pack("d", number)

    def get(self, name, device=0):
        return struct.unpack_from("d", self._map, self._place(name, device))[0]

    def force(self, device=0):
        """N, the largest component."""
        return max(abs(self.get(f"force_{axis}", device)) for axis in "xyz")

    def close(self):
        self._map.close()
        self._file.close()
