"""The studies, each a command of its name."""

from __future__ import annotations

import typer

from fingerpad.cli import run
from studies.commands.drives import drives_command
from studies.commands.materials import materials_command
from studies.commands.refine import refine_command
from studies.commands.results import results_command

app = typer.Typer(help="Research on the model itself.", add_completion=False, pretty_exceptions_enable=False)
app.command("drives")(drives_command)
app.command("materials")(materials_command)
app.command("refine")(refine_command)
app.command("results")(results_command)


def main() -> None:
    """Run one study."""
    run(app, "studies")


if __name__ == "__main__":
    main()
