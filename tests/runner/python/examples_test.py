"""The examples of runner/python run, and their inference finds what is there: in data whose posterior is known."""

import importlib
import pathlib
import subprocess
import sys

import numpy as np
import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "runner/python/examples"


@pytest.fixture(scope="module", autouse=True)
def on_path():
    sys.path.insert(0, str(EXAMPLES))
    yield
    sys.path.remove(str(EXAMPLES))


@pytest.mark.parametrize("name,words", [("recover_parameters", ("slide speed", "correlation")),
                                        ("choose_sizes", ("standard", "best"))])
def test_an_example_runs_and_repeats_its_results(name, words, tmp_path):
    command = [sys.executable, str(EXAMPLES / f"{name}.py"), "--quick"]
    said = [subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True, timeout=1500).stdout
            for _ in range(2)]
    assert said[0] == said[1]
    for word in words:
        assert word in said[0]
    assert "nan" not in said[0]
    assert list(tmp_path.iterdir()) == []


def linear_labs(random, n):
    """Figures of labs that are the settings' logits, mixed, with normal noise, and figures that say nothing."""
    shares = random.random((n, 5))
    x = np.log(shares / (1 - shares))
    seed = 5
    mixing = np.random.default_rng(seed).normal(size=(5, 8))
    return shares, np.column_stack([x @ mixing + random.normal(size=(n, 8)), random.normal(size=(n, 6))])


def test_the_posterior_is_calibrated_and_follows_the_truth():
    module = importlib.import_module("recover_parameters")
    seed = 3
    random = np.random.default_rng(seed)
    inference = module.Inference(*linear_labs(random, 3000), keep=0.2)
    shares, figures = linear_labs(random, 600)
    means, ranks = module.calibrate(inference, shares, figures)
    for i in range(5):
        assert module.uniformity(ranks[:, i])[1] > 0.001
        assert np.corrcoef(means[:, i], shares[:, i])[0, 1] > 0.85
    # Ranks that are not uniform are detected: of a posterior that is too narrow, and of a biased one.
    for wrong in (0.5 + 1.5 * (ranks - 0.5), ranks**1.5):
        assert module.uniformity(np.clip(wrong[:, 0], 0, 1))[1] < 0.001


def test_the_prior_has_its_distribution_and_bounds():
    module = importlib.import_module("recover_parameters")
    np.testing.assert_allclose(module.values_of(np.zeros(5)), module.LOW)
    np.testing.assert_allclose(module.values_of(np.ones(5)), module.HIGH)
    person = module.person(np.full(5, 0.5))
    assert person["motor"]["slide_speed_m_per_s"] == pytest.approx(np.sqrt(0.02 * 0.15))
    assert person["observer"]["threshold"] == pytest.approx((0.7 + 0.99) / 2)
    seed = 4
    random = np.random.default_rng(seed)
    inference = module.Inference(*linear_labs(random, 500), keep=0.2)
    draws, weights = inference.posterior(np.full(14, 50.0))
    assert ((draws >= 0) & (draws <= 1)).all()
    assert weights.sum() == pytest.approx(1)


def test_d_prime_is_that_of_normal_figures():
    module = importlib.import_module("choose_sizes")
    seed = 6
    random = np.random.default_rng(seed)
    is_three = np.arange(400) % 2 == 1
    noise = random.normal(size=(400, 6))
    nothing, error = module.separation(noise, is_three)
    assert nothing < 3 * error
    for shift in (1, 1.5, 3):  # of two independent figures: shift * sqrt(2) in all
        figures = noise.copy()
        figures[is_three, :2] += shift
        found, error = module.separation(figures, is_three)
        assert abs(found - shift * np.sqrt(2)) < 3 * error
    mirrored, _ = module.separation(-figures * 7 + 3, is_three)  # the unit of a figure does not matter
    assert mirrored == pytest.approx(found)
