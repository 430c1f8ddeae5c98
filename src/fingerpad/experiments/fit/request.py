"""A fit to recordings: what is asked, and its run, which presses, samples the receptor and fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Strict

from fingerpad.core.checked import result_class
from fingerpad.core.errors import InputError
from fingerpad.core.signals import INTERVAL
from fingerpad.core.values import Count, Flag, IntArray, Positive, Seed, Text, Vector, Whole, choice
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.fit.fit import METHODS, check_enough, check_offset, check_spikes, fit_recordings
from fingerpad.experiments.fit.results import FitResult
from fingerpad.experiments.recording_files import Recorded, read_recordings, recorded_of
from fingerpad.experiments.requests.afferents import (
    DEFAULT,
    AfferentChoice,
    RateWindowSettings,
    check_windows,
    chosen_afferent,
    files_of,
)
from fingerpad.experiments.requests.parts import as_list, at, object_of_python
from fingerpad.experiments.requests.stimuli import BAR, NamedStimulus, ShiftedBar, Stimuli, read_stimuli
from fingerpad.experiments.requests.stimulus import (
    FINGER_OBJECTS,
    FingerDescription,
    FingerRequest,
    MotionPart,
    ObjectPart,
    made_of,
    named_files,
    object_of,
)
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.geometry.bodies import Bar
from fingerpad.geometry.grading import RESOLUTIONS
from fingerpad.inference.afferent_fit import OFFSETS_MM, check_free, fit_afferent
from fingerpad.inference.fitting.methods import interleaved_folds
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES
from fingerpad.inference.recordings import RateRecordings, SpikeRecordings
from fingerpad.neuron.afferent import AnyAfferent, type_of
from fingerpad.neuron.spikes import Windows, common_rate_windows_ms
from fingerpad.skin.fields import sampled_fields
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

QUANTITIES = tuple(sampled_fields())


@result_class
class FitFile:
    """The file `fit.json`."""

    format: Literal["fingerpad fit"] = "fingerpad fit"
    format_version: Literal[3] = 3
    fit: FitResult
    windows_ms: tuple[tuple[float, ...], tuple[float, ...]]  #: Of the dynamic and of the static rate. [ms]
    dynamic_quantity: str
    static_quantity: str  #: Quantities of the two terms.
    manifest: Manifest


class FitRequest(FingerRequest):
    """A fit to recordings, as `fingerpad.fit` runs it and a file or a command describes it."""

    word: ClassVar[str] = "fit"
    main: ClassVar[str] = "recordings"
    python: ClassVar[tuple[str, ...]] = (*FINGER_OBJECTS, "object", "motion", "afferent")

    recordings: Text | Path | object_of_python(RateRecordings | SpikeRecordings | Recorded)  # type: ignore[valid-type]
    """A CSV or NWB file (docs/fit.md), or recordings whose names are those of the stimuli."""
    stimuli: Text | Path | object_of_python(Stimuli) = BAR  # type: ignore[valid-type]
    """"bar" (shifted along the finger), or a CSV or YAML file with stimuli."""
    stimulus_column: Text | None = None
    """Column of the recordings with the name of the stimulus; by default shift_mm or stimulus."""
    unit: Whole | None = None  #: Id of the spike unit of an NWB file.
    object: ObjectPart | None = None
    motion: MotionPart | None = None  #: The bar and how it is pressed, where the stimuli are the bar.
    afferent: AfferentChoice = DEFAULT
    """Type of the afferent for `free`, a file of results, numbers, or an afferent of Python."""
    depth_mm: Positive | None = None
    """Depth of the receptor below the skin; by default the border of epidermis and dermis. [mm]"""
    free: Annotated[tuple[Text, ...], Strict(False), BeforeValidator(as_list)] = ()
    """Fit these numbers of the afferent alone; by default the four that spikes of an SAI determine."""
    dynamic_quantity: Annotated[str, choice(QUANTITIES)] | None = None
    static_quantity: Annotated[str, choice(QUANTITIES)] | None = None
    """What each term follows: strain energy density, "stored", as in the paper, or another quantity; by
    default that of the tissues."""
    windows_ms: RateWindowSettings = RateWindowSettings()
    """Windows of the two rates; by default they follow the phases of the stimuli. [ms]"""
    method: Annotated[str, choice(METHODS)] = "least_squares"  #: One of `METHODS`.
    posterior: Flag = False
    profiles: Flag = False
    sensitivity: Flag = False
    offset: Flag = False
    """Whether credible intervals, profile likelihoods and Sobol indices are computed, and whether the
    receptor's offset along the finger is fitted."""
    folds: Count | None = None
    """Number of interleaved folds; by default 6, or the column fold of the recordings."""
    seed: Seed = 0  #: Of methods that draw.
    resolution: Annotated[str, choice(RESOLUTIONS)] = "standard"
    """As of `FingerDescription`; "standard" by default, and those of the file of the stimuli."""

    def check(self) -> None:
        """Raise `InputError` if the fit is impossible; before anything is solved."""
        with self.origin.located():
            if self.free or self.afferent != DEFAULT:
                self._check_chosen()
            stimuli = self.recorded.stimuli
            for name, stimulus in stimuli.items():
                check_windows(self.used_windows_ms, stimulus.motion.end_ms, name)
            if self.offset:
                check_offset(self.method, [stimulus.x_mm for stimulus in stimuli.values()])
            n_free = len(self.free) or len(IDENTIFIABLE_NAMES) + self.offset
            check_enough(self.rates, self.memberships, n_free)
            if self.method == "likelihood":
                motions = {stimulus.motion for stimulus in stimuli.values()}
                check_spikes(self.recorded.recordings, len(motions))
        self.touches  # noqa: B018

    def _check_chosen(self) -> None:
        """Refuse a fit of chosen numbers that names none, or asks for what only the four numbers have."""
        check_free(self.shape_of_fit, self.free)
        for option in ("posterior", "profiles", "sensitivity", "offset"):
            if getattr(self, option):
                raise InputError(
                    option, "belongs to the fit of all numbers of SAI", remedy="leave it out with free"
                )
        if self.method != "least_squares":
            raise InputError("free", "needs the method least_squares", str(self.method))

    @cached_property
    def presented(self) -> Stimuli:
        """The stimuli, which say how they are pressed."""
        if not isinstance(self.stimuli, str | Path):
            return self.stimuli
        if str(self.stimuli) == BAR:
            described = {"kind": BAR} if self.object is None else self.object
            with at("object"):
                bar = Bar() if self.object is None else object_of(described, self.beside)
                if not isinstance(bar, Bar):
                    raise InputError("object", "must be a bar where the stimuli are the bar", repr(bar))
            motion = {} if self.motion is None else {"motion": made_of(self.motion, self.beside)}
            found: Any = ShiftedBar(bar, **motion, conditions=self.conditions(self.pressed_finger, self.seed))
            found = replace(found, finger_files=tuple(named_files(self.finger, self.beside)))
        else:
            for name in ("object", "motion"):
                if getattr(self, name) is not None:
                    raise InputError(
                        name, f"is that of the bar, and {self.stimuli} lists stimuli with their own",
                        remedy="leave it out",
                    )  # fmt: skip
            fields = self.model_fields_set & set(FingerDescription.model_fields)
            given = {name: getattr(self, name) for name in fields}
            if "finger" in given:
                given["finger"] = self.pressed_finger
            found = read_stimuli(self.beside / self.stimuli, **given)
        return found if self.stimulus_column is None else replace(found, column=self.stimulus_column)

    @cached_property
    def recorded(self) -> Recorded:
        """Recordings with the stimuli they belong to."""
        with self.origin.located():
            if isinstance(self.recordings, str | Path):
                return read_recordings(self.beside / self.recordings, self.presented, self.unit)
            return recorded_of(self.recordings, self.presented)

    @cached_property
    def shape_of_fit(self) -> AnyAfferent:
        """Afferent about whose numbers is searched: that of its type with the tissues pressed."""
        chosen = "SAI" if self.afferent == DEFAULT else self.afferent
        with self.origin.located(), at("afferent"):
            return chosen_afferent(chosen, self.settings.tissues, self.beside)

    @cached_property
    def measure(self) -> str:
        """What a rate of the afferent is, "interval" or "count"."""
        return getattr(self.shape_of_fit, "rate_measure", INTERVAL) if self.free else INTERVAL

    @cached_property
    def used_windows_ms(self) -> Windows:
        """Windows of the two rates, the same for all stimuli. [ms]"""
        touches = [stimulus.motion.phases for stimulus in self.recorded.stimuli.values()]
        return common_rate_windows_ms(touches, *self.windows_ms.both, self.measure)

    @cached_property
    def rates(self) -> RateRecordings:
        """What is fitted."""
        given = self.recorded.recordings
        return given if isinstance(given, RateRecordings) else given.rates(self.used_windows_ms, self.measure)

    @cached_property
    def memberships(self) -> IntArray:
        """Fold of each stimulus."""
        given = self.recorded.memberships
        if given is not None and self.folds is not None:
            raise InputError(
                "folds", "must come from the column fold or from folds, not both", remedy="leave one out"
            )
        return interleaved_folds(len(self.rates.stimuli), self.folds) if given is None else given

    @cached_property
    def touches(self) -> dict[str, Touch]:
        """One touch per stimulus."""
        return self.presented.touches(list(self.recorded.stimuli.values()), self.settings)

    @cached_property
    def settings(self) -> Conditions:
        """Finger, tissues, accuracy and seed."""
        depths_mm = () if self.depth_mm is None else (self.depth_mm,)
        return replace(self.presented.conditions, seed=self.seed, receptor_depths_mm=depths_mm)

    @property
    def quantities(self) -> tuple[str, str]:
        """Quantities of the dynamic and of the static term."""
        if self.free:
            return self.shape_of_fit.dynamic_quantity, self.shape_of_fit.static_quantity
        default = self.settings.afferent
        return (
            self.dynamic_quantity or default.dynamic_quantity,
            self.static_quantity or default.static_quantity,
        )

    def further_files(self) -> list[Path]:
        """Files of the recordings, the stimuli and the afferent."""
        asked = (self.recordings, None if self.stimuli == BAR else self.stimuli)
        own = [self.beside / file for file in asked if isinstance(file, str | Path)]
        of_stimuli = [file for stimulus in self.recorded.stimuli.values() for file in stimulus.files]
        return [*own, *self.presented.finger_files, *of_stimuli, *files_of(self.afferent, self.beside)]


def run_fit(request: FitRequest, runner: Runner) -> FitFile | ChosenNumbersFile:
    """Indent with all stimuli, fit, and record what ran."""
    request.check()
    skins = runner.responses({"stimuli": request.touches})["stimuli"]
    mesh = next(iter(skins.values())).mesh
    if request.free:
        return _fit_chosen_numbers(request, runner, skins)
    recorded = request.recorded
    offsets_mm = OFFSETS_MM if request.offset else (0.0,)
    x_mm, z_mm = request.settings.finger.contact_mm
    sites = [[x_mm + offset, z_mm] for offset in offsets_mm]
    sampled = [skin.sed(sites, *request.quantities, depth_mm=request.depth_mm) for skin in skins.values()]
    beside = {
        offset: [traces.part(slice(place, place + 1)) for traces in sampled]
        for place, offset in enumerate(offsets_mm)
    }
    shifts_mm = _shifts_mm(list(recorded.stimuli.values()), request.settings.along_skin)
    with runner.stage("fit", 1) as advance:
        found = fit_recordings(
            beside[0.0],
            recorded.recordings,
            request.memberships,
            method=request.method,
            windows_ms=request.used_windows_ms,
            seed=request.seed,
            with_posterior=request.posterior,
            with_profiles=request.profiles,
            with_sensitivity=request.sensitivity,
            beside=beside if request.offset else None,
            # Two stimuli at one place have no distance for a correlation of residuals.
            positions_mm=shifts_mm if shifts_mm and len(set(shifts_mm)) == len(shifts_mm) else None,
        )
        advance()
    return FitFile(
        fit=replace(
            found,
            shift_mm=None if shifts_mm is None else np.array(shifts_mm),
            presentations=tuple(recorded.presentations.values()),
            spikes_after_hold=recorded.spikes_after_hold,
        ),
        windows_ms=request.used_windows_ms,
        dynamic_quantity=request.quantities[0],
        static_quantity=request.quantities[1],
        manifest=runner.manifest(request.settings, {"stimuli": mesh}, inputs=request.input_hashes()),
    )


@result_class
class ChosenNumbersFile:
    """The file `fit.json` of a fit of chosen numbers; a touch takes its afferent by `afferent: fit.json`."""

    format: Literal["fingerpad fit of chosen numbers"] = "fingerpad fit of chosen numbers"
    format_version: Literal[1] = 1
    type: str
    fitted: dict[str, float]  #: Numbers by their names, in the units of the type.
    stimulus: tuple[str, ...]
    dynamic_rate_hz: Vector
    static_rate_hz: Vector  #: Rates of the fitted afferent. [spikes/s]
    observed_dynamic_rate_hz: Vector | None
    observed_static_rate_hz: Vector | None
    fss_in_sample: float
    fss_out_of_sample: float
    windows_ms: tuple[tuple[float, ...], tuple[float, ...]]
    manifest: Manifest

    def summary(self) -> list[str]:
        """Return what a command prints: the numbers and the scores."""
        numbers = ", ".join(f"{name} {value:.4g}" for name, value in self.fitted.items())
        return [
            f"{self.type} fitted to {len(self.stimulus)} stimuli: {numbers}. FSS {self.fss_in_sample:.3f} in "
            f"sample, {self.fss_out_of_sample:.3f} out of sample."
        ]


def _fit_chosen_numbers(
    request: FitRequest, runner: Runner, skins: Mapping[str, SkinResponse]
) -> ChosenNumbersFile:
    """Fit the numbers `request.free` of an afferent."""
    site = [request.settings.finger.contact_mm]
    traces = [skin.sed(site, *request.quantities, depth_mm=request.depth_mm) for skin in skins.values()]
    rates, windows_ms = request.rates, request.used_windows_ms
    with runner.stage("fit", 1) as advance:
        folds = request.memberships
        found = fit_afferent(request.shape_of_fit, request.free, traces, rates, folds, windows_ms)
        advance()
    return ChosenNumbersFile(
        type=type_of(request.shape_of_fit),
        fitted={name: float(getattr(found.afferent, name)) for name in request.free},
        stimulus=rates.stimuli,
        dynamic_rate_hz=found.dynamic_rate_hz,
        static_rate_hz=found.static_rate_hz,
        observed_dynamic_rate_hz=rates.dynamic_rate_hz,
        observed_static_rate_hz=rates.static_rate_hz,
        fss_in_sample=found.fss_in_sample,
        fss_out_of_sample=found.fss_out_of_sample,
        windows_ms=windows_ms,
        manifest=runner.manifest(
            request.settings, {"stimuli": next(iter(skins.values())).mesh}, inputs=request.input_hashes()
        ),
    )


def _shifts_mm(stimuli: Sequence[NamedStimulus], along: float) -> list[float] | None:
    """Shifts along the skin, proximal positive, of stimuli that differ in nothing else; None for others."""
    if len({replace(stimulus, x_mm=0.0, name="", level=None) for stimulus in stimuli}) > 1:
        return None
    return [0.0 - float(f"{stimulus.x_mm / along:.9g}") for stimulus in stimuli]
