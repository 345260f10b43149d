"""What commands write: whole, private, all or none, and over nothing that it must not replace.

Usage: outputs_test.py PALPATE PROTOCOLS
"""

import json
import os
import pathlib
import resource
import shutil
import signal
import stat
import struct
import subprocess
import sys
import tempfile
import threading
import unittest

PALPATE, PROTOCOLS = sys.argv[1], pathlib.Path(sys.argv[2])
TRIALS = "participant_id,session,block,trial,renderer,shape,response,correct,response_time\n" + "".join(
    f"{who},1,1,{i},{r},{s},{s},1,{2 + 0.3 * i + 0.2 * len(r + who)}\n" for who in ("A", "BB", "CCC")
    for i, (r, s) in enumerate([(r, s) for r in ("point", "ray") for s in ("cone", "cube")] * 3, 1))
CUBE = '{"objects": [{"shape": "cube", "edge_m": 0.05}]}'
MESH = '{"objects": [{"shape": "mesh", "file": "solid.obj"}]}'
SOLID = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
PATH = "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n0,0,0,1,0,0,2\n"


class Outputs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.scratch.cleanup)
        cls.study = pathlib.Path(cls.scratch.name) / "study.db"
        subprocess.run([PALPATE, "simulate", PROTOCOLS / "quick.json", "--db", cls.study, "--participants", "2"],
                       check=True, capture_output=True)

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        self.db, self.csv = self.dir / "s.db", self.write("x.csv", TRIALS)
        shutil.copy(self.study, self.db)
        self.scene, self.path = self.write("scene.json", CUBE), self.write("t.csv", PATH)

    def write(self, name, text):
        path = self.dir / name
        path.write_text(text)
        return path

    def palpate(self, *args, status=0, **more):
        done = subprocess.run([PALPATE, *map(str, args)], capture_output=True, text=True, timeout=120, **more)
        self.assertEqual(done.returncode, status, f"{args}\n{done.stdout}{done.stderr}")
        return done

    def writers(self):
        """Commands with an option that names a file to write, and what they read, without that file."""
        render = ["render", "--scene", self.scene, "--renderer", "ray"]
        return [
            (["analyze", "--csv", self.csv], ["json", "report"], [self.csv]),
            (["analyze", "--db", self.db], ["json", "report"], [self.db]),
            (["plan", "--db", self.db, "--participants", "2-3", "--trials", "10", "--studies", "100"],
             ["json", "figure"], [self.db]),
            (["replay", "--db", self.db, "--trial", "S001/1/1"], ["json", "out"], [self.db]),
            (render + ["--trajectory", self.path], ["out"], [self.scene, self.path]),
            (render + ["--explain"], ["json"], [self.scene]),
            (["export", "--db", self.db, "--format", "csv"], ["out"], [self.db]),
            (["accuracy", "--search", "100"], ["json", "report"], []),
            (["stability"], ["json", "report", "figure"], []),
            (["bench", "--ticks", "1000"], ["json"], []),
            (["devices", "--device", "simulated", "--calibration", self.csv, "--firmware", self.path], ["json"],
             [self.csv, self.path]),
        ]

    def everything(self):
        return {str(p): (p.lstat().st_mode, p.read_bytes() if p.is_file() else b"") for p in self.dir.rglob("*")}

    def refused(self, command, option, out, *more, status=2):
        before = self.everything()
        done = self.palpate(*command, f"--{option}", out, *more, status=status)
        self.assertEqual(done.stdout, "", (command, option))
        self.assertIn(str(out), done.stderr)
        self.assertEqual(self.everything(), before, (command, option, out))
        return done.stderr

    def test_no_output_is_an_input_under_any_name(self):
        for command, options, inputs in self.writers():
            for option in options:
                for source in inputs:
                    linked, hard = self.dir / "linked", self.dir / "hard"
                    linked.symlink_to(source)
                    os.link(source, hard)
                    for out in (source, self.dir / "." / source.name, linked, hard):
                        with self.subTest(command=command[0], option=option, out=out.name):
                            self.refused(command, option, out, "--force")
                    linked.unlink()
                    hard.unlink()

    def test_a_scenes_mesh_is_protected_as_an_input(self):
        scene, solid = self.write("scene.json", MESH), self.write("solid.obj", SOLID)
        for more in (["--trajectory", self.path, "--out"], ["--explain", "--json"]):
            self.refused(["render", "--scene", scene, "--renderer", "point", *more[:-1]], more[-1][2:], solid, "--force")

    def test_a_meshs_data_files_are_protected_as_inputs(self):
        solid = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        corners = (0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3)
        buffer = self.dir / "my mesh.bin"
        buffer.write_bytes(b"".join(struct.pack("<3f", *v) for v in solid) + struct.pack("<12H", *corners))
        self.write("solid.gltf", json.dumps({
            "asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                          {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}],
            "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
            "buffers": [{"byteLength": 72, "uri": "my%20mesh.bin"}]}))
        mesh = {"shape": "mesh", "file": "solid.gltf"}
        (self.dir / "link.bin").symlink_to(buffer)
        for objects in ([mesh], [{"shape": "compound", "parts": [{"shape": "cube", "edge_m": 0.1}, mesh]}]):
            scene = self.write("scene.json", json.dumps({"objects": objects}))
            render = ["render", "--scene", scene, "--renderer", "point"]
            for out in (buffer, self.dir / "link.bin"):
                self.refused(render + ["--trajectory", self.path], "out", out, "--force")
                self.refused(render + ["--explain"], "json", out, "--force")
            self.palpate(*render, "--trajectory", self.path, "--out", self.dir / "other.csv", "--force")

    def test_no_output_is_a_database_or_beside_one(self):
        other = self.dir / "other.db"
        subprocess.run([PALPATE, "simulate", PROTOCOLS / "quick.json", "--db", other, "--participants", "1"],
                       check=True, capture_output=True)
        (self.dir / "bookmarks").write_bytes(b"SQLite format 3\0" + bytes(100))
        (self.dir / "log").write_bytes(b"\x37\x7f\x06\x82" + bytes(100))
        names = ["other.db", "bookmarks", "log", "other.db-wal", "other.db-shm", "other.db-journal",
                 "other.db.palpate-lock"]
        for command, options, _ in self.writers():
            for option in options:
                for name in names:
                    with self.subTest(command=command[0], option=option, out=name):
                        self.refused(command, option, self.dir / name, "--force")
        (self.dir / "s.db-shm").write_bytes(bytes(100))
        os.link(self.dir / "s.db-shm", self.dir / "index")
        self.refused(["analyze", "--db", self.db], "json", self.dir / "index", "--force")

    def test_no_output_is_a_folder_or_a_device(self):
        os.mkfifo(self.dir / "pipe")
        (self.dir / "nowhere").symlink_to(self.dir / "none" / "file")
        for command, options, _ in self.writers():
            for option in options:
                for out in (self.dir, "/dev/full", "/dev/zero", "/dev/no-such-disk", self.dir / "nowhere"):
                    with self.subTest(command=command[0], option=option, out=out):
                        self.refused(command, option, out, "--force")
                self.palpate(*command, f"--{option}", "", status=2)
                self.refused(command, option, self.dir / "no" / "folder.x", status=1)

    def test_existing_files_are_replaced_only_with_force_and_stay_private(self):
        before = os.umask(0)
        self.addCleanup(os.umask, before)
        for command, options, _ in self.writers():
            if command[0] in ("stability", "replay", "devices"):
                continue  # slow; without samples; without a real calibration
            for option in options:
                with self.subTest(command=command[0], option=option):
                    out = self.write("mine", "mine")
                    self.assertIn("--force", self.refused(command, option, out))
                    self.palpate(*command, f"--{option}", out, "--force")
                    self.assertGreater(out.stat().st_size, 10)
                    self.assertEqual(stat.S_IMODE(out.stat().st_mode), 0o600)
                    out.unlink()
                    self.palpate(*command, f"--{option}", out)
                    self.assertEqual(stat.S_IMODE(out.stat().st_mode), 0o600)
        self.assertEqual([p.name for p in self.dir.iterdir() if "palpate" in p.name], [])

    def test_all_files_are_written_or_none(self):
        kept, page = self.write("a.json", "kept"), self.dir / "r.html"
        analyze = ["analyze", "--csv", self.csv, "--force", "--json", kept]
        self.refused(analyze, "report", "/dev/full")
        self.refused(analyze, "report", kept)
        self.refused(analyze, "figures", self.csv)
        self.refused([*analyze, "--figures", self.dir / "figures"], "report", self.dir / "figures" / "times.svg",
                     status=1)  # the folder is not there yet
        ends = os.pipe()
        os.close(ends[0])  # no reader: writing the text fails after all checks
        before = self.everything()
        done = self.palpate(*analyze, "--report", f"/dev/fd/{ends[1]}", pass_fds=[ends[1]], status=1)
        os.close(ends[1])
        self.assertIn("cannot be written", done.stderr)
        self.assertEqual(self.everything(), before)
        self.palpate(*analyze, "--report", page, "--figures", self.dir / "figures")
        self.assertTrue(page.stat().st_size > 1000 and kept.stat().st_size > 1000)
        for figure in (self.dir / "figures").iterdir():
            self.assertEqual(stat.S_IMODE(figure.stat().st_mode), 0o600)
        self.refused(["analyze", "--csv", self.csv], "figures", self.dir / "figures")

    def test_a_stopped_writer_leaves_the_old_file_and_the_next_one_cleans_up(self):
        kept = self.write("a.json", "kept")
        command = [PALPATE, "analyze", "--csv", self.csv, "--json", kept, "--force"]
        done = subprocess.run(["prlimit", "--fsize=1000", *command], capture_output=True)
        self.assertEqual(done.returncode, 1, "a limit on file size")
        self.assertEqual(kept.read_text(), "kept")
        self.assertEqual([p.name for p in self.dir.iterdir() if ".palpate-" in p.name], [])
        self.write(".a.json.palpate-abcdef", "of a killed writer")
        self.write(".b.json.palpate-abcdef", "of another file")
        subprocess.run(command, check=True, capture_output=True)
        self.assertGreater(kept.stat().st_size, 1000)
        self.assertEqual([p.name for p in self.dir.iterdir() if ".palpate-" in p.name], [".b.json.palpate-abcdef"])

    def test_pipes_receive_the_text_directly(self):
        shown = self.palpate("analyze", "--csv", self.csv, "--json", "/dev/stdout").stdout
        self.assertIn('"mixed_model"', shown)
        with open(self.dir / "shown", "w") as file:
            subprocess.run([PALPATE, "analyze", "--csv", self.csv, "--json", "/dev/stdout"], stdout=file, check=True)
        self.assertEqual((self.dir / "shown").read_text(), shown)
        os.mkfifo(self.dir / "pipe")
        texts = []
        reader = threading.Thread(target=lambda: texts.append((self.dir / "pipe").read_text()))
        reader.start()
        self.palpate("render", "--scene", self.scene, "--renderer", "ray", "--trajectory", self.path, "--out",
                     self.dir / "pipe")
        reader.join()
        self.assertTrue(texts[0].startswith("t,force_x"))
        self.palpate("analyze", "--csv", self.csv, "--json", "/dev/null")
        self.assertTrue(stat.S_ISCHR(os.stat("/dev/null").st_mode))

    def test_closed_standard_streams_are_not_reused_by_files(self):
        command = ["analyze", "--db", self.db, "--json"]
        self.palpate(*command, self.dir / "open.json")
        shell = f"exec {PALPATE} {' '.join(map(str, command))} {self.dir}/closed.json <&- >&- 2>&-"
        self.assertEqual(subprocess.run(["bash", "-c", shell]).returncode, 1)
        self.assertEqual((self.dir / "closed.json").read_bytes(), (self.dir / "open.json").read_bytes())
        shell = f"exec {PALPATE} simulate {PROTOCOLS}/quick.json --db {self.dir}/n.db --participants 1 <&- >&- 2>&-"
        self.assertEqual(subprocess.run(["bash", "-c", shell]).returncode, 1)
        self.palpate("analyze", "--db", self.dir / "n.db")

    def test_a_dash_is_standard_output_and_nothing_else_goes_there(self):
        render = ["render", "--scene", self.scene, "--renderer", "ray"]
        for command, options in ((["analyze", "--db", self.db], ["json", "report"]),
                                 (["plan", "--db", self.db, "--participants", "2-3", "--trials", "10", "--studies", "100"],
                                  ["json", "figure"]),
                                 (render + ["--trajectory", self.path], ["out"])):
            for option in options:
                with self.subTest(command=command[0], option=option):
                    stream = self.palpate(*command, f"--{option}", "-", cwd=self.dir)
                    self.palpate(*command, f"--{option}", self.dir / "whole", "--force", cwd=self.dir)
                    self.assertEqual(stream.stdout, (self.dir / "whole").read_text())
                    self.assertFalse((self.dir / "-").exists())
        for measures in (render + ["--explain"], ["devices", "--device", "simulated"]):
            json.loads(self.palpate(*measures, "--json", "-", cwd=self.dir).stdout)
        self.palpate("analyze", "--db", self.db, "--json", "-", "--report", "-", status=2)
        self.palpate("export", "--db", self.db, "--format", "csv", "--out", "-", status=2, cwd=self.dir)
        self.assertFalse((self.dir / "-").exists())

    def test_no_folder_or_database_is_named_dash(self):
        for command in (["export", "--db", self.db, "--format", "bids", "--out", "-"],
                        ["merge", "--out", "-", self.db],
                        ["simulate", PROTOCOLS / "quick.json", "--participants", "1", "--db", "-"],
                        ["analyze", "--db", self.db, "--figures", "-"],
                        ["cluster", "plan", "--db", self.db, "--trials", "10", "--participants", "2-3", "--dir", "-"]):
            with self.subTest(command=command[0]):
                self.palpate(*command, status=2, cwd=self.dir)
                self.assertFalse((self.dir / "-").exists())

    def limited(self, which, limit, *args):
        """Under a limit, as a batch system sets it."""
        def limit_it():
            signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
            resource.setrlimit(which, (limit, limit))
        return subprocess.run([PALPATE, *map(str, args)], capture_output=True, text=True, timeout=120, cwd=self.dir,
                              preexec_fn=limit_it)

    def test_a_limit_on_the_size_of_files_is_said(self):
        kept = {path.name for path in self.dir.iterdir()}
        reads = [["analyze", "--db", self.db, "--report", "a.html"], ["merge", "--out", "all.db", self.db],
                 ["export", "--db", self.db, "--format", "csv", "--out", "a.csv"],
                 ["export", "--db", self.db, "--format", "bids", "--out", "bids"],
                 ["export", "--db", self.db, "--format", "psych-ds", "--out", "psychds"]]
        writes = [["simulate", PROTOCOLS / "quick.json", "--participants", "1", "--db", "new.db"],
                  ["forget", "--db", self.db, "--participant", "S001", "--yes"]]
        for limit, commands in ((2048, reads + writes), (40_000, reads[:2] + writes)):
            for command in commands:
                with self.subTest(limit=limit, command=command):
                    done = self.limited(resource.RLIMIT_FSIZE, limit, *command)
                    self.assertEqual(done.returncode, 1, done.stderr)
                    self.assertIn("ulimit -f", done.stderr)
                    self.assertNotIn("session", done.stderr)
        self.assertEqual({path.name for path in self.dir.iterdir()} - kept - {"s.db-wal", "s.db-shm"}, set())
        self.palpate("forget", "--db", self.db, "--participant", "S001", "--yes")

    def test_a_limit_on_memory_is_said(self):
        many = self.write("many.csv", TRIALS + "".join(
            f"P{i},1,1,{t},{('point', 'ray')[t % 2]},cone,cone,1,2.{t}\n" for i in range(4000) for t in range(1, 41)))
        ends = set()
        for megabytes in range(40, 400, 4):
            done = self.limited(resource.RLIMIT_AS, megabytes << 20, "analyze", "--csv", many)
            if done.returncode == 0:
                break
            if done.stderr.startswith("palpate: "):  # else the loader of libraries had not enough
                ends.add((done.returncode, "ulimit -v" in done.stderr))
        else:
            return  # a sanitizer needs more than any limit
        self.assertEqual(ends, {(1, True)})

    def test_own_links_are_followed(self):
        target = self.write("real.json", "old")
        (self.dir / "link.json").symlink_to("real.json")
        self.palpate("analyze", "--csv", self.csv, "--json", self.dir / "link.json", "--force")
        self.assertTrue((self.dir / "link.json").is_symlink())
        self.assertGreater(target.stat().st_size, 1000)

    def test_files_with_similar_names_are_left_alone(self):
        protocol = PROTOCOLS / "quick.json"
        others = {name: self.write(name, "mine") for name in
                  ("poetry.lock", "Cargo.lock", "all.palpate-new", "all.palpate-new-wal", "all.lock", "r.json.part")}
        for name in ("poetry", "all"):
            self.palpate("simulate", protocol, "--db", self.dir / name, "--participants", 1)
        self.palpate("merge", "--out", self.dir / "Cargo", self.dir / "all")
        self.palpate("analyze", "--db", self.dir / "all", "--json", self.dir / "r.json")
        for path in others.values():
            self.assertEqual(path.read_text(), "mine")
        lock = self.write("all.palpate-lock", "a lock of another program")
        self.assertIn("all.palpate-lock", self.palpate("simulate", protocol, "--db", self.dir / "all", status=2).stderr)
        self.assertEqual(lock.read_text(), "a lock of another program")
        for name in ("all-wal", "all-journal", "all.palpate-lock2"):
            self.palpate("simulate", protocol, "--db", self.dir / name, "--participants", 1,
                         status=0 if name.endswith("2") else 2)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
