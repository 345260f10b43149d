"""Lets AEPsych choose the levels: aepsych_server & python3 aepsych_levels.py levels.sock & palpate run ... --ask levels.sock

Needs the package aepsych_client (0.5) and a server of AEPsych, which serves one client and one experiment at a time.
Each track of a block has a strategy of its own: points of Sobol's sequence, then those that tell most about the level
with a share of TARGET successes. Levels on a logarithmic scale are its logarithms."""
import argparse
import json
import math
import pathlib
import socketserver

from aepsych_client import AEPsychClient

CONFIG = """[common]
parnames = [level]
stimuli_per_trial = 1
outcome_types = [binary]
strategy_names = [init_strat, opt_strat]
[level]
par_type = continuous
lower_bound = {low!r}
upper_bound = {high!r}
[init_strat]
min_asks = {first}
generator = SobolGenerator
[opt_strat]
min_asks = 1000
refit_every = 5
generator = OptimizeAcqfGenerator
acqf = EAVC
model = GPClassificationModel
max_gen_time = 0.2
[EAVC]
target = {target!r}
objective = ProbitObjective
"""


class Track:
    """The strategy of a track, from its first question on."""

    def __init__(self, client, name, ask, options):
        self.client, self.name, self.log = client, name, ask["scale"] != "linear"
        low, high = (self.place(ask[end]) for end in ("least", "most"))
        client.configure(config_str=CONFIG.format(low=low, high=high, first=options.first, target=options.target), config_name=name)

    def place(self, level):
        return math.log10(level) if self.log else level

    def tell(self, trial):
        """Trials without an answer and catch trials say nothing about the level."""
        if trial["level"] is None or trial["catch_trial"] or not trial["answered"]:
            return
        self.client.resume(config_name=self.name)
        self.client.tell(config={"level": [self.place(trial["level"])]}, outcome=int(trial["success"]))

    def next_level(self, ask):
        self.client.resume(config_name=self.name)
        place = self.client.ask()["config"]["level"][0]
        return min(max(10**place if self.log else place, ask["least"]), ask["most"])


class Session(socketserver.StreamRequestHandler):
    options = None

    def handle(self):
        client, tracks, before = AEPsychClient(ip=self.options.ip, port=self.options.port), {}, []
        for line in self.rfile:
            message = json.loads(line)
            if message["type"] == "begin":
                before = message["history"]
            elif message["type"] == "tell" and (message["block"], message["track"]) in tracks:
                tracks[message["block"], message["track"]].tell(message)
            elif message["type"] == "ask":
                key = message["block"], message["track"]
                if key not in tracks:
                    tracks[key] = Track(client, f"{id(self)} {key}", message, self.options)
                    for trial in before:
                        if (trial["block"], trial["track"]) == key:
                            tracks[key].tell(trial)
                answer = {"type": "level", "trial": message["trial"], "level": tracks[key].next_level(message)}
                self.wfile.write(json.dumps(answer).encode() + b"\n")
            elif message["type"] == "refused":
                print(message["message"])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("socket", type=pathlib.Path)
    parser.add_argument("--ip", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=5555)
    parser.add_argument("--target", type=float, default=0.75, help="share of successes that is sought (0.75)")
    parser.add_argument("--first", type=int, default=10, help="points of Sobol's sequence (10)")
    Session.options = parser.parse_args()
    if Session.options.socket.is_socket():
        Session.options.socket.unlink()  # left behind by an earlier run
    socketserver.UnixStreamServer(str(Session.options.socket), Session).serve_forever()
