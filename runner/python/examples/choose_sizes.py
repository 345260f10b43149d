#!/usr/bin/env python3
"""Sizes of the four shapes with which one lab's study tells best whether its people are like version 2 or version 3 of the
simulated participant.

At each of many sets of sizes labs of both versions are simulated. How well they can be told apart is d', the distance of the
versions' mean scores in standard deviations of a lab's score, with a linear discriminant of the other labs as the score (n
times as many participants give about sqrt(n) times the d'). A quadratic surface over the sizes smooths these; its best set
is tried again, with new labs, beside the standard sizes: the winner of many noisy estimates looks better than it is.

Usage: PYTHONPATH=.build/release/runner/python python3 runner/python/examples/choose_sizes.py [--quick]
"""

import argparse

import numpy as np

import palpate
from labs import SHAPES, STANDARD_SIZES_M, protocol, save_figure, simulate_all

LOW, HIGH = np.array([0.015] * 3 + [0.03]), np.array([0.04] * 3 + [0.065])  # larger ones reach the hand's start


def latin_hypercube(n, dimensions, random):
    return (np.column_stack([random.permutation(n) for _ in range(dimensions)]) + random.random((n, dimensions))) / n


def scores(figures, is_three, shrinkage=0.5):
    """Log odds of version 3 for each lab, from a linear discriminant of all the other labs."""
    z = (figures - figures.mean(0)) / np.maximum(figures.std(0), 1e-9)
    out = np.empty(len(z))
    for i in range(len(z)):
        others = np.arange(len(z)) != i
        two, three = z[others & ~is_three], z[others & is_three]
        within = np.vstack([two - two.mean(0), three - three.mean(0)])
        covariance = within.T @ within / (len(within) - 2)
        covariance = (1 - shrinkage) * covariance + shrinkage * np.diag(np.maximum(np.diag(covariance), 1e-3))
        direction = np.linalg.solve(covariance, three.mean(0) - two.mean(0))
        out[i] = (z[i] - (three.mean(0) + two.mean(0)) / 2) @ direction
    return out


def separation(figures, is_three):
    """d' of a lab's score between the versions, and its standard error over labs (Hedges 1981, large samples)."""
    score = scores(figures, is_three)
    two, three = score[~is_three], score[is_three]
    found = (three.mean() - two.mean()) / np.sqrt((two.var(ddof=1) + three.var(ddof=1)) / 2)
    return found, np.sqrt(1 / len(two) + 1 / len(three) + found**2 / (2 * len(score)))


def labs_at(sizes, options, first_seed):
    """Arguments of labs of both versions in turn."""
    people = [palpate.settings(2), palpate.settings(3)]
    return [{"protocol": protocol(options.repetitions, sizes), "settings": people[i % 2],
             "participants": options.participants, "seed": first_seed + i} for i in range(2 * options.labs)]


def surface(shares):
    x = 2 * shares - 1
    products = [x[:, i] * x[:, j] for i in range(x.shape[1]) for j in range(i, x.shape[1])]
    return np.column_stack([np.ones(len(x)), x, *products])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--designs", type=int, default=30, help="sets of sizes that are tried")
    parser.add_argument("--labs", type=int, default=24, help="of each version at each set")
    parser.add_argument("--participants", type=int, default=1, help="of a lab")
    parser.add_argument("--repetitions", type=int, default=1, help="of each shape with each renderer")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--figure", help="PNG to write, with matplotlib")
    parser.add_argument("--quick", action="store_true", help="a try in seconds; too few labs to trust")
    options = parser.parse_args()
    if options.quick:
        options.designs, options.labs = 3, 8

    random = np.random.default_rng(options.seed)
    shares = latin_hypercube(options.designs, 4, random)
    designs = LOW * (HIGH / LOW) ** shares
    studies = [lab for d, sizes in enumerate(designs) for lab in labs_at(sizes, options, 1_000_000 * options.seed + 1000 * d)]
    figures = simulate_all(studies, "labs").reshape(options.designs, 2 * options.labs, -1)
    is_three = np.arange(2 * options.labs) % 2 == 1
    found, errors = np.array([separation(one, is_three) for one in figures]).T

    terms = surface(shares)
    ridge = np.eye(terms.shape[1])
    ridge[0, 0] = 0
    fitted = np.linalg.solve(terms.T @ terms + ridge, terms.T @ found)
    tries = random.random((20000, 4))
    best_share = tries[np.argmax(surface(tries) @ fitted)]
    best = LOW * (HIGH / LOW) ** best_share

    print(f"d' between the versions, for a lab of {options.participants} participants with "
          f"{8 * options.repetitions} trials each:\n")
    print("".join(f"{shape + ', mm':>14}" for shape in SHAPES) + f"{'d':>9}'{'se':>8}")
    for d in np.argsort(-found)[:5]:
        print("".join(f"{1000 * size:14.0f}" for size in designs[d]) + f"{found[d]:10.2f}{errors[d]:8.2f}")
    print(f"{'...':>14}\n\nTried again with new labs (radii; edge of the cube):\n")
    again = []
    for number, (name, sizes) in enumerate((("standard", STANDARD_SIZES_M), ("best", best))):
        labs = labs_at(sizes, argparse.Namespace(**{**vars(options), "labs": 4 * options.labs}),
                       1_000_000 * options.seed + 500_000 + 1000 * number)
        once_more = separation(simulate_all(labs, name), np.arange(len(labs)) % 2 == 1)
        again.append((name, *once_more))
        print(f"{name:10}" + "".join(f"{1000 * size:8.0f}" for size in sizes) + f" mm: d' {once_more[0]:.2f} (se {once_more[1]:.2f})")

    def draw(pyplot):
        figure, axes = pyplot.subplots(1, 5, figsize=(10, 2.4), layout="constrained", sharey=True)
        for i, shape in enumerate(SHAPES):
            axes[i].errorbar(1000 * designs[:, i], found, errors, fmt=".", ms=4, lw=0.6, color="C0")
            axes[i].axvline(1000 * best[i], color="C3", lw=1)
            axes[i].set(xlabel=f"{shape}, {'edge' if shape == 'cube' else 'radius'}, mm")
        axes[0].set(ylabel="d' between the versions")
        axes[4].bar([one[0] for one in again], [one[1] for one in again], yerr=[one[2] for one in again], color=["0.6", "C3"])
        axes[4].set(xlabel="new labs")
        return figure

    if options.figure:
        save_figure(draw, options.figure)


if __name__ == "__main__":
    main()
