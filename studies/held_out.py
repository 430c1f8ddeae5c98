"""Predictions of a set of tissues that no search and no fit has used, against published facts.

Numbers that can be cited are scored as `fingerpad validate` scores a file. What a source states in words is a
check of the prediction's direction: the smallest of all changes must be above 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import FloatArray, Number
from fingerpad.data import paper, protocol, psychophysics
from fingerpad.data.published import Published
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014.thresholds import fitted_noise
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.experiments.validation.observations import KINDS, Observation, Observations, read_observations
from fingerpad.experiments.validation.validation import (
    LOADINGS,
    RAMP_AND_HOLD,
    Condition,
    ValidationRequest,
    predict,
    validate,
)
from fingerpad.geometry.bodies import FlatPunch, Grating, Plate
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh_checks import jacobian_at_gauss
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import firing_rate_hz, modulation_index
from fingerpad.psychophysics.encoding import Measured, neighbour_pairs
from fingerpad.psychophysics.observer import NOISE_DRAWS
from fingerpad.psychophysics.sensitivity import InterpolatedObserver
from fingerpad.report.page import edition
from fingerpad.report.tables import ABSENT, fixed, number
from fingerpad.skin.indentation import Touch, touch_of
from fingerpad.skin.sampling import SkinResponse
from studies import held_out_facts as facts
from studies.pages import joined, table

Fact = Published[float] | Published[tuple[float, ...]]
OBSERVATIONS = Path(__file__).with_name("observations")

CHOSEN, PREDICTED = "chosen in sample", "predicted"
ROLES = {"plate_force": CHOSEN, "plate_force_mean": CHOSEN, "cylinder_deflection": CHOSEN}
"""How the tissues `human` came to the observations of each file."""

FORCE_DEPTHS_MM = (0.5, 1.0, 1.5, 2.0)
PLATE_SHARES = (0.65, 1.44)
"""Smallest and largest force of a subject over the mean of the four, the wider of 1.0 and 2.0 mm."""

SPHERE_FORCES_N = (0.2, facts.SPHERE_FORCES.value[0], facts.SPHERE_FORCES.value[-1])
PROFILE_FORCE_N, PROFILES_PER_M = 0.2, (172.0, 340.0, 694.0)
POSITIONS_MM = np.arange(0.0, 5.01, 0.5)
"""Places of the receptor from the middle of the sphere, towards the proximal end. [mm]"""

RIDGES_MM, TURNED_MM, IN_VIVO_MM = (0.5, 1.0, 1.5, 2.5, 3.0, 5.0), (1.0, 3.0), (3.0, 5.0)
"""Width of the ridges of gratings and of their grooves; those that are also pressed with ridges along the
finger; those whose modulation index in vivo was published. [mm]"""

FORCED_MM, GRATING_FORCES_N, PLACES_PER_PERIOD = 3.0, (0.1, 0.2), 24
VOLUME_DEPTHS_MM = (1.0, 2.0)
VOLUME_INDENTERS: tuple[Indenter, ...] = (Plate(), FlatPunch())
DECLINE_STEPS = PressSettings(5, 10)
STANDARDS_PER_M = (144.0, 200.0, 287.0)
PRESSED_PER_M = (144.0, 165.0, 190.0, 218.0, 250.0, psychophysics.SPHERE_287.value, 296.0, 328.0, 365.0)


@result_class
class Check:
    """One published number or statement, and the prediction."""

    subject: str
    statement: str  #: Force, spheres, gratings, adaptation, volume or percept; what is compared.
    source: str
    status: str  #: Where it was published, and the status of what we know of it.
    role: str  #: `CHOSEN` or `PREDICTED`.
    predicted: Number  #: In `unit`; NaN if it cannot be pressed.
    unit: str  #: Unit of the numbers.
    low: Number
    high: Number  #: Published range; NaN where there is no bound.

    @property
    def inside(self) -> bool | None:
        """Whether the prediction lies in the range; None without a prediction or a bound."""
        if not np.isfinite(self.predicted) or not np.isfinite([self.low, self.high]).any():
            return None
        return not (self.predicted < self.low or self.predicted > self.high)


@result_class
class Score:
    """Scores of one file of observations as of `ValidationFile`, and how the tissues came to it."""

    file: str
    role: str
    loading: str
    n_rows: int
    r2: Number
    correlation: Number
    gain: Number
    inside_range: bool | None


@result_class
class HeldOut:
    """Result of `python -m studies held-out`: checks, scores of the files of observations, and what ran."""

    checks: tuple[Check, ...]
    scores: tuple[Score, ...]
    manifest: Manifest


def run(runner: Runner, conditions: Conditions) -> HeldOut:
    """Press what is missing, predict, and compare; the afferent is the one that belongs to the tissues.

    A stopped run continues after the last stored press.
    """
    return HeldOut(
        checks=(
            *force_checks(plate_forces(conditions, runner)),
            *sphere_checks(*sphere_rates(conditions, runner)),
            *grating_checks(grating_rates(conditions, runner), forced_indices(conditions, runner)),
            *adaptation_checks(declines(conditions, runner)),
            *volume_checks(volume_decreases(conditions, runner)),
            *threshold_checks(weber_fractions(conditions, runner)),
        ),
        scores=tuple(scores(conditions, runner)),
        manifest=runner.manifest(conditions),
    )


def scores(conditions: Conditions, runner: Runner) -> Iterable[Score]:
    """Score every file of observations, by both ways to reach a depth."""
    for path in sorted(OBSERVATIONS.glob("*.csv")):
        for loading in LOADINGS:
            found = validate(_asked(read_observations(path), conditions, loading), runner)
            yield Score(
                file=path.stem,
                role=ROLES.get(path.stem, PREDICTED),
                loading=loading,
                n_rows=found.n_rows,
                r2=found.r2,
                correlation=found.correlation,
                gain=found.gain,
                inside_range=found.inside_range,
            )


def _asked(observed: Observations, conditions: Conditions, loading: str) -> ValidationRequest:
    return ValidationRequest(
        observations=observed, resolution=conditions.resolution, tissues=conditions.tissues, loading=loading
    )


def predicted(
    kind: str,
    wanted: Sequence[Condition],
    conditions: Conditions,
    runner: Runner,
    loading: str = RAMP_AND_HOLD,
) -> FloatArray:
    """Predict conditions of a kind of `KINDS` without observations; NaN where a press is impossible."""
    rows = tuple(Observation(line, condition, np.nan) for line, condition in enumerate(wanted))
    observed = Observations(KINDS[kind], rows, "predictions")
    return predict(_asked(observed, conditions, loading), runner).values


def _check(
    subject: str, statement: str, fact: Fact, value: float, unit: str, low: float, high: float
) -> Check:
    return Check(
        subject=subject,
        statement=statement,
        source=fact.source,
        status=fact.status,
        role=PREDICTED,
        predicted=value,
        unit=unit,
        low=low,
        high=high,
    )


def _direction(subject: str, statement: str, fact: Fact, smallest_change: float, unit: str) -> Check:
    """Check of a direction: the smallest of several changes must be above 0."""
    return _check(subject, statement, fact, smallest_change, unit, np.nextafter(0.0, 1.0), np.nan)


def _smallest_step(values: FloatArray, axis: int) -> float:
    """Smallest difference of neighbours along an axis, of those that both exist."""
    steps = np.diff(values, axis=axis)
    return float(np.nanmin(steps)) if np.isfinite(steps).any() else np.nan


# Force


def plate_forces(conditions: Conditions, runner: Runner) -> dict[str, FloatArray]:
    """Force of the plate at `FORCE_DEPTHS_MM`, by the way to reach a depth. [N]"""
    wanted = [("plate", depth) for depth in FORCE_DEPTHS_MM]
    return {loading: predicted("force", wanted, conditions, runner, loading) for loading in LOADINGS}


def force_checks(force_n: Mapping[str, FloatArray]) -> Iterable[Check]:
    """Compare the plate with people: ranges at 1 and 2 mm, and shares of the mean at other depths."""
    means, ranges = (
        read_observations(OBSERVATIONS / name).rows for name in ("plate_force_mean.csv", "plate_force.csv")
    )
    for loading, forces in force_n.items():
        for depth, force in zip(FORCE_DEPTHS_MM, forces, strict=True):
            mean = next(row.observed for row in means if row.condition[1] == depth)
            subjects = [row.observed for row in ranges if row.condition[1] == depth]
            yield Check(
                subject="force",
                statement=f"plate at {depth:g} mm, {loading.replace('_', ' ')}",
                source="Dandekar 1995, as quoted in later public material; four subjects",
                status="read",
                role=CHOSEN,
                predicted=force,
                unit="N",
                low=min(subjects, default=PLATE_SHARES[0] * mean),
                high=max(subjects, default=PLATE_SHARES[1] * mean),
            )


# Spheres


def sphere_rates(conditions: Conditions, runner: Runner) -> tuple[FloatArray, FloatArray]:
    """Predict static rates under spheres that a force presses. [spikes/s]

    In the middle of the contact (n_forces, n_curvatures), NaN where the sphere would come too near to the
    bone; and beside the middle (n_profiles, n_positions).
    """
    curvatures = facts.SPHERE_CURVATURES.value
    middle = [(force, curvature) for force in SPHERE_FORCES_N for curvature in curvatures]
    beside = [
        (PROFILE_FORCE_N, curvature, place) for curvature in PROFILES_PER_M for place in POSITIONS_MM.tolist()
    ]
    return (
        predicted("rate_curvature", middle, conditions, runner).reshape(len(SPHERE_FORCES_N), -1),
        predicted("rate_position", beside, conditions, runner).reshape(len(PROFILES_PER_M), -1),
    )


def half_width_mm(position_mm: FloatArray, rate_hz: FloatArray) -> float:
    """Distance at which a profile first falls to half of its peak, linear between positions; NaN if never.

    Examples
    --------
    >>> half_width_mm(np.array([0.0, 1.0, 2.0]), np.array([20.0, 15.0, 5.0]))
    1.5
    """
    half = rate_hz.max() / 2.0
    after = [index for index in np.flatnonzero(rate_hz < half) if index > rate_hz.argmax()]
    if not after:
        return np.nan
    last = after[0] - 1
    within = (rate_hz[last] - half) / (rate_hz[last] - rate_hz[last + 1])
    return float(position_mm[last] + within * (position_mm[last + 1] - position_mm[last]))


def sphere_checks(rate_hz: FloatArray, profile_hz: FloatArray) -> Iterable[Check]:
    """Compare with what was stated of human afferents under spheres; the last two forces were applied."""
    curvature, force = facts.SPHERE_CURVATURES, facts.SPHERE_FORCES
    applied = float(np.isfinite(rate_hz[-2:]).mean())
    widths = np.array([half_width_mm(POSITIONS_MM[: row.size], row) for row in profile_hz])
    at = f"at {PROFILE_FORCE_N:g} N"
    yield _check(
        "spheres",
        "share of the applied spheres that stay away from the bone",
        force,
        applied,
        "1",
        1.0,
        np.nan,
    )
    for statement, fact, change, unit in (
        ("rate increases with curvature", curvature, _smallest_step(rate_hz, 1), "spikes/s"),
        ("rate increases with force", force, _smallest_step(rate_hz, 0), "spikes/s"),
        (
            f"more curved, higher profile {at}",
            curvature,
            _smallest_step(profile_hz.max(axis=1), 0),
            "spikes/s",
        ),
        (f"more curved, narrower profile {at}", curvature, _smallest_step(-widths, 0), "mm"),
    ):
        yield _direction("spheres", statement, fact, change, unit)


# Gratings


def grating_touch(conditions: Conditions, ridge_mm: float, spin_deg: float = 0.0) -> Touch:
    """Grating pressed 1.0 mm deep along the skin's normal, a ridge above the receptor.

    Grooves are as wide as ridges; `spin_deg` turns the ridges from across the finger.
    """
    return touch_of(
        conditions.finger,
        Grating(ridge_mm, ridge_mm, min(protocol.LIP_RADIUS.value, ridge_mm / 2)),
        tissues=conditions.tissues,
        resolution=conditions.resolution,
        tilt_deg=conditions.skin_tilt_deg,
        spin_deg=spin_deg,
    )


def grating_rates(conditions: Conditions, runner: Runner) -> dict[tuple[float, float], FloatArray]:
    """Predict static rates over one period of gratings, by ridge and spin. [spikes/s]"""
    gratings = [(ridge, 0.0) for ridge in RIDGES_MM] + [(ridge, 90.0) for ridge in TURNED_MM]
    touches = {grating: grating_touch(conditions, *grating) for grating in gratings}
    skins = runner.responses({"gratings": touches})["gratings"]
    return {
        grating: period_rates_hz(skins[grating], conditions.afferent, *grating, conditions.skin_tilt_deg)
        for grating in gratings
    }


def forced_indices(conditions: Conditions, runner: Runner) -> FloatArray:
    """Modulation index of one grating by force, (n_forces,)."""
    wanted = [
        (force, FORCED_MM, FORCED_MM, place)
        for force in GRATING_FORCES_N
        for place in _places_mm(FORCED_MM).tolist()
    ]
    return _index(predicted("grating", wanted, conditions, runner).reshape(len(GRATING_FORCES_N), -1))


def _places_mm(ridge_mm: float) -> FloatArray:
    """Places over one period, from minus half of it, (PLACES_PER_PERIOD,). [mm]"""
    return 2.0 * ridge_mm * (np.arange(PLACES_PER_PERIOD) / PLACES_PER_PERIOD - 0.5)


def _index(rates_hz: FloatArray) -> FloatArray:
    """Modulation index over the last axis."""
    return modulation_index(rates_hz.max(axis=-1), rates_hz.min(axis=-1))


def period_rates_hz(
    skin: SkinResponse, afferent: Afferent, ridge_mm: float, spin_deg: float, tilt_deg: float
) -> FloatArray:
    """Return static rates over one period of a grating along the skin, (PLACES_PER_PERIOD,). [spikes/s]"""
    places = _places_mm(ridge_mm)
    across = spin_deg == 0.0
    along = places * np.cos(np.deg2rad(tilt_deg)) if across else np.zeros_like(places)
    sites = np.stack([RECEPTOR_X_MM + along, np.zeros_like(places) if across else places], axis=1)
    return Population(sites, 1.0, afferent).respond(skin).static_rate_hz


def grating_checks(
    static_hz: Mapping[tuple[float, float], FloatArray], forced_index: FloatArray
) -> Iterable[Check]:
    """Compare with modulation in vivo, and with what was stated of gratings."""
    index = {grating: float(_index(rates)) for grating, rates in static_hz.items()}
    in_vivo, fine, fact = paper.GRATING_MODULATION_IN_VIVO, facts.FINEST_GRATING, facts.GRATINGS
    for size, observed in zip(IN_VIVO_MM, in_vivo.value, strict=True):
        rates = static_hz[size, 0.0]
        # In vivo it is the edge against the flat face, as for bars, not the ridge against the groove.
        face_hz = rates[PLACES_PER_PERIOD // 2]
        yield _check(
            "gratings",
            f"static index of Eq. 11, edge against flat face of {size:g} mm, within 10 %",
            in_vivo,
            float(modulation_index(rates.max(), face_hz)),
            "1",
            0.9 * observed,
            1.1 * observed,
        )
    changes = float(np.ptp(static_hz[fine.value, 0.0]))
    yield _direction("gratings", f"rate changes over grooves of {fine.value:g} mm", fine, changes, "spikes/s")
    rising = _smallest_step(np.array([index[ridge, 0.0] for ridge in RIDGES_MM]), 0)
    yield _direction("gratings", "index increases with the period", fact, rising, "1")
    change = float(np.abs(np.diff(forced_index)).max())
    yield _check("gratings", "index does not change from 0.1 to 0.2 N", fact, change, "1", np.nan, 0.05)
    turned = min(index[ridge, 90.0] - index[ridge, 0.0] for ridge in TURNED_MM)
    yield _direction("gratings", "ridges along the finger modulate more than across it", fact, turned, "1")
    louder = min(float(static_hz[ridge, 90.0].mean() - static_hz[ridge, 0.0].mean()) for ridge in TURNED_MM)
    yield _direction(
        "gratings", "ridges along the finger evoke more than across it", fact, louder, "spikes/s"
    )


# Adaptation


def steady(conditions: Conditions, depth_mm: float) -> tuple[Touch, list[tuple[float, float]]]:
    """Slow ramp and hold of 12 s, with windows of its first and its last second. [ms]"""
    ramp_ms = MS_PER_S * depth_mm / facts.DECLINE_SPEED.value
    hold_ms = MS_PER_S * facts.DECLINE_TIME.value
    touch = touch_of(
        conditions.finger,
        FlatPunch(facts.DECLINE_PROBE.value),
        RampAndHold(depth_mm, ramp_ms, hold_ms),
        conditions.tissues,
        conditions.resolution,
        tilt_deg=conditions.skin_tilt_deg,
        settings=DECLINE_STEPS,
    )
    end_ms = ramp_ms + hold_ms
    return touch, [(ramp_ms, ramp_ms + MS_PER_S), (end_ms - MS_PER_S, end_ms)]


def declines(conditions: Conditions, runner: Runner) -> list[float]:
    """Share by which the rate falls from the first to the last second of a hold, by depth."""
    named = {depth: steady(conditions, depth) for depth in facts.DECLINE_DEPTHS.value}
    skins = runner.responses({"adaptation": {depth: touch for depth, (touch, _) in named.items()}})
    middle = Population(np.array([(RECEPTOR_X_MM, 0.0)]), 1.0, conditions.afferent)
    return [decline(middle, skins["adaptation"][depth], windows) for depth, (_, windows) in named.items()]


def decline(population: Population, skin: SkinResponse, windows_ms: Sequence[tuple[float, float]]) -> float:
    """Share by which the rate of the first receptor falls from first to last window; NaN if silent."""
    spikes = population.respond(skin).spikes
    first, *_, last = (firing_rate_hz(spikes, window)[0] for window in windows_ms)
    return float(1.0 - last / first) if first > 0.0 else np.nan


def adaptation_checks(found: Sequence[float]) -> Iterable[Check]:
    """Compare the decline over 12 s with that of monkey afferents, within a quarter of it."""
    fact = facts.DECLINES
    for depth, value, observed in zip(facts.DECLINE_DEPTHS.value, found, fact.value, strict=True):
        statement = f"decline of the rate in 12 s, flat probe, {depth:g} mm, within a quarter"
        yield _check("adaptation", statement, fact, value, "1", 0.75 * observed, 1.25 * observed)


# Volume


def volume_decrease(skin: SkinResponse) -> float:
    """Relative decrease of the volume of all elements at the last time.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from fingerpad.geometry.mesh import block_mesh
    >>> block = block_mesh([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], layers=[3])
    >>> skin = SimpleNamespace(mesh=block, displacement_mm=-0.1 * block.nodes_mm * [0.0, 1.0, 0.0])
    >>> round(volume_decrease(skin), 9)
    0.1
    """
    mesh = skin.mesh
    deformed = replace(mesh, nodes_mm=mesh.nodes_mm + skin.displacement_mm)
    return float(1.0 - jacobian_at_gauss(deformed).sum() / jacobian_at_gauss(mesh).sum())


def volume_decreases(conditions: Conditions, runner: Runner) -> FloatArray:
    """Decrease of the volume under plate and disc, (n_indenters, n_depths)."""
    touches = {
        (number, depth): touch_of(
            conditions.finger, body, RampAndHold(depth), conditions.tissues, conditions.resolution
        )
        for number, body in enumerate(VOLUME_INDENTERS)
        for depth in VOLUME_DEPTHS_MM
    }
    skins = runner.responses({"volume": touches})["volume"]
    return np.array([volume_decrease(skins[key]) for key in touches]).reshape(len(VOLUME_INDENTERS), -1)


def volume_checks(decrease: FloatArray) -> Iterable[Check]:
    """Compare with the largest change in vivo, and with what was stated of its causes."""
    fact = facts.VOLUME_CHANGE
    for depth, value in zip(VOLUME_DEPTHS_MM, decrease[0], strict=True):
        yield _check("volume", f"decrease under a plate at {depth:g} mm", fact, value, "1", 0.0, fact.value)
    deeper, larger = np.diff(decrease, axis=1).min(), -np.diff(decrease, axis=0).max()
    yield _direction("volume", "more at 2 mm than at 1 mm", fact, deeper, "1")
    yield _direction("volume", "more under a plate than under a disc", fact, larger, "1")


# Percept


def weber_fractions(conditions: Conditions, runner: Runner) -> list[float]:
    """Weber fraction at each of `STANDARDS_PER_M`, the noise fitted to people's hit rates at 287 /m."""
    touches = {curvature: conditions.sphere_touch(curvature) for curvature in PRESSED_PER_M}
    skins = runner.responses({"spheres": touches})["spheres"]
    grid = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0), afferent=conditions.afferent)
    static_hz = np.array([grid.respond(skins[curvature]).static_rate_hz for curvature in PRESSED_PER_M])
    return weber_fractions_of(grid, static_hz, conditions.seed)


def weber_fractions_of(grid: Population, static_hz: FloatArray, seed: int) -> list[float]:
    """Weber fractions from static rates under `PRESSED_PER_M`; NaN if no pressed sphere is discriminated."""
    pairs = neighbour_pairs(grid.positions_mm, grid.pitch_mm)
    draws = normals(seed, 1, len(grid), Purpose.RESPONSE, NOISE_DRAWS)[0].T
    people = (psychophysics.SPHERE_287.value, *psychophysics.GOODWIN_CURVATURES.value)
    rows = static_hz[[PRESSED_PER_M.index(curvature) for curvature in people]]
    measured = Measured(rows, pairs, grid.noise_offset_hz)
    noise = measured.noise(fitted_noise(measured, draws))
    observer = InterpolatedObserver(np.array(PRESSED_PER_M), static_hz, pairs, noise, draws)
    return [observer.difference(standard) / standard for standard in STANDARDS_PER_M]


def threshold_checks(fractions: Sequence[float]) -> Iterable[Check]:
    """Compare Weber fractions with people's, in whole per cent."""
    fact = psychophysics.WEBER_FRACTIONS
    for standard, fraction in zip(STANDARDS_PER_M, fractions, strict=True):
        statement = f"Weber fraction at {standard:g} /m"
        found = _check("percept", statement, fact, round(fraction, 2), "1", *fact.value)
        yield replace(found, role=CHOSEN)  # The offset of the noise was chosen by them.


# Page


def blocks(results: HeldOut) -> dict[str, str]:
    """Return the blocks of docs/held-out.md."""
    judged = [check for check in results.checks if check.role == PREDICTED and check.inside is not None]
    inside = sum(bool(check.inside) for check in judged)
    outside = ", ".join(sorted({check.subject for check in judged if not check.inside})) or "none"
    sources = dict.fromkeys(f"{check.source} ({check.status})" for check in results.checks)
    return {
        "checks": joined(
            f"{inside} of {len(judged)} predictions lie inside what was published. Outside are some of: "
            f"{outside}. Written by `python -m studies held-out`: tissues `{results.manifest.materials}`, "
            f"{edition(results.manifest)}",
            table(
                ("of", "what", "predicted", "published", "verdict"), [_row(each) for each in results.checks]
            ),
            f"Sources (status): {'; '.join(sources)}.",
        ),
        "scores": table(
            ("file", "loading", "role", "rows", "r2", "correlation", "gain", "inside"),
            [
                (
                    f"`{each.file}.csv`",
                    each.loading.replace("_", " "),
                    each.role,
                    str(each.n_rows),
                    *(fixed(value, 2) for value in (each.r2, each.correlation, each.gain)),
                    ABSENT if each.inside_range is None else str(each.inside_range).lower(),
                )
                for each in results.scores
            ],
        ),
    }


def _row(check: Check) -> tuple[str, ...]:
    low, high = (number(value) if np.isfinite(value) else "" for value in (check.low, check.high))
    if not high:
        published = "above 0" if check.low < 1e-9 else f"from {low}"
    else:
        published = f"{low}–{high}" if low else f"up to {high}"
    verdict = ABSENT if check.inside is None else "inside" if check.inside else "**outside**"
    return (
        check.subject,
        check.statement,
        f"{number(check.predicted)} {'' if check.unit == '1' else check.unit}".strip(),
        published,
        f"{verdict} (chosen)" if check.role == CHOSEN else verdict,
    )
