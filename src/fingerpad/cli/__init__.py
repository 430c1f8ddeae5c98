"""The command line: its commands in the order of the help, and its errors."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from fingerpad import __version__
from fingerpad.cli.discriminate import discriminate_command
from fingerpad.cli.export import export_command
from fingerpad.cli.fit import fit_command
from fingerpad.cli.options import Command
from fingerpad.cli.reproduce import reproduce_command
from fingerpad.cli.touch import check_command, init_command, touch_command
from fingerpad.cli.validate import validate_command
from fingerpad.cli.view import view_command
from fingerpad.core.errors import FingerpadError

# What a command runs is imported where it runs: help and version need none of it and come at once.

app = typer.Typer(
    help="Simulate touch: a finite-element fingertip, the spikes of SAI afferents, discrimination.",
    add_completion=False,
    pretty_exceptions_enable=False,
)

MISUSE: Any = typer.BadParameter.__base__
"""What typer raises for options that it does not know or cannot read; it names only this child of it."""


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"fingerpad {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit."),
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(2)


# In the order of the help.
app.command("touch", cls=Command)(touch_command)
app.command("init", cls=Command)(init_command)
app.command("check", cls=Command)(check_command)
app.command("reproduce", cls=Command)(reproduce_command)
app.command("fit", cls=Command)(fit_command)
app.command("discriminate", cls=Command)(discriminate_command)
app.command("validate", cls=Command)(validate_command)
app.command("export", cls=Command)(export_command)
app.command("view", cls=Command)(view_command)


def main() -> None:
    """Run the command line `fingerpad`."""
    run(app, "fingerpad")


def run(commands: typer.Typer, program: str) -> None:
    """Run a command line; an error is one sentence on standard error and exit status 2."""
    try:
        sys.exit(commands(standalone_mode=False))
    except FingerpadError as error:
        print(f"{program}: {error}", file=sys.stderr)
        sys.exit(2)
    except MISUSE as error:
        print(f"{program}: {error.format_message().rstrip('.')}.", file=sys.stderr)
        sys.exit(2)
