"""One run of any request: press what is not stored yet, compute, and record what ran."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

from fingerpad.core.engine import Engine
from fingerpad.core.progress import Progress
from fingerpad.core.values import Flag, Seed, choice
from fingerpad.experiments.discrimination.analysis import discriminate
from fingerpad.experiments.discrimination.request import DiscriminationRequest
from fingerpad.experiments.fit.request import FitRequest, run_fit
from fingerpad.experiments.gerling2014.reproduction import Reproduction, ReproductionResult, reproduce
from fingerpad.experiments.requests.parts import Request
from fingerpad.experiments.requests.reduction import ReductionRequest
from fingerpad.experiments.requests.touch import RespondRequest, TouchRequest
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.validation.request import ValidationRequest
from fingerpad.experiments.validation.validation import validate
from fingerpad.geometry.grading import RESOLUTIONS
from fingerpad.mechanics.tissues import TISSUES


class ReproductionRequest(Request):
    """A reproduction of Gerling et al. (2014), as `fingerpad.reproduce` runs it.

    Parameters
    ----------
    resolution : {"quick", "standard", "paper"}
        How fine meshes and steps are.
    tissues : str
        Tissues of the first column: "paper", Trial 3 with a Poisson's ratio of 0.40, our reading; "trial3",
        Trial 3 to the letter, 0.48; or any other named set but human.
    extended : bool, optional
        Whether what goes beyond the paper is run as well: uncertainty of the fit, curvature thresholds; by
        default at all resolutions but quick.
    seed : int
        Of all random numbers.
    """

    word: ClassVar[str] = "reproduction"

    resolution: Annotated[str, choice(RESOLUTIONS)] = "standard"
    tissues: Annotated[str, choice(TISSUES)] = "paper"
    extended: Flag | None = None
    seed: Seed = 0

    def check(self) -> None:
        """Raise `InputError` if the reproduction is impossible."""
        with self.origin.located():
            self.of(Path())

    def of(self, folder: Path, jobs: int | Engine = 1) -> Reproduction:
        """Return the reproduction in a folder."""
        return Reproduction(
            folder, self.resolution, self.seed, self.tissues, jobs=jobs, extended=self.extended
        )


RUNS: Mapping[type[Request], Callable[[Any, Runner, str | None], Any]] = MappingProxyType(
    {
        TouchRequest: TouchRequest.run,
        RespondRequest: RespondRequest.run,
        FitRequest: run_fit,
        DiscriminationRequest: discriminate,
        ValidationRequest: validate,
        ReductionRequest: lambda request, runner, _: request.run(runner),
    }
)
"""What runs a request, by its class."""


def run(
    request: Request,
    folder: Path,
    jobs: int | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
) -> Any:
    """Run a request, with its stored presses in a folder."""
    if isinstance(request, ReproductionRequest):
        found: ReproductionResult = reproduce(request.of(folder, jobs), progress)
        return found
    request_run = RUNS[type(request)]
    return request_run(request, Runner(folder, jobs, progress), command)
