"""Keyed random numbers: known answers, agreement with NumPy, independence of order and threads."""

from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import chi2, kstest

from fingerpad.core.random_streams import Purpose, normals, numbered, uniforms
from fingerpad.core.random_streams import words as scrambled
from refusals import refusals


def test_the_scrambler_gives_the_published_answer():
    """The known answer that came with the algorithm: ten rounds of zeros."""
    words = [f"{int(word):016x}" for word in scrambled(0, 0, 0, 0, 0)]
    assert words == ["16554d9eca36314c", "db20fe9d672d0fdc", "d7e772cee186176b", "7e68b68aec7ba23b"]


def test_uniform_numbers_are_those_of_numpy_to_the_bit():
    """An independent implementation, with carries between halves that the known answer may not meet."""
    seeds, places = (0, 1, 2**40 + 17, 2**63 - 1), ((0, 0), (3, 5), (2**62, 1), (1, 2**62))
    for seed, (trial, receptor), purpose in product(seeds, places, Purpose):
        counter = np.array([0, 0, receptor, trial], dtype=np.uint64)
        ours = uniforms(seed, [trial], [receptor], purpose, 41)[0, 0]
        numpys = np.random.Philox(counter=counter, key=np.array([seed, purpose], dtype=np.uint64))
        assert_array_equal(ours, np.random.Generator(numpys).random(41))


def test_normal_numbers_follow_from_uniform_ones_by_box_and_muller():
    u = uniforms(5, 3, 4, Purpose.THRESHOLD, 12).reshape(3, 4, 6, 2)
    radius, angle = np.sqrt(-2.0 * np.log(1.0 - u[..., 0])), 2.0 * np.pi * u[..., 1]
    expected = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1).reshape(3, 4, 12)
    assert_allclose(normals(5, 3, 4, Purpose.THRESHOLD, 12), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("draw", [uniforms, normals])
def test_neither_order_nor_company_nor_threads_change_a_number(draw):
    whole = draw(11, 6, 7, Purpose.CURRENT, 9)
    backwards = draw(11, [5, 4, 3, 2, 1, 0], [6, 5, 4, 3, 2, 1, 0], Purpose.CURRENT, 9)
    assert_array_equal(backwards[::-1, ::-1], whole)
    assert_array_equal(draw(11, [2], [3], Purpose.CURRENT, 4)[0, 0], whole[2, 3, :4])
    with ThreadPoolExecutor(4) as pool:
        parts = list(pool.map(lambda trial: draw(11, [trial], 7, Purpose.CURRENT, 9), range(6)))
    assert_array_equal(np.concatenate(parts), whole)


def test_numbers_have_their_distributions():
    assert kstest(uniforms(1, 20, 50, Purpose.ESCAPE, 40).ravel(), "uniform").pvalue > 0.001
    assert kstest(normals(1, 20, 50, Purpose.ESCAPE, 40).ravel(), "norm").pvalue > 0.001
    # A number of streams means the first ones.
    assert numbered("trials", 2).tolist() == [0, 1]
    assert_array_equal(uniforms(1, 2, 3, Purpose.GAIN, 2), uniforms(1, range(2), range(3), Purpose.GAIN, 2))


def neighbours():
    """Many streams, beside those one step away in every part of the key."""
    count, n = 25, 40
    here = normals(100, n, n, Purpose.GAIN, count)
    return {
        "seed": (here, normals(101, n, n, Purpose.GAIN, count)),
        "trial": (here[:-1], here[1:]),
        "receptor": (here[:, :-1], here[:, 1:]),
        "purpose": (here, normals(100, n, n, Purpose.THRESHOLD, count)),
        "number": (here[..., :-1], here[..., 1:]),
        "trial against receptor": (here, here.swapaxes(0, 1)),
    }


def test_streams_with_neighbouring_keys_are_not_correlated():
    """The correlation of n independent pairs is normal with variance 1/n."""
    for step, (first, second) in neighbours().items():
        pairs = first.size
        if step == "trial against receptor":  # the diagonal is the same number twice
            off = ~np.eye(len(first), dtype=bool)
            first, second = first[off], second[off]
            pairs = first.size / 2  # (i, j) with (j, i) and the reverse are one pair
        correlation = float(np.mean(first * second))
        assert abs(correlation) * np.sqrt(pairs) < 3.5, step


def test_first_numbers_of_many_streams_fill_the_unit_interval_evenly():
    """What a threshold noise uses first: number 0 of each stream, over 10,000 neighbouring keys."""
    first = uniforms(3, 100, 100, Purpose.THRESHOLD, 1).ravel()
    counts = np.bincount((first * 64).astype(int), minlength=64)
    statistic = np.sum((counts - first.size / 64) ** 2) / (first.size / 64)
    assert chi2.ppf(0.001, 63) < statistic < chi2.ppf(0.999, 63)


KEY = {"seed": 1, "trials": 1, "receptors": 1, "purpose": Purpose.GAIN, "count": 1}


test_a_key_is_made_of_whole_numbers = refusals(
    ({"seed": -1}, "seed must be a whole number of at least 0"),
    ({"seed": 2**63}, "seed must be at most"),
    ({"seed": 0.5}, ("seed",)),
    ({"trials": 0}, "trials must be a whole number of at least 1"),
    ({"trials": [-1]}, ("trials",)),
    ({"receptors": [1.5]}, ("receptors",)),
    ({"purpose": 1}, "purpose must be of type Purpose"),
    ({"count": -1}, ("count",)),
    call=lambda change: uniforms(**(KEY | change)),
)  # fmt: skip
