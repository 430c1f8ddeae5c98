"""The command line: its commands in the order of the help, and its errors."""

from __future__ import annotations

import logging
import os
import sys
import warnings
from contextlib import suppress
from typing import Annotated, Any

import typer

from fingerpad import __version__
from fingerpad.cli.discriminate import discriminate_command
from fingerpad.cli.export import export_command
from fingerpad.cli.fit import fit_command
from fingerpad.cli.lab import lab_command
from fingerpad.cli.options import Command
from fingerpad.cli.reduce import reduce_command
from fingerpad.cli.reproduce import reproduce_command
from fingerpad.cli.running import INTERRUPTED, TERMINATED, Terminated, forget_interrupt, signals_raise
from fingerpad.cli.store import store_app
from fingerpad.cli.sweep import sweep_command
from fingerpad.cli.touch import check_command, init_command, touch_command
from fingerpad.cli.validate import validate_command
from fingerpad.cli.view import view_command
from fingerpad.core.errors import FingerpadError, InputError
from fingerpad.core.logger import LOGGER

# What a command runs is imported where it runs: help and version need none of it and come at once.

app = typer.Typer(
    help="Simulate touch: a finite-element fingertip, the spikes of SAI afferents, discrimination.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # which would take a unit, [mm], for markup
)

MISUSE: Any = typer.BadParameter.__base__
"""What typer raises for options that it does not know or cannot read; it names only this child of it."""


GENERAL_OPTIONS = ("--quiet", "--verbose")  # Of every command, before its name or after it.


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
    quiet: Annotated[
        bool, typer.Option("--quiet", help="Show no progress and no notices, only results and errors.")
    ] = False,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose",
            help="Also tell of the steps of a press, what is stored and how long each stage takes.",
        ),
    ] = False,
) -> None:
    if quiet and verbose:
        raise InputError("--quiet and --verbose exclude each other: leave one out.")
    LOGGER.setLevel(logging.ERROR if quiet else logging.DEBUG if verbose else logging.NOTSET)
    if verbose:
        logging.basicConfig(format="%(asctime)s %(name)s: %(message)s", datefmt="%H:%M:%S")
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(2)


# In the order of the help.
app.command("touch", cls=Command)(touch_command)
app.command("init", cls=Command)(init_command)
app.command("check", cls=Command)(check_command)
app.command("sweep", cls=Command)(sweep_command)
app.command("reproduce", cls=Command)(reproduce_command)
app.command("fit", cls=Command)(fit_command)
app.command("discriminate", cls=Command)(discriminate_command)
app.command("validate", cls=Command)(validate_command)
app.command("export", cls=Command)(export_command)
app.command("view", cls=Command)(view_command)
app.command("reduce", cls=Command)(reduce_command)
app.command("lab", cls=Command)(lab_command)

app.add_typer(store_app, name="store")


def main() -> None:
    run(app, "fingerpad")


def _general_first(words: list[str]) -> list[str]:
    """Put the options of all commands before the name of the command, where they are read."""
    end = words.index("--") if "--" in words else len(words)
    general = [word for word in words[:end] if word in GENERAL_OPTIONS]
    return [*general, *(word for word in words[:end] if word not in GENERAL_OPTIONS), *words[end:]]


def _give_up_output() -> None:
    """Leave nothing in standard output that Python would try to write once more at its end."""
    with suppress(OSError):
        sys.stdout.flush()
        return
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    """Show a warning as a sentence: its place in the code says nothing to the user of a command."""
    print(f"fingerpad: {message}", file=sys.stderr)


def run(commands: typer.Typer, program: str) -> None:
    """Run a command line; an error is one sentence on standard error and exit status 2."""
    try:
        with signals_raise(), warnings.catch_warnings():
            warnings.showwarning = _show_warning
            status = commands(args=_general_first(sys.argv[1:]), standalone_mode=False)
            sys.stdout.flush()
        sys.exit(status)
    except (typer.Abort, KeyboardInterrupt) as stop:  # click makes the first of the second
        forget_interrupt()
        terminated = isinstance(stop.__cause__ or stop, Terminated)
        print(f"{program}: stopped. Run the same command again.", file=sys.stderr)
        sys.exit(TERMINATED if terminated else INTERRUPTED)
    except FingerpadError as error:
        print(f"{program}: {error}", file=sys.stderr)
        sys.exit(2)
    except OSError as error:  # a folder without rights, a full disk, a closed pipe
        _give_up_output()
        what = error.filename or "The output"
        print(f"{program}: {what} cannot be used ({error.strerror or error}).", file=sys.stderr)
        sys.exit(2)
    except MISUSE as error:
        print(f"{program}: {FingerpadError(error.format_message().rstrip('.'))}.", file=sys.stderr)
        sys.exit(2)
