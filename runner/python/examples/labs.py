"""Simulated labs for the examples: a small protocol, studies side by side on all processors, and their figures."""

import concurrent.futures
import os
import sys

import numpy as np

import palpate

RENDERERS, SHAPES = ("point", "ray"), ("sphere", "cone", "cylinder", "cube")
STANDARD_SIZES_M = (0.03, 0.03, 0.03, 0.06)  # radii of sphere, cone and cylinder, edge of the cube


def protocol(repetitions, sizes_m=STANDARD_SIZES_M):
    """The paper's four shapes with both renderers; cone and cylinder are as high as they are wide."""
    sphere, cone, cylinder, edge = (float(size) for size in sizes_m)
    return {
        "version": 1, "name": "example", "renderers": list(RENDERERS), "repetitions": int(repetitions), "seed": 1,
        "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": sphere},
                    {"name": "cone", "shape": "cone", "radius_m": cone, "height_m": 2 * cone},
                    {"name": "cylinder", "shape": "cylinder", "radius_m": cylinder, "height_m": 2 * cylinder},
                    {"name": "cube", "shape": "cube", "edge_m": edge}],
        "response": {"keys": {"1": "sphere", "2": "cone", "3": "cylinder", "4": "cube"}, "time_out_s": 60}}


def figures(trials):
    """What an analysis sees of a lab, 29 numbers: per renderer and shape the mean log response time and the accuracy, per
    renderer the spread and the fastest tenth of times, the share of time-outs, the time before the first contact and from
    there to the answer (logs), and the spread of participants' mean log times."""
    log_time, out = np.log(trials["response_time"]), []
    contact = np.where(np.isnan(trials["first_contact_time"]), trials["response_time"], trials["first_contact_time"])
    after = np.log(np.maximum(trials["response_time"] - contact, 0.05))
    for renderer in RENDERERS:
        of_renderer = trials["renderer"] == renderer
        for shape in SHAPES:
            cell = of_renderer & (trials["shape"] == shape)
            out += [log_time[cell].mean(), trials["correct"][cell].mean()]
        out += [log_time[of_renderer].std(), np.quantile(log_time[of_renderer], 0.1), trials["timed_out"][of_renderer].mean(),
                np.log(contact[of_renderer]).mean(), after[of_renderer].mean(), np.quantile(after[of_renderer], 0.1)]
    people = trials["participant_id"]
    return np.array(out + [np.std([log_time[people == one].mean() for one in np.unique(people)])])


def simulate_all(studies, what):
    """figures() of every study, a row each. studies: arguments of palpate.simulate, as dicts. Simulation releases the
    interpreter's lock, so threads are enough."""
    rows = []
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            for row in pool.map(lambda study: figures(palpate.simulate(**study)), studies):
                rows.append(row)
                if sys.stderr.isatty():
                    print(f"\r{what}: {len(rows)} of {len(studies)}", end="", file=sys.stderr)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    if sys.stderr.isatty():
        print(file=sys.stderr)
    return np.array(rows)


def save_figure(draw, file):
    """Draws with matplotlib where there is one. draw(pyplot) returns the figure."""
    try:
        import matplotlib
    except ImportError:
        print(f"no {file}: matplotlib (python3-matplotlib) is not installed", file=sys.stderr)
        return
    matplotlib.use("Agg")
    import matplotlib.pyplot as pyplot
    pyplot.rcParams.update({"font.size": 8, "axes.spines.top": False, "axes.spines.right": False})
    draw(pyplot).savefig(file, dpi=130)
    print(f"figure: {file}", file=sys.stderr)
