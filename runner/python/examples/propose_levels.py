"""Proposes the levels of adaptive blocks to `palpate run` or `palpate simulate` (--ask SOCKET).

    python3 propose_levels.py levels.sock &
    palpate simulate protocols/stiffness-2afc.json --db asked.db --participants 1 --ask levels.sock

Accelerated stochastic approximation (Kesten 1958): smaller steps the more often the answers have turned.
"""
import json
import socketserver
import sys

TARGET = 0.75  # share of successes at which it converges


class Track:
    def __init__(self, level, step):
        self.level, self.step, self.shown, self.turns, self.before = level, step, 0, 0, None

    def learn(self, success):
        self.turns += self.before is not None and self.before != success
        self.before, self.shown = success, self.shown + 1
        self.level -= self.step / (self.shown if self.shown < 3 else 2 + self.turns) * (success - TARGET)


class Session(socketserver.StreamRequestHandler):
    def handle(self):
        tracks, trials = {}, []
        for line in self.rfile:
            message = json.loads(line)
            if message["type"] == "begin":
                trials = message["history"]  # of a session that goes on
            elif message["type"] == "tell":
                trials.append(message)
            elif message["type"] == "ask":
                least, most = message["least"], message["most"]
                track = tracks.setdefault((message["block"], message["track"]), Track(message["own"], most - least))
                for trial in [t for t in trials if (t["block"], t["track"]) == (message["block"], message["track"])]:
                    trials.remove(trial)
                    if trial["answered"] and not trial["catch_trial"]:
                        track.learn(trial["success"])
                answer = {"type": "level", "trial": message["trial"], "level": min(max(track.level, least), most)}
                self.wfile.write((json.dumps(answer) + "\n").encode())


if __name__ == "__main__":
    with socketserver.UnixStreamServer(sys.argv[1], Session) as server:
        server.serve_forever()
