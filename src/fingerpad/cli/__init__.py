"""The command line: each request is a command, and its fields are the options.

Names, explanations and choices are those of the packaged schemas of the requests, so that help needs nothing
else. An option within a block is written with its place: `--motion.depth_mm 0.5`.
"""

from __future__ import annotations

import argparse
import logging
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, NoReturn

from fingerpad import __version__
from fingerpad.cli import commands
from fingerpad.core.errors import FingerpadError, InputError, closest
from fingerpad.core.logger import LOGGER

GENERAL = ("--quiet", "--verbose")  # Options of every command, before its name or after it.

INTERRUPTED, TERMINATED = 130, 143  # Exit statuses after Ctrl-C and after SIGTERM, by convention.


class Terminated(KeyboardInterrupt):
    """SIGTERM came."""


@contextmanager
def signals_raise() -> Iterator[None]:
    """Let the first Ctrl-C and the first SIGTERM raise, and let a second one end the process at once.

    Modules in C turn what is raised while they are imported into an `ImportError`.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    came: list[type[KeyboardInterrupt]] = []

    def raise_once(number: int, frame: object) -> None:
        for each in before:
            signal.signal(each, signal.SIG_DFL)
        came.append(Terminated if number == signal.SIGTERM else KeyboardInterrupt)
        raise came[0]

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number in before:
        signal.signal(number, raise_once)
    try:
        yield
    except Exception as error:
        if came:
            raise came[0] from error
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def forget_interrupt() -> None:
    """Let this process end with its own status after a `KeyboardInterrupt`.

    CPython ends `python -m` by SIGINT instead if the exception passed through `exec` of a text, as while
    dataclasses are made, until another text is executed (`run_eval_code_obj` of its source).
    """
    exec("")


class Parser(argparse.ArgumentParser):
    """Parser whose errors are one sentence."""

    def __init__(self, **options: Any):
        super().__init__(allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter, **options)

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message[:1].upper()}{message[1:].rstrip('.')}.")


@dataclass(frozen=True)
class Program:
    """A program of several commands."""

    name: str
    what: str  #: In one sentence.
    commands: Mapping[str, commands.Command]


FINGERPAD = Program(
    "fingerpad",
    "Simulate touch: a finite-element fingertip, the spikes of afferents, discrimination.",
    commands.COMMANDS,
)


def parser_of(program: Program, name: str) -> Parser:
    what, add, _ = program.commands[name]
    parser = Parser(prog=f"{program.name} {name}", description=what)
    add(parser)
    for option, words in zip(GENERAL, ("Show only results and errors.", "Show each step."), strict=True):
        parser.add_argument(option, action="store_true", help=words)
    return parser


def main(words: Sequence[str] | None = None, program: Program = FINGERPAD) -> NoReturn:
    """Run a command line; an error is one sentence on standard error and exit status 2."""
    try:
        with signals_raise(), warnings.catch_warnings():
            warnings.showwarning = _show_warning
            status = _run(program, [*(sys.argv[1:] if words is None else words)])
            sys.stdout.flush()
        sys.exit(status)
    except KeyboardInterrupt as stop:
        forget_interrupt()
        print(f"{program.name}: stopped. {commands.ENDING}", file=sys.stderr)
        sys.exit(TERMINATED if isinstance(stop, Terminated) else INTERRUPTED)
    except FingerpadError as error:
        print(f"{program.name}: {error}", file=sys.stderr)
        sys.exit(2)
    except OSError as error:  # a folder without rights, a full disk, a closed pipe
        _give_up_output()
        what = error.filename or "The output"
        print(f"{program.name}: {what} cannot be used ({error.strerror or error}).", file=sys.stderr)
        sys.exit(2)


def _run(program: Program, words: list[str]) -> int | None:
    end = words.index("--") if "--" in words else len(words)
    general = [word for word in words[:end] if word in GENERAL]
    words = [word for word in words if word not in general]
    if set(GENERAL) <= set(general):
        raise InputError("--quiet and --verbose exclude each other: leave one out.")
    if words[:1] == ["--version"]:
        print(f"fingerpad {__version__}")
        return 0
    if not words or words[0] in ("--help", "-h"):
        _show_help(program)
        return 0 if words else 2
    name, *rest = words
    if name not in program.commands:
        if name.startswith("-"):
            raise InputError(f"No such option: {name}; the name of a command comes first.")
        near = closest(name, program.commands)
        raise InputError(f"No such command: {name!r}" + (f"; did you mean {near}?" if near else "."))
    LOGGER.setLevel(logging.ERROR if "--quiet" in general else logging.DEBUG if general else logging.NOTSET)
    if "--verbose" in general:
        logging.basicConfig(format="%(asctime)s %(name)s: %(message)s", datefmt="%H:%M:%S")
    parser, run = parser_of(program, name), program.commands[name][2]
    _add_within_blocks(parser, rest)
    for before, word in zip(["An argument", *rest], rest, strict=False):
        if not word:
            raise InputError(f"{before} must not be empty: write a name, or leave it out.")
    given, unknown = parser.parse_known_args(rest)
    for word in unknown:
        if not word.startswith("-"):
            raise InputError(f"Got an unexpected extra argument: {word!r}.")
        option = word.partition("=")[0]
        near = closest(
            option.lstrip("-").replace("-", "_"), [name.replace("-", "_") for name in _names(parser)]
        )
        remedy = f"; write --{near.replace('_', '-')}." if near else "."
        raise InputError(f"No such option: {option}{remedy}")
    return run(given)


def _names(parser: Parser) -> list[str]:
    return [name.lstrip("-") for each in parser._actions for name in each.option_strings]


def _add_within_blocks(parser: Parser, words: Iterable[str]) -> None:
    """Add the options among the words that name a key within a block, such as `--motion.depth_mm`."""
    for option in {word.partition("=")[0] for word in words}:
        key, dot, _ = option.removeprefix("--").partition(".")
        if option.startswith("--") and dot and key in _names(parser):
            place = option.removeprefix("--").replace("-", "_")
            parser.add_argument(option, dest=f"{commands.KEY}{place}", metavar="VALUE")


def _show_help(program: Program) -> None:
    width = max(map(len, program.commands)) + 2
    print(f"usage: {program.name} [--version] [--help] COMMAND ...\n\n{program.what}\n\ncommands:")
    for name, (what, _, _) in program.commands.items():
        print(f"  {name:{width}}{what}")
    print(f"\n`{program.name} COMMAND --help` explains its options. All take --quiet and --verbose.")


def _give_up_output() -> None:
    """Leave nothing in standard output that Python would try to write once more at its end."""
    with suppress(OSError):
        sys.stdout.flush()
        return
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    """Show a warning as a sentence: its place in the code says nothing to the user of a command."""
    print(f"fingerpad: {message}", file=sys.stderr)
