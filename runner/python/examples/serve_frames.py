"""Poses for a game engine, as Unity would take them 60 times a second: python3 serve_frames.py TOKEN_FILE --frames N

A scene is put before the hand, and each frame gets the newest stylus and force, never a backlog: a line of JSON with the
position of the grip, the direction it points to, and whether it touches. In C# the same messages go over
System.Net.WebSockets.ClientWebSocket with AddSubProtocol("palpate.1").
"""
import argparse
import asyncio
import json
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "palpate"))
from client import AsyncClient, ServeError  # noqa: E402  with the module: from palpate import AsyncClient, ServeError

SCENE = {"objects": [{"shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 100}]}
FRAME = 1 / 60  # s


def to_engine(v):
    """Metres with y up and a left hand, as Unity has them; palpate has z up and a right hand."""
    x, y, z = map(float, v)
    return [x, z, y]


class Stylus:
    """What a frame needs of the ticks since the last one."""

    def __init__(self):
        self.pose, self.touched = None, False

    def update(self, samples):
        if not len(samples["tick"]):
            return
        tip, tail = samples["tip"][-1], samples["tail"][-1]
        self.pose = {"tip": to_engine(tip), "points_to": to_engine(tip - tail), "force": to_engine(samples["force"][-1])}
        self.touched = bool((samples["object"] >= 0).any())  # a tap between two frames is not lost


async def felt(hand):
    """Keeps the scene before the hand, also after forces went off."""
    while True:
        try:
            await hand.start(renderer="ray")
            await hand.wait_for("forces_off", 1e6)
        except ServeError as error:
            if error.code == "closed":
                return
        await hand.stop()
        await hand.clear()


async def run(token_file, frames):
    async with await AsyncClient.from_token_file(token_file) as hand:
        await hand.load(SCENE)
        await hand.subscribe(250, ("tip", "tail", "force", "object"))
        feeling = asyncio.ensure_future(felt(hand))
        stylus, shown = Stylus(), 0
        while shown < frames:
            await asyncio.sleep(FRAME)
            stylus.update(hand.samples())
            if stylus.pose is None:
                continue
            print(json.dumps({"frame": shown, "t": time.monotonic(), "touched": stylus.touched, **stylus.pose}), flush=True)
            shown += 1
        feeling.cancel()
        await asyncio.gather(feeling, return_exceptions=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("token_file")
    parser.add_argument("--frames", type=int, default=600)
    given = parser.parse_args()
    asyncio.run(run(given.token_file, given.frames))
