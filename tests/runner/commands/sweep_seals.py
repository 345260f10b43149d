"""Seals the plan and the rows of a sweep's file whose values a test has made up (data/README.md: the file of a sweep)."""

import hashlib
import struct


def encoded(value):
    if value is None:
        return b"n"
    if isinstance(value, int):
        return b"i" + struct.pack("<q", value)
    if isinstance(value, float):
        return b"r" + struct.pack("<d", value)
    text = value.encode()
    return b"t" + struct.pack("<q", len(text)) + text


def seal(previous, kind, values):
    return hashlib.sha256(previous + b"".join(map(encoded, (kind, *values)))).digest()


def reseal(file):
    """file: a connection of sqlite3"""
    *plan, _ = file.execute("SELECT * FROM sweep").fetchone()
    first = seal(bytes(32), "sweep", plan)
    file.execute("UPDATE sweep SET seal = ?", [first])
    for *values, _ in file.execute("SELECT * FROM points").fetchall():
        file.execute("UPDATE points SET seal = ? WHERE point = ?", [seal(first, "point", values), values[0]])
