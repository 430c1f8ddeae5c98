"""docs/command-line.md: the options of every command, as its help states them."""

from __future__ import annotations

from typing import Any

import typer

from fingerpad.cli import app
from studies.pages import table

INTRODUCTION = """# Command line

`fingerpad` has thirteen commands. The option `--help` of each shows the same text.
With every command, as in `fingerpad touch touch.yaml --quiet`, `--quiet` leaves out progress and notices, and
`--verbose` also tells of the steps of a press, what is stored and how long each stage takes.
`make reproduce ARGS="--resolution quick"` runs `fingerpad reproduce` in the environment of the repository.
`python -m studies results` writes this page.
"""

GUIDES = {
    "touch": "Format and outputs: [touch.md](touch.md).",
    "init": "What it holds: [touch.md](touch.md).",
    "check": "How good the estimate is: [touch.md](touch.md#before-a-press).",
    "sweep": "Format and results: [sweeps.md](sweeps.md).",
    "fit": "Formats and results: [fit.md](fit.md).",
    "discriminate": "Format and results: [discriminate.md](discriminate.md).",
    "validate": "Format and scores: [validate.md](validate.md).",
    "export": "What is exported: [mechanics.md](mechanics.md#export).",
    "view": "Pictures and films: [view.md](view.md).",
    "store": "What a store holds: [stored presses](sweeps.md#stored-presses).",
    "reduce": "Format and use: [reduced.md](reduced.md).",
    "lab": "Guide: [a laboratory in the browser](reduced.md#a-laboratory-in-the-browser).",
    "reproduce": "Results of a run: [results.md](results.md).",
}
"""Pages that explain a command."""


def command_line_page() -> str:
    """Return the page."""
    group: Any = typer.main.get_command(app)
    parts = [INTRODUCTION.rstrip("\n")]
    commands = [
        (f"{name} {inner}", each)
        for name, command in group.commands.items()
        for inner, each in getattr(command, "commands", {"": command}).items()
    ]
    for name, command in ((name.strip(), command) for name, command in commands):
        parts += [
            f"## fingerpad {name}",
            " ".join([" ".join(command.help.split()), GUIDES[name.split()[0]]]),
            table(("option", "default", "meaning"), [_row(parameter) for parameter in command.params]),
        ]
    return "\n\n".join(parts) + "\n"


def _row(parameter: Any) -> tuple[str, str, str]:
    named = [name for name in (*parameter.opts, *parameter.secondary_opts) if name.startswith("--")]
    name = " / ".join(named) or parameter.metavar or parameter.name.upper()
    return f"`{name}`", _default(parameter.default), parameter.help.replace("|", "\\|")


def _default(value: Any) -> str:
    if value is None or value is False:
        return ""
    if isinstance(value, tuple):
        return f"`{' '.join(f'{each:g}' for each in value)}`"
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"
