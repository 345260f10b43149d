"""Another user of the same computer puts files where palpate reads and writes.

Usage: two_users_test.py PALPATE PROTOCOLS    (root, who drops to two user numbers; else skipped, status 77)
"""

import os
import pathlib
import shutil
import stat
import subprocess
import sys
import tempfile
import unittest

LAB, OTHER = 64321, 64322
PALPATE, PROTOCOL = sys.argv[1], pathlib.Path(sys.argv[2]) / "quick.json"


def become(user):
    def change():
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
        os.umask(0o022)
    return change


def skip_reason():
    if os.geteuid() != 0:
        return "only root can become two users"
    if subprocess.run(["true"], preexec_fn=become(LAB)).returncode != 0:
        return "users cannot be changed here"
    return ""


class TwoUsers(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(dir="/tmp")
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        self.dir.chmod(0o755)
        self.program, self.protocol = self.dir / "palpate", self.dir / "quick.json"
        shutil.copy(PALPATE, self.program)
        shutil.copy(PROTOCOL, self.protocol)
        self.program.chmod(0o755)
        self.protocol.chmod(0o644)
        self.own = self.folder("own", 0o755, LAB)
        self.shared = self.folder("shared", 0o1777, 0)
        self.db = self.shared / "s.db"

    def folder(self, name, mode, owner):
        path = self.dir / name
        path.mkdir()
        os.chown(path, owner, owner)
        path.chmod(mode)
        return path

    def lab(self, *args, status=0):
        done = subprocess.run([self.program, *map(str, args)], capture_output=True, text=True, timeout=120,
                              preexec_fn=become(LAB), cwd=self.own)
        self.assertEqual(done.returncode, status, f"{args}\n{done.stdout}{done.stderr}")
        return done

    def other(self, script):
        subprocess.run(["bash", "-c", script], preexec_fn=become(OTHER), cwd=self.shared, check=True)

    def simulate(self, status=0, people=1, db=None):
        return self.lab("simulate", self.protocol, "--db", db or self.db, "--participants", people, status=status)

    def commands(self):
        """Every command that opens a database."""
        return [
            ["simulate", self.protocol, "--db", self.db, "--participants", 2],
            ["run", self.protocol, "--db", self.db, "--participant", "P1", "--device", "simulated", "--no-window"],
            ["analyze", "--db", self.db],
            ["plan", "--db", self.db],
            ["export", "--db", self.db, "--format", "csv", "--out", self.own / "x.csv"],
            ["export", "--db", self.db, "--format", "bids", "--out", self.own / "bids"],
            ["replay", "--db", self.db, "--trial", "S001/1/1"],
            ["forget", "--db", self.db, "--participant", "S001", "--yes"],
            ["merge", "--out", self.own / "all.db", self.db],
        ]

    def all_refuse(self, planted):
        before = self.db.read_bytes()
        for command in self.commands():
            with self.subTest(command=command[0], planted=planted):
                self.assertIn(planted, self.lab(*command, status=2).stderr)
        self.assertEqual(self.db.read_bytes(), before)

    def test_logs_that_another_user_laid_out_are_refused_before_anything_goes_into_them(self):
        self.simulate()
        for end in ("-wal", "-shm", "-journal"):
            for script in (f"umask 0; : > s.db{end}", f"ln -s /dev/null s.db{end}", f"mkfifo -m 666 s.db{end}",
                           f"umask 077; : > s.db{end}"):
                self.other(script)
                self.all_refuse(f"s.db{end}")
                path = self.shared / f"s.db{end}"
                self.assertEqual(path.lstat().st_size if path.is_file() and not path.is_symlink() else 0, 0)
                path.unlink()
        self.simulate(people=2)

    def test_a_log_that_is_open_to_others_is_refused_even_where_it_is_ours(self):
        self.simulate()
        log = self.shared / "s.db-wal"
        log.touch()
        os.chown(log, LAB, LAB)
        log.chmod(0o644)
        self.assertIn("chmod 600", self.lab("analyze", "--db", self.db, status=2).stderr)
        self.db.chmod(0o644)  # then neither is private, by the user's own will
        self.lab("analyze", "--db", self.db)

    def test_another_users_lock_is_left_alone(self):
        self.simulate()
        lock = self.shared / "s.db.palpate-lock"
        for script in ("umask 0; : > s.db.palpate-lock", "ln -s ../own/mine s.db.palpate-lock",
                       "mkfifo -m 666 s.db.palpate-lock"):
            self.other(script)
            self.assertIn(lock.name, self.simulate(status=2).stderr)
            self.assertTrue(lock.is_symlink() or lock.exists())
            lock.unlink()
        self.assertEqual(list(self.own.iterdir()), [])

    def test_a_folder_that_others_can_write_to_is_reported_once(self):
        self.assertEqual(self.simulate().stderr.count("others can write to the folder"), 1)
        self.assertEqual(self.simulate(db=self.own / "s.db").stderr, "")
        theirs = self.folder("theirs", 0o777, OTHER)
        self.assertIn("belongs to another user", self.simulate(db=theirs / "s.db").stderr)

    def test_links_and_pipes_of_others_are_not_written_through(self):
        self.simulate(db=self.own / "s.db")
        victim = self.own / "victim"
        victim.write_text("mine")
        os.chown(victim, LAB, LAB)
        self.other("ln -s ../own/victim r.html; ln -s ../own/victim r.html.part; ln -s ../own sub; mkfifo -m 666 pipe;"
                   "umask 0; echo theirs > file")
        for name in ("r.html", "sub/new.html", "pipe"):
            done = self.lab("analyze", "--db", self.own / "s.db", "--report", self.shared / name, "--force", status=2)
            self.assertIn("another user", done.stderr)
        self.other("ln -s ../own/s.db s.db")
        for command in (["simulate", self.protocol, "--db", self.shared / "s.db"],
                        ["simulate", self.protocol, "--db", self.shared / "sub" / "new.db"],
                        ["merge", "--out", self.shared / "sub" / "all.db", self.own / "s.db"],
                        ["export", "--db", self.own / "s.db", "--format", "bids", "--out", self.shared / "sub" / "bids"],
                        ["export", "--db", self.own / "s.db", "--format", "csv", "--out", self.shared / "sub" / "t.csv"]):
            self.assertIn("another user", self.lab(*command, status=2).stderr)
        self.assertEqual(sorted(path.name for path in self.own.iterdir()), ["s.db", "victim"])
        self.lab("analyze", "--db", self.shared / "s.db")  # reading through it is the reader's will
        self.assertEqual(victim.read_text(), "mine")
        self.lab("analyze", "--db", self.own / "s.db", "--report", self.shared / "mine.html")
        page = (self.shared / "mine.html").stat()
        self.assertEqual((page.st_uid, stat.S_IMODE(page.st_mode)), (LAB, 0o600))

    def test_temporary_files_of_another_user_are_neither_used_nor_removed(self):
        self.other("umask 0; : > .s.db.palpate-abcdef; : > .r.json.palpate-abcdef; mkdir .s.db.palpate-folder;"
                   ": > s.db.palpate-new-wal")
        self.simulate()
        self.lab("analyze", "--db", self.db, "--json", self.shared / "r.json")
        self.assertEqual(len([p for p in self.shared.iterdir() if ".palpate-" in p.name]), 4)

    def test_the_systems_administrator_may_look_in(self):
        self.simulate()
        done = subprocess.run([PALPATE, "analyze", "--db", self.db], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.simulate(people=2)


if __name__ == "__main__":
    if skip_reason():
        print("skipped:", skip_reason())
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
