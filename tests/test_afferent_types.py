"""RA, PC, SAII and own afferents, end organs and mixed populations."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import fingerpad as fp
from fingerpad.core.regions import Rectangle
from fingerpad.data import afferents as published
from fingerpad.experiments.requests.afferents import AfferentsSettings, respond_to
from fingerpad.neuron.band_pass import BandPass
from fingerpad.neuron.end_organs import EndOrgans
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.population import sensitivities
from fingerpad.neuron.spikes import firing_rate_hz
from fingerpad.neuron.transduction import drive
from fingerpad.neuron.tuning import impulses_per_cycle, tuning_curve, vibration
from refusals import refusals
from sections import SED_DRIVEN, followed_by

PUNCH_KPA_PER_UM, PUNCH_HOLD_KPA = 0.0200, 10.4
"""Compressive stress below a 1 mm punch on a hold of 0.5 mm (docs/afferents.md, table of the probe)."""

PC_PER_UM, PC_HOLD_MM = 3.43e-4, 0.151
"""Mean displacement of the skin within 3 mm there."""

LIGHT_KPA = 0.7
"""Stress under a touch so light that an SAI afferent is silent in it."""

FREQUENCIES_HZ = np.array([1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0, 100.0, 150.0, 200.0, 300.0, 400.0])


def traces(quantity, times_ms, values, kinks_ms=()):
    columns = np.array(values, np.float64).reshape(len(np.array(times_ms)), -1)
    return fp.Traces(times_ms, columns, np.array(kinks_ms), quantity=quantity)


def press(quantity, height, ramp_ms=50.0):
    return traces(quantity, [0.0, ramp_ms, 1000.0], [0.0, height, height], [ramp_ms])


class Pressed:
    """Every quantity rises in 50 ms to a height that falls with the distance from a point, and stays."""

    def __init__(self, heights):
        self.heights = heights

    def sed(self, sites, dynamic_quantity="stored", static_quantity="stored"):
        places = np.array(sites)
        away = np.hypot(places[:, 0] - 17.0, places[:, -1])
        dynamic, static = (
            traces(name, [0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 1.0], self.heights[name] * shape), [50.0])
            for shape in [np.exp(-((away / 3.0) ** 2))]
            for name in (dynamic_quantity, static_quantity)
        )
        return static if dynamic_quantity == static_quantity else replace(static, dynamic=dynamic)


RESTED = {
    "SAI": fp.Afferent(end_organs=1),
    "smoothed SAI": fp.SAI(end_organs=1),
    "SAI by SED": SED_DRIVEN,
    "RA": fp.RA(),
    "PC": fp.PC(),
    "SAII": fp.SAII(),
    "own": fp.OwnAfferent(
        lambda sed: fp.Traces(sed.times_ms, 1e-6 * sed.values - 5e-7, quantity="current"),
        LeakyIntegrateAndFire(60.0, 1e-6, 50.0, 1.0),
    ),
    "soft": fp.OwnAfferent(
        lambda sed: EscapeRate(fp.SAII().membrane, 0.01).spikes(fp.SAII().transduction.current(sed), 3),
        dynamic_quantity="skin_stretch",
        static_quantity="skin_stretch",
    ),
}


@pytest.mark.parametrize("name", RESTED)
def test_the_same_touch_has_the_same_answer_after_any_rest(name):
    """Uneven samples, so that the slope at first touch would notice those before it."""
    afferent = RESTED[name]
    quantity = afferent.static_quantity
    height = {"deep_displacement": 1.0, "skin_stretch": 0.1}.get(quantity, 20.0)
    times, course = np.array([0.0, 7.3, 21.1, 50.0, 300.0]), np.array([0.0, 0.1, 0.4, 1.0, 0.9])
    population = fp.Population.grid(rows=1, columns=1, afferent=afferent)

    def respond_to(course):
        return population.respond_to(followed_by(afferent, course))

    once = respond_to(traces(quantity, times, height * course, [50.0]))
    assert once.spikes.times_ms.size > 2
    for rests_ms in ([500.1], [10.0, 500.1]):
        rested = traces(
            quantity, [0.0, *rests_ms[:-1], *(rests_ms[-1] + times)],
            height * np.append(np.zeros(len(rests_ms)), course), [rests_ms[-1] + 50.0],
        )  # fmt: skip
        again = respond_to(rested)
        assert rested.onset_ms == 500.1
        assert_allclose(again.spikes.times_ms - 500.1, once.spikes.times_ms, rtol=0.0, atol=1e-9)
        for read in ("first_spike_latency_ms", "dynamic_rate_hz", "static_rate_hz"):
            assert_allclose(getattr(again, read), getattr(once, read), rtol=1e-9)


def test_a_stream_starts_at_rest_and_the_membrane_of_the_set_paper_at_0():
    human, paper = fp.Afferent(), fp.Afferent.for_tissues("paper")
    first_ms = []
    for rest_ms in (0.0, 500.0):
        stream = fp.AfferentStream(human, 1)
        if rest_ms:
            stream.step(rest_ms, [0.0], [0.0])
        first_ms.append(stream.step(rest_ms + 50.0, [20.0], [20.0])[0][0] - rest_ms)
    assert_allclose(first_ms[1], first_ms[0], rtol=0.0, atol=1e-9)
    at_once = human.spikes(followed_by(human, press("von_mises", 20.0)))[0][0]
    assert_allclose(first_ms[0], at_once, rtol=0.0, atol=1e-9)
    resting_mv = human.membrane.initial_potentials_mv(np.array([human.intercept_ma]))
    assert_allclose(resting_mv, human.intercept_ma * human.time_constant_ms / human.capacitance_mf)
    assert paper.membrane.initial_potentials_mv(np.array([paper.intercept_ma])) == 0.0
    # A membrane that would fire at rest has just been reset, so that it fires at its rate from the start.
    firing = replace(human, intercept_ma=2.0 * human.rheobase_ma)
    assert firing.membrane.initial_potentials_mv(np.array([firing.intercept_ma])) == 0.0


@pytest.mark.parametrize("afferent", [fp.PC(), fp.RA()])
def test_afferents_that_fire_once_in_a_ramp_have_a_rate_and_sai_keeps_that_of_the_paper(afferent):
    places = [[17.0 + 0.02 * number, 0.0] for number in range(700)]
    found = fp.Population(places, 1.0, afferent).respond(FINGER)
    in_ramp = [np.count_nonzero(train <= 50.0) for train in found.spikes]
    assert in_ramp[-1] == 0
    assert 1 in in_ramp
    assert_allclose(found.dynamic_rate_hz, 20.0 * np.array(in_ramp))
    assert_array_equal(found.dynamic_count_hz, found.dynamic_rate_hz)
    assert_array_equal(found.spike_count, [train.size for train in found.spikes])
    columns = found.to_frame()
    for name in ("dynamic_rate_hz", "dynamic_count_hz", "static_count_hz"):
        assert_array_equal(columns[name], getattr(found, name))
        assert_array_equal(found.to_dataset()[name], getattr(found, name))
    sai = fp.Population(places, 1.0).respond(FINGER)
    assert_array_equal(sai.dynamic_rate_hz, firing_rate_hz(sai.spikes, (30.0, 50.0)))
    counts = [np.count_nonzero((train > 30.0) & (train <= 50.0)) for train in sai.spikes]
    assert_allclose(sai.dynamic_count_hz, 50.0 * np.array(counts))


ENDS = np.array([[[0.0, 0.0], [1.0, 0.0]]])
FINGER = Pressed(
    {
        "compressive_stress": 15.0,
        "deep_displacement": 1.0,
        "skin_stretch": 0.1,
        "stored": 2.0,
        "von_mises": 9.0,
    }
)
SQUARE = Rectangle(10.0, 10.0, centre_mm=(17.0, 0.0))


@pytest.mark.parametrize(("rise", "fall"), [(1, 1), (2, 2), (3, 1)])
@pytest.mark.parametrize("frequency_hz", [10.0, 100.0, 400.0])
def test_the_band_pass_has_the_gain_of_its_transfer_function(rise, fall, frequency_hz):
    band = BandPass(120.0, rise, fall)
    times_ms = np.arange(0.0, 400.0, 0.05)
    wave = 5.0 + np.sin(2e-3 * np.pi * frequency_hz * times_ms)
    at_ms, passed = band.of(drive(traces("stored", times_ms, wave), pieces=1))
    settled = passed[at_ms > 200.0, 0]
    relative = frequency_hz / 120.0
    gain = relative**rise / np.sqrt(1.0 + relative**2) ** (rise + fall)
    assert_allclose([settled.max(), settled.min()], [gain, -gain], rtol=0.01)


def test_the_band_pass_of_a_step_of_speed_is_the_closed_form():
    band = BandPass(50.0, 1, 1)
    tau = band.time_constant_ms
    sites = traces("stored", [0.0, 40.0], np.outer([0.0, 8.0], np.append(1.0, np.linspace(0.0, 2.0, 1500))))
    at_ms, passed = band.of(sites)
    for site in (0, 700, 1500):  # whatever the number of sites
        assert_array_equal(passed[:, [site]], band.of(sites.part(slice(site, site + 1)))[1])
    x = at_ms / tau
    # s tau / (1 + s tau)^2 of a ramp of 0.2 per ms: 0.2 tau (1 - (1 + x) e^-x).
    assert_allclose(passed[:, 0], 0.2 * tau * (1.0 - (1.0 + x) * np.exp(-x)), atol=0.004 * 0.2 * tau)


@pytest.mark.parametrize(
    ("afferent", "at_hz", "observed_um", "per_um", "hold"),
    [
        (fp.RA(), published.RA_TUNING_FREQUENCIES, published.RA_TUNING, PUNCH_KPA_PER_UM, PUNCH_HOLD_KPA),
        (fp.PC(), published.PC_TUNING_FREQUENCIES, published.PC_TUNING, PC_PER_UM, PC_HOLD_MM),
    ],
    ids=["RA", "PC"],
)
def test_tuning_curves_have_the_shape_of_the_recorded_ones(afferent, at_hz, observed_um, per_um, hold):
    ratio = tuning_curve(afferent, at_hz.value, per_um, hold) / np.array(observed_um.value)
    shape = ratio / np.exp(np.log(ratio).mean())
    assert shape.min() > 0.7
    assert shape.max() < 1.4


def test_two_terms_that_follow_two_quantities_have_their_own_slopes():
    sai, both = fp.SAI(), fp.SAI(dynamic_quantity="von_mises")
    alike = tuning_curve(both, [5.0, 50.0], 0.02)
    assert_array_equal(tuning_curve(both, [5.0, 50.0], (0.02, 0.02), (0.0, 0.0)), alike)
    assert_array_equal(tuning_curve(sai, [5.0, 50.0], 0.02), alike)
    assert (tuning_curve(sai, [5.0, 50.0], (0.04, 0.02)) < alike).all()


def test_the_best_frequencies_are_those_of_the_recordings():
    low, high, pacinian = published.BEST_FREQUENCIES.value
    ra = tuning_curve(fp.RA(), FREQUENCIES_HZ, PUNCH_KPA_PER_UM, PUNCH_HOLD_KPA)
    pc = tuning_curve(fp.PC(), FREQUENCIES_HZ[3:], PC_PER_UM, PC_HOLD_MM)
    assert low <= FREQUENCIES_HZ[np.argmin(ra)] <= high
    assert FREQUENCIES_HZ[3:][np.argmin(pc)] > pacinian
    assert pc[FREQUENCIES_HZ[3:] == 200.0] < 0.1 * ra[FREQUENCIES_HZ == 200.0]
    assert pc[FREQUENCIES_HZ[3:] == 10.0] > 2.0 * ra[FREQUENCIES_HZ == 10.0]
    # A threshold separates silence from entrainment.
    (threshold_um,) = tuning_curve(fp.RA(), [40.0], PUNCH_KPA_PER_UM, PUNCH_HOLD_KPA)
    amplitudes_um = threshold_um * np.array([0.98, 1.0])
    beside = vibration(40.0, amplitudes_um, PUNCH_KPA_PER_UM, PUNCH_HOLD_KPA, "compressive_stress")
    below, above = impulses_per_cycle(fp.RA(), beside)
    assert below < 1.0 <= above


def test_ra_and_pc_respond_to_ramps_only():
    for afferent, height in ((fp.RA(), 15.0), (fp.PC(), 1.0)):
        (spikes,) = afferent.spikes(press(afferent.quantity, height))
        assert spikes.size > 1
        assert spikes[-1] < 100.0
    fast, slow = (fp.RA().spikes(press(fp.RA().quantity, 10.0, ms))[0].size / ms for ms in (20.0, 80.0))
    assert fast > 1.5 * slow
    released = traces(fp.RA().quantity, [0.0, 500.0, 550.0, 900.0], [10.0, 10.0, 0.0, 0.0], [500.0, 550.0])
    assert fp.RA().spikes(released)[0].size > 0
    assert replace(fp.RA(), retraction=0.0).spikes(released)[0].size == 0


def test_saturation_keeps_the_threshold_and_bounds_the_rate():
    """i (1 + s) / (1 + s i) is 1 at the threshold, and 1 + 1/s where the skin moves by any more."""
    kept, saturating = fp.RA(saturation=0.0), fp.RA(saturation=0.5)
    passed = kept.threshold * np.array([0.0, 1.0, 2.0, 1e9])
    np.testing.assert_allclose(kept.rectified(passed), [0.0, 1.0, 2.0, 1e9], rtol=1e-12)
    np.testing.assert_allclose(saturating.rectified(passed), [0.0, 1.0, 1.5, 3.0], rtol=1e-8)
    assert saturating.rectified(-passed)[3] == pytest.approx(3.0, rel=1e-8)


def test_saii_fires_regularly_while_the_skin_is_stretched():
    (spikes,) = fp.SAII().spikes(press("skin_stretch", 0.06))
    intervals = np.diff(spikes[spikes > 600.0])
    assert intervals.size > 5
    assert np.ptp(intervals) < 1e-6
    assert fp.SAII().spikes(press("skin_stretch", 0.005))[0].size == 0


def test_an_own_afferent_returns_current_or_spikes():
    membrane = LeakyIntegrateAndFire(20.0, 1e-6, 5.0, 1.0)

    def current(sed):
        return fp.Traces(sed.times_ms, 1e-6 * sed.values, quantity="current")

    own = fp.OwnAfferent(current, membrane)
    sed = press("stored", 2.0)
    assert_array_equal(own.spikes(sed)[0], membrane.spikes(current(sed))[0])
    response = fp.Population.grid(afferent=own).respond(FINGER)
    assert (response.static_rate_hz > 0.0).any()


def test_one_end_organ_is_the_afferent_itself_and_two_are_their_weighted_sum():
    layout = fp.Population.grid(rows=2, columns=3).positions_mm
    alone = fp.Population(layout, 1.0, fp.RA()).respond(FINGER)
    single = fp.Population(layout, 1.0, fp.RA(), ends=EndOrgans(layout[:, None])).respond(FINGER)
    assert_array_equal(alone.spikes.times_ms, single.spikes.times_ms)
    far = np.stack([layout, layout + np.array([100.0, 0.0])], axis=1)
    halved = fp.Population(layout, 1.0, fp.RA(), ends=EndOrgans(far, [0.5, 0.5])).respond(FINGER)
    half = fp.Population(layout, 1.0, fp.RA(), sensitivity=np.full(6, 0.5)).respond(FINGER)
    assert_allclose(halved.spikes.times_ms, half.spikes.times_ms, rtol=1e-12)


@pytest.mark.parametrize("afferent", [fp.SAI(), fp.RA(), fp.PC(), fp.SAII()], ids=lambda each: each.type)
def test_sites_that_move_too_little_are_silent_and_leave_the_others_as_they_are(afferent):
    scale = {"SAI": 6.0, "RA": 2.0, "PC": 0.2, "SAII": 0.1}[afferent.type]
    heights = scale * np.geomspace(1e-4, 1.0, 40)
    quantity = afferent.static_quantity
    sed = traces(quantity, [0.0, 20.0, 300.0], np.outer([0.0, 1.0, 1.0], heights), [20.0])
    sed = followed_by(afferent, sed)
    together = afferent.spikes(sed)
    counts = np.diff(together.offsets)
    assert counts[0] == 0 < counts[-1]
    assert (np.diff(counts) >= 0).all()
    for site in range(25, 40):
        assert_array_equal(afferent.spikes(sed.part(slice(site, site + 1)))[0], together[site])


@pytest.mark.parametrize(("rise", "fall"), [(1, 1), (2, 2), (3, 1)])
def test_no_input_gives_more_than_the_largest_share_of_its_range(rise, fall):
    band = BandPass(100.0, rise, fall)
    # The worst input follows the sign of the impulse response, backwards in time.
    times_ms = np.arange(0.0, 120.0, 0.05)
    step = traces("stored", [0.0, 50.0, 50.05, 120.0], [0.0, 0.0, 1.0, 1.0])
    at_ms, passed = band.of(step)
    impulse = np.diff(np.interp(times_ms, at_ms, passed[:, 0]))
    worst = (impulse[::-1] > 0.0).astype(float)
    found = np.convolve(worst, impulse)[: 2 * worst.size].max()
    assert found == pytest.approx(band.largest_share, rel=0.02)


def test_the_strongest_end_organ_leads_if_asked_for():
    sed = traces("stored", [0.0, 50.0], [[0.0, 0.0], [2.0, 3.0]])
    largest = EndOrgans(ENDS, [0.8, 0.2], combine="largest").combined(sed)
    assert largest.values.tolist() == [[0.0], [2.0]]
    equal = EndOrgans(ENDS, combine="largest").combined(sed)
    assert equal.values.tolist() == [[0.0], [3.0]]


def test_scattered_end_organs_lie_within_reach_and_depend_on_seed_and_number_only():
    places = np.zeros((400, 2))
    ends = EndOrgans.scattered(places, count=6, reach_mm=1.5, seed=3)
    away = np.linalg.norm(ends.positions_mm, axis=2)
    assert away.max() < 1.5
    assert (away > 1.5 / np.sqrt(2.0)).mean() == pytest.approx(0.5, abs=0.03)
    assert_array_equal(ends.positions_mm[:5], EndOrgans.scattered(places[:5], 6, 1.5, 3).positions_mm)
    lifted = EndOrgans.scattered(places[:2], 6, 1.5, 3, place=lambda flat: np.insert(flat, 1, 7.0, axis=1))
    assert_array_equal(lifted.positions_mm[..., [0, 2]], ends.positions_mm[:2])


def test_an_afferent_with_end_organs_follows_their_mean_wherever_it_is_placed():
    branched = fp.Afferent(end_organs=6, reach_mm=0.5)
    places = fp.Population.grid(rows=2, columns=3).positions_mm
    ends = EndOrgans.about(places, count=6, reach_mm=0.5)
    assert (np.linalg.norm(ends.positions_mm - places[:, None], axis=2) < 0.6).all()
    assert_allclose(ends.positions_mm.mean(axis=1), places, atol=1e-12)
    given = fp.Population(places, 1.0, fp.Afferent(), ends=ends).respond(FINGER)
    populations = (
        fp.Population(places, 1.0, branched),
        fp.Population.grid(rows=2, columns=3, afferent=branched),
        fp.Population.mixed({"SAI": fp.Population(places, 1.0, branched)}),
    )
    for population in populations:
        assert_array_equal(population.sites_mm, ends.sites_mm)
        assert_array_equal(population.respond(FINGER).spikes.times_ms, given.spikes.times_ms)
    lifted = fp.Population.of_layout(
        fp.hexagonal(SQUARE, 25.0), lambda flat: np.insert(flat, 1, 7.0, axis=1), branched
    )
    assert lifted.sites_mm.shape == (6 * len(lifted), 3)


def test_a_soft_threshold_keeps_the_end_organs():
    branched = fp.Population.grid(afferent=fp.Afferent(end_organs=6, reach_mm=2.0))
    soft = respond_to(AfferentsSettings(noise=1e-6), branched, FINGER).spikes
    alone = fp.Population.grid(afferent=fp.Afferent(end_organs=1)).respond(FINGER).spikes
    sharp = branched.respond(FINGER).spikes
    assert_array_equal(soft.counts, sharp.counts)
    assert (sharp.counts != alone.counts).any()


def test_a_mixed_population_has_the_published_densities_and_one_response():
    population = fp.Population.at_densities(SQUARE, seed=4)
    assert list(population) == list(population.respond(FINGER)) == ["SAI", "RA", "PC", "SAII"]
    assert list(population["RA"]) == list(population["RA"].respond(FINGER)) == []
    sizes = {name: len(part) for name, part in population.parts.items()}
    assert sizes == {"SAI": 70, "RA": 140, "PC": 21, "SAII": 10}
    assert sum(published.DENSITIES.value) == published.DENSITY_TOTAL.value == len(population)
    response = population.respond(FINGER)
    assert list(response.parts) == ["SAI", "RA", "PC", "SAII"]
    assert len(response.spikes) == len(response.types) == len(response.positions_mm) == len(population)
    assert_array_equal(response.spikes[70], response["RA"].spikes[0])
    assert (response["SAI"].static_rate_hz > 0.0).any()
    assert not response["RA"].static_rate_hz.any()
    alone = fp.Population.at_densities(SQUARE, {"SAI": 70.0}, seed=4).respond(FINGER)
    assert_array_equal(alone["SAI"].spikes.times_ms, response["SAI"].spikes.times_ms)
    factors = SPARSE(SQUARE, {"RA": 140.0}, spread=0.4, seed=4).parts["RA"].sensitivity
    assert np.log(factors).std() == pytest.approx(0.4, abs=0.06)
    assert not np.array_equal(factors, sensitivities(140, 0.4, seed=4))


ENERGY = press("stored", 1.0)
SPARSE = fp.Population.at_densities


def own(respond):
    return fp.OwnAfferent(respond).spikes(ENERGY)


test_bad_input_is_refused_in_one_sentence = refusals(
    (lambda: fp.RA(retraction=1.5), "retraction must lie within 0 to 1: got 1.5"),
    (lambda: fp.RA(rise=0), ("rise",)),
    (lambda: fp.RA(threshold=-1.0), ("threshold",)),
    (lambda: fp.RA().spikes(ENERGY), "needs 'compressive_stress': got traces of 'stored'"),
    (lambda: fp.RA(treshold=0.1), "treshold is no argument of RapidlyAdapting: did you mean threshold"),
    (lambda: fp.OwnAfferent("sum"), "respond must be a function: got 'sum'"),
    (lambda: own(lambda sed: sed), "respond must return .* got Traces"),
    (lambda: own(lambda sed: fp.SpikeTrains.from_lists([])), "respond must return .* 1 in all: got 0 trains"),
    (lambda: own(lambda sed: fp.Traces(sed.times_ms, sed.values, quantity="current")), "needs a membrane"),
    (lambda: EndOrgans(ENDS, [0.5, 0.6]), "must sum to 1: got 1.1"),
    (lambda: EndOrgans(ENDS, [1.5, -0.5]), "must not be negative: the smallest is -0.5"),
    (lambda: EndOrgans(ENDS, combine="mean"), "combine must be one of sum, largest: got 'mean'"),
    (lambda: EndOrgans(np.zeros((1, 0, 2))), "afferents by end organs"),
    (lambda: EndOrgans.scattered([[0.0, 0.0]], 0, 1.0, 1), ("count",)),
    (lambda: fp.Population([[17.0, 0.0]], 1.0, ends=EndOrgans(np.zeros((2, 1, 2)))), "one row per"),
    (lambda: fp.Population([[17.0, 0.0]], 1.0, fp.RA), "afferent must be one such as"),
    (lambda: fp.Population.grid().respond(None), "skin must be like Skin, with sed: got None"),
    (lambda: fp.Population.grid(centre_mm=17.0), r"centre_mm must be a pair \[mm\]: got 17.0"),
    (lambda: fp.Population.grid(finger="child"), ("finger",)),
    (lambda: fp.Population.mixed([fp.Population.grid()]), ("parts",)),
    (lambda: fp.Population.mixed({"RA": fp.RA()}), "parts must be of type Population: got RapidlyAdapting"),
    (lambda: SPARSE(SQUARE, {"RA": 0.0}), r"densities_per_cm2\['RA'\].*greater than 0"),
    (lambda: SPARSE(SQUARE, {}), "must hold at least one Population"),
    (lambda: SPARSE(SQUARE, {"FA": 10.0}), "type 'FA' without an afferent"),
    (lambda: SPARSE(SQUARE, {"X": 50.0}, {"X": None}), "afferents must be of type AnyAfferent: got None"),
    (lambda: SPARSE(SQUARE, {"RA": 9.0}).respond(FINGER)["SAI"], "must be one of RA: got 'SAI'"),
    (lambda: SPARSE(SQUARE, 100.0), "densities_per_cm2 must be a mapping"),
    (lambda: SPARSE(SQUARE, afferents=[fp.RA()]), "afferents must be a mapping"),
    (lambda: SPARSE("pad"), ("region",)),
    (lambda: SPARSE(SQUARE).respond("skin"), "skin must be like Skin, with sed: got 'skin'"),
    (lambda: tuning_curve(fp.RA(), [0.0], 0.02), ("frequency_hz",)),
)  # fmt: skip
