"""Lets AEPsych choose the levels: aepsych_server & python3 aepsych_levels.py levels.sock & palpate run ... --ask levels.sock

Needs the package aepsych_client (0.5) and a server of AEPsych, which serves one client and one experiment at a time.
Each track of a block has a strategy of its own: points of Sobol's sequence, then those that tell most about the level
with a share of TARGET successes. A level of several dimensions has a parameter for each. Levels on a logarithmic scale
are its logarithms. With --asks N a block ends once a track has had N questions."""
import argparse
import json
import math
import pathlib
import socketserver

from aepsych_client import AEPsychClient

CONFIG = """[common]
parnames = [{names}]
stimuli_per_trial = 1
outcome_types = [binary]
strategy_names = [init_strat, opt_strat]
{parameters}[init_strat]
min_asks = {first}
generator = SobolGenerator
[opt_strat]
min_asks = {asks}
refit_every = 5
generator = OptimizeAcqfGenerator
acqf = EAVC
model = GPClassificationModel
max_gen_time = 0.2
[EAVC]
target = {target!r}
objective = ProbitObjective
"""
PARAMETER = """[{name}]
par_type = continuous
lower_bound = {low!r}
upper_bound = {high!r}
"""


def key_of(dimension):
    return dimension["name"].replace("-", "_")


def place_of(dimension, level):
    return math.log10(level) if dimension["scale"] != "linear" else level


def level_at(dimension, place):
    level = 10**place if dimension["scale"] != "linear" else place
    return min(max(level, dimension["least"]), dimension["most"])


class Track:
    """The strategy of a track, from its first question on."""

    def __init__(self, client, name, ask, options):
        self.client, self.name, self.finished = client, name, False
        # A level of one number has the name "level"; names of dimensions have no "-" for AEPsych.
        self.several = "dimensions" in ask
        self.dimensions = ask["dimensions"] if self.several else [{**ask, "name": "level"}]
        parameters = "".join(PARAMETER.format(name=key_of(one), low=place_of(one, one["least"]), high=place_of(one, one["most"]))
                             for one in self.dimensions)
        names = ", ".join(key_of(one) for one in self.dimensions)
        client.configure(config_str=CONFIG.format(names=names, parameters=parameters, first=options.first, asks=options.asks or 1000,
                                                  target=options.target), config_name=name)

    def tell(self, trial):
        """Trials without an answer and catch trials say nothing about the level."""
        levels = trial.get("levels") if self.several else {"level": trial["level"]}
        if not levels or None in levels.values() or trial["catch_trial"] or not trial["answered"]:
            return
        self.client.resume(config_name=self.name)
        config = {key_of(one): [place_of(one, levels[one["name"]])] for one in self.dimensions}
        self.client.tell(config=config, outcome=int(trial["success"]))

    def answer(self, trial):
        """What to say to a question: levels, or that the block has enough."""
        if self.finished:
            return {"type": "finished", "trial": trial}
        self.client.resume(config_name=self.name)
        asked = self.client.ask()
        config, self.finished = asked["config"], asked["is_finished"]
        levels = {one["name"]: level_at(one, config[key_of(one)][0]) for one in self.dimensions}
        if self.several:
            return {"type": "levels", "trial": trial, "levels": levels}
        return {"type": "level", "trial": trial, "level": levels["level"]}


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
                self.wfile.write(json.dumps(tracks[key].answer(message["trial"])).encode() + b"\n")
            elif message["type"] == "refused":
                print(message["message"])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("socket", type=pathlib.Path)
    parser.add_argument("--ip", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=5555)
    parser.add_argument("--target", type=float, default=0.75, help="share of successes that is sought (0.75)")
    parser.add_argument("--first", type=int, default=10, help="points of Sobol's sequence (10)")
    parser.add_argument("--asks", type=int, help="questions to a track, after which its block ends (as the protocol says)")
    Session.options = parser.parse_args()
    if Session.options.socket.is_socket():
        Session.options.socket.unlink()  # left behind by an earlier run
    socketserver.UnixStreamServer(str(Session.options.socket), Session).serve_forever()
