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
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "palpate"))
from client import AsyncClient, ServeError  # noqa: E402  with the module: from palpate import AsyncClient, ServeError

SCENE = {"objects": [{"shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 100}]}
FRAME = 1 / 60  # s
MAY_COME_AGAIN = ("emergency", "forces-off", "not-started", "stopped")  # then the scene is put there again
FOREVER = 1e9  # s


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


class Person:
    """Whoever presses Enter at this program's terminal."""

    def __init__(self):
        self.loop, self.pressed = asyncio.get_running_loop(), None
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self):
        for _ in sys.stdin:
            self.loop.call_soon_threadsafe(self._press)

    def _press(self):
        if self.pressed is not None and not self.pressed.done():
            self.pressed.set_result(None)

    async def agrees(self):
        """Only what is pressed from now on counts."""
        print("Look what it was, then press Enter: forces come again.", file=sys.stderr, flush=True)
        self.pressed = self.loop.create_future()
        await self.pressed


async def forces_may_come(hand, person, code):
    """Until a person says so; an emergency is cleared where it was raised."""
    if code == "emergency":
        await hand.wait_for("cleared", FOREVER)
        return
    while True:
        await person.agrees()
        try:
            return await hand.clear()
        except ServeError as error:  # as while the device is unplugged
            if error.code not in MAY_COME_AGAIN:
                raise
            print(error, file=sys.stderr)


async def felt(hand):
    """Keeps the scene before the hand, also after forces went off."""
    person = Person()
    while True:
        try:
            await hand.start(renderer="ray")
            off = await hand.wait_for(("forces_off", "fault"), FOREVER)
            code = off["code"]
            print(f"forces are off: {off['reason']}", file=sys.stderr)
            await hand.stop()
        except ServeError as error:
            if error.code not in MAY_COME_AGAIN:
                raise
            code = error.code
            print(f"forces are off: {error}", file=sys.stderr)
        await forces_may_come(hand, person, code)


async def run(token_file, frames):
    async with await AsyncClient.from_token_file(token_file) as hand:
        await hand.load(SCENE)
        await hand.subscribe(250, ("tip", "tail", "force", "object"))
        feeling = asyncio.ensure_future(felt(hand))
        stylus, shown = Stylus(), 0
        try:
            while shown < frames:
                await asyncio.sleep(FRAME)
                if feeling.done():
                    feeling.result()  # raises what ended it: there will be no more ticks
                stylus.update(hand.samples())
                if stylus.pose is None:
                    continue
                print(json.dumps({"frame": shown, "t": time.monotonic(), "touched": stylus.touched, **stylus.pose}), flush=True)
                shown += 1
        finally:
            feeling.cancel()
            await asyncio.wait([feeling])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("token_file")
    parser.add_argument("--frames", type=int, default=600)
    given = parser.parse_args()
    try:
        asyncio.run(run(given.token_file, given.frames))
    except (OSError, ServeError) as reason:
        sys.exit(f"{given.token_file}: {reason}")
