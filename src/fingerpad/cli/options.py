"""Options that several commands share, and how words of the command line are read."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any

import typer
import typer.core

from fingerpad.cli.running import interruptible
from fingerpad.core.errors import closest
from fingerpad.skin.fields import sampled_fields

DEFAULT_TISSUES = "human"  # Tissues of every command; as in `fingerpad.data.tissues`.
RESOLUTION_CHOICES = ("quick", "standard", "paper")
INDENTER_CHOICES = ("sphere", "cylinder", "bar", "line", "punch", "plate", "edge", "gap", "grating")
FINGER_CHOICES = ("adult", "small", "large", "child", "macaque", "aged")
TISSUES_CHOICES = (
    "human", "paper", "trial1", "trial2", "trial3", "trial2_wu", "trial3_wu", "trial3_stiffening",
    "maeno1998", "wu2007", "gerling2014_fit",
)  # fmt: skip
FORMAT_CHOICES = ("vtu", "csv", "npz", "netcdf", "zarr", "abaqus", "calculix", "febio")
METHOD_CHOICES = ("least_squares", "response_surface", "closed_form", "cma_es", "likelihood")
QUANTITY_CHOICES = tuple(sampled_fields())
KIND_CHOICES = ("force", "deflection", "rate_curvature", "rate_position", "grating")
LOADING_CHOICES = ("ramp_and_hold", "quasi_static")

RESOLUTIONS_AS_OPTIONS = tuple(f"--{name}" for name in RESOLUTION_CHOICES)
"""Values of `--resolution` as they may be mistaken for options."""


class _WholeSentence:
    """In the list of commands, the whole first paragraph of a command."""

    help: str | None

    def get_short_help_str(self, limit: int = 0) -> str:
        """First paragraph of the help, which click cuts at a width and at any full stop."""
        return " ".join((self.help or "").partition("\n\n")[0].split())


class Group(_WholeSentence, typer.core.TyperGroup):
    """A command with commands of its own, which it names where none is given."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if not args:
            ctx.fail(f"{ctx.info_name} needs a command: {', '.join(self.list_commands(ctx))}")
        return super().parse_args(ctx, args)


class Command(_WholeSentence, typer.core.TyperCommand):
    """A command that does not take an option's name for the value of another, and ends well by a signal."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        options = [each for each in self.get_params(ctx) if isinstance(each, typer.core.TyperOption)]
        names = {name for option in options for name in (*option.opts, *option.secondary_opts)}
        with_argument = {name for option in options if not option.is_flag for name in option.opts}
        for before, word in pairwise(["An argument", *args]):
            # As a path an empty word would mean the current folder.
            if not word and (before in ("--out", "--example") or before not in with_argument):
                ctx.fail(f"{before} must not be empty: write a name, or leave it out")
        words = args[: args.index("--")] if "--" in args else args
        for word in words:
            if word not in names and word in RESOLUTIONS_AS_OPTIONS and "--resolution" in names:
                ctx.fail(f"No such option: {word}; write --resolution {word.removeprefix('--')}")
        for word, following in pairwise(["", *words]):
            option = following.partition("=")[0]
            meant = closest(option[2:], [name[2:] for name in names])
            unknown = option.startswith("--") and option not in {*names, "--help"}
            if unknown and meant and word not in with_argument:
                ctx.fail(f"No such option: {option}; write --{meant}")
            if word in with_argument and following in names:
                ctx.fail(f"Option {word!r} requires an argument: got {following!r}; write its value first")
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the command; a signal that it does not take care of itself ends it with a sentence."""
        with interruptible("Run the same command again."):
            return super().invoke(ctx)


def to_whole(text: str) -> int:
    """Read an option, and repeat what came where it cannot be read."""
    try:
        return int(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be a whole number: got {text!r}.") from error


def to_number(text: str) -> float:
    """Read an option, and repeat what came where it cannot be read."""
    try:
        return float(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be a number: got {text!r}.") from error


def option(help_text: str, name: str | None = None) -> Any:
    """Make an option, by default of the name of its parameter."""
    return typer.Option(*([name] if name else []), help=help_text)


def number_option(help_text: str) -> Any:
    return typer.Option(parser=to_number, metavar="NUMBER", help=help_text)


def integer_option(help_text: str) -> Any:
    return typer.Option(parser=to_whole, metavar="INTEGER", help=help_text)


Resolution = Annotated[str, option(f"One of {', '.join(RESOLUTION_CHOICES)}.")]
Tissues = Annotated[str, option(f"One of {', '.join(TISSUES_CHOICES)}.")]
Jobs = Annotated[int | None, integer_option("Number of processes. Default: one per core.")]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Press on the workers of this Dask scheduler, tcp://HOST:PORT, instead of processes here.",
    ),
]
Seed = Annotated[int, integer_option("Seed of the random numbers.")]
