"""Force and path of what is felt through palpate serve, live: python3 serve_plot.py TOKEN_FILE [--out PICTURE.png]

Needs matplotlib. With --out it draws the first so many seconds into a file, without a window.
"""
import argparse
import collections
import pathlib
import sys

import matplotlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "palpate"))
from client import Client, ServeError  # noqa: E402  with the module: from palpate import Client, ServeError

SHOWN = 5.0  # s


class Plot:
    def __init__(self, pyplot):
        self.figure, (force, path) = pyplot.subplots(1, 2, figsize=(10, 4), layout="constrained")
        self.force, = force.plot([], [], color="tab:red")
        force.set(xlabel="s", ylabel="force on the hand, N", xlim=(-SHOWN, 0))
        self.path, = path.plot([], [], color="tab:blue", linewidth=0.8)
        self.tip, = path.plot([], [], "o", color="tab:red")
        path.set(xlabel="x, mm", ylabel="z, mm", aspect="equal", xlim=(-80, 80), ylim=(-80, 80))
        self.axes = force
        self.rows = collections.deque()  # (s, N, x, z)
        self.most = 0.5  # N

    def add(self, samples):
        """Rows of Client.samples()."""
        strength = (samples["force"] ** 2).sum(axis=1) ** 0.5
        seconds = samples["t_ns"] * 1e-9
        self.rows.extend(zip(seconds, strength, 1000 * samples["tip"][:, 0], 1000 * samples["tip"][:, 2]))
        while self.rows and self.rows[0][0] < self.rows[-1][0] - SHOWN:
            self.rows.popleft()

    def draw(self):
        if not self.rows:
            return
        times, strength, x, z = zip(*self.rows)
        self.most = max(self.most, *strength)
        self.force.set_data([t - times[-1] for t in times], strength)
        self.axes.set_ylim(0, 1.05 * self.most)
        self.path.set_data(x, z)
        self.tip.set_data(x[-1:], z[-1:])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("token_file")
    parser.add_argument("--out")
    parser.add_argument("--seconds", type=float, default=2)
    given = parser.parse_args()
    if given.out:
        matplotlib.use("Agg")
    from matplotlib import pyplot

    plot = Plot(pyplot)
    with Client.from_token_file(given.token_file, role="watch") as eye:
        eye.subscribe(250, ("tip", "force"))
        seconds = 0.0
        while pyplot.get_fignums() and not (given.out and seconds >= given.seconds):
            pyplot.pause(0.04)  # draws, and lets the window answer
            plot.add(eye.samples())  # raises ServeError once the server has gone
            plot.draw()
            seconds = plot.rows[-1][0] - plot.rows[0][0] if plot.rows else 0.0
        if given.out:
            plot.figure.savefig(given.out, dpi=100)


if __name__ == "__main__":
    try:
        main()
    except (OSError, ServeError) as reason:
        sys.exit(str(reason))
