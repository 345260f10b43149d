#!/usr/bin/env python3
"""Five settings of the simulated participant from a lab's data, by approximate Bayesian computation, and how far that can
be trusted, by simulation-based calibration.

Labs are simulated with settings drawn from the prior. The nearest to a lab's data are kept (rejection), on statistics that
are regressions of the settings on its figures (Fearnhead & Prangle 2012), and a weighted local-linear regression moves them
to the data (Beaumont, Zhang & Balding 2002), on the logit scale of the prior's range, so that it is never left.

Calibration (Talts et al. 2018): every lab of a second set, whose settings are known, is analysed alike. Over them the
rank of the true setting among the posterior's draws is uniform if the posterior is right.

Usage: PYTHONPATH=.build/release/runner/python python3 runner/python/examples/recover_parameters.py [--quick]
"""

import argparse

import numpy as np

import palpate
from labs import protocol, save_figure, simulate_all

# Name, place in the settings, range of the prior (log-uniform; the threshold uniform), unit.
PARAMETERS = (("direction noise", ("percept", "direction_sd_deg"), 5, 40, "deg"),
              ("threshold", ("observer", "threshold"), 0.7, 0.99, ""),
              ("non-decision time", ("observer", "non_decision_s"), 0.4, 4, "s"),
              ("l", ("observer", "movement_scale_m"), 0.01, 0.1, "m"),
              ("slide speed", ("motor", "slide_speed_m_per_s"), 0.02, 0.15, "m/s"))
IS_LOG = np.array([name != "threshold" for name, *_ in PARAMETERS])
LOW, HIGH = (np.array([p[i] for p in PARAMETERS], float) for i in (2, 3))


def values_of(share):
    """Settings at shares (0 to 1) of the prior."""
    return np.where(IS_LOG, LOW * (HIGH / LOW) ** share, LOW + (HIGH - LOW) * share)


def person(share):
    out = palpate.settings(3)
    for (_, (group, key), *_), value in zip(PARAMETERS, values_of(share)):
        out[group][key] = value
    return out


def logit(share):
    return np.log(share / (1 - share))


def expit(x):
    return 1 / (1 + np.exp(-x))


class Inference:
    """Draws from the posterior of a lab, given labs that were simulated over the prior."""

    def __init__(self, shares, figures, keep):
        """shares: labs x settings; figures: labs x figures; keep: share of the labs that is kept, those nearest."""
        self.targets = logit(shares)
        self.centre, self.scale = figures.mean(0), np.maximum(figures.std(0), 1e-9)
        terms = self._terms(figures)
        ridge = 3.0 * np.eye(terms.shape[1])
        ridge[0, 0] = 0
        self.weights = np.linalg.solve(terms.T @ terms + ridge, terms.T @ self.targets)
        self.statistics = terms @ self.weights
        self.spread = self.statistics.std(0)
        self.kept = max(30, round(keep * len(shares)))

    def _terms(self, figures):
        z = np.clip((np.atleast_2d(figures) - self.centre) / self.scale, -4, 4)
        return np.column_stack([np.ones(len(z)), z, z**2 - 1])

    def posterior(self, figures):
        """Shares of the prior, a row a draw, and their weights (sum 1). figures: of one lab."""
        offset = (self.statistics - self._terms(figures) @ self.weights) / self.spread
        distance = np.sqrt((offset**2).sum(1))
        near = np.argsort(distance)[: self.kept]
        weight = np.maximum(1 - (distance[near] / distance[near].max()) ** 2, 1e-6)  # Epanechnikov
        x = np.column_stack([np.ones(len(near)), offset[near]])
        ridge = 1e-6 * weight.sum() * np.eye(x.shape[1])
        slope = np.linalg.solve(x.T @ (weight[:, None] * x) + ridge, x.T @ (weight[:, None] * self.targets[near]))
        return expit(self.targets[near] - offset[near] @ slope[1:]), weight / weight.sum()


def weighted_quantile(draws, weights, q):
    order = np.argsort(draws)
    return np.interp(q, np.cumsum(weights[order]) - 0.5 * weights[order], draws[order])


def calibrate(inference, shares, figures):
    """Of every test lab and setting: the posterior's mean (share of the prior) and the rank (0 to 1) of the truth."""
    means, ranks = [], []
    for truth, lab in zip(shares, figures):
        draws, weights = inference.posterior(lab)
        means.append(weights @ draws)
        ranks.append(((draws < truth) * weights[:, None]).sum(0))
    return np.array(means), np.array(ranks)


def uniformity(ranks, bins=10):
    """Chi squared of equal bins and its p, from simulated uniform ranks: no table is needed."""
    def chi2(r):
        counts = np.apply_along_axis(lambda one: np.histogram(one, bins, (0, 1))[0], -1, r)
        return ((counts - r.shape[-1] / bins) ** 2).sum(-1) / (r.shape[-1] / bins)
    found = chi2(ranks)
    return found, (chi2(np.random.default_rng(1).random((4000, len(ranks)))) >= found).mean()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--simulations", type=int, default=1500, help="labs over the prior; a sixth more to calibrate")
    parser.add_argument("--participants", type=int, default=6, help="of a lab")
    parser.add_argument("--repetitions", type=int, default=1, help="of each shape with each renderer")
    parser.add_argument("--keep", type=float, default=0.2, help="share of the labs that is kept")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--figure", help="PNG to write, with matplotlib")
    parser.add_argument("--quick", action="store_true", help="a try in seconds; too few labs to trust")
    options = parser.parse_args()
    if options.quick:
        options.simulations, options.participants = 60, 1

    random = np.random.default_rng(options.seed)
    tests = max(20, options.simulations // 6)
    shares = random.random((options.simulations + tests, len(PARAMETERS)))
    study = protocol(options.repetitions)
    figures = simulate_all([{"protocol": study, "settings": person(share), "participants": options.participants,
                             "seed": options.seed * 1_000_000 + i} for i, share in enumerate(shares)], "labs")
    inference = Inference(shares[tests:], figures[tests:], options.keep)

    print(f"A lab of {options.participants} participants, {8 * options.repetitions} trials each:\n")
    print(f"{'':20}{'truth':>10}{'median':>10}{'95 % interval':>22}")
    draws, weights = inference.posterior(figures[0])
    for i, (name, _, _, _, unit) in enumerate(PARAMETERS):
        low, middle, high = (values_of(np.full(len(PARAMETERS), weighted_quantile(draws[:, i], weights, q)))[i]
                             for q in (0.025, 0.5, 0.975))
        print(f"{name:20}{values_of(shares[0])[i]:10.3g}{middle:10.3g}{low:11.3g} to{high:8.3g} {unit}")

    means, ranks = calibrate(inference, shares[:tests], figures[:tests])
    print(f"\nOver {tests} labs: does the posterior's mean follow the truth, and are its intervals right?\n")
    print(f"{'':20}{'correlation':>12}{'sd left':>9}{'in 50 %':>9}{'in 90 %':>9}{'chi2(9)':>9}{'p':>7}")
    for i, (name, *_) in enumerate(PARAMETERS):
        inside = [(np.abs(ranks[:, i] - 0.5) < share / 2).mean() for share in (0.5, 0.9)]
        left = np.sqrt(((means - shares[:tests])[:, i] ** 2).mean()) / np.sqrt(1 / 12)
        chi2, p = uniformity(ranks[:, i])
        print(f"{name:20}{np.corrcoef(means[:, i], shares[:tests, i])[0, 1]:12.2f}{left:9.2f}{inside[0]:9.2f}{inside[1]:9.2f}"
              f"{chi2:9.1f}{p:7.2f}")
    print("\nsd left: error of the mean, 1 where the data say nothing; p: of a rank that is uniform.")

    def draw(pyplot):
        figure, axes = pyplot.subplots(2, len(PARAMETERS), figsize=(10, 4), layout="constrained")
        for i, (name, _, _, _, unit) in enumerate(PARAMETERS):
            truth, mean = (np.array([values_of(s)[i] for s in x]) for x in (shares[:tests], means))
            top, bottom = axes[0, i], axes[1, i]
            top.plot(truth, mean, ".", ms=3, alpha=0.6)
            top.plot([LOW[i], HIGH[i]], [LOW[i], HIGH[i]], "k-", lw=0.7)
            ticks = [LOW[i], np.sqrt(LOW[i] * HIGH[i]) if IS_LOG[i] else (LOW[i] + HIGH[i]) / 2, HIGH[i]]
            words = [f"{tick:.2g}" for tick in ticks]
            for axis, scale in ((top.xaxis, top.set_xscale), (top.yaxis, top.set_yscale)):
                scale("log" if IS_LOG[i] else "linear")
                axis.set_ticks(ticks, labels=words)
                axis.set_minor_locator(pyplot.NullLocator())
            top.set(title=name, xlabel="truth" + (f", {unit}" if unit else ""), ylabel="posterior mean" if i == 0 else "")
            bottom.hist(ranks[:, i], 10, (0, 1), color="0.6")
            bottom.axhline(tests / 10, color="k", lw=0.7)
            bottom.set(xlabel="rank of the truth", ylabel="labs" if i == 0 else "")
        return figure

    if options.figure:
        save_figure(draw, options.figure)


if __name__ == "__main__":
    main()
