"""Many afferents at once, from strain energy density to exact spikes, and the paper's two observers."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.measuring import Spread, run_job
from benchmarks.results import Report, Table
from fingerpad.core.signals import Traces
from fingerpad.data import psychophysics
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.transduction import drive
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.psychophysics.observer import EuclideanDistance, Experiment, GradientSum, discriminate_by

AFFERENTS = 100_000
THREADS, REPEATS = (1, 2), 3

STRONGEST_KPA = 4.0
"""Strain energy density of the last receptor at the end of the ramp; the others' rise evenly from 0. [kPa]"""

RESPONSES_HZ = (20.0, 60.0)
"""Range of the static rates that the observers compare; their number matters, not their values. [spikes/s]"""


def traces(receptors: int) -> Traces:
    """Ramp of 50 ms and hold of 950 ms at the 8 + 8 steps of standard resolution, from nothing to strong.

    Examples
    --------
    >>> traces(3).values.shape
    (17, 3)
    """
    ramp_ms, hold_ms = np.linspace(0.0, 50.0, 9), 50.0 + np.geomspace(10.0, 950.0, 8)
    times_ms = np.append(ramp_ms, hold_ms)
    course = np.append((ramp_ms / 50.0) ** 1.6, 0.85 + 0.15 * np.exp(-(hold_ms - 50.0) / 120.0))
    return Traces(times_ms, np.outer(course, np.linspace(0.0, STRONGEST_KPA, receptors)), np.array([50.0]))


def fire(receptors: int) -> dict[str, Any]:
    """Let one afferent end at each of many sites; all of it, and its last stage alone on fewer.

    Returns
    -------
    dict
        Seconds from traces to spikes, and of the membrane alone per afferent; number of spikes.
    """
    afferent, sed = Afferent.for_tissues("trial3"), traces(receptors)  # it follows SED
    afferent.spikes(sed.part(slice(0, 2)))  # loads compiled kernels
    started = perf_counter()
    spikes = afferent.spikes(sed)
    fire_s = perf_counter() - started
    some = drive(sed.part(slice(0, receptors, 10)))
    current = afferent.transduction.current(some)
    started = perf_counter()
    afferent.membrane.spikes(current)
    membrane_s = (perf_counter() - started) * receptors / some.n_sites
    return {"fire_s": fire_s, "membrane_s": membrane_s, "spikes": int(spikes.times_ms.size)}


def observe() -> dict[str, Any]:
    """Tell seven spheres apart by 18 receptors, with the paper's 100 x 100 x 100 repetitions.

    Returns
    -------
    dict
        Seconds of both strategies.
    """
    population = Population.grid()
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    spheres = len(psychophysics.SPHERE_CURVATURES.value)
    responses = np.random.default_rng(0).uniform(*RESPONSES_HZ, (spheres, len(population.positions_mm)))
    sigma = psychophysics.NOISE_SIGMA.value
    few = Experiment(presentations=2, distributions=2, hit_rates=2)
    discriminate_by(GradientSum(neighbours), responses, sigma, 1, few)  # loads compiled kernels
    discriminate_by(EuclideanDistance(), responses, sigma, 1, few)
    started = perf_counter()
    discriminate_by(GradientSum(neighbours), responses, sigma, 1)
    between = perf_counter()
    discriminate_by(EuclideanDistance(), responses, sigma, 1)
    return {"gradient_sum_s": between - started, "euclidean_s": perf_counter() - between}


def measure() -> Report:
    """Repeat both jobs in fresh processes."""
    run_job("population", "fire", THREADS[0], receptors=2)  # compiles kernels, if that is still to be done
    fired = {
        threads: [run_job("population", "fire", threads, receptors=AFFERENTS) for _ in range(REPEATS)]
        for threads in THREADS
    }
    observed = [run_job("population", "observe", THREADS[0]).answer for _ in range(REPEATS)]
    time_s = {threads: Spread.of([run.answer["fire_s"] for run in runs]) for threads, runs in fired.items()}
    gradient_s, euclidean_s = (
        Spread.of([answer[name] for answer in observed]) for name in ("gradient_sum_s", "euclidean_s")
    )
    return Report(
        name="population",
        title="Populations",
        about=f"{REPEATS} runs each in fresh processes: median (smallest to largest).",
        tables=[
            Table(
                f"{AFFERENTS:,} afferents, 1 s of touch, from strain energy density to exact spikes:",
                ["threads", "s", "of which membrane, s", "spikes", "memory, MB"],
                [
                    [
                        threads,
                        str(time_s[threads]),
                        str(Spread.of([run.answer["membrane_s"] for run in runs])),
                        runs[0].answer["spikes"],
                        str(Spread.of([run.peak_mb for run in runs])),
                    ]
                    for threads, runs in fired.items()
                ],
            ),
            Table(
                "Seven spheres, 18 receptors, 100 x 100 x 100 repetitions, one thread:",
                ["strategy", "s"],
                [["Gradient Sum", str(gradient_s)], ["Euclidean Distance", str(euclidean_s)]],
            ),
        ],
        measured={"afferents_s": time_s[THREADS[-1]].median, "gradient_sum_s": gradient_s.median},
        notes=[
            "The time of the afferents includes interpolation, current and membrane; the time of the "
            "membrane alone is measured on every tenth afferent."
        ],
    )
