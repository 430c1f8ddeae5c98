"""Numbers and picture of docs/afferents.md and docs/decisions/inertia.md.

`python -m studies.vibration_page` presses some forty vibrations (about 20 minutes) and writes them anew; with
names of parts ("inertia", "range", "errors", "picture", "second") only those.
"""

from __future__ import annotations

import re
import sys
import time
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from fingerpad.core.errors import InertiaWarning
from fingerpad.core.files import write_atomically
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import FlatPunch, Indenter, Plate, Sphere
from fingerpad.geometry.motion import Cycles
from fingerpad.geometry.motions import sine
from fingerpad.geometry.trajectory import Trajectory
from fingerpad.mechanics.inertia import moved_mass_mg, resonance_hz
from fingerpad.neuron.afferent import Afferent
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, new_figure, write_png
from fingerpad.skin.indentation import CONTACT_POINT_MM, settings_of, touch_of
from fingerpad.skin.sampling import SkinResponse

DOCS = Path(__file__).parents[1] / "docs"
PAGE, DECISION, PICTURE = (
    DOCS / "vibration.md",
    DOCS / "decisions" / "inertia.md",
    DOCS / "images" / "vibration.png",
)
BALL, HOLD_MM = Sphere(curvature_per_m=287.0), 0.8
MASS_BODIES: dict[str, Indenter] = {
    "sphere, 287 /m": BALL,
    "flat punch, 3 mm": FlatPunch(diameter_mm=3.0, fillet_mm=0.3),
    "plate": Plate(),
}
SITE = [(*CONTACT_POINT_MM,)]


@dataclass(frozen=True)
class Vibrated:
    """One vibration and how it was solved."""

    cycles: Cycles
    skin: SkinResponse
    seconds: float


def vibrated(frequency_hz: float, amplitude_mm: float, cycles: int, all_cycles: bool = False) -> Vibrated:
    """Press a sphere at quick and let it vibrate."""
    motion = sine(HOLD_MM, amplitude_mm, frequency_hz, cycles, hold_ms=450.0)
    settings = settings_of("quick")
    if all_cycles:
        settings = replace(settings, cycle_tolerance=None)
    started = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        skin = touch_of(Fingertip(), BALL, motion, settings=settings).solve()
    assert motion.cycles is not None
    return Vibrated(motion.cycles, skin, time.perf_counter() - started)


def spikes_of(done: Vibrated) -> np.ndarray:
    """Spike times of an afferent below the sphere during the vibration. [ms]"""
    afferent = Afferent()
    spikes = afferent.spikes(done.skin.sed(SITE, afferent.dynamic_quantity, afferent.static_quantity))[0]
    return spikes[spikes > done.cycles.start_ms]


def range_rows() -> Iterable[Sequence[str]]:
    """Range of frequencies and amplitudes: two cycles of each, all solved."""
    for frequency in (1.0, 20.0, 100.0, 400.0):
        for amplitude in (0.001, 0.01, 0.1, 1.0):
            done = vibrated(frequency, amplitude, 2)
            held = done.skin.force_mn[done.skin.times_ms >= done.cycles.start_ms]
            print(frequency, amplitude, done.skin.energy_imbalance, flush=True)
            yield (
                f"{frequency:g}", f"{1e3 * amplitude:g}", f"{held.min():.1f}", f"{held.max():.1f}",
                f"{done.skin.newton_steps}", f"{done.skin.energy_imbalance:.2%}",
            )  # fmt: skip


def error_rows() -> Iterable[Sequence[str]]:
    """Twelve cycles with some interpolated against all of them solved."""
    for frequency, amplitude in ((20.0, 0.1), (100.0, 0.1), (100.0, 0.5)):
        some, full = vibrated(frequency, amplitude, 12), vibrated(frequency, amplitude, 12, all_cycles=True)
        errors = [
            np.abs(got - expected).max() / np.abs(expected).max()
            for got, expected in (
                (getattr(some.skin, name), getattr(full.skin, name))
                for name in ("sed_kpa", "force_mn", "contact_area_mm2")
            )
        ]
        different = np.setdiff1d(spikes_of(some).round(1), spikes_of(full).round(1)).size
        yield (
            f"{frequency:g}", f"{1e3 * amplitude:g}", *(f"{error:.1e}" for error in errors),
            f"{different} of {spikes_of(full).size}",
        )  # fmt: skip


def inertia_rows() -> Iterable[Sequence[str]]:
    """Press fast small steps on a hold: moved mass, stiffness, and the resonance that follows from them."""
    for tissues in ("human", "trial3"):
        for name, body in MASS_BODIES.items():
            motion = Trajectory((0.0, 50.0, 500.0, 520.0), (0.0, 1.0, 1.0, 1.02))
            touch = touch_of(Fingertip(), body, motion, tissues)
            done = touch.solve(whole=True).deformation
            assert done is not None
            way_mm = done.depth_mm[-1] - done.depth_mm[-2]
            mass_mg = moved_mass_mg(
                touch.mesh, (done.displacement_mm[-1] - done.displacement_mm[-2]) / way_mm
            )
            stiffness = (done.force_mn[-1] - done.force_mn[-2]) / way_mm
            measured = np.sqrt(stiffness / (1e-6 * mass_mg)) / (2.0 * np.pi)
            estimate = resonance_hz(touch.tissues.layers, touch.layers_mm)
            shares = (f"{(frequency / measured) ** 2:.0%}" for frequency in (20.0, 50.0, 100.0, 200.0))
            yield (
                tissues, name, f"{mass_mg:.0f}", f"{stiffness:.0f}", f"{measured:.0f}", f"{estimate:.0f}",
                *shares,
            )  # fmt: skip


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown, numbers to the right."""
    lines = [header, ["---:"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def with_table(text: str, name: str, content: str) -> str:
    """Return a page with new content between the markers of a name."""
    pattern = re.compile(rf"(<!-- begin {name} -->\n).*?(\n<!-- end {name} -->)", re.DOTALL)
    assert pattern.search(text), name
    return pattern.sub(lambda found: found[1] + content + found[2], text)


def draw(runs: Sequence[Vibrated]) -> Figure:
    """Draw the loop of force over depth, energy density over time, spikes, and spikes per cycle."""
    shown = runs[2]
    figure = new_figure(8.0, 5.4)
    (loop, density), (counts, raster) = figure.subplots(2, 2)
    skin, cycles, afferent = shown.skin, shown.cycles, Afferent()
    vibrates = skin.times_ms >= cycles.start_ms
    loop.plot(
        skin.depth_mm[~vibrates], skin.force_mn[~vibrates], color=GREY, linestyle="--", label="ramp and hold"
    )
    loop.plot(skin.depth_mm[vibrates], skin.force_mn[vibrates], color=BLUE, label="vibration")
    loop.set(xlabel="depth [mm]", ylabel="force [mN]")
    loop.legend(loc="upper left")
    traces = skin.sed(SITE, afferent.dynamic_quantity, afferent.static_quantity)
    density.plot(skin.times_ms, skin.sed(SITE).sed_kpa[:, 0], color=BLUE)
    density.set(xlabel="time [ms]", ylabel="stored energy density [kPa]")
    spikes = afferent.spikes(traces)[0]
    for time_ms in spikes:
        density.axvline(time_ms, ymax=0.06, color=BLACK, linewidth=0.6)
    frequencies = [1e3 / run.cycles.period_ms for run in runs]
    names = [f"{frequency:g}" for frequency in frequencies]
    per_cycle = [spikes_of(run).size / run.cycles.count for run in runs]
    counts.loglog(frequencies, per_cycle, color=ORANGE, marker="o")
    counts.set(xlabel="frequency [Hz]", ylabel="spikes per cycle")
    counts.set_xticks(frequencies, names)
    counts.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    counts.yaxis.set_major_formatter("{x:g}")
    counts.minorticks_off()
    for row, run in enumerate(runs):
        period = run.cycles.period_ms
        raster.plot(
            (spikes_of(run) - run.cycles.start_ms) % period / period,
            np.full(spikes_of(run).size, row), color=BLACK, marker="|", linestyle="none", markersize=9.0,
        )  # fmt: skip
    raster.set(xlabel="phase of the cycle", ylabel="frequency [Hz]", xlim=(0.0, 1.0))
    raster.set_yticks(range(len(runs)), names)
    return figure


TABLES = {
    "inertia": (
        DECISION,
        ("tissues", "indenter", "moved mass [mg]", "stiffness [N/m]", "resonance [Hz]", "estimate [Hz]",
         "20 Hz", "50 Hz", "100 Hz", "200 Hz"),
        inertia_rows,
    ),
    "range": (
        PAGE,
        ("frequency [Hz]", "amplitude [µm]", "least force [mN]", "largest force [mN]", "Newton steps",
         "energy imbalance"),
        range_rows,
    ),
    "errors": (
        PAGE,
        ("frequency [Hz]", "amplitude [µm]", "SED", "force", "contact area", "spikes that differ by 0.1 ms"),
        error_rows,
    ),
}  # fmt: skip


def main(parts: Sequence[str]) -> None:
    """Write the tables and the picture, or the named ones, and print the time of a second at 100 Hz."""
    if not parts or "second" in parts:
        second = vibrated(100.0, 0.1, 100)
        print(f"1 s of 100 Hz: {second.seconds:.0f} s, energy imbalance {second.skin.energy_imbalance:.2%}")
    for name, (path, header, rows) in TABLES.items():
        if not parts or name in parts:
            content = table(header, rows())
            write_atomically(path, with_table(path.read_text(encoding="utf-8"), name, content).encode())
    if not parts or "picture" in parts:
        runs = [vibrated(frequency, 0.1, 12) for frequency in (5.0, 10.0, 20.0, 40.0, 100.0, 200.0)]
        write_png(draw, runs, PICTURE)


if __name__ == "__main__":
    main(sys.argv[1:])
