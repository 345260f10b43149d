"""palpate cluster without Slurm: shards by GNU parallel over ssh, to an sshd of this test on this machine that stands for
two nodes with a common disk. Usage: cluster_ssh_test.py PALPATE PROTOCOLS; exit status 77: no parallel or no sshd."""

import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import unittest

PALPATE, PROTOCOLS = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
SSHD = shutil.which("sshd", path=os.environ.get("PATH", "") + ":/usr/sbin")
SWEEP = [PROTOCOLS / "quick.json", "--space", PROTOCOLS / "spaces" / "small.json", "--points", "24", "--participants", "1",
         "--repetitions", "1"]

# As `palpate cluster --help` says it.
COMMAND = 'parallel --sshloginfile hosts "$PWD"/people/shard.sh ::: $(seq 6) && people/finish.sh'


class OverSsh(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        for key in ("host", "user"):
            subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", self.folder / key], check=True)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        (self.folder / "sshd.conf").write_text(
            f"Port {port}\nListenAddress 127.0.0.1\nHostKey {self.folder}/host\nAuthorizedKeysFile {self.folder}/user.pub\n"
            f"PidFile none\nStrictModes no\nUsePAM no\nPasswordAuthentication no\nPermitRootLogin prohibit-password\n")
        (self.folder / "ssh.conf").write_text(
            f"Host node1 node2\n  HostName 127.0.0.1\n  Port {port}\n  IdentityFile {self.folder}/user\n  LogLevel ERROR\n"
            f"  IdentitiesOnly yes\n  StrictHostKeyChecking no\n  UserKnownHostsFile /dev/null\n")
        (self.folder / "hosts").write_text("".join(f"1/ssh -F {self.folder}/ssh.conf {node}\n" for node in ("node1", "node2")))
        if os.geteuid() == 0:
            os.makedirs("/run/sshd", exist_ok=True)
        daemon = subprocess.Popen([SSHD, "-D", "-e", "-f", self.folder / "sshd.conf"], stderr=subprocess.DEVNULL)
        self.addCleanup(daemon.wait)
        self.addCleanup(daemon.terminate)
        reach = ["ssh", "-F", self.folder / "ssh.conf", "node2", "true"]
        for _ in range(100):
            if subprocess.run(reach, capture_output=True).returncode == 0:
                return
            self.assertIsNone(daemon.poll(), "sshd ended")
            time.sleep(0.1)
        self.skipTest("this user cannot log in to an sshd of their own")

    def shell(self, command, status=0):
        done = subprocess.run(["bash", "-c", command], cwd=self.folder, capture_output=True, text=True, timeout=300,
                              env=os.environ | {"PARALLEL_HOME": str(self.folder / "parallel")})
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def test_the_merged_file_equals_that_of_one_machine_even_after_a_failed_shard(self):
        subprocess.run([PALPATE, "sweep", *SWEEP, "--db", self.folder / "one.sweep"], check=True, capture_output=True)
        subprocess.run([PALPATE, "cluster", "sweep", *SWEEP, "--shards", "6", "--dir", self.folder / "people", "--no-submit"],
                       check=True, capture_output=True)
        people = self.folder / "people"
        (people / "parts" / "part000003.sweep").mkdir(parents=True)  # one cannot write its file
        said = self.shell(COMMAND, status=1)
        self.assertIn("part000003.sweep", said)
        self.assertFalse((people / "all.sweep").exists())
        self.assertEqual(len([part for part in (people / "parts").glob("*.sweep") if part.is_file()]), 5)
        (people / "parts" / "part000003.sweep").rmdir()
        self.shell(COMMAND)
        self.assertEqual((people / "all.sweep").read_bytes(), (self.folder / "one.sweep").read_bytes())
        self.assertIn("24", (people / "analysis.txt").read_text())


if __name__ == "__main__":
    if not SSHD or not shutil.which("parallel") or not shutil.which("ssh-keygen"):
        print("no GNU parallel or no sshd")
        sys.exit(77)
    sys.argv[1:] = []
    unittest.main()
