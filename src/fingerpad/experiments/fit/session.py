"""Recordings of one's own from file to fit: press what was pressed, read the receptor, fit, say how."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checks import one_of, whole
from fingerpad.core.errors import InputError
from fingerpad.core.progress import NoProgress, Progress
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.data import bar_firing_rates
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.fit.fit import check_enough, dealt_folds, fit_recordings
from fingerpad.experiments.fit.methods import METHODS, check_spikes
from fingerpad.experiments.fit.offset import check_offset
from fingerpad.experiments.gerling2014.reproduction import plain
from fingerpad.experiments.manifest import software
from fingerpad.experiments.recording_files import Recorded
from fingerpad.experiments.runner import STORE_FOLDER
from fingerpad.experiments.stimuli import TactileStimulus
from fingerpad.geometry.grading import Grading, covering
from fingerpad.geometry.indenter_grading import grading_about
from fingerpad.geometry.indenters import Bar, FlatPunch, Line, Sphere
from fingerpad.inference.afferent_methods import OFFSETS_MM
from fingerpad.inference.fitting.problem import IntArray
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES
from fingerpad.inference.rate_model import WINDOWS_MS, Windows
from fingerpad.inference.recordings import RateRecordings
from fingerpad.skin.fields import sampled_fields
from fingerpad.skin.indentation import Touch, touch_of
from fingerpad.skin.store import Store, solve_missing

EXAMPLE = "bar.csv"
"""Name of the file of `example`."""


@dataclass(frozen=True)
class RecordingFit:
    """A fit to recordings with all that it needs.

    Parameters
    ----------
    recorded : Recorded
        From `fingerpad.experiments.recording_files.read_recordings`.
    conditions : Conditions
        Finger, tissues, accuracy and seed.
    folder : Path
        Where finished indentations are stored.
    method : str
        One of `METHODS`.
    n_folds : int, optional
        How many folds to deal out; not together with folds that the recordings bring.
    windows_ms : ((float, float), (float, float))
        Windows of the dynamic and of the static rate. [ms]
    jobs : int
        Processes to use; the numbers do not depend on it.
    dynamic_quantity : str
        What the dynamic term follows: strain energy density, "stored", as in the paper, or another quantity
        of `SkinResponse.sample` as an extension.
    with_posterior : bool
        Whether credible intervals are drawn as well.
    with_profiles : bool
        Whether the likelihood of each number is profiled.
    with_sensitivity : bool
        Whether Sobol's indices of FSS are told.
    with_offset : bool
        Whether the receptor's place along the finger is fitted as well.

    Raises
    ------
    InputError
        If the recordings cannot be fitted or a stimulus not be pressed; nothing has been pressed then.
    """

    recorded: Recorded
    conditions: Conditions
    folder: Path
    method: str = "least_squares"
    n_folds: int | None = None
    windows_ms: Windows = WINDOWS_MS
    jobs: int = 1
    dynamic_quantity: str = STORED_ENERGY
    with_posterior: bool = False
    with_profiles: bool = False
    with_sensitivity: bool = False
    with_offset: bool = False

    def __post_init__(self) -> None:
        one_of("method", self.method, tuple(METHODS))
        one_of("dynamic_quantity", self.dynamic_quantity, tuple(sampled_fields()))
        whole("jobs", self.jobs, at_least=1)
        for start, end in self.windows_ms:
            if not 0.0 <= start < end:
                raise InputError(
                    f"windows must be a start from 0 on and a later end: got {start:g}, {end:g}."
                )
        end = max(end for _, end in self.windows_ms)
        for name, stimulus in self.recorded.stimuli.items():
            if stimulus.motion.end_ms < end:
                raise InputError(
                    f"windows must end with the stimuli, not at {end:g} ms: {name} ends at "
                    f"{stimulus.motion.end_ms:g} ms."
                )
        if self.with_offset:
            check_offset(self.method, [stimulus.x_mm for stimulus in self.recorded.stimuli.values()])
        check_enough(self.rates, self.memberships, len(IDENTIFIABLE_NAMES) + self.with_offset)
        if self.method == "likelihood":
            motions = {stimulus.motion for stimulus in self.recorded.stimuli.values()}
            check_spikes(self.recorded.recordings, len(motions))
        # Built once here: what cannot be pressed is said before anything is.
        self.touches  # noqa: B018

    @cached_property
    def rates(self) -> RateRecordings:
        """What is fitted."""
        recordings = self.recorded.recordings
        return recordings if isinstance(recordings, RateRecordings) else recordings.rates(self.windows_ms)

    @cached_property
    def memberships(self) -> IntArray:
        """Fold of each stimulus."""
        given = self.recorded.memberships
        if given is not None and self.n_folds is not None:
            raise InputError("folds must come from the column fold or be dealt out, not both: leave one out.")
        return dealt_folds(len(self.rates.stimuli), self.n_folds) if given is None else given

    @cached_property
    def touches(self) -> dict[str, Touch]:
        """One touch per stimulus."""
        return touches(self.recorded.stimuli, self.conditions)


def touches(stimuli: Mapping[str, TactileStimulus], conditions: Conditions) -> dict[str, Touch]:
    """One touch per stimulus; those of the paper's bar are the very touches of the reproduction.

    Parameters
    ----------
    stimuli : mapping of str to TactileStimulus
        By name.
    conditions : Conditions
        Finger, tissues and accuracy.

    Returns
    -------
    dict of str to Touch

    Raises
    ------
    InputError
        If one cannot be pressed, with its name.
    """
    along = float(np.cos(np.deg2rad(conditions.skin_tilt_deg)))

    def touch(stimulus: TactileStimulus) -> Touch:
        wire = isinstance(stimulus.indenter, Line)
        return touch_of(
            conditions.finger,
            stimulus.indenter,
            stimulus.motion,
            conditions.materials,
            conditions.resolution,
            (RECEPTOR_X_MM + stimulus.x_mm * along, stimulus.z_mm),
            None if wire else _grading(stimulus, conditions),
            conditions.tilt_deg(stimulus.indenter) if stimulus.tilt_deg is None else stimulus.tilt_deg,
            spin_deg=stimulus.spin_deg,
        )

    found = {}
    for name, stimulus in stimuli.items():
        try:
            found[name] = touch(stimulus)
        except InputError as error:
            raise InputError(f"Stimulus {name} cannot be pressed: {error}") from error
    return found


def _grading(stimulus: TactileStimulus, conditions: Conditions) -> Grading:
    """Mesh that is fine about the receptor, the same for all stimuli of a kind, and about edges within it."""
    indenter, spin_deg = stimulus.indenter, stimulus.spin_deg
    is_round = isinstance(indenter, Sphere | FlatPunch)
    grading = conditions.sphere_grading() if is_round else conditions.bar_grading()
    # The bar of the paper keeps the mesh of the reproduction, whose touches are then those of a fit.
    as_reproduced = isinstance(indenter, Bar) and spin_deg == 0.0
    if not (is_round or as_reproduced) and (indenter.edge_reach_mm > 0.0 or spin_deg != 0.0):
        about = grading_about(indenter, conditions.resolution, RECEPTOR_X_MM, stimulus.z_mm, spin_deg)
        grading = covering([grading, about])
    return replace(grading, full=True) if stimulus.z_mm != 0.0 else grading


def run(fit: RecordingFit, progress: Progress | None = None, **provenance: Any) -> dict[str, Any]:
    """Press all stimuli, fit, and say how it was done.

    Parameters
    ----------
    fit : RecordingFit
        What to fit and how.
    progress : Progress, optional
        Told about each finished press.
    **provenance
        What else the results shall say of their origin, such as the command and hashes of its files.

    Returns
    -------
    dict
        "fit" as `fit_recordings` returns it, with the stimuli's presentations, and "manifest".

    Raises
    ------
    ConvergenceError
        If a press or a fit does not end; finished presses stay stored.
    StoreError
        If a stored press is damaged or the folder cannot be written.
    """
    progress, recorded = progress or NoProgress(), fit.recorded
    started, clock = datetime.now(UTC), time.perf_counter()
    store = Store(fit.folder / STORE_FOLDER)
    wanted = list(fit.touches.values())
    with progress.stage("indentations", sum(not store.holds(touch) for touch in wanted)) as advance:
        computed = solve_missing(wanted, store, fit.jobs, lambda seconds: advance())
    offsets_mm = OFFSETS_MM if fit.with_offset else (0.0,)
    sites = [[RECEPTOR_X_MM + offset, 0.0] for offset in offsets_mm]
    felt = [store.load(touch).sed(sites, fit.dynamic_quantity) for touch in wanted]
    beside = {
        offset: [traces.part(slice(place, place + 1)) for traces in felt]
        for place, offset in enumerate(offsets_mm)
    }
    shifts_mm = _shifts_mm(list(recorded.stimuli.values()))
    with progress.stage("fit", 1) as advance:
        found = fit_recordings(
            beside[0.0],
            recorded.recordings,
            fit.memberships,
            method=fit.method,
            windows_ms=fit.windows_ms,
            seed=fit.conditions.seed,
            with_posterior=fit.with_posterior,
            with_profiles=fit.with_profiles,
            with_sensitivity=fit.with_sensitivity,
            beside=beside if fit.with_offset else None,
            # Two stimuli in one place have no distance over which residuals could be alike.
            positions_mm=shifts_mm if shifts_mm and len(set(shifts_mm)) == len(shifts_mm) else None,
        )
        advance()
    return plain(
        {
            "fit": found
            | {
                "presentations": list(recorded.presentations.values()),
                "spikes_after_hold": recorded.spikes_after_hold,
                "shift_mm": shifts_mm,
            },
            "manifest": software()
            | {
                "seed": fit.conditions.seed,
                "resolution": fit.conditions.resolution,
                "materials": fit.conditions.materials,
                "windows_ms": fit.windows_ms,
                "dynamic_quantity": fit.dynamic_quantity,
                "indentations": len(wanted),
                "computed": computed,
                "started": started.isoformat(timespec="seconds"),
                "wall_s": round(time.perf_counter() - clock, 2),
            }
            | provenance,
        }
    )


def _shifts_mm(stimuli: Sequence[TactileStimulus]) -> list[float] | None:
    """Shifts, proximal positive, of stimuli that differ in nothing else; None for others."""
    if len({replace(stimulus, x_mm=0.0) for stimulus in stimuli}) > 1:
        return None
    return [0.0 - stimulus.x_mm for stimulus in stimuli]


def example() -> dict[str, bytes]:
    """Files to try a fit with: the rates under the paper's bar that come with the package.

    Returns
    -------
    dict of str to bytes
        Contents by file name.

    Examples
    --------
    >>> print(example()[EXAMPLE].decode().splitlines()[3])
    -3.5,0,0
    """
    observed = bar_firing_rates()
    rows = np.column_stack([observed.shift_mm, observed.dynamic_rate_hz, observed.static_rate_hz])
    lines = [
        f"# One SAI afferent under a bar 3 mm wide, pressed in by 1 mm. {observed.source}",
        "# shift: of the bar from the centre of the receptive field, proximal positive.",
        "shift_mm,dynamic_rate_hz,static_rate_hz",
        *(",".join(f"{value:g}" for value in row) for row in rows),
    ]
    return {EXAMPLE: ("\n".join(lines) + "\n").encode()}


def sha256(path: Path) -> str:
    """Hash of a file's content, by which it is known again."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
