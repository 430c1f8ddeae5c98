"""Predictions of a set of tissues that no search and no fit has used, against published facts.

Numbers that can be cited are scored as `fingerpad validate` scores a file. What a source states in words is a
check of the prediction's direction. Without numbers the prediction alone is given, in the columns of
`fingerpad validate`, so that a file of observations can be scored in its place.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Matrix, Number, Vector, result_class
from fingerpad.core.units import MN_PER_N, MS_PER_S
from fingerpad.data import paper, protocol, psychophysics
from fingerpad.data.published import Published
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014.skin_deflection import PLATE_DEPTHS_MM
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.validation.observations import KINDS, Observation, Observations, read_observations
from fingerpad.experiments.validation.predictions import (
    LOADINGS,
    QUASI_STATIC,
    RAMP_AND_HOLD,
    Condition,
    FingertipModel,
    predict,
)
from fingerpad.experiments.validation.validation import ValidationRequest, validate
from fingerpad.geometry.edged_indenters import Grating
from fingerpad.geometry.indenters import FlatPunch, Indenter, Plate
from fingerpad.geometry.mesh_quality import jacobian_at_gauss
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import firing_rate_hz, modulation_index
from fingerpad.skin.indentation import Touch, touch_of
from fingerpad.skin.sampling import SkinResponse
from studies import held_out_facts as facts
from studies import sphere_thresholds
from studies.sphere_thresholds import SphereThresholds, ThresholdRow

Fact = Published[float] | Published[tuple[float, ...]]

OBSERVATIONS = Path(__file__).with_name("observations")

CHOSEN, PREDICTED, PARTLY = "chosen in sample", "predicted", "1 and 2 mm chosen in sample, others predicted"
ROLES = {"plate_force": CHOSEN, "plate_force_mean": PARTLY, "cylinder_deflection": CHOSEN}
"""How the tissues `human` came to the observations of each file."""

FORCE_DEPTHS_MM = (0.5, 1.0, 1.5, 2.0)
FORCE_INDENTERS = ("plate", "punch:6.35", "cylinder:3.17", "sphere:287")
DEFLECTED = (("cylinder:3.17", 0.5), ("cylinder:3.17", 1.0), ("cylinder:3.17", 2.0), ("line", 1.0))
DISTANCES_MM = (0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0)

SPHERE_FORCES_N = (0.2, facts.SPHERE_FORCES.value[0], facts.SPHERE_FORCES.value[-1])
PROFILE_FORCE_N = 0.2
PROFILES_PER_M = (172.0, 340.0, 694.0)
POSITIONS_MM = tuple(np.arange(0.0, 5.01, 0.5).tolist())
"""Places of the receptor from the middle of the sphere, towards the proximal end. [mm]"""

RIDGES_MM = (0.5, 1.0, 1.5, 2.5, 3.0, 5.0)
"""Width of the ridges of a grating, and of its grooves. [mm]"""

TURNED_MM = (1.0, 3.0)
"""Gratings that are also pressed with their ridges along the finger. [mm]"""

IN_VIVO_MM = (3.0, 5.0)
"""Gratings whose modulation index in vivo was published. [mm]"""

FORCED_MM = (3.0,)
GRATING_FORCES_N = (0.1, 0.2)
PLACES_PER_PERIOD = 24

WINDOWS_MS = ((50.0, 150.0), (150.0, 300.0), (300.0, 600.0), protocol.STATIC_WINDOW.value)
"""Successive windows of the hold. [ms]"""

DECLINE_STEPS = PressSettings(5, 10)
VOLUME_DEPTHS_MM = (1.0, 2.0)
VOLUME_INDENTERS: dict[str, Indenter] = {"plate": Plate(), "disc of 6.35 mm": FlatPunch()}
PLATE_SHARES = (0.65, 1.44)
"""Smallest and largest force of a subject over the mean of the four, the wider of 1.0 and 2.0 mm."""


@result_class
class Check:
    """One published number or statement, and the prediction.

    Parameters
    ----------
    subject : str
        Force, deflection, spheres, gratings, adaptation, volume or percept.
    statement : str
        What is compared.
    source, status : str
        Where it was published, and the status of what we know of it.
    role : str
        `CHOSEN` or `PREDICTED`.
    predicted : float
        In `unit`; NaN if it cannot be pressed.
    unit : str
        Unit of the numbers.
    low, high : float
        Published range; NaN where there is no bound.
    """

    subject: str
    statement: str
    source: str
    status: str
    role: str
    predicted: Number
    unit: str
    low: Number
    high: Number

    @property
    def inside(self) -> bool | None:
        """Whether the prediction lies in the range; None without a prediction or a bound."""
        if not np.isfinite(self.predicted) or not np.isfinite([self.low, self.high]).any():
            return None
        return not (self.predicted < self.low or self.predicted > self.high)


@result_class
class Score:
    """Scores of one file of observations, as `fingerpad validate` computes them.

    Parameters
    ----------
    file, role, loading : str
        Name of the file, how the tissues came to its observations, and how depths were reached.
    n_rows, n_judged : int
        Rows, and conditions with a range.
    r2, correlation, gain, share_inside : float
        As of `ValidationFile`.
    inside_range : bool or None
        Likewise.
    """

    file: str
    role: str
    loading: str
    n_rows: int
    n_judged: int
    r2: Number
    correlation: Number
    gain: Number
    share_inside: Number
    inside_range: bool | None


@result_class
class Forces:
    """Force of indenters at depths, at the end of the hold.

    Parameters
    ----------
    indenter : tuple of str
        As in files of observations.
    depth_mm : array (n_depths,)
        [mm]
    force_n : array (n_indenters, n_depths)
        By the paper's motion. [N]
    slow_plate_n : array (n_depths,)
        Of the plate with relaxed tissues. [N]
    people_n : array (n_depths,)
        Mean of four subjects under the plate. [N]
    people_range_n : array (n_depths, 2)
        Smallest and largest of them; NaN where only the mean is known. [N]
    """

    indenter: tuple[str, ...]
    depth_mm: Vector
    force_n: Matrix
    slow_plate_n: Vector
    people_n: Vector
    people_range_n: Matrix


@result_class
class Deflections:
    """Predicted deflection of the skin, mean of both sides, over the depth.

    Parameters
    ----------
    indenter : tuple of str
        One per press.
    depth_mm : array (n_presses,)
        [mm]
    distance_mm : array (n_distances,)
        From the axis of the indenter. [mm]
    share : array (n_presses, n_distances)
        [1]
    """

    indenter: tuple[str, ...]
    depth_mm: Vector
    distance_mm: Vector
    share: Matrix


@result_class
class SphereRates:
    """Predicted static rates under spheres that a force presses.

    Parameters
    ----------
    force_n : array (n_forces,)
        [N]
    curvature_per_m : array (n_curvatures,)
        0 is a plate. [1/m]
    rate_hz : array (n_forces, n_curvatures)
        At the middle of the contact; NaN where the sphere would come too near to the bone. [spikes/s]
    profile_force_n : float
        Force of the profiles. [N]
    profile_per_m : array (n_profiles,)
        Their curvatures. [1/m]
    position_mm : array (n_positions,)
        Of the receptor from the middle of the sphere. [mm]
    profile_hz : array (n_profiles, n_positions)
        [spikes/s]
    """

    force_n: Vector
    curvature_per_m: Vector
    rate_hz: Matrix
    profile_force_n: float
    profile_per_m: Vector
    position_mm: Vector
    profile_hz: Matrix

    def half_widths_mm(self) -> FloatArray:
        """Distance at which each profile falls to half of its peak, (n_profiles,). [mm]"""
        return np.array([_half_width(self.position_mm, profile) for profile in self.profile_hz])


@result_class
class GratingRates:
    """Predicted rates over one period of gratings whose grooves are as wide as their ridges.

    Parameters
    ----------
    ridge_mm : array (n_gratings,)
        Width of ridges and grooves. [mm]
    spin_deg : array (n_gratings,)
        0 with ridges across the finger, 90 along it. [degrees]
    static_hz : array (n_gratings, n_places)
        1.0 mm deep, in the hold, at equal steps from a ridge's middle. [spikes/s]
    static_index, dynamic_index : array (n_gratings,)
        Modulation index, Eq. 11, in hold and ramp.
    force_n : array (n_forces,)
        Forces of the same gratings, those of `forced_ridge_mm`. [N]
    forced_ridge_mm : array (n_forced,)
        [mm]
    forced_index : array (n_forces, n_forced)
        Static modulation index.
    """

    ridge_mm: Vector
    spin_deg: Vector
    static_hz: Matrix
    static_index: Vector
    dynamic_index: Vector
    force_n: Vector
    forced_ridge_mm: Vector
    forced_index: Matrix

    def index_of(self, ridge_mm: float, spin_deg: float = 0.0) -> float:
        """Return the static modulation index of one grating."""
        chosen = (self.ridge_mm == ridge_mm) & (self.spin_deg == spin_deg)
        return float(self.static_index[chosen][0])


@result_class
class Adaptation:
    """Predicted rates in successive windows of a hold.

    Parameters
    ----------
    name : str
        What is pressed.
    window_s : array (n_windows, 2)
        Start and end of each window, after the start of the ramp. [s]
    rate_hz : array (n_windows,)
        Below the middle of the contact. [spikes/s]
    """

    name: str
    window_s: Matrix
    rate_hz: Vector

    @property
    def decline(self) -> float:
        """Share by which the rate falls from the first to the last window."""
        return float(1.0 - self.rate_hz[-1] / self.rate_hz[0]) if self.rate_hz[0] > 0.0 else np.nan


@result_class
class Volumes:
    """Predicted relative decrease of the volume of the soft tissue, at the end of the hold.

    Parameters
    ----------
    indenter : tuple of str
        What is pressed.
    depth_mm : array (n_depths,)
        [mm]
    decrease : array (n_indenters, n_depths)
        Over the soft tissue of the modelled fingertip. [1]
    """

    indenter: tuple[str, ...]
    depth_mm: Vector
    decrease: Matrix


@result_class
class HeldOut:
    """Result of `python -m studies held-out`.

    Parameters
    ----------
    checks : tuple of Check
        Published numbers and statements, each with its prediction.
    scores : tuple of Score
        Of the files of observations.
    forces, deflections, spheres, gratings, volumes
        Predictions.
    adaptation : tuple of Adaptation
        Predictions.
    thresholds : SphereThresholds
        Curvature thresholds by depth and by force.
    manifest : Manifest
        What ran.
    """

    checks: tuple[Check, ...]
    scores: tuple[Score, ...]
    forces: Forces
    deflections: Deflections
    spheres: SphereRates
    gratings: GratingRates
    adaptation: tuple[Adaptation, ...]
    volumes: Volumes
    thresholds: SphereThresholds
    manifest: Manifest


def run(runner: Runner, conditions: Conditions) -> HeldOut:
    """Press what is missing, predict, and compare.

    Parameters
    ----------
    runner : Runner
        Stores the presses; a stopped run continues after the last one.
    conditions : Conditions
        Finger, tissues, resolution and seed; the afferent is the one that belongs to the tissues.

    Returns
    -------
    HeldOut

    Raises
    ------
    ConvergenceError
        If a press without an alternative cannot be solved.
    StoreError
        If a stored press is damaged or the folder cannot be written.
    """
    model = FingertipModel(conditions)
    forces = indenter_forces(model, runner)
    spheres = sphere_rates(model, runner)
    gratings = grating_rates(model, runner)
    adaptation = adaptations(model, runner)
    volumes = volume_changes(conditions, runner)
    thresholds = sphere_thresholds.run(runner, conditions, model.responding)
    checks = (
        *force_checks(forces),
        *sphere_checks(spheres),
        *grating_checks(gratings),
        *adaptation_checks(adaptation),
        *volume_checks(volumes),
        *threshold_checks(thresholds.rows[:1]),
    )
    return HeldOut(
        checks=checks,
        scores=tuple(scores(model, runner)),
        forces=forces,
        deflections=deflections(model, runner),
        spheres=spheres,
        gratings=gratings,
        adaptation=adaptation,
        volumes=volumes,
        thresholds=thresholds,
        manifest=runner.manifest(conditions),
    )


def scores(model: FingertipModel, runner: Runner) -> Iterable[Score]:
    """Score every file of observations, by both ways to reach a depth."""
    for path in sorted(OBSERVATIONS.glob("*.csv")):
        for loading in LOADINGS:
            request = ValidationRequest(
                read_observations(path), replace(model, loading=loading), runner.folder, runner.jobs
            )
            found = validate(request)
            yield Score(
                file=path.stem,
                role=ROLES.get(path.stem, PREDICTED),
                loading=loading,
                n_rows=found.n_rows,
                n_judged=found.n_judged,
                r2=found.r2,
                correlation=found.correlation,
                gain=found.gain,
                share_inside=found.share_inside,
                inside_range=found.inside_range,
            )


def predicted(
    kind: str, conditions: Sequence[Condition], model: FingertipModel, runner: Runner
) -> FloatArray:
    """Predict conditions of a kind of observation, without observations.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    conditions : sequence of tuple (n,)
        Values in the order of the kind's conditions.
    model : FingertipModel
        Finger, tissues, afferent.
    runner : Runner
        Stores the presses.

    Returns
    -------
    array (n,)
        In the unit of the kind; NaN where a press is impossible.
    """
    rows = tuple(Observation(line, condition, np.nan) for line, condition in enumerate(conditions))
    return predict(Observations(KINDS[kind], rows, "predictions"), model, runner).values


def indenter_forces(model: FingertipModel, runner: Runner) -> Forces:
    """Predict the forces of all indenters, and of the plate with relaxed tissues."""
    wanted = [(body, depth) for body in FORCE_INDENTERS for depth in FORCE_DEPTHS_MM]
    slow = [("plate", depth) for depth in FORCE_DEPTHS_MM]
    means = read_observations(OBSERVATIONS / "plate_force_mean.csv").rows
    ranges = read_observations(OBSERVATIONS / "plate_force.csv").rows
    observed = {
        depth: [row.observed for row in ranges if row.condition[1] == depth] for depth in FORCE_DEPTHS_MM
    }
    return Forces(
        indenter=FORCE_INDENTERS,
        depth_mm=np.array(FORCE_DEPTHS_MM),
        force_n=predicted("force", wanted, model, runner).reshape(len(FORCE_INDENTERS), -1),
        slow_plate_n=predicted("force", slow, replace(model, loading=QUASI_STATIC), runner),
        people_n=np.array([
            next(row.observed for row in means if row.condition[1] == depth) for depth in FORCE_DEPTHS_MM
        ]),
        people_range_n=np.array([
            (min(found), max(found)) if found else (np.nan, np.nan) for found in observed.values()
        ]),
    )  # fmt: skip


def force_checks(forces: Forces) -> Iterable[Check]:
    """Compare the plate with people: ranges at 1 and 2 mm, and shares of the mean at other depths."""
    source = "Dandekar 1995, as quoted in later public material; four subjects"
    for loading, force_n in ((RAMP_AND_HOLD, forces.force_n[0]), (QUASI_STATIC, forces.slow_plate_n)):
        for depth, force, mean, (low, high) in zip(
            forces.depth_mm, force_n, forces.people_n, forces.people_range_n, strict=True
        ):
            ranged = depth in PLATE_DEPTHS_MM
            how = "range of four" if ranged else "mean of four, with the relative range at 1 and 2 mm"
            yield Check(
                subject="force",
                statement=f"plate at {depth:g} mm, {loading.replace('_', ' ')}: {how}",
                source=source,
                status="read",
                role=CHOSEN if ranged else PREDICTED,
                predicted=force,
                unit="N",
                low=low if ranged else PLATE_SHARES[0] * mean,
                high=high if ranged else PLATE_SHARES[1] * mean,
            )


def deflections(model: FingertipModel, runner: Runner) -> Deflections:
    """Predict profiles of cylinder and line, mean of the proximal and the distal side."""
    distances = [sign * distance for distance in DISTANCES_MM for sign in (-1.0, 1.0)]
    wanted = [(body, depth, distance) for body, depth in DEFLECTED for distance in distances]
    found = predicted("deflection", wanted, model, runner).reshape(len(DEFLECTED), -1, 2).mean(axis=2)
    depth_mm = np.array([depth for _, depth in DEFLECTED])
    return Deflections(
        indenter=tuple(body for body, _ in DEFLECTED),
        depth_mm=depth_mm,
        distance_mm=np.array(DISTANCES_MM),
        share=found / depth_mm[:, None],
    )


def sphere_rates(model: FingertipModel, runner: Runner) -> SphereRates:
    """Predict rates under spheres by force, against curvature and against position."""
    curvatures = facts.SPHERE_CURVATURES.value
    middle = [(force, curvature) for force in SPHERE_FORCES_N for curvature in curvatures]
    beside = [
        (PROFILE_FORCE_N, curvature, position) for curvature in PROFILES_PER_M for position in POSITIONS_MM
    ]
    return SphereRates(
        force_n=np.array(SPHERE_FORCES_N),
        curvature_per_m=np.array(curvatures),
        rate_hz=predicted("rate_curvature", middle, model, runner).reshape(len(SPHERE_FORCES_N), -1),
        profile_force_n=PROFILE_FORCE_N,
        profile_per_m=np.array(PROFILES_PER_M),
        position_mm=np.array(POSITIONS_MM),
        profile_hz=predicted("rate_position", beside, model, runner).reshape(len(PROFILES_PER_M), -1),
    )


def _half_width(position_mm: FloatArray, rate_hz: FloatArray) -> float:
    """Distance at which a profile first falls to half of its peak, linear between positions; NaN if never."""
    half = rate_hz.max() / 2.0
    below = np.flatnonzero(rate_hz < half)
    after = [index for index in below if index > rate_hz.argmax()]
    if not after:
        return np.nan
    last = after[0] - 1
    share = (rate_hz[last] - half) / (rate_hz[last] - rate_hz[last + 1])
    return float(position_mm[last] + share * (position_mm[last + 1] - position_mm[last]))


def _direction(subject: str, statement: str, fact: Fact, smallest_change: float, unit: str) -> Check:
    """Check of a direction: the smallest of several changes must be above 0."""
    return Check(
        subject=subject,
        statement=statement,
        source=fact.source,
        status=fact.status,
        role=PREDICTED,
        predicted=smallest_change,
        unit=unit,
        low=np.nextafter(0.0, 1.0),
        high=np.nan,
    )


def _smallest_step(values: FloatArray, axis: int) -> float:
    """Smallest difference of neighbours along an axis, of those that both exist."""
    steps = np.diff(values, axis=axis)
    return float(np.nanmin(steps)) if np.isfinite(steps).any() else np.nan


def sphere_checks(spheres: SphereRates) -> Iterable[Check]:
    """Compare with what was stated of human afferents under spheres."""
    fact, force = facts.SPHERE_CURVATURES, facts.SPHERE_FORCES
    applied = spheres.rate_hz[np.isin(spheres.force_n, force.value)]
    yield Check(
        subject="spheres",
        statement="share of the spheres applied to people that stay away from the bone, "
        + " and ".join(f"{newton:g} N" for newton in SPHERE_FORCES_N if newton in force.value),
        source=force.source,
        status=force.status,
        role=PREDICTED,
        predicted=float(np.isfinite(applied).mean()),
        unit="1",
        low=1.0,
        high=np.nan,
    )
    yield _direction(
        "spheres",
        "rate increases with curvature, smallest step at all forces",
        fact,
        _smallest_step(spheres.rate_hz, axis=1),
        "spikes/s",
    )
    yield _direction(
        "spheres",
        "rate increases with force, smallest step at all curvatures",
        force,
        _smallest_step(spheres.rate_hz, axis=0),
        "spikes/s",
    )
    yield _direction(
        "spheres",
        f"more curved, higher profile at {spheres.profile_force_n:g} N, smallest step of the peak",
        fact,
        _smallest_step(spheres.profile_hz.max(axis=1), axis=0),
        "spikes/s",
    )
    yield _direction(
        "spheres",
        f"more curved, narrower profile at {spheres.profile_force_n:g} N, smallest loss of half-width",
        fact,
        _smallest_step(-spheres.half_widths_mm(), axis=0),
        "mm",
    )


def grating_touch(conditions: Conditions, ridge_mm: float, spin_deg: float = 0.0) -> Touch:
    """Grating pressed 1.0 mm deep along the skin's normal, a ridge above the receptor.

    Parameters
    ----------
    conditions : Conditions
        Finger, tissues and resolution.
    ridge_mm : float
        Width of ridges and grooves. [mm]
    spin_deg : float, optional
        Of the ridges from across the finger. [degrees]
    """
    return touch_of(
        conditions.finger,
        Grating(ridge_mm, ridge_mm, min(protocol.LIP_RADIUS.value, ridge_mm / 2)),
        tissues=conditions.tissues,
        resolution=conditions.resolution,
        tilt_deg=conditions.skin_tilt_deg,
        spin_deg=spin_deg,
    )


def grating_rates(model: FingertipModel, runner: Runner) -> GratingRates:
    """Predict rates over one period of each grating, by depth and by force."""
    conditions = model.conditions
    gratings = [(ridge, 0.0) for ridge in RIDGES_MM] + [(ridge, 90.0) for ridge in TURNED_MM]
    touches = {grating: grating_touch(conditions, *grating) for grating in gratings}
    skins = runner.responses({"gratings": touches})["gratings"]
    rates = [
        period_rates_hz(skins[grating], model.responding, *grating, conditions.skin_tilt_deg)
        for grating in gratings
    ]
    static, dynamic = np.array([rate[1] for rate in rates]), np.array([rate[0] for rate in rates])
    forced = [
        (force, ridge, ridge, place)
        for force in GRATING_FORCES_N
        for ridge in FORCED_MM
        for place in _places_mm(ridge).tolist()
    ]
    by_force = predicted("grating", forced, model, runner)
    by_force = by_force.reshape(len(GRATING_FORCES_N), len(FORCED_MM), PLACES_PER_PERIOD)
    return GratingRates(
        ridge_mm=np.array([ridge for ridge, _ in gratings]),
        spin_deg=np.array([spin for _, spin in gratings]),
        static_hz=static,
        static_index=_index(static),
        dynamic_index=_index(dynamic),
        force_n=np.array(GRATING_FORCES_N),
        forced_ridge_mm=np.array(FORCED_MM),
        forced_index=_index(by_force),
    )


def _places_mm(ridge_mm: float) -> FloatArray:
    """Places over one period, from minus half of it, (PLACES_PER_PERIOD,). [mm]"""
    return 2.0 * ridge_mm * (np.arange(PLACES_PER_PERIOD) / PLACES_PER_PERIOD - 0.5)


def _index(rates_hz: FloatArray) -> FloatArray:
    """Modulation index over the last axis."""
    return modulation_index(rates_hz.max(axis=-1), rates_hz.min(axis=-1))


def period_rates_hz(
    skin: SkinResponse, afferent: Afferent, ridge_mm: float, spin_deg: float, tilt_deg: float
) -> tuple[FloatArray, FloatArray]:
    """Dynamic and static rates of receptors over one period of a grating, (PLACES_PER_PERIOD,) each.

    Parameters
    ----------
    skin : SkinResponse
        Under the grating.
    afferent : Afferent
        Of all receptors.
    ridge_mm, spin_deg : float
        Of the grating. [mm, degrees]
    tilt_deg : float
        Of the skin, along which receptors lie. [degrees]
    """
    places = _places_mm(ridge_mm)
    across = spin_deg == 0.0
    along = places * np.cos(np.deg2rad(tilt_deg)) if across else np.zeros_like(places)
    sites = np.stack([RECEPTOR_X_MM + along, np.zeros_like(places) if across else places], axis=1)
    found = Population(sites, 1.0, afferent).respond(skin)
    return found.dynamic_rate_hz, found.static_rate_hz


def grating_checks(gratings: GratingRates) -> Iterable[Check]:
    """Compare with modulation in vivo, and with what was stated of gratings."""
    across = gratings.spin_deg == 0.0
    readings = [
        (size, observed, read_as, ridge)
        for size, observed in zip(IN_VIVO_MM, paper.GRATING_MODULATION_IN_VIVO.value, strict=True)
        for read_as, ridge in (("width of a ridge", size), ("period", size / 2.0))
    ]
    for size, observed, read_as, ridge in readings:
        yield Check(
            subject="gratings",
            statement=f"static modulation index, {size:g} mm read as the {read_as}, within 10 % of in vivo",
            source=paper.GRATING_MODULATION_IN_VIVO.source,
            status=paper.GRATING_MODULATION_IN_VIVO.status,
            role=PREDICTED,
            predicted=gratings.index_of(ridge),
            unit="1",
            low=0.9 * observed,
            high=1.1 * observed,
        )
    fine = facts.FINEST_GRATING
    finest = gratings.static_hz[across & (gratings.ridge_mm == fine.value)]
    yield _direction(
        "gratings",
        f"rate changes over a grating with grooves of {fine.value:g} mm, static difference",
        fine,
        float(np.ptp(finest)),
        "spikes/s",
    )
    fact = facts.GRATINGS
    yield _direction(
        "gratings",
        "modulation index increases with the period, smallest step",
        fact,
        _smallest_step(gratings.static_index[across], axis=0),
        "1",
    )
    change = np.abs(np.diff(gratings.forced_index, axis=0)).max()
    yield Check(
        subject="gratings",
        statement="modulation index does not depend on amplitude: change from 0.1 to 0.2 N, below 0.05",
        source=fact.source,
        status=fact.status,
        role=PREDICTED,
        predicted=float(change),
        unit="1",
        low=np.nan,
        high=0.05,
    )
    turned = [gratings.index_of(ridge, 90.0) - gratings.index_of(ridge) for ridge in TURNED_MM]
    yield _direction(
        "gratings", "ridges along the finger modulate more than across it, smallest difference", fact,
        min(turned), "1",
    )  # fmt: skip
    louder = [
        gratings.static_hz[(gratings.ridge_mm == ridge) & (gratings.spin_deg == spin)].mean()
        for ridge in TURNED_MM
        for spin in (0.0, 90.0)
    ]
    yield _direction(
        "gratings", "ridges along the finger evoke more than across it, smallest difference of the mean rate",
        fact, min(second - first for first, second in zip(louder[::2], louder[1::2], strict=True)),
        "spikes/s",
    )  # fmt: skip


def adaptations(model: FingertipModel, runner: Runner) -> tuple[Adaptation, ...]:
    """Predict rates in successive windows: the paper's hold by depth and by force, and a hold of 12 s."""
    conditions = model.conditions
    sphere = conditions.sphere_touch(sphere_thresholds.STANDARD_PER_M)
    by_force = replace(sphere, stimulus=ForceRampAndHold(force_mn=MN_PER_N * sphere_thresholds.FORCES_N[0]))
    named: dict[str, tuple[Touch, Sequence[Sequence[float]]]] = {
        "sphere of 287 /m, 1.0 mm deep": (sphere, WINDOWS_MS),
        f"sphere of 287 /m, {sphere_thresholds.FORCES_N[0]:g} N": (by_force, WINDOWS_MS),
    }
    for depth in facts.DECLINE_DEPTHS.value:
        touch, windows = _steady(conditions, depth)
        named[f"flat probe, {depth:g} mm deep"] = touch, windows
    skins = runner.responses({"adaptation": {name: touch for name, (touch, _) in named.items()}})[
        "adaptation"
    ]
    middle = Population(np.array([(RECEPTOR_X_MM, 0.0)]), 1.0, model.responding)
    return tuple(
        Adaptation(
            name=name,
            window_s=np.array(windows) / MS_PER_S,
            rate_hz=windowed_rates_hz(middle, skins[name], windows),
        )
        for name, (_, windows) in named.items()
    )


def _steady(conditions: Conditions, depth_mm: float) -> tuple[Touch, list[tuple[float, float]]]:
    """Slow ramp and hold of 12 s, with windows of its first and its last second."""
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


def windowed_rates_hz(
    population: Population, skin: SkinResponse, windows_ms: Sequence[Sequence[float]]
) -> FloatArray:
    """Rate of the first receptor in each window, (n_windows,). [spikes/s]"""
    spikes = population.respond(skin).spikes
    return np.array([firing_rate_hz(spikes, tuple(window))[0] for window in windows_ms])


def adaptation_checks(adaptation: Sequence[Adaptation]) -> Iterable[Check]:
    """Compare the decline over 12 s with that of monkey afferents, within a quarter of it."""
    for found, observed in zip(adaptation[-len(facts.DECLINES.value) :], facts.DECLINES.value, strict=True):
        yield Check(
            subject="adaptation",
            statement=f"decline of the rate in 12 s, {found.name}, within a quarter of the observed one",
            source=facts.DECLINES.source,
            status=facts.DECLINES.status,
            role=PREDICTED,
            predicted=found.decline,
            unit="1",
            low=0.75 * observed,
            high=1.25 * observed,
        )


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


def volume_changes(conditions: Conditions, runner: Runner) -> Volumes:
    """Predict the decrease of volume under plate and disc."""
    touches = {
        (name, depth): touch_of(
            conditions.finger, body, RampAndHold(depth), conditions.tissues, conditions.resolution
        )
        for name, body in VOLUME_INDENTERS.items()
        for depth in VOLUME_DEPTHS_MM
    }
    skins = runner.responses({"volume": touches})["volume"]
    found = [volume_decrease(skins[key]) for key in touches]
    return Volumes(
        indenter=tuple(VOLUME_INDENTERS),
        depth_mm=np.array(VOLUME_DEPTHS_MM),
        decrease=np.array(found).reshape(len(VOLUME_INDENTERS), -1),
    )


def volume_checks(volumes: Volumes) -> Iterable[Check]:
    """Compare with the largest change in vivo, and with what was stated of its causes."""
    fact = facts.VOLUME_CHANGE
    for depth, decrease in zip(volumes.depth_mm, volumes.decrease[0], strict=True):
        yield Check(
            subject="volume",
            statement=f"decrease under a plate at {depth:g} mm, at most about 5 %",
            source=fact.source,
            status=fact.status,
            role=PREDICTED,
            predicted=decrease,
            unit="1",
            low=0.0,
            high=fact.value,
        )
    deeper, larger = np.diff(volumes.decrease, axis=1).min(), -np.diff(volumes.decrease, axis=0).max()
    yield _direction("volume", "more at 2 mm than at 1 mm, smallest difference", fact, deeper, "1")
    yield _direction("volume", "more under a plate than under a disc, smallest difference", fact, larger, "1")


def threshold_checks(rows: Iterable[ThresholdRow]) -> Iterable[Check]:
    """Compare Weber fractions with people's, in whole per cent."""
    fact = psychophysics.WEBER_FRACTIONS
    for row in rows:
        for threshold in row.thresholds:
            yield Check(
                subject="percept",
                statement=f"Weber fraction at {threshold.standard_per_m:g} /m; {row.pressed}; "
                f"noise {row.noise}; {row.receptors}",
                source=fact.source,
                status=fact.status,
                role=PREDICTED,
                predicted=round(threshold.weber_fraction, 2),
                unit="1",
                low=fact.value[0],
                high=fact.value[1],
            )
