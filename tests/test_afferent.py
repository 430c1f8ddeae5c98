import tracemalloc
from dataclasses import fields, replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fingerpad import Afferent, InputError, Traces, named_tissues
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.threads import BLOCK
from fingerpad.data import neuron
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.spikes import firing_rate_hz
from fingerpad.neuron.transduction import drive
from refusals import refusals
from sections import SED_DRIVEN


def ramp_and_hold(*peaks_kpa):
    return Traces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 1.0], peaks_kpa), kinks_ms=[50.0])


def test_the_stages_are_chained():
    afferent, sed = replace(SED_DRIVEN, static_gain=1.5e-6), ramp_and_hold(1.0, 2.0)
    by_hand = afferent.membrane.spikes(afferent.transduction.current(sed))
    assert by_hand.times_ms.size > 20
    assert_array_equal(afferent.spikes(sed).times_ms, by_hand.times_ms)
    dynamic_hz, static_hz = afferent.rates(sed)
    assert_array_equal(dynamic_hz, firing_rate_hz(by_hand, (30.0, 50.0)))
    assert_array_equal(static_hz, firing_rate_hz(by_hand, (600.0, 950.0)))


def test_the_default_afferent_is_that_of_the_default_tissues():
    """It is silent in a hold below its threshold, and answers more for more above it."""
    afferent = Afferent()
    assert afferent == Afferent.for_tissues(DEFAULT_TISSUES)
    assert (afferent.dynamic_quantity, afferent.static_quantity) == ("stored", "von_mises")
    energy = ramp_and_hold(*(afferent.static_threshold * np.array([0.0, 0.95, 1.2, 4.0, 20.0])))
    stress = replace(energy, quantity="von_mises", dynamic=energy)
    dynamic_hz, static_hz = afferent.rates(stress)
    assert dynamic_hz[0] == static_hz[0] == static_hz[1] == 0.0
    assert (np.diff(dynamic_hz[2:]) > 0).all()
    assert (np.diff(static_hz[1:]) > 0).all()
    assert (dynamic_hz[2:] > static_hz[2:]).all()


def test_only_the_sets_with_an_afferent_of_their_own_differ_from_trial_3():
    assert Afferent.for_tissues("paper").dynamic_quantity == SED_DRIVEN.dynamic_quantity == STORED_ENERGY
    assert len({Afferent.for_tissues(name) for name in ("human", "paper", "trial3")}) == 3
    for other in ("trial1", "wu2007", named_tissues("human")):
        assert Afferent.for_tissues(other) == Afferent.for_tissues("trial3")


def test_the_afferent_of_trial_3_answers_like_an_sai():
    """Fast in the ramp, slow in the hold, more for more: SED of a 1 mm touch is 1 to 2 kPa."""
    dynamic_hz, static_hz = SED_DRIVEN.rates(ramp_and_hold(0.0, 1.0, 1.5, 2.0))
    assert dynamic_hz[0] == static_hz[0] == 0.0
    assert (np.diff(dynamic_hz) > 0).all()
    assert (np.diff(static_hz) > 0).all()
    assert 100.0 < dynamic_hz[1] < dynamic_hz[3] < 250.0
    assert 20.0 < static_hz[1] < 40.0
    assert 50.0 < static_hz[3] < 70.0


def test_the_printed_dynamic_gain_is_silent_in_the_ramp():
    """The reason for DYNAMIC_GAIN_SCALE."""
    start = {
        "intercept_ma": neuron.INTERCEPT_START.value,
        "static_gain": neuron.STATIC_GAIN_START_1.value,
        "time_constant_ms": neuron.TIME_CONSTANT.value,
        "capacitance_mf": neuron.CAPACITANCE.value,
        "threshold_mv": neuron.THRESHOLD.value,
    }
    gain = neuron.DYNAMIC_GAIN_START_1.value
    sed = ramp_and_hold(1.0, 2.0, 3.0)
    without = replace(SED_DRIVEN, dynamic_gain=0.0, **start).rates(sed)[0]
    assert_array_equal(replace(SED_DRIVEN, dynamic_gain=gain, **start).rates(sed)[0], without)
    rescaled = replace(SED_DRIVEN, dynamic_gain=gain * neuron.DYNAMIC_GAIN_SCALE.value, **start)
    assert (rescaled.rates(sed)[0] > 50.0).all()


def test_parameters_go_round():
    values = [1e-7, 3e-4, 1e-6, 40.0, 2e-6, 30.0]
    afferent = Afferent.from_parameters(values, refractory_ms=2.0)
    as_in_the_paper = Afferent.for_tissues("paper")
    assert afferent == replace(
        as_in_the_paper, **dict(zip(PARAMETER_NAMES, values, strict=True)), refractory_ms=2.0, initial_mv=None
    )
    assert_array_equal(afferent.parameters, values)
    human = Afferent()
    others = {each.name: getattr(human, each.name) for each in fields(human)}
    six = [others.pop(name) for name in PARAMETER_NAMES]
    assert Afferent.from_parameters(six, **others) == human


def test_many_receptors_never_stand_on_all_knots_at_once():
    times = np.append(np.linspace(0.0, 50.0, 9), 50.0 + np.geomspace(2.0, 950.0, 12))
    sed = Traces(times, np.outer(np.minimum(times, 50.0), np.linspace(0.0, 0.02, 24 * BLOCK)), [50.0])
    SED_DRIVEN.spikes(sed.part(slice(0, 2)))  # compile
    tracemalloc.start()
    spikes = SED_DRIVEN.spikes(sed)
    peak_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    knots = drive(sed.part(slice(0, 1))).times_ms.size
    assert len(spikes[24 * BLOCK - 1]) > 10
    assert peak_bytes < 0.8 * knots * sed.n_sites * np.dtype(float).itemsize
    alone = SED_DRIVEN.spikes(sed.part(slice(23 * BLOCK, 23 * BLOCK + 1)))[0]
    assert alone.size > 10
    assert_array_equal(spikes[23 * BLOCK], alone)


test_impossible_afferents_and_traces_of_another_quantity_are_refused = refusals(
    (lambda: Afferent.from_parameters([0.0, 1.0]), "parameters must hold intercept_ma"),
    (lambda: Afferent.from_parameters([0.0, 1.0, 1.0, -1.0, 1.0, 1.0]), ("time_constant_ms",)),
    (lambda: Afferent.from_parameters([np.nan, *[1.0] * 5]), "parameters must hold finite"),
    (lambda: Afferent(threshold_mv=0.0), ("threshold_mv",)),
    (lambda: Afferent(dynamic_gain=np.inf), ("dynamic_gain",)),
    (lambda: Afferent().spikes(ramp_and_hold(1.0)), r"got traces of 'stored'; .*for_tissues\('paper'\)"),
    (lambda: replace(SED_DRIVEN, static_quantity="work").spikes(ramp_and_hold(1.0)),
     "static term of this afferent needs 'work': got traces of 'stored'"),
)  # fmt: skip


def test_an_afferent_and_its_traces_agree_on_what_the_dynamic_term_follows():
    energy = ramp_and_hold(1.0, 2.0)
    both = Traces(
        energy.times_ms,
        energy.values,
        energy.kinks_ms,
        dynamic=Traces(energy.times_ms, 10.0 * energy.values, quantity="von_mises"),
    )
    gain = SED_DRIVEN.dynamic_gain / 10.0
    extended = replace(SED_DRIVEN, dynamic_gain=gain, dynamic_quantity="von_mises")
    # Ten times the quantity and a tenth of its gain are the paper's afferent.
    assert_allclose(extended.spikes(both).times_ms, SED_DRIVEN.spikes(energy).times_ms, rtol=1e-12)
    assert_array_equal(extended.spikes(drive(both)).times_ms, extended.spikes(both).times_ms)
    for afferent, traces in ((SED_DRIVEN, both), (extended, energy), (extended, drive(energy))):
        with pytest.raises(InputError, match=r"dynamic term of this afferent needs '\w+': got traces of"):
            afferent.spikes(traces)


def test_sites_that_are_not_simulated_would_be_silent():
    afferent = Afferent.for_tissues("trial3")
    ramp = np.linspace(0.0, 1.0, 9)
    course = np.concatenate([ramp, np.full(8, 1.0)])[:, None]
    times = np.concatenate([50.0 * ramp, 50.0 + np.geomspace(1.0, 950.0, 8)])
    # Half of the peaks lie within 1 % of where the hold just reaches the threshold.
    near = afferent.static_threshold * np.concatenate([1.0 + np.geomspace(1e-12, 1e-2, 40), [1.0]])
    peaks = np.concatenate([near, 2.0 - near / near[-1], np.linspace(0.0, 0.2, 40)])
    sed = Traces(times, course * np.maximum(peaks, 0.0), kinks_ms=[50.0])
    slow = Traces(20.0 * times, sed.values, kinks_ms=[1000.0])
    others = replace(afferent, adapting_share=0.4), replace(afferent, saturation_per_ma=1e5)
    for each, traces in product((afferent, *others), (sed, slow)):
        found, all_simulated = each.spikes(traces), each.spikes(drive(traces))
        assert_array_equal(found.times_ms, all_simulated.times_ms)
        assert_array_equal(found.offsets, all_simulated.offsets)
        assert 0 < np.count_nonzero(np.diff(found.offsets)) < peaks.size


@pytest.mark.parametrize("saturation_per_ma", [0.0, 4e5])
def test_a_threshold_holds_for_what_lasts_once_the_afferent_has_adapted(saturation_per_ma):
    afferent = Afferent(saturation_per_ma=saturation_per_ma).with_static_threshold(2.0)
    assert afferent.static_threshold == pytest.approx(2.0, rel=1e-12)
    course = np.outer([0.0, 1.0, 1.0], 2.0 * np.array([0.99, 1.01]))
    stress = Traces([0.0, 1.0, 20_000.0], course, kinks_ms=[1.0], quantity="von_mises")
    stress = replace(stress, dynamic=Traces(stress.times_ms, 0.0 * course, quantity="stored"))
    late = [train[train > 5000.0].size for train in afferent.spikes(stress)]
    assert late[0] == 0 < late[1]


def test_the_sum_of_both_terms_saturates_and_the_intercept_does_not():
    afferent = replace(Afferent.for_tissues("trial3"), intercept_ma=0.0)
    sed = ramp_and_hold(0.0, 1.0, 1e3, 1e9)
    both_ma = afferent.current(sed).values
    least = replace(afferent, saturation_per_ma=2.0 / both_ma[-1, 1], intercept_ma=1.0).current(sed).values
    assert_allclose(least, 1.0 + both_ma / (1.0 + 2.0 * both_ma / both_ma[-1, 1]), rtol=1e-12)
    assert least[-1, 3] - 1.0 == pytest.approx(0.5 * both_ma[-1, 1], rel=1e-6)
    # Whoever saturates below the threshold never fires.
    silent = replace(afferent, saturation_per_ma=2.0 / afferent.rheobase_ma)
    assert silent.static_threshold == np.inf
    assert silent.spikes(sed).times_ms.size == 0


def test_a_held_static_term_loses_its_share_as_an_exponential():
    afferent = Afferent(intercept_ma=0.0, static_gain=2.0, adapting_share=0.4, adapting_ms=80.0)
    quantity = afferent.static_quantity
    held = Traces([0.0, 1e-3, 400.0], [[0.0], [3.0], [3.0]], kinks_ms=[1e-3], quantity=quantity)
    current = afferent.current(held)
    later = current.times_ms > 1.0
    expected = 6.0 * (1.0 - 0.4 * (1.0 - np.exp(-current.times_ms[later] / 80.0)))
    assert_allclose(current.values[later, 0], expected, rtol=1e-5)
    unadapted = replace(afferent, adapting_share=0.0).current(held)
    assert_allclose(unadapted.values[later, 0], 6.0, rtol=1e-15)
    # Once the term is gone, what was lost returns with the same time constant, below the intercept.
    gone = Traces([0.0, 1e-3, 400.0, 400.001, 480.0], [[0.0], [3.0], [3.0], [0.0], [0.0]], held.kinks_ms)
    gone = replace(gone, kinks_ms=np.array([1e-3, 400.0, 400.001]), quantity=quantity)
    left = afferent.current(gone).values[-1, 0]
    assert left == pytest.approx(-2.4 * (1.0 - np.exp(-5.0)) * np.exp(-1.0), rel=1e-4)
