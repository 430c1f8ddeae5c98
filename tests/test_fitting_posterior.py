"""The sampler against densities whose moments are known; it never returns draws that have not converged."""

import numpy as np
import pytest

from fingerpad.core.errors import ConvergenceError
from fingerpad.core.threads import compiled_threads
from fingerpad.inference.fitting.posterior import (
    credible_band,
    effective_size,
    effective_sizes,
    sample,
    split_r_hat,
)
from refusals import refusals

COVARIANCE = np.array([[4.0, 1.9, 0.0], [1.9, 1.0, 0.0], [0.0, 0.0, 0.01]])
CENTRE = np.array([3.0, -1.0, 0.5])


def normal(points):
    offsets = points - CENTRE
    return -0.5 * np.einsum("ni,ij,nj->n", offsets, np.linalg.inv(COVARIANCE), offsets)


def from_normal(seed, **settings):
    return sample(normal, np.zeros(3), [4.0, 4.0, 1.0], ("a", "b", "c"), seed=seed, **settings)


def test_moments_and_quantiles_of_a_normal_density_come_back():
    chains = from_normal(1, smallest_effective_size=1500.0)
    # A mean of k effective draws errs by sd/sqrt(k), a standard deviation by sd/sqrt(2 k): four times these.
    deviations = np.sqrt(np.diag(COVARIANCE))
    off_centre = np.abs(chains.flat.mean(axis=0) - CENTRE)
    np.testing.assert_array_less(off_centre, 4.0 * deviations / np.sqrt(1500.0))
    np.testing.assert_allclose(chains.flat.std(axis=0), deviations, rtol=4.0 / np.sqrt(2.0 * 1500.0))
    correlation = np.corrcoef(chains.flat, rowvar=False)[0, 1]
    assert correlation == pytest.approx(0.95, abs=0.02)
    band = (credible_band(chains.flat) - CENTRE) / deviations
    np.testing.assert_allclose(band, [[-1.96] * 3, [1.96] * 3], atol=0.2)
    np.testing.assert_allclose(normal(chains.flat), chains.log_densities.ravel(), rtol=1e-12)
    assert (chains.r_hat < 1.01).all()
    assert (chains.tail_effective_sizes >= 1500.0).all()
    assert (chains.autocorrelation_steps * chains.effective_sizes).round().tolist() == [len(chains.flat)] * 3


def test_two_lumps_keep_their_shares():
    """A third of the probability lies to the left, in a lump half as wide."""

    def lumps(points):
        x = points[:, 0]
        left = np.log(1.0 / 3.0 / 0.5) - 0.5 * ((x + 5.0) / 0.5) ** 2
        right = np.log(2.0 / 3.0) - 0.5 * (x - 5.0) ** 2
        return np.logaddexp(left, right)

    chains = sample(lumps, [0.0], [5.0], ("x",), seed=2, smallest_effective_size=800.0)
    assert (chains.flat < 0.0).mean() == pytest.approx(1.0 / 3.0, abs=4.0 * np.sqrt(2.0 / 9.0 / 800.0))
    assert chains.flat[chains.flat < 0.0].std() == pytest.approx(0.5, rel=0.15)


def test_samples_at_a_bound_have_the_right_density():
    """An exponential density has its largest value at its border."""

    def falling(points):
        return np.where(points[:, 0] >= 0.0, -points[:, 0], -np.inf)

    chains = sample(falling, [1.0], [1.0], ("x",), seed=3)
    assert chains.flat.min() >= 0.0
    assert chains.flat.mean() == pytest.approx(1.0, abs=4.0 / np.sqrt(chains.effective_sizes[0]))
    assert credible_band(chains.flat, 0.5)[:, 0] == pytest.approx(np.log([4.0 / 3.0, 4.0]), abs=0.12)


def test_the_seed_fixes_every_bit_and_threads_change_none():
    effort = {"n_steps": 32, "largest_r_hat": 3.0, "smallest_effective_size": 10.0}
    first, other = from_normal(5, **effort), from_normal(6, **effort)
    np.random.random(7)  # noqa: NPY002  # moves the global state, on which nothing may depend
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    with compiled_threads(1):
        again = from_normal(5, **effort)
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002
    np.testing.assert_array_equal(first.draws, again.draws)
    assert not np.array_equal(first.draws, other.draws)
    assert first.n_evaluations == again.n_evaluations > first.flat.shape[0]


def test_draws_that_have_not_converged_are_never_returned():
    with pytest.raises(ConvergenceError, match=r"not converged after 16 steps: .* has R-hat [1-9]") as caught:
        sample(normal, CENTRE + 60.0, [0.1, 0.1, 0.1], ("a", "b", "c"), seed=1, n_steps=8, most_steps=16)
    assert [line.split(" steps")[0] for line in caught.value.history] == ["8", "16"]
    with pytest.raises(ConvergenceError, match=r"effective sample size of \w is only \d+"):
        from_normal(1, n_steps=8, most_steps=8, largest_r_hat=2.0, smallest_effective_size=1e6)


def test_r_hat_detects_ensembles_that_differ_in_location_or_width():
    same = np.random.default_rng(1).normal(size=(4, 60, 20))
    assert split_r_hat(same) < 1.005
    assert split_r_hat(same + np.array([0.6, 0.0, 0.0, 0.0])[:, None, None]) > 1.02
    assert split_r_hat(same * np.array([2.0, 1.0, 1.0, 1.0])[:, None, None]) > 1.02
    drifting = same + np.linspace(0.0, 1.0, 60)[:, None]
    assert split_r_hat(drifting) > 1.02
    assert split_r_hat(np.repeat(np.arange(4.0)[:, None, None], 8, axis=1)) == np.inf
    assert split_r_hat(np.ones((2, 8, 3))) == 1.0


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("n_walkers", [1, 12])
def test_effective_size_of_an_autoregression_is_the_known_one(correlation, n_walkers):
    """Draws with correlation r^t are worth (1 - r)/(1 + r) of as many independent ones."""
    noise = np.random.default_rng(7).normal(size=(4, 2000, n_walkers))
    draws = noise.copy()
    for step in range(1, 2000):
        draws[:, step] = correlation * draws[:, step - 1] + np.sqrt(1.0 - correlation**2) * noise[:, step]
    expected = draws.size * (1.0 - correlation) / (1.0 + correlation)
    assert effective_size(draws) == pytest.approx(expected, rel=0.25)
    assert max(effective_sizes(draws)) <= draws.size
    together = np.repeat(noise[:, :500, :1], 10, axis=2)  # walkers that move together count once
    assert effective_size(together) == pytest.approx(2000.0, rel=0.2)


def round_density(**changes):
    given = {"log_density": lambda points: -0.5 * (points**2).sum(axis=1), "names": ("a", "b"), "seed": 1}
    return sample(**(given | {"centre": [0.0, 0.0], "spread": [1.0, 1.0]} | changes))


test_what_cannot_be_sampled_is_refused = refusals(
    (lambda: round_density(log_density=lambda p: np.full(len(p), np.nan)), "must be a number or -inf"),
    (lambda: round_density(log_density=lambda p: np.full(len(p), -np.inf)), "finite near the centre"),
    (lambda: round_density(log_density=lambda p: np.zeros((len(p), 1))), "one number per point"),
)  # fmt: skip
