"""`python -m studies materials`: sets of tissues side by side."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import Jobs, Resolution, to_whole
from fingerpad.cli.running import interruptible, make_writable, processes
from fingerpad.core.files import write_json


def materials_command(
    resolution: Resolution = "quick",
    out: Annotated[
        Path, typer.Option(help="Folder for page, figure, numbers and stored indentations.")
    ] = Path("materials"),
    jobs: Jobs = None,
    seed: Annotated[
        int, typer.Option(parser=to_whole, metavar="INTEGER", help="Seed of noise and search.")
    ] = 0,
    name: Annotated[
        list[str] | None, typer.Option(help="A set to compare; may be given several times; all by default.")
    ] = None,
    shifted_bars: Annotated[
        bool, typer.Option("--shifted-bars", help="Press the bar at all 36 shifts, not once.")
    ] = False,
) -> None:
    """Compare sets of tissues on deflection, firing and discrimination."""
    from rich.console import Console

    from fingerpad.experiments.conditions import Conditions
    from studies.material_sets import Effort
    from studies.material_study import MaterialStudy, study_materials
    from studies.pages.material_sets import write_material_page

    study = MaterialStudy(
        Conditions(resolution=resolution, seed=seed),
        out,
        processes(jobs),
        Effort(shifted_bars=shifted_bars),
        **({"names": tuple(name)} if name else {}),
    )
    make_writable(out)
    console = Console(stderr=True, quiet=not sys.stderr.isatty())
    chosen = "".join(f' --name "{one}"' for one in name or ())
    options = f"--resolution {resolution}{' --shifted-bars' * shifted_bars}{chosen}"
    command = f"python -m studies materials {options}"
    with interruptible():
        results = study_materials(study, lambda part: console.print(f"done: {part}"))
        numbers = out / "material_sets.json"
        write_json(numbers, results)
        page = write_material_page(results, out, command)
    typer.echo(f"Page: {page}")
    typer.echo(f"Results: {numbers}")
