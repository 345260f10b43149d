"""Slurm with two nodes of one core each on this machine, all of it in a folder: munged, slurmctld and two slurmd as
child processes, without systemd and without /etc. Needs root and the packages slurm-wlm and munge."""

import os
import pathlib
import signal
import socket
import subprocess
import time

CONF = """ClusterName=test
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket={dir}/munge/sock
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
SlurmctldPort=16817
SlurmctldPidFile={dir}/ctld.pid
StateSaveLocation={dir}/state
SlurmctldLogFile={dir}/log/ctld.log
SlurmdLogFile={dir}/log/%n.log
SlurmdPidFile={dir}/%n.pid
SlurmdSpoolDir={dir}/spool-%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port=17001 CPUs=1 State=UNKNOWN
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port=17002 CPUs=1 State=UNKNOWN
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
"""


class NotHere(Exception):
    """The daemons do not run on this machine; why."""


class Slurm:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        for name in ("state", "log", "munge"):
            (self.folder / name).mkdir(parents=True, mode=0o755)
        self.conf = self.folder / "slurm.conf"
        self.conf.write_text(CONF.format(dir=self.folder, host=socket.gethostname().split(".")[0]))
        self.environment = {**os.environ, "SLURM_CONF": str(self.conf)}
        self.running = {}

    def __enter__(self):
        munge = self.folder / "munge"
        (munge / "key").write_bytes(os.urandom(128))
        (munge / "key").chmod(0o600)
        try:
            self.start("munged", "munged", "--force", "--foreground", f"--socket={munge}/sock", f"--key-file={munge}/key",
                       f"--log-file={munge}/log", f"--pid-file={munge}/pid", f"--seed-file={munge}/seed")
            self.wait("munge answers", (munge / "sock").exists, 60)
            self.start_controller()
            for node in ("n1", "n2"):
                self.start_node(node)
            self.wait("both nodes are idle", lambda: self.ask("sinfo", "-h", "-t", "idle", "-o", "%D").strip() == "2", 120)
        except (AssertionError, OSError) as error:
            self.__exit__()
            logs = sorted((self.folder / "log").iterdir())
            raise NotHere(f"{error}\n" + "".join(log.read_text(errors="replace")[-500:] for log in logs)) from error
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for name in reversed(list(self.running)):
            self.end(name)

    def start(self, name, *command):
        with open(self.folder / "log" / f"{name}.out", "ab") as log:
            self.running[name] = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=self.environment)

    def start_controller(self):
        self.start("slurmctld", "slurmctld", "-D")

    def start_node(self, node):
        self.start(node, "slurmd", "-D", "-N", node)

    def end(self, name):
        process = self.running.pop(name)
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def ask(self, *command):
        """What a command of Slurm says; "" while nobody answers."""
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True)
        return done.stdout if done.returncode == 0 else ""

    def wait(self, what, holds, seconds=600):
        end = time.monotonic() + seconds
        while not holds():
            dead = [name for name, process in self.running.items() if process.poll() is not None]
            assert not dead, f"{dead} ended; see {self.folder}/log"
            assert time.monotonic() < end, f"waited for: {what}"
            time.sleep(0.05)
