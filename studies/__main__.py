"""The studies, each a command of its name."""

from __future__ import annotations

import sys

import typer

from fingerpad.core.errors import FingerpadError
from studies.commands.drives import drives_command
from studies.commands.materials import materials_command
from studies.commands.refine import refine_command

app = typer.Typer(help="Research on the model itself.", add_completion=False, pretty_exceptions_enable=False)
app.command("drives")(drives_command)
app.command("materials")(materials_command)
app.command("refine")(refine_command)


def main() -> None:
    """Run one study; a failure is one sentence on standard error and exit status 2."""
    try:
        sys.exit(app(standalone_mode=False))
    except FingerpadError as error:
        print(f"studies: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
