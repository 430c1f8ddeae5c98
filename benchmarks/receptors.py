"""Ten thousand receptors all over the pad answer one touch, once the skin is solved."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import Any

from benchmarks.measuring import Spread, run_job
from benchmarks.pressing import PRESSED, touch_of_sphere
from benchmarks.results import Report, Table

RECEPTORS = 10_000
THREADS, REPEATS = (1, 2), 3
SITES = ("x and z of the receptors", "points of the skin")


def respond(receptors: int) -> dict[str, Any]:
    """Press a sphere, then let the population answer several times, each time as if for the first time.

    Returns
    -------
    dict
        By kind of site, seconds of `Population.respond`, those of `SkinResponse.sed` in it, and spikes.
    """
    from fingerpad.core.regions import MM2_PER_CM2, hexagonal
    from fingerpad.geometry.fingertip import Fingertip
    from fingerpad.neuron.population import Population
    from fingerpad.skin.unrolled_skin import UnrolledSkin

    solved = touch_of_sphere("standard").solve()
    unrolled = UnrolledSkin(Fingertip())
    pad = unrolled.pad()
    layout = hexagonal(pad, receptors * MM2_PER_CM2 / pad.area_mm2)
    points = unrolled.points(layout.places_mm)
    population = Population(points, layout.pitch_mm)
    sites = dict(zip(SITES, (points[:, [0, 2]], points), strict=True))
    answer: dict[str, Any] = {"receptors": len(population)}
    for name, positions in sites.items():
        some = Population(positions, layout.pitch_mm)
        Population(positions[:2], layout.pitch_mm).respond(replace(solved))  # loads compiled kernels
        respond_s, sample_s = [], []
        for _ in range(REPEATS):
            skin = replace(solved)  # which has kept nothing from the time before
            started = perf_counter()
            response = some.respond(skin)
            respond_s.append(perf_counter() - started)
            skin = replace(solved)
            started = perf_counter()
            skin.sed(positions)
            sample_s.append(perf_counter() - started)
        answer[name] = {
            "respond_s": respond_s, "sample_s": sample_s, "spikes": int(response.spikes.times_ms.size)
        }  # fmt: skip
    return answer


def measure() -> Report:
    """Press once with one thread and once with two, and report how long the answers take."""
    answers = {
        threads: run_job("receptors", "respond", threads, receptors=RECEPTORS).answer for threads in THREADS
    }
    last = Spread.of(answers[THREADS[-1]][SITES[-1]]["respond_s"])
    return Report(
        name="receptors",
        title="Many receptors under one touch",
        about=(
            f"{PRESSED}, half a finger at standard resolution; then {answers[1]['receptors']:,} receptors in "
            f"a hexagonal layout over the pad, computed {REPEATS} times: median (smallest to largest)."
        ),
        tables=[
            Table(
                "`Population.respond`, from the solved skin to spikes, rates and latencies:",
                ["threads", "sites", "s", "of which sampling the skin, s", "spikes"],
                [
                    [
                        threads,
                        name,
                        str(Spread.of(answer[name]["respond_s"])),
                        str(Spread.of(answer[name]["sample_s"])),
                        answer[name]["spikes"],
                    ]
                    for threads, answer in answers.items()
                    for name in SITES
                ],
            )
        ],
        measured={"receptors_s": last.median},
        notes=["The rest is the time of current, membrane and spikes."],
    )
