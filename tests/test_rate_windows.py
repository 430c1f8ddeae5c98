"""Phases of a motion, and windows of rates that follow them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerpad.core.errors import InputError
from fingerpad.core.phases import Phase, phase_named
from fingerpad.core.signals import Traces
from fingerpad.data import protocol
from fingerpad.experiments.discrimination.request import DiscriminationRequest
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold, Trajectory
from fingerpad.geometry.motions import repeated, sine
from fingerpad.inference.afferent_fit import ReceptorOffset
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import PAPER_WINDOWS_MS, common_rate_windows_ms, rate_windows_ms
from fingerpad.neuron.transduction import drive
from refusals import refused
from sections import SED_DRIVEN


def traces(ramp_ms, end_ms=1150.0):
    """Energy density that grows linearly in the ramp and stays."""
    return Traces([0.0, ramp_ms, end_ms], [[0.0], [2.0], [2.0]], [ramp_ms])


def test_windows_of_the_papers_motion_are_the_papers_to_the_bit():
    assert (protocol.DYNAMIC_WINDOW.value, protocol.STATIC_WINDOW.value) == PAPER_WINDOWS_MS
    for motion in (RampAndHold(), ForceRampAndHold(100.0)):
        assert rate_windows_ms(motion.phases) == PAPER_WINDOWS_MS
        assert Trajectory((0.0, 50.0, 1000.0), (0.0, 1.0, 1.0)).phases == motion.phases
    assert rate_windows_ms(traces(50.0, 1000.0).phases) == PAPER_WINDOWS_MS


@given(st.floats(1.0, 1e4), st.floats(1.0, 1e5))
def test_windows_lie_in_their_phases(ramp_ms, hold_ms):
    (ramp, hold) = phases = RampAndHold(1.0, ramp_ms, hold_ms).phases
    (dynamic, static) = rate_windows_ms(phases)
    assert 0.0 < dynamic[0] < dynamic[1] == pytest.approx(ramp.end_ms, rel=1e-12)
    assert dynamic[1] - dynamic[0] == pytest.approx(0.4 * ramp_ms)
    assert hold.start_ms < static[0] < static[1] < hold.end_ms
    # Read at the same time since the ramp as the paper's, or earlier in a shorter hold.
    assert static[0] - hold.start_ms == pytest.approx(550.0 * min(1.0, hold_ms / 950.0))


def test_a_slow_ramp_is_not_read_in_the_papers_window_and_a_population_follows_its_phases():
    """The rate at the end of a ramp of 200 ms is higher than in its first quarter."""
    slow = traces(200.0)
    (followed,), _ = SED_DRIVEN.rates(slow)
    (early,), _ = SED_DRIVEN.rates(slow, *PAPER_WINDOWS_MS)
    assert followed > 1.4 * early
    assert SED_DRIVEN.rates(drive(slow))[0] == followed
    assert SED_DRIVEN.rates(slow, (120.0, 200.0))[0] == followed
    assert AfferentModel.of_traces(slow).evaluate(SED_DRIVEN.parameters)[0] == followed
    roving = ReceptorOffset.of_traces({-0.1: slow, 0.1: slow})
    assert roving.evaluate(np.append(SED_DRIVEN.parameters, 0.0))[0] == followed

    class Pressed:
        def sed(self, sites):
            return traces(200.0)

    lone = Population(np.array([[17.0, 0.0]]), 1.0, SED_DRIVEN)
    assert lone.respond(Pressed()).dynamic_rate_hz == SED_DRIVEN.rates(traces(200.0))[0]
    given_too = lone.respond(Pressed(), dynamic_window_ms=(30.0, 50.0))
    assert given_too.dynamic_rate_hz == SED_DRIVEN.rates(traces(200.0), (30.0, 50.0))[0]


def test_without_phases_windows_must_be_given():
    unnamed = Traces([0.0, 50.0, 100.0, 1000.0], [[0.0], [2.0], [1.0], [1.0]], [50.0, 100.0])
    with refused("dynamic_window_ms"):
        SED_DRIVEN.rates(unnamed)
    with refused("static_window_ms"):
        SED_DRIVEN.rates(unnamed, dynamic_window_ms=(30.0, 50.0))
    assert SED_DRIVEN.rates(unnamed, *PAPER_WINDOWS_MS)[1] > 0.0
    course = Traces([0.0, 9.0], [[0.0], [2.0]], phases=(Phase("press", 0.0, 9.0),))
    with pytest.raises(InputError, match="the phases are press"):
        SED_DRIVEN.rates(course)


def test_stimuli_of_a_fit_share_their_windows():
    longer = traces(50.0, 2000.0)
    assert AfferentModel.of_traces([traces(50.0, 1000.0), longer]).used_windows_ms == PAPER_WINDOWS_MS
    with pytest.raises(InputError, match="120-200 ms, 750-1100 ms or 30-50 ms, 600-950 ms"):
        AfferentModel.of_traces([traces(200.0), longer])
    both = [longer.phases, traces(200.0).phases]
    assert common_rate_windows_ms(both, *PAPER_WINDOWS_MS) == PAPER_WINDOWS_MS


def test_each_stimulus_of_a_task_has_its_own_windows():
    ramps = {"vary": "motion.ramp_ms", "values": [50, 1500]}
    ramp = {"object": "sphere", "motion": {"hold_ms": 950}, "stimuli": ramps, "standard": 50, "noise": 0.1}
    task = DiscriminationRequest.read(ramp)

    class Pressed:
        def __init__(self, motion):
            self.phases, self.end_ms = motion.phases, motion.end_ms
            self.asked = []

        def sed(self, sites, dynamic_quantity, quantity):
            ones = np.ones((3, len(sites)))
            times, kinks = [0.0, self.phases[0].end_ms, self.end_ms], [self.phases[0].end_ms]
            height = 50.0 * ones * np.array([[0.0], [1.0], [1.0]])
            dynamic = Traces(times, height, kinks, quantity=dynamic_quantity)
            return replace(dynamic, quantity=quantity, dynamic=dynamic)

    quick, slow = task.responses({each.name: Pressed(each.motion) for each in task.pressed})
    assert (quick.dynamic_rate_hz > slow.dynamic_rate_hz).all()
    assert (slow.dynamic_rate_hz > 0.0).all()
    with pytest.raises(InputError, match=r"windows_ms\.static must end with the stimuli, not at 2000 ms"):
        DiscriminationRequest.read(ramp, {"afferents.windows_ms.static": [600, 2000]}).check()


def test_phases_of_a_trajectory_are_named_by_its_course():
    def names(motion):
        return [phase.name for phase in motion.phases]

    assert names(Trajectory((0, 50, 500, 550, 900), (0, 1, 1, 0, 0))) == ["ramp", "hold", "release", "pause"]
    twice = repeated(1.0, 2, 50.0, 200.0, 300.0)
    again = ["ramp 2", "hold 2", "release 2", "pause 2"]
    assert names(twice) == ["ramp", "hold", "release", "pause", *again]
    assert phase_named(twice.phases, "hold 2").window_ms == (650.0, 850.0)
    assert names(sine(0.8, 0.1, 20.0, cycles=2)) == ["ramp", "hold", "vibration"]
    slide = Trajectory((0, 50, 100, 600), (0, 1, 1, 1), x_mm=(0, 0, 0, 5.0))
    assert names(slide) == ["ramp", "hold", "move"]
    turn = Trajectory((0, 50, 600), force_mn=(0, 100, 100), spin_deg=(0, 0, 30.0))
    assert names(turn) == ["ramp", "move"]
    # Two speeds are one ramp, and noise of a recording is part of its hold.
    two_speeds = Trajectory((0, 50, 60, 500), (0, 0.2, 1, 1))
    assert names(two_speeds) == ["ramp", "hold"]
    noise = 0.002 * np.random.default_rng(0).normal(size=401)
    shaken = Trajectory(np.arange(401.0), np.clip(np.arange(401) / 50, 0, 1) + np.append(0.0, noise[1:]))
    assert names(shaken) == ["ramp", "hold"]
    assert rate_windows_ms(shaken.phases)[0] == (30.0, 50.0)
    around = Trajectory((0, 10, 20, 30), (0, 1.0, 0.5, 1.0))
    assert names(around) == ["ramp", "release", "ramp 2"]


@given(st.lists(st.tuples(st.floats(0.5, 500.0), st.floats(-0.5, 2.0)), min_size=1, max_size=8))
def test_phases_of_any_trajectory_follow_each_other_from_start_to_end(steps):
    lengths, depths = zip(*steps, strict=True)
    motion = Trajectory((0.0, *np.cumsum(lengths)), (0.0, *depths[:-1], 1.0))
    assert motion.phases[0].start_ms == motion.onset_ms
    assert motion.phases[-1].end_ms == motion.end_ms
    for one, next_one in zip(motion.phases, motion.phases[1:], strict=False):
        assert one.end_ms == next_one.start_ms
        assert one.name.split()[0] != next_one.name.split()[0]
    assert len({phase.name for phase in motion.phases}) == len(motion.phases)


def test_phases_can_be_named_and_do_not_change_what_is_pressed():
    plain = Trajectory((0, 50, 1000), (0, 1, 1))
    named = Trajectory((0, 50, 1000), (0, 1, 1), phases=[Phase("press", 0.0, 1000.0)])
    assert [phase.name for phase in named.phases] == ["press"]
    assert named == plain
    assert hash(named) == hash(plain)
    with refused("phases"):
        Trajectory((0, 50, 1000), (0, 1, 1), phases=(Phase("rest", 1000, 1100),))
    for bad in (("", 0.0, 1.0), ("a", 1.0, 1.0), ("a", -1.0, 1.0), ("a", 0.0, np.nan)):
        with pytest.raises(InputError, match=r"phase|end_ms"):
            Phase(*bad)
