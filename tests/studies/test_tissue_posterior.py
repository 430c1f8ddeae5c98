"""Posterior over tissues: the emulator against known functions, the sampler against closed forms, one run."""

from dataclasses import replace

import emcee
import numpy as np
import pytest

from fingerpad.core.result_files import from_json, to_json
from fingerpad.core.signals import Traces
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.gerling2014.nerve import PIECES
from fingerpad.experiments.runner import Runner
from fingerpad.inference.fitting.posterior import sample
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.transduction import drive
from presses import Coarse
from studies import finger_posterior, tissue_posterior
from studies.finger_levels import RAMP_MS, SITES, Afferents, bar_rates, deflection_distances_mm
from studies.finger_posterior import (
    LOGARITHMIC,
    PARAMETERS,
    RESTING,
    Finger,
    Likelihood,
    Observations,
    Prior,
    Proposal,
    Sampling,
    adapted,
    from_coordinates,
    log_extremes,
    log_posterior,
    prediction,
    synthetic,
    to_coordinates,
)
from studies.pages import DOCS
from studies.posterior_calibration import Calibration, calibrate
from studies.tissue_candidates import HUMAN, LEVELS
from studies.tissue_design import RANGES, REFERENCE_KPA, design, point_of, shares_of, tissues_at, values_at
from studies.tissue_emulator import Emulator, GaussianProcess, left_out
from studies.tissue_page import POSTERIOR_COLUMNS, posterior_blocks
from studies.tissue_posterior import Pressed, TissuePosterior, like_human
from studies.tissue_search import Skins, bar_traces, touches

# Design


def test_points_of_the_design_fill_the_ranges_evenly_and_a_larger_design_begins_with_a_smaller_one():
    points = design(32)
    for column in points.T:
        assert np.histogram(column, bins=8, range=(0.0, 1.0))[0].tolist() == [4] * 8
    assert (design(64)[:32] == points).all()


def test_tissues_of_a_point_have_its_ratios_and_those_of_human_lie_within():
    values = values_at(design(4))
    for point in values:
        tissues = tissues_at(point)
        assert point_of(tissues) == pytest.approx(point)
        assert tissues.subcutis.shear_modulus_kpa == pytest.approx(REFERENCE_KPA)
        assert [layer.poisson for layer in tissues.layers] == pytest.approx([point[3]] * 4)
    assert shares_of(values) == pytest.approx(design(4))
    human = shares_of(point_of(named_tissues("human")))
    assert ((human > 0.05) & (human < 0.95)).all()


# Emulator


def smooth(points):
    return np.exp(points[:, 0]) * np.sin(2.0 * points[:, 1]) + points[:, 2]


def test_the_error_of_the_emulator_falls_with_the_size_of_the_design():
    new, errors = np.random.default_rng(1).uniform(size=(200, 3)), []
    for n in (8, 16, 32, 64):
        points = design(n)[:, :3]
        errors.append(np.abs(GaussianProcess.fit(points, smooth(points)).mean(new) - smooth(new)).max())
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.02 * np.ptp(smooth(new))


def test_points_left_out_are_predicted_by_an_emulator_that_has_not_seen_them():
    points = design(12)
    values = np.where(np.arange(12)[:, None] == 5, 100.0, points[:, :1])
    emulators, unseen = left_out(points, {"y": values}, 3)
    assert sorted(np.bincount(unseen).tolist()) == [4, 4, 4]
    own = emulators[unseen[5]].predict(points[5:6])["y"]
    assert own == pytest.approx(points[5:6, :1], abs=0.2)


# Calibration


def gaussian_experiments(n, width):
    """Known mean, one observation of deviation 1; the posterior is as wide as it is told to be."""
    random = np.random.default_rng(5)

    truths = 2.0 * random.normal(size=(n, 1))
    # Prior N(0, 2^2), so that the posterior is N(0.8 y, 0.8).
    centres = 0.8 * (truths + random.normal(size=(n, 1)))
    draws = random.normal(centres[:, None], width * np.sqrt(0.8), (n, 500, 1))
    return calibrate(("mean",), zip(truths, draws, strict=True))


def test_a_correct_posterior_is_calibrated():
    found = gaussian_experiments(300, 1.0)
    assert found.wrong() == ()
    assert found.inside(0.5)[0] == pytest.approx(0.5, abs=0.1)
    assert found.inside(0.95)[0] == pytest.approx(0.95, abs=0.04)


@pytest.mark.parametrize("width", [0.4, 2.5])
def test_a_wrong_width_is_detected(width):
    assert gaussian_experiments(100, width).wrong() == ("mean",)


# Sampler


def linear_gaussian():
    """Data y = A x + noise and x ~ N(0, I): precision I + A'A/s^2."""
    random = np.random.default_rng(6)
    matrix, deviation = random.normal(size=(8, 4)), 0.3
    data = matrix @ random.normal(size=4) + deviation * random.normal(size=8)
    precision = np.eye(4) + matrix.T @ matrix / deviation**2
    covariance = np.linalg.inv(precision)
    mean = covariance @ matrix.T @ data / deviation**2

    def log_density(points):
        misfit = (data - points @ matrix.T) / deviation
        return -0.5 * (np.square(points).sum(axis=1) + np.square(misfit).sum(axis=1))

    return log_density, mean, covariance, random


def test_the_posterior_of_a_linear_gaussian_model_is_recovered():
    log_density, mean, covariance, random = linear_gaussian()
    proposal = adapted(log_density, random.normal(size=(800, 4)), random)
    spread = np.sqrt(np.diagonal(covariance))
    chains = sample(
        log_density,
        proposal.centre,
        2.0 * spread,
        tuple("abcd"),
        seed=1,
        n_walkers=40,
        n_steps=100,
        moves=[(proposal.move(), 0.7), (emcee.moves.DEMove(), 0.3)],
    )
    assert chains.flat.mean(axis=0) == pytest.approx(mean, abs=0.1 * spread.max())
    assert np.cov(chains.flat.T) == pytest.approx(covariance, abs=0.1 * spread.max() ** 2)
    assert chains.acceptance > 0.4


# Likelihood


def test_extremes_of_normal_numbers_have_a_density():
    """Its integral over all pairs in order is 1, for any number of subjects."""
    grid = np.linspace(-5.0, 5.0, 51)
    pairs = np.array([(low, high) for low in grid for high in grid if low < high])
    for n in (3, 4):
        density = [np.exp(log_extremes(pair[None], np.zeros((1, 1)), n, (1.0,))[0]) for pair in pairs]
        assert np.sum(density) * (grid[1] - grid[0]) ** 2 == pytest.approx(1.0, abs=0.01)


# A chain of synthetic skins

TIMES_MS = np.concatenate([[0.0, 0.0], np.linspace(5.0, 50.0, 10), [50.0], np.geomspace(60.0, 1000.0, 12)])
SHARES = design(16)


def synthetic_outputs(shares):
    """Outputs that depend on the parameters in a simple way, with plausible sizes."""
    shift, distance = np.linspace(-3.5, 3.5, 36), deflection_distances_mm()
    course = np.minimum(TIMES_MS / 50.0, 1.0)
    rising = np.where((TIMES_MS <= 50.0) & (np.arange(TIMES_MS.size) < 12), 1.0, 0.0)
    rising[0] = 0.0
    z = SITES.half_mm[:, 1]

    def drive(space, held):
        return np.einsum("tn,ns->nts", np.outer(course, held), space), np.einsum("t,ns->nts", rising, space)

    edges = np.exp(-((np.abs(shift) - 1.4) ** 2) / (0.5 + shares[:, :1]))
    held = 0.8 + 0.2 * shares[:, 1]
    bars = np.stack(drive(edges, held), axis=1)
    near = np.exp(-(z**2) / (3.0 + shares[:, 2:3]))
    spheres = np.stack(drive(near, held), axis=1)
    standard = np.stack([spheres, 0.99 * spheres], axis=1)
    comparisons = np.stack([0.02 * standard, 0.2 * standard], axis=1)
    return {
        "deflection": np.exp(-np.abs(distance) / (1.5 + shares[:, :1])),
        "log_force": np.log([0.2, 0.75]) + shares[:, 3:4] - 0.5,
        "log_stress": np.log(5.0) + shares[:, 4:5] - 0.5,
        "bars": bars,
        "standard": standard,
        "comparisons": comparisons,
    }


@pytest.fixture(scope="module")
def finger():
    return Finger(Emulator.fit(SHARES, synthetic_outputs(SHARES)), TIMES_MS)


PRIOR = Prior(np.array([2.0, 0.4, 0.008, 60.0, 0.055]), np.array([3.0, 10.0, 10.0, 2.0, 2.0]))


def truth(n=1):
    values = np.empty((n, len(PARAMETERS)))
    values[:, : len(RANGES)] = values_at(np.full((n, len(RANGES)), 0.5))
    values[:, LOGARITHMIC] = PRIOR.medians
    values[:, RESTING] = 0.2
    return values


def test_coordinates_and_parameters_are_inverse(finger):
    values = PRIOR.draw(50, np.random.default_rng(1))
    outputs = finger.outputs(values)
    assert from_coordinates(to_coordinates(values, outputs), outputs) == pytest.approx(values)


def test_the_prior_has_the_medians_and_bounds_that_it_is_given():
    values = PRIOR.draw(4000, np.random.default_rng(2))
    assert np.median(values[:, LOGARITHMIC], axis=0) == pytest.approx(PRIOR.medians, rel=0.15)
    assert values[:, RESTING].max() <= 0.95
    assert np.median(shares_of(values[:, : len(RANGES)])) == pytest.approx(0.5, abs=0.02)
    assert np.isfinite(PRIOR.log_density(values)).all()
    resting, poisson = truth(), truth()
    resting[0, RESTING], poisson[0, 3] = 0.96, 0.49
    for beyond in (resting, poisson):
        assert PRIOR.log_density(beyond)[0] == -np.inf


def test_the_prior_is_sampled_where_nothing_is_observed(finger):
    """The density in coordinates has the Jacobian that belongs to the prior's own draws."""
    density = log_posterior(finger, Likelihood(Observations.published()), PRIOR, ())
    random = np.random.default_rng(3)
    values = PRIOR.draw(3000, random)
    points = to_coordinates(values, finger.outputs(values))
    proposal = Proposal.of(points.mean(axis=0), np.cov(points.T))
    drawn = proposal.draw(6000, random)
    logarithms = density(drawn) - proposal.log_density(drawn)
    weights = np.exp(logarithms - logarithms.max())
    found = np.average(drawn, axis=0, weights=weights)
    assert found == pytest.approx(points.mean(axis=0), abs=0.15 * points.std(axis=0).max())
    resting = 1.0 - np.exp(drawn[:, RESTING])
    assert np.average(resting, weights=weights) == pytest.approx(values[:, RESTING].mean(), abs=0.1)


def test_a_common_factor_changes_forces_and_gains_only(finger):
    soft, stiff = truth(), truth()
    stiff[:, len(RANGES)] *= 3.0
    stiff[:, [RESTING + 1, RESTING + 2]] /= 3.0
    first, second = finger.predict(soft), finger.predict(stiff)
    assert second.plate_force_n == pytest.approx(3.0 * first.plate_force_n)
    assert second.deflection_mm == pytest.approx(first.deflection_mm)
    assert second.bar_hz == pytest.approx(first.bar_hz)
    assert second.hit_rates == pytest.approx(first.hit_rates)


def test_each_level_is_most_likely_at_the_truth(finger):
    observed = synthetic(
        finger.predict(truth()),
        {"deflection": (1e-3, 0.0), "dynamic": (0.1, 0.0), "static": (0.1, 0.0), "force": (0.05, 0.0)},
        np.random.default_rng(4),
    )
    likelihood, right, wrong = Likelihood(observed), truth(), truth()
    wrong[:, : len(RANGES)] = values_at(np.full((1, len(RANGES)), 0.8))
    wrong[:, LOGARITHMIC] *= 1.5
    good, bad = (likelihood.of_levels(finger.predict(values)) for values in (right, wrong))
    assert all(good[level][0] > bad[level][0] for level in LEVELS)


# Levels


def test_rates_of_a_point_are_those_of_the_papers_model():
    """The same traces through `AfferentModel`, which resamples them more finely."""
    times = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 100.0, 300.0, 1000.0])
    course = np.concatenate([np.linspace(0.0, 1.0, 6) ** 2, [0.98, 0.96, 0.95]])
    traces = Traces(times, np.outer(course, np.linspace(0.5, 2.0, 36)), np.array([50.0]))
    dynamic, static = Skins([traces], {}).model.evaluate(np.array([1e-7, 2e-4, 2e-6, 50.0, 1e-6, 50.0]))
    driven = drive(traces, pieces=8)
    relative = np.array([driven.values, RAMP_MS * driven.rate_per_ms]) / 2.0
    own = Afferents(
        np.array([1e-7 * 50.0 / 5e-5]), np.array([4.0 * 2.0]), np.array([0.04 * 2.0]), np.array([50.0])
    )
    found = bar_rates(own, driven.times_ms, {"bars": relative[None]})
    assert found[0, 0] == pytest.approx(dynamic, abs=0.5)
    assert found[1, 0] == pytest.approx(static, abs=0.1)


# Results


QUICK = Sampling(
    n_walkers=46, n_steps=60, most_steps=480, n_ensembles=2, largest_r_hat=1.2, smallest_effective_size=20.0
)
FEW = replace(QUICK, n_steps=24, most_steps=24, largest_r_hat=9.0, smallest_effective_size=1e-3)
"""Draws for tests of what is made of them, not of their distribution."""


def shorten(patch):
    """Shorten the search for the start of the chains."""
    patch.setattr(finger_posterior, "N_TRIED", 150)
    patch.setattr(finger_posterior, "N_BEST", 40)


def test_experiments_use_pressed_tissues_and_an_emulator_that_has_not_seen_them(monkeypatch):
    shorten(monkeypatch)
    outputs = synthetic_outputs(SHARES)
    human = synthetic_outputs(np.full((1, len(RANGES)), 0.5))
    centres = like_human(SHARES, outputs, human, PRIOR, 0.2)
    tissues = Pressed(SHARES, outputs, TIMES_MS, centres, *left_out(SHARES, outputs, 2))
    residuals = {"deflection": (0.02, 1.0), "dynamic": (4.0, 0.6), "static": (2.0, 0.6), "force": (0.3, 0.0)}
    cases = tissues.experiments(residuals, PRIOR, 2, 1, FEW)
    for case in cases:
        number = int(np.argmin(np.abs(SHARES - shares_of(case.truth[: len(RANGES)])).sum(axis=1)))
        assert shares_of(case.truth[: len(RANGES)]) == pytest.approx(SHARES[number])
        assert case.finger.emulator is tissues.emulators[tissues.unseen[number]]
    assert cases[0].draw().shape[1] == len(PARAMETERS)


# One tiny run


def test_human_keeps_its_rates_and_force_through_the_reference_modulus(shared_folder):
    """Its own skin, scaled to the reference modulus and back, and the model of the search for tissues."""
    runner, conditions, human = Runner(shared_folder), Coarse("quick"), replace(HUMAN, finalist=False)
    times, outputs, _ = tissue_posterior.pressed(runner, conditions, [human])
    prior, six = Prior.about_human(), Afferent.for_tissues("human").parameters
    resting = six[0] * six[3] / (six[4] * six[5])
    shares = shares_of(point_of(HUMAN.tissues))[None]
    found = prediction(like_human(shares, outputs, outputs, prior, resting), outputs, times)
    responses = {key: runner.store.load(touch) for key, touch in touches(human, conditions).items()}
    (bars,) = bar_traces(responses, human, conditions)
    dynamic, static = AfferentModel.of_traces(bars, pieces=PIECES).evaluate(six)
    assert found.bar_hz[0, 0] == pytest.approx(dynamic, abs=1e-6)
    assert found.bar_hz[1, 0] == pytest.approx(static, abs=1e-6)
    force_n = responses["plate", 2.0, 0.0].force_mn[-1] / 1000.0
    assert found.plate_force_n[0, 1] == pytest.approx(force_n)


def synthetic_presses(runner, conditions, candidates):
    shares = shares_of(np.array([point_of(one.tissues) for one in candidates]))
    return TIMES_MS, synthetic_outputs(shares), np.arange(len(shares))


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        sizes = {"N_TISSUES": 8, "N_FOLDS": 2, "N_DRAWN": 20, "N_REPLICATES": 1}
        parts = {"SAMPLING": FEW, "REPEATED": FEW, "pressed": synthetic_presses}
        for name, value in (sizes | parts).items():
            patch.setattr(tissue_posterior, name, value)
        shorten(patch)
        return tissue_posterior.run(Runner(tmp_path_factory.mktemp("posterior")), Conditions("quick", 0))


def test_the_block_shows_every_parameter_and_has_the_form_of_the_page(tiny):
    assert to_json(from_json(TissuePosterior, to_json(tiny))) == to_json(tiny)
    (block,) = posterior_blocks(tiny).values()
    for one in tiny.marginals:
        assert f"| {one.name} | " in block
    assert f"| {' | '.join(POSTERIOR_COLUMNS)} |" in (DOCS / "tissues.md").read_text(encoding="utf-8")
    ends = np.where(np.arange(20)[:, None] % 2, 0.999, 0.001) * np.ones(len(PARAMETERS))
    narrow = Calibration(names=PARAMETERS, shares_below=ends)
    (block,) = posterior_blocks(replace(tiny, calibration=narrow)).values()
    assert "The coverage is wrong by binomial tests for: stratum corneum" in block
    assert "| 0/20 | 0/20 |" in block
