"""palpate merge of many shards with many rows: memory that does not grow with them, and the same bytes in any order.
Usage: merge_shards_test.py PALPATE PROTOCOLS [SHARDS ROWS FOLDER]

With three more arguments it measures: 1000 1000 FOLDER is a million points."""

import os
import pathlib
import random
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
import unittest

from sweep_seals import reseal

PALPATE, PROTOCOLS = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()


def make_shards(folder, shards, rows):
    """Of one real point, whose figures are replaced by random numbers."""
    first = folder / "first.sweep"
    running = subprocess.Popen([PALPATE, "sweep", PROTOCOLS / "quick.json", "--space", PROTOCOLS / "spaces" / "small.json",
                                "--points", str(shards * rows), "--participants", "1", "--repetitions", "1", "--shard",
                                f"1/{shards}", "--jobs", "1", "--db", first], stdout=subprocess.DEVNULL)
    count = 0
    while count == 0 and running.poll() is None:
        time.sleep(0.1)
        try:
            count, = sqlite3.connect(f"file:{first}?mode=ro", uri=True).execute("SELECT count(*) FROM points").fetchone()
        except sqlite3.OperationalError:
            pass  # not begun
    running.terminate()
    running.wait()
    with sqlite3.connect(first) as db:
        names = [column[1] for column in db.execute("PRAGMA table_info(points)")]
        point = db.execute("SELECT * FROM points LIMIT 1").fetchone()
        db.execute("DELETE FROM points")
    db.execute("VACUUM")
    db.close()
    seed = 5
    draw = random.Random(seed)
    figures = next(i for i, name in enumerate(names) if name.startswith("gain_"))
    insert = f"INSERT INTO points VALUES ({', '.join('?' * len(names))})"
    for shard in range(shards):
        path = folder / f"shard{shard + 1}.sweep"
        shutil.copy(first, path)
        with sqlite3.connect(path) as db:
            db.execute("PRAGMA synchronous = OFF")
            db.executemany(insert, ((shard * rows + i + 1, *point[1:figures],
                                     *(40 * draw.random() for _ in names[figures:-1]), bytes(32)) for i in range(rows)))
            reseal(db)
        db.close()
    return [folder / f"shard{shard + 1}.sweep" for shard in range(shards)]


def merge(out, shards):
    """s, kB at most"""
    out.unlink(missing_ok=True)
    begin = time.monotonic()
    pid = os.posix_spawn(PALPATE, [PALPATE, "merge", "--out", out, *shards], os.environ)
    _, status, usage = os.wait4(pid, 0)
    if status != 0:
        raise AssertionError(f"merge ended with {status}")
    return time.monotonic() - begin, usage.ru_maxrss


class ManyShards(unittest.TestCase):
    def test_memory_is_constant_and_the_order_of_files_does_not_matter(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            shards = make_shards(folder, 50, 1000)
            mixed = sorted(shards)  # 1, 10, 11, ...
            self.assertNotEqual(mixed, shards)
            _, few = merge(folder / "few.sweep", shards[:2])
            _, many = merge(folder / "all.sweep", shards)
            self.assertLess(many, few + 8_000, "kB; the rows are 22 MB")
            _, many = merge(folder / "mixed.sweep", mixed)
            self.assertLess(many, few + 8_000)
            self.assertEqual((folder / "all.sweep").read_bytes(), (folder / "mixed.sweep").read_bytes())


if __name__ == "__main__":
    if len(sys.argv) > 3:
        files = make_shards(pathlib.Path(sys.argv[5]), int(sys.argv[3]), int(sys.argv[4]))
        for order, paths in (("in order", files), ("not in order", sorted(files))):
            print(order, "%.1f s, at most %d kB" % merge(pathlib.Path(sys.argv[5]) / "all.sweep", paths))
        sys.exit()
    sys.argv[1:] = []
    unittest.main()
