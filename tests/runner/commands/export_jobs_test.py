"""palpate export --format bids --jobs: the same files from one thread and from several. Usage: export_jobs_test.py PALPATE"""

import gzip
import unittest

from command_case import CommandCase

STUDY = {"version": 1, "name": "kept", "renderers": ["point"], "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03}],
         "repetitions": 40, "response": {"keys": {"1": "ball"}, "time_out_s": 5}, "samples": True, "seed": 3}


class Jobs(CommandCase):
    def test_files_do_not_depend_on_threads(self):
        db = self.dir / "kept.db"
        self.palpate("simulate", self.file("kept.json", STUDY), "--db", db, "--participants", 2, "--seed", 5)
        folders = []
        for jobs in (1, 2, 7):
            folder = self.dir / f"bids{jobs}"
            self.palpate("export", "--db", db, "--format", "bids", "--out", folder, "--jobs", jobs)
            folders.append({path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*"))
                            if path.is_file()})
        self.assertEqual(folders[0], folders[1])
        self.assertEqual(folders[0], folders[2])
        packed = {name: data for name, data in folders[0].items() if name.endswith(".tsv.gz")}
        self.assertEqual(len(packed), 2)
        for data in packed.values():
            rows = gzip.decompress(data).decode().splitlines()
            self.assertGreater(len(rows), 1000)
            self.assertEqual(len({row.count("\t") for row in rows}), 1)

    def test_wrong_numbers_of_threads_are_refused(self):
        for jobs in (0, 257, -1):
            self.palpate("export", "--db", "x.db", "--format", "bids", "--out", "x", "--jobs", jobs, status=2)
        self.assertIn("bids", self.palpate("export", "--db", "x.db", "--format", "csv", "--out", "x", "--jobs", 2, status=2).stderr)


if __name__ == "__main__":
    unittest.main()
