"""What a line of commands is made of: files, calls, shell blocks, sessions on a terminal, programs at a server.

Each step has `words` to be found by and `run(place)`, which returns what was said. `timed`: numbers in it are times, and hidden.
"""

import dataclasses
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import time
import typing
import urllib.request

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(SOURCE / folder) for folder in ("tests/runner/session", "tests/readme", "runner/python/palpate")]
from client import Client, ServeError  # noqa: E402
from terminal import Terminal  # noqa: E402

PATIENCE = 60  # s; only a hang reaches it
DISTURBED = re.compile(r'missed in a row|"event": "forces_off"')
STATE = re.compile(r"^\[(?:trial|question|homing|block begins|instructions|page|end|pre-flight|fault|paused)\b.*\]\n", re.M)



class Place(typing.NamedTuple):
    program: pathlib.Path
    folder: pathlib.Path

    def make(self):
        (self.folder / "bin").mkdir(parents=True)
        (self.folder / "bin/palpate").symlink_to(self.program)
        (self.folder / "protocols").symlink_to(SOURCE / "protocols")

    def environment(self):
        """Without displays, and without settings of whoever runs this."""
        kept = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY", "XDG_RUNTIME_DIR")}
        return dict(kept, PATH=f"{self.folder}/bin:{os.environ['PATH']}", HOME=str(self.folder), TZ="UTC", LC_ALL="C.UTF-8", COLUMNS="80")

    def where(self):
        return {"cwd": self.folder, "env": self.environment()}


@dataclasses.dataclass(frozen=True)
class File:
    name: str
    text: str
    mode: int = 0o600
    status: int = 0
    timed: bool = False

    @property
    def words(self):
        return ["write", self.name]

    def run(self, place):
        path = place.folder / self.name
        path.write_text(self.text)
        path.chmod(self.mode)
        return "0\n"


@dataclasses.dataclass(frozen=True)
class Call:
    """palpate with these words, and what is typed; it must end with `status`."""
    words: typing.Sequence[str]
    status: int = 0
    typed: str = ""
    timed: bool = False

    def run(self, place):
        done = subprocess.run([place.program, *self.words], input=self.typed, capture_output=True, text=True, errors="replace",
                              **place.where())
        return f"{done.returncode}\n{done.stdout}\n{done.stderr}"


@dataclasses.dataclass(frozen=True)
class Shell:
    """A block of commands, as a README shows it."""
    name: str
    text: str
    status: int = 0
    timed: bool = False

    @property
    def words(self):
        return [self.name, *self.text.split()]

    def run(self, place):
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", self.text], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              errors="replace", **place.where())
        return f"{done.returncode}\n{done.stdout}\n{done.stderr}"


def undisturbed(step, place):
    """What it says on a machine that keeps the servo's time: forces go off where it does not, so it is done again."""
    before = place.folder.with_suffix(".before")
    shutil.copytree(place.folder, before, symlinks=True)
    try:
        for _ in range(5):
            said = step(place)
            if not DISTURBED.search(said):
                break
            shutil.rmtree(place.folder)
            shutil.copytree(before, place.folder, symlinks=True)
        return said
    finally:
        shutil.rmtree(before)


@dataclasses.dataclass(frozen=True)
class Session:
    """palpate run on a terminal. `answers`: what is typed where these words appear; a trial is felt for a second first, so
    that there was contact before the answer."""
    words: typing.Sequence[str]
    answers: typing.Sequence[typing.Tuple[str, str]]
    status: int = 0
    timed: bool = False

    def once(self, place):
        with Terminal([place.program, *self.words], patience=PATIENCE, columns=120, **place.where()) as terminal:
            for awaited, typed in self.answers:
                try:
                    if terminal.wait_for(awaited, "missed in a row") != awaited:
                        return terminal.text
                except AssertionError:
                    return f"{awaited} does not come\n{terminal.text}"
                if awaited.startswith("[trial"):
                    time.sleep(1)
                terminal.type(typed)
            return f"{terminal.finish()}\n{terminal.text}"

    def run(self, place):
        """Without the states of the console, except that those awaited came: it looks at them from time to time, may skip a
        short one, and says others among other words. Two threads say what an emergency does."""
        said = undisturbed(self.once, place)
        return re.sub(r"(^\* .*\n){2,}", lambda match: "".join(sorted(match.group(0).splitlines(True))), STATE.sub("", said), flags=re.M)


@dataclasses.dataclass(frozen=True)
class Serve:
    """palpate serve, and what a program says to it: messages (type, fields); "touch" waits for the first contact."""
    words: typing.Sequence[str]
    messages: typing.Sequence[typing.Tuple[str, dict]]
    status: int = 0
    timed: bool = False

    def once(self, place):
        process = subprocess.Popen([place.program, *self.words], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True, **place.where())
        try:
            first = process.stdout.readline()
            said = self.talk(json.loads(first), place) if first else ""
            process.terminate()
            rest, messages = process.communicate(timeout=PATIENCE)
            return f"{process.returncode}\n{first}{said}\n{rest}\n{messages}"
        finally:
            process.kill()

    def talk(self, serving, place):
        secret = serving if "token" in serving else json.loads((place.folder / "token.json").read_text())
        token = secret["token"]
        with urllib.request.urlopen(serving["url"].replace("ws:", "http:"), timeout=PATIENCE) as page:
            said = [json.dumps(secret), page.read().decode()]
        path = os.path.relpath(place.folder / "socket")  # an address has 108 bytes
        with Client(serving["url"], token, time_out=PATIENCE, role="watch") as watcher, \
                Client(socket_path=path, token=token, time_out=PATIENCE) as hand:
            said += [json.dumps(client.server, indent=1) for client in (watcher, hand)]
            for kind, fields in self.messages:
                said.append(f"{kind} {fields}: {self.reply(hand, kind, fields)}")
            events = [json.dumps(event, indent=1) for event in hand.events() if event["event"] not in ("left", "waiting")]
        return "\n".join(said + sorted(events))

    @staticmethod
    def reply(hand, kind, fields):
        if kind == "touch":
            return hand.wait_for(["first_contact", "forces_off"], PATIENCE)["event"]
        try:
            return json.dumps(hand.ask(kind, **fields), indent=1)
        except ServeError as error:
            return f"{error} {error.faults}"

    def run(self, place):
        return undisturbed(self.once, place)


def steps(*texts, timed=False):
    return [Call(shlex.split(text), timed=timed) for text in texts]


def refused(text, status=2, timed=False):
    return Call(shlex.split(text), status=status, timed=timed)
