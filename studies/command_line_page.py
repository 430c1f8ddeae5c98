"""docs/command-line.md: the options of every command, as its help states them."""

from __future__ import annotations

import argparse

from fingerpad.cli import FINGERPAD, parser_of
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
    "respond": "Keys: those of the block [afferents](touch.md) of a touch.",
    "init": "What it holds: [touch.md](touch.md).",
    "check": "How good the estimate is: [touch.md](touch.md#before-a-press).",
    "sweep": "Format and results: [sweeps.md](sweeps.md).",
    "fit": "Formats and results: [fit.md](fit.md).",
    "discriminate": "Format and results: [discriminate.md](discriminate.md).",
    "validate": "Format and scores: [validate.md](validate.md).",
    "view": "Pictures and films: [view.md](view.md).",
    "store": "What a store holds: [stored presses](sweeps.md#stored-presses).",
    "reduce": "Format and use: [reduced.md](reduced.md).",
    "lab": "Guide: [a laboratory in the browser](reduced.md#a-laboratory-in-the-browser).",
    "reproduce": "Results of a run: [results.md](results.md).",
}
"""Pages that explain a command."""


def command_line_page() -> str:
    """Return the page."""
    parts = [INTRODUCTION.rstrip("\n")]
    for name, (what, _, _) in FINGERPAD.commands.items():
        options = parser_of(FINGERPAD, name)._actions
        rows = [_row(each) for each in options if each.dest not in ("help", "quiet", "verbose")]
        parts += [f"## fingerpad {name}", f"{what} {GUIDES[name]}", table(("option", "meaning"), rows)]
    return "\n\n".join(parts) + "\n"


def _row(option: argparse.Action) -> tuple[str, str]:
    name = option.option_strings[0] if option.option_strings else option.metavar
    return f"`{name}`", str(option.help).replace("%%", "%").replace("|", "\\|")
