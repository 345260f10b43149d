"""Proposes levels: python3 propose_levels.py levels.sock & palpate simulate P.json --db F --ask levels.sock
Accelerated stochastic approximation (Kesten 1958): smaller steps the more often the answers have turned."""
import json
import pathlib
import socketserver
import sys
TARGET = 0.75  # share of successes at which it converges

def next_level(ask, trials):
    level, turned = ask["own"], 0
    for n, trial in enumerate(trials):
        turned += n > 0 and trial["success"] != trials[n - 1]["success"]
        step = (ask["most"] - ask["least"]) / (n + 1 if n < 2 else 2 + turned)
        level = trial["level"] - step * (trial["success"] - TARGET)
    return min(max(level, ask["least"]), ask["most"])

class Session(socketserver.StreamRequestHandler):
    def handle(self):
        trials = []
        for message in map(json.loads, self.rfile):
            trials += message.get("history", [message] if message["type"] == "tell" else [])
            if message["type"] == "ask":
                own = [t for t in trials if all(t[key] == message[key] for key in ("block", "track"))]
                level = next_level(message, [t for t in own if t["answered"] and not t["catch_trial"]])
                answer = {"type": "level", "trial": message["trial"], "level": level}
                self.wfile.write(json.dumps(answer).encode() + b"\n")

if pathlib.Path(sys.argv[1]).is_socket():
    pathlib.Path(sys.argv[1]).unlink()  # left behind by an earlier run
socketserver.UnixStreamServer(sys.argv[1], Session).serve_forever()
