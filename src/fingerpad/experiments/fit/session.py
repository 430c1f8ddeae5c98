"""Run of a fit to recordings: solve the indentations, sample the receptor, fit, record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Literal

import numpy as np

from fingerpad.core.checked import checked, result_class, value_class
from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.errors import InputError
from fingerpad.core.progress import Progress
from fingerpad.core.signals import INTERVAL
from fingerpad.core.values import AnyPath, Flag, IntArray, Many, Vector, Whole, choice, one_of, positive
from fingerpad.data.afferents import TYPES
from fingerpad.data.observations import bar_firing_rates
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.descriptions.stimuli import NamedStimulus
from fingerpad.experiments.fit.fit import check_enough, fit_recordings, folds_in_turn
from fingerpad.experiments.fit.methods import METHODS, check_offset, check_spikes
from fingerpad.experiments.fit.results import FitResult
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.recording_files import Recorded
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.stimuli import Stimuli, along_skin
from fingerpad.inference.afferent_methods import OFFSETS_MM
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES
from fingerpad.inference.recordings import RateRecordings
from fingerpad.inference.typed_fit import fit_afferent
from fingerpad.neuron.afferent import AnyAfferent
from fingerpad.neuron.afferent_types import afferent_types
from fingerpad.neuron.spikes import Window, Windows, common_rate_windows_ms
from fingerpad.skin.fields import sampled_fields
from fingerpad.skin.indentation import Touch

EXAMPLE = "bar.csv"  # Name of the file of `example_recordings`.


@result_class
class FitFile:
    """The file `fit.json`."""

    format: Literal["fingerpad fit"] = "fingerpad fit"
    format_version: Literal[2] = 2
    fit: FitResult
    windows_ms: tuple[tuple[float, ...], tuple[float, ...]]  # Of the dynamic and of the static rate. [ms]
    dynamic_quantity: str
    static_quantity: str  # Quantities of the two terms.
    manifest: Manifest


@value_class
class FitRequest:
    """A fit to recordings with all that it takes to run it.

    Parameters
    ----------
    recorded : Recorded
        From `fingerpad.experiments.recording_files.read_recordings`.
    stimuli : Stimuli
        With which it was read: they say how they are pressed.
    folder : Path
        Where finished indentations are stored.
    method : str
        One of `METHODS`.
    n_folds : int, optional
        Number of folds; not together with folds that the recordings give.
    windows_ms : ((float, float) or None, (float, float) or None)
        Windows of the dynamic and of the static rate; one that is None follows the phases of the stimuli, and
        is the paper's for the paper's motion. [ms]
    jobs : int or Engine
        Processes, or the engine that solves the indentations; the numbers do not depend on it.
    seed : int
        Of methods that draw.
    dynamic_quantity, static_quantity : str
        What each term follows: strain energy density, "stored", as in the paper, or another quantity of
        `SkinResponse.sample` as an extension. Default: that of the tissues.
    with_posterior, with_profiles, with_sensitivity, with_offset : bool
        Whether credible intervals, profile likelihoods and Sobol indices of FSS are computed, and whether the
        receptor's offset along the finger is fitted.
    afferent_type : str, optional
        Type of the afferent, such as "RA", for a fit of chosen numbers by `fit_chosen_numbers`.
    free : tuple of str
        Names of these numbers.
    """

    recorded: Recorded
    stimuli: Stimuli
    folder: AnyPath
    method: Annotated[str, choice(METHODS)] = "least_squares"
    n_folds: Whole | None = None
    windows_ms: tuple[Window | None, Window | None] = (None, None)
    jobs: Whole | Engine = 1
    seed: Whole = 0
    dynamic_quantity: str | None = None
    static_quantity: str | None = None
    with_posterior: Flag = False
    with_profiles: Flag = False
    with_sensitivity: Flag = False
    with_offset: Flag = False
    afferent_type: str | None = None
    free: Many[str] = ()

    def __post_init__(self) -> None:
        if self.afferent_type is not None or self.free:
            self._check_chosen()
        for name, quantity in zip(("dynamic_quantity", "static_quantity"), self.quantities, strict=True):
            one_of(name, quantity, tuple(sampled_fields()))
        engine_of(self.jobs)
        for start, end in self.used_windows_ms:
            if not 0.0 <= start < end:
                raise InputError(
                    "windows", "must be a start from 0 on and a later end", f"{start:g}, {end:g}"
                )
        end = max(end for _, end in self.used_windows_ms)
        for name, stimulus in self.recorded.stimuli.items():
            if stimulus.motion.end_ms < end:
                raise InputError(
                    "windows",
                    f"must end with the stimuli, not at {end:g} ms",
                    remedy=f"{name} ends at {stimulus.motion.end_ms:g} ms",
                )
        if self.with_offset:
            check_offset(self.method, [stimulus.x_mm for stimulus in self.recorded.stimuli.values()])
        n_free = len(self.free) or len(IDENTIFIABLE_NAMES) + self.with_offset
        check_enough(self.rates, self.memberships, n_free)
        if self.method == "likelihood":
            motions = {stimulus.motion for stimulus in self.recorded.stimuli.values()}
            check_spikes(self.recorded.recordings, len(motions))
        # Built here, so that an error comes before anything is solved.
        self.touches  # noqa: B018

    def _check_chosen(self) -> None:
        """Refuse a fit of chosen numbers that names none, or asks for what only the four numbers have."""
        numbers = tuple(getattr(self.afferent, "__dataclass_fields__", ()))
        if not self.free:
            raise InputError(
                "--free", f"must name at least one number of {self.kind}, one of {', '.join(numbers)}", "none"
            )
        for name in self.free:
            positive(one_of("--free", name, numbers), getattr(self.afferent, name))
        for option in ("with_posterior", "with_profiles", "with_sensitivity", "with_offset"):
            if getattr(self, option):
                raise InputError(
                    f"--{option.removeprefix('with_')} belongs to the fit of all numbers of SAI: leave it "
                    "out with --free."
                )
        if self.method != "least_squares":
            raise InputError("--free", "needs the method least_squares", str(self.method))

    @property
    def kind(self) -> str:
        """Type of the afferent, SAI unless another is named."""
        return one_of("--afferent", self.afferent_type or "SAI", tuple(TYPES))

    @cached_property
    def afferent(self) -> AnyAfferent:
        """Afferent about whose numbers is searched: that of its type with the tissues pressed."""
        return afferent_types(self.conditions.tissues)[self.kind]

    @cached_property
    def measure(self) -> str:
        """What a rate of the afferent is, "interval" or "count"."""
        return getattr(self.afferent, "rate_measure", INTERVAL)

    @cached_property
    def used_windows_ms(self) -> Windows:
        """Windows of the two rates, the same for all stimuli. [ms]"""
        touches = [stimulus.motion.phases for stimulus in self.recorded.stimuli.values()]
        return common_rate_windows_ms(touches, *self.windows_ms, self.measure)

    @cached_property
    def rates(self) -> RateRecordings:
        """What is fitted."""
        given = self.recorded.recordings
        return given if isinstance(given, RateRecordings) else given.rates(self.used_windows_ms, self.measure)

    @cached_property
    def memberships(self) -> IntArray:
        """Fold of each stimulus."""
        given = self.recorded.memberships
        if given is not None and self.n_folds is not None:
            raise InputError(
                "folds", "must come from the column fold or from --folds, not both", remedy="leave one out"
            )
        return folds_in_turn(len(self.rates.stimuli), self.n_folds) if given is None else given

    @cached_property
    def touches(self) -> dict[str, Touch]:
        """One touch per stimulus."""
        return self.stimuli.touches(list(self.recorded.stimuli.values()), self.conditions)

    @cached_property
    def conditions(self) -> Conditions:
        """Finger, tissues, accuracy and seed."""
        return replace(self.stimuli.conditions, seed=self.seed)

    @property
    def quantities(self) -> tuple[str, str]:
        """Quantities of the dynamic and of the static term."""
        default = self.conditions.quantity
        if self.free:
            return self.afferent.dynamic_quantity, self.afferent.static_quantity
        return self.dynamic_quantity or default, self.static_quantity or default


@checked
def run_fit(
    request: FitRequest,
    progress: Progress | None = None,
    command: str | None = None,
    inputs: Mapping[str, str] | None = None,
) -> FitFile:
    """Indent with all stimuli, fit, and record what ran.

    Parameters
    ----------
    request : FitRequest
        What to fit and how.
    progress : Progress, optional
        Shown each finished indentation.
    command : str, optional
        The command line, for the manifest.
    inputs : mapping of str to str, optional
        SHA-256 of the input files, by name.

    Raises
    ------
    ConvergenceError
        If an indentation or a fit does not converge; finished indentations stay stored.
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    recorded, runner = request.recorded, Runner(request.folder, request.jobs, progress)
    skins = runner.responses({"stimuli": request.touches})["stimuli"]
    offsets_mm = OFFSETS_MM if request.with_offset else (0.0,)
    x_mm, z_mm = request.conditions.finger.contact_mm
    sites = [[x_mm + offset, z_mm] for offset in offsets_mm]
    sampled = [skin.sed(sites, *request.quantities) for skin in skins.values()]
    beside = {
        offset: [traces.part(slice(place, place + 1)) for traces in sampled]
        for place, offset in enumerate(offsets_mm)
    }
    shifts_mm = _shifts_mm(list(recorded.stimuli.values()), along_skin(request.conditions))
    with runner.stage("fit", 1) as advance:
        found = fit_recordings(
            beside[0.0],
            recorded.recordings,
            request.memberships,
            method=request.method,
            windows_ms=request.used_windows_ms,
            seed=request.conditions.seed,
            with_posterior=request.with_posterior,
            with_profiles=request.with_profiles,
            with_sensitivity=request.with_sensitivity,
            beside=beside if request.with_offset else None,
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
        manifest=runner.manifest(
            request.conditions, {"stimuli": next(iter(skins.values())).mesh}, command=command, inputs=inputs
        ),
    )


def _shifts_mm(stimuli: Sequence[NamedStimulus], along: float) -> list[float] | None:
    """Shifts along the skin, proximal positive, of stimuli that differ in nothing else; None for others."""
    if len({replace(stimulus, x_mm=0.0, name="", level=None) for stimulus in stimuli}) > 1:
        return None
    return [0.0 - float(f"{stimulus.x_mm / along:.9g}") for stimulus in stimuli]


def example_recordings() -> dict[str, bytes]:
    """Return example recordings: the rates under the paper's bar that come with the package."""
    observed = bar_firing_rates()
    rows = np.column_stack([observed.shift_mm, observed.dynamic_rate_hz, observed.static_rate_hz])
    lines = [
        f"# One SAI afferent under a bar 3 mm wide, pressed in by 1 mm. {observed.source}",
        "# shift: of the bar from the centre of the receptive field, proximal positive.",
        "shift_mm,dynamic_rate_hz,static_rate_hz",
        *(",".join(f"{value:g}" for value in row) for row in rows),
    ]
    return {EXAMPLE: ("\n".join(lines) + "\n").encode()}


@result_class
class ChosenNumbersFile:
    """The file `fit.json` of a fit of chosen numbers; a touch takes its afferent by `afferent: fit.json`."""

    format: Literal["fingerpad fit of chosen numbers"] = "fingerpad fit of chosen numbers"
    format_version: Literal[1] = 1
    type: str
    fitted: dict[str, float]  # Numbers by their names, in the units of the type.
    stimulus: tuple[str, ...]
    dynamic_rate_hz: Vector
    static_rate_hz: Vector  # Rates of the fitted afferent. [spikes/s]
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


def fit_chosen_numbers(
    request: FitRequest, runner: Runner, command: str | None, inputs: dict[str, str]
) -> ChosenNumbersFile:
    """Indent with all stimuli, and fit the numbers `request.free` of its type of afferents."""
    skins = runner.responses({"stimuli": request.touches})["stimuli"]
    site = [request.conditions.finger.contact_mm]
    traces = [skin.sed(site, *request.quantities) for skin in skins.values()]
    rates, windows_ms = request.rates, request.used_windows_ms
    with runner.stage("fit", 1) as advance:
        found = fit_afferent(request.afferent, request.free, traces, rates, request.memberships, windows_ms)
        advance()
    return ChosenNumbersFile(
        type=request.kind,
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
            request.conditions, {"stimuli": next(iter(skins.values())).mesh}, command=command, inputs=inputs
        ),
    )
