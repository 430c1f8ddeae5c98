"""A fit of chosen numbers of an RA, PC, SAII or SAI afferent to recordings, and the file it writes."""

from __future__ import annotations

from typing import Literal

from fingerpad.core.results import Vector, result_class
from fingerpad.experiments.fit.session import FitRequest
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.inference.typed_fit import fit_afferent


@result_class
class ChosenNumbersFile:
    """The file `fit.json` of a fit of chosen numbers; a touch takes its afferent by `afferent: fit.json`."""

    format: Literal["fingerpad fit of chosen numbers"] = "fingerpad fit of chosen numbers"
    format_version: Literal[1] = 1
    type: str
    fitted: dict[str, float]
    """Numbers by their names, in the units of the type."""
    stimulus: tuple[str, ...]
    dynamic_rate_hz: Vector
    static_rate_hz: Vector
    """Rates of the fitted afferent. [spikes/s]"""
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
