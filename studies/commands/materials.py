"""`python -m studies materials`: sets of tissues side by side."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import Jobs, Resolution
from fingerpad.core.checks import one_of
from fingerpad.experiments.conditions import Conditions
from studies import material_study
from studies.material_sets import Effort
from studies.pages.material_sets import materials_page
from studies.study import Out, Seed, Study, execute


def materials_command(
    resolution: Resolution = "quick",
    out: Out = Path("materials"),
    jobs: Jobs = None,
    seed: Seed = 0,
    name: Annotated[
        list[str] | None, typer.Option(help="A set to compare; may be given several times; all by default.")
    ] = None,
    shifted_bars: Annotated[
        bool, typer.Option("--shifted-bars", help="Press the bar at all 36 shifts, not once.")
    ] = False,
) -> None:
    """Compare sets of tissues on deflection, firing and discrimination."""
    names = [one_of("--name", one, material_study.NAMES) for one in name or material_study.NAMES]
    run = partial(material_study.run, effort=Effort(shifted_bars=shifted_bars), names=names)
    study = Study("materials", "", run, materials_page)
    execute(study, Conditions(resolution=resolution, seed=seed), out, jobs)
