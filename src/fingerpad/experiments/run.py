"""One run of any request: press what is not stored yet, compute, and record what ran."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar

from fingerpad.core.values import Flag, Seed, choice
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.discrimination.analysis import discriminate
from fingerpad.experiments.discrimination.request import DiscriminationRequest
from fingerpad.experiments.fit.request import FitRequest, run_fit
from fingerpad.experiments.gerling2014.reproduction import HUMAN, PAPER, ReproductionResult, reproduce
from fingerpad.experiments.requests.parts import Request
from fingerpad.experiments.requests.touch import ReductionRequest, RespondRequest, TouchRequest
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.scan import ScanRequest
from fingerpad.experiments.sweep.request import SweepRequest
from fingerpad.experiments.validation.validation import ValidationRequest, validate
from fingerpad.geometry.grading import RESOLUTIONS
from fingerpad.mechanics.tissues import TISSUES


class ReproductionRequest(Request):
    """A reproduction of Gerling et al. (2014), as `fingerpad.reproduce` runs it."""

    word: ClassVar[str] = "reproduction"

    resolution: Annotated[str, choice(RESOLUTIONS)] = "standard"  #: How fine meshes and steps are.
    tissues: Annotated[str, choice(tuple(name for name in TISSUES if name != HUMAN))] = PAPER
    """Tissues of the first column: "paper", Trial 3 with a Poisson's ratio of 0.40, our reading; "trial3",
    Trial 3 to the letter, 0.48; or any other named set but human."""
    extended: Flag | None = None
    """Whether what goes beyond the paper is run as well: uncertainty of the fit, curvature thresholds; by
    default at all resolutions but quick."""
    seed: Seed = 0  #: Of all random numbers.

    @property
    def goes_beyond(self) -> bool:
        """Whether what goes beyond the paper is run."""
        return self.resolution != "quick" if self.extended is None else self.extended

    def run(self, runner: Runner) -> ReproductionResult:
        """Run both columns, the paper's own system and the set human."""
        tissues = {PAPER: self.tissues, HUMAN: HUMAN}
        columns = {name: Conditions(self.resolution, self.seed, each) for name, each in tissues.items()}
        return reproduce(columns, self.goes_beyond, runner)


REQUESTS: Mapping[str, type[Request]] = {
    "touch": TouchRequest,
    "respond": RespondRequest,
    "scan": ScanRequest,
    "fit": FitRequest,
    "discriminate": DiscriminationRequest,
    "validate": ValidationRequest,
    "sweep": SweepRequest,
    "reduce": ReductionRequest,
    "reproduce": ReproductionRequest,
}  # Requests by the names of their functions and commands.

RUNS: Mapping[type[Request], Callable[[Any, Runner], Any]] = {
    TouchRequest: TouchRequest.run,
    RespondRequest: RespondRequest.run,
    FitRequest: run_fit,
    DiscriminationRequest: discriminate,
    ValidationRequest: validate,
    ScanRequest: ScanRequest.run,
    ReductionRequest: ReductionRequest.run,
    ReproductionRequest: ReproductionRequest.run,
}  # What runs a request, by its class.


def run(request: Request, runner: Runner) -> Any:
    """Run a request, with its stored presses in the folder of the runner."""
    return RUNS[type(request)](request, runner)
