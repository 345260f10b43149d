"""What the clients of palpate serve cost its servo: lateness of ticks with many of them and with one, in alternating runs.

Usage: serve_isolation.py PALPATE [--pairs 10] [--seconds 10] [--flood MINUTES] [--json FILE]

In each run a controller starts a scene and reads the lateness of every tick. In the second run of a pair, seven watchers
more read all fields at 1 kHz, and one subscribes and never reads. Prints quantiles of each condition, their ratio with
the range over pairs, missed ticks, the round trip of a message, and the offset of the clocks. --flood: a watcher sends 200
messages a second, half of them bad, for so many minutes, while another never reads; prints the server's memory.
For an idle machine; nothing is judged.
"""

import argparse
import atexit
import json
import pathlib
import random
import selectors
import statistics
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "runner" / "python" / "palpate"))
from client import Client, _Lines  # noqa: E402

BALL = {"objects": [{"shape": "sphere", "radius_m": 0.03, "subdivisions": 3, "stiffness_n_per_m": 300}]}
FIELDS = ["tip", "tail", "force", "rendered", "contact", "depth", "object", "faults", "lateness"]
QUANTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999, "max": 1}


class Server:
    def __init__(self, program, folder):
        scene = folder / "scene.json"
        scene.write_text(json.dumps(BALL))
        self.path = folder / "socket"
        self.process = subprocess.Popen([program, "serve", "--device", "simulated", "--scene", scene, "--socket", self.path],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        atexit.register(self.process.kill)  # also where this program fails
        self.said = json.loads(self.process.stdout.readline())

    def client(self, **more):
        return Client(self.said["url"], self.said["token"], time_out=60, **more)

    def watcher(self):
        """A connection that has subscribed to everything at 1 kHz; who owns it reads, or does not."""
        link = _Lines(str(self.path), 60)
        link.send(json.dumps({"id": 0, "type": "hello", "token": self.said["token"], "version": 1, "role": "watch"}))
        link.receive()
        link.send(json.dumps({"id": 1, "type": "subscribe", "rate_hz": 1000, "fields": FIELDS}))
        return link.socket

    def memory_kb(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0])

    def end(self):
        self.process.terminate()
        return self.process.communicate()[1].strip()


class Readers:
    """Reads and throws away: what the program of a client costs is not the server's."""

    def __init__(self, sockets):
        self.selector, self.bytes, self.quit = selectors.DefaultSelector(), 0, False
        for one in sockets:
            self.selector.register(one, selectors.EVENT_READ)
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        while not self.quit:
            for key, _ in self.selector.select(0.1):
                got = key.fileobj.recv(1 << 16)
                self.bytes += len(got)
                if not got:
                    self.selector.unregister(key.fileobj)

    def end(self):
        self.quit = True
        self.thread.join()


def measure(program, seconds, crowd):
    with tempfile.TemporaryDirectory() as folder:
        server = Server(program, pathlib.Path(folder))
        links = [server.watcher() for _ in range(8)] if crowd else []
        readers = Readers(links[:-1])
        with server.client() as hand:
            hand.subscribe(1000, ("lateness", "faults"))
            hand.start(renderer="ray")
            time.sleep(0.5)
            hand.samples()
            began, trips = time.monotonic(), []
            while time.monotonic() - began < seconds:
                sent = time.perf_counter()
                hand.ask("alive")
                trips.append(1e6 * (time.perf_counter() - sent))
                time.sleep(0.01)
            got, dropped = hand.samples(), hand.dropped
            clock = hand.clock(50)
            known = hand.ask("clock")["known"]
            said = hand.stop()
        readers.end()
        server.end()
        for link in links:
            link.close()
    late = sorted(got["lateness"] / 1000)
    return {"late_us": {name: float(late[min(int(share * len(late)), len(late) - 1)]) for name, share in QUANTILES.items()},
            "ticks": len(late), "dropped": dropped, "missed": said["missed_ticks"],
            "trip_us": {"p50": statistics.median(trips), "p99": sorted(trips)[int(0.99 * len(trips))]},
            "offset_us": clock.offset_ns / 1000, "bound_us": clock.round_trip_ns / 2000, "known": known,
            "read_mb": readers.bytes / 1e6}


def flood(program, minutes):
    seed = 1
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        server = Server(program, pathlib.Path(folder))
        deaf, loud = server.watcher(), server.watcher()
        readers = Readers([loud])
        with server.client() as hand:
            hand.start(renderer="ray")
            began, sent, memory = time.monotonic(), 0, []
            due = began
            while time.monotonic() - began < 60 * minutes:
                good = json.dumps({"id": sent, "type": "subscribe", "rate_hz": 1000, "fields": FIELDS})
                bad = json.dumps({"id": sent, "type": "load", "scene": {"objects": [[chance.random()] * 100] * 20}})[:chance.randrange(3, 9000)]
                loud.sendall((good if sent % 2 else bad).encode() + b"\n")
                sent += 1
                if sent % 1000 == 0:
                    memory.append(server.memory_kb())
                if sent % 30 == 0 and (off := [one for one in hand.events() if one["event"] == "forces_off"]):
                    hand.stop()
                    hand.clear()
                    hand.start(renderer="ray")
                    print("forces were off:", off[0]["reason"], file=sys.stderr)
                due = max(due + 1 / 190, time.monotonic())  # never catches up: above 400 a second it would be closed
                time.sleep(max(0, due - time.monotonic()))
            hand.stop()
        readers.end()
        deaf.close()
        loud.close()
        said = server.end()
    quarter = max(1, len(memory) // 4)
    first, last = statistics.median(memory[:quarter]), statistics.median(memory[-quarter:])
    print(f"flood: {sent} messages in {minutes:g} min, memory {first} kB in the first quarter, {last} kB in the last; {said}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("palpate")
    parser.add_argument("--pairs", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--flood", type=float, default=0, metavar="MINUTES")
    parser.add_argument("--json")
    given = parser.parse_args()
    pairs = []
    for number in range(given.pairs):
        pairs.append([measure(given.palpate, given.seconds, crowd) for crowd in (False, True)])
        alone, crowd = pairs[-1]
        print(f"pair {number + 1}: p99.9 {alone['late_us']['p99.9']:.1f} us alone, {crowd['late_us']['p99.9']:.1f} with "
              f"{crowd['read_mb']:.1f} MB read", file=sys.stderr)
    if pairs:
        print(f"{'us':28}{'one client':>12}{'nine':>12}{'ratio':>8}  range over pairs")
        rows = [(f"lateness {name}", [[one["late_us"][name] for one in pair] for pair in pairs]) for name in QUANTILES]
        rows += [(f"round trip {name}", [[one["trip_us"][name] for one in pair] for pair in pairs]) for name in ("p50", "p99")]
        for name, values in rows:
            alone, crowd = (statistics.median(pair[i] for pair in values) for i in (0, 1))
            ratios = [pair[1] / pair[0] for pair in values]
            print(f"{name:28}{alone:12.1f}{crowd:12.1f}{crowd / alone:8.2f}  {min(ratios):.2f} to {max(ratios):.2f}")
        for name in ("missed", "dropped", "ticks"):
            print(f"{name + ', in all':28}{sum(pair[0][name] for pair in pairs):12}{sum(pair[1][name] for pair in pairs):12}")
        worst = max((abs(one["offset_us"]) for pair in pairs for one in pair))
        print(f"clock: offset at most {worst:.1f} us, bound at most {max(one['bound_us'] for pair in pairs for one in pair):.1f} us; "
              f"known to the server in {sum(one['known'] for pair in pairs for one in pair)} of {2 * len(pairs)} runs")
    if given.json:
        pathlib.Path(given.json).write_text(json.dumps(pairs))
    if given.flood:
        flood(given.palpate, given.flood)


if __name__ == "__main__":
    main()
