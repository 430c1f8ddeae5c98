"""The commands: what each says, its options, and what it runs."""

from __future__ import annotations

import argparse
import logging
import os
import shlex
import socket
import sys
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import fingerpad as fp
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.files import make_writable
from fingerpad.core.logger import LOGGER
from fingerpad.core.progress import Bars, Lines, NoProgress, Progress
from fingerpad.experiments.schemas import request_schema

if TYPE_CHECKING:
    from fingerpad.core.engine import Engine

# What a command runs is imported where it runs: help and version need none of it and come at once.

INCOMPLETE = 3  # Exit status of a validation of which some rows have no prediction.
MOST_FAILED = 99  # Largest exit status for settings of a sweep that failed: larger ones have other meanings.
SECONDS_PER_DAY = 86_400.0
ENDING = "The same command continues after the last finished indentation."
LOOPBACK = "127.0.0.1"
KEY = "key:"  # Begin of what argparse calls the value of a key of the request.

TABLE: dict[str, Any] = tomllib.loads((files(__package__) / "commands.toml").read_text(encoding="utf-8"))
"""What each command says and which options it has; `commands.toml` says how to read it."""

OPTION_KINDS = {"path": Path, "name": str, "number": float, "count": int, "flag": bool}


def processes(jobs: int | None) -> int:
    """Return what `--jobs` says, or one process per core that this process may use."""
    from fingerpad.core.values import whole  # loads NumPy, which help and version do without

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores if jobs is None else whole("jobs", jobs, at_least=1)


def engine(jobs: int | None, scheduler: str | None) -> int | Engine:
    """Return the workers of `--scheduler` once it answers, or the number of processes here."""
    if scheduler is None:
        return processes(jobs)
    if jobs is not None:
        raise InputError(
            f"--jobs is the number of processes here, and --scheduler {scheduler} has workers: leave one out."
        )
    from fingerpad.experiments.cluster import Cluster

    cluster = Cluster(scheduler)
    cluster.check()
    return cluster


def command_line() -> str:
    return shlex.join(["fingerpad", *sys.argv[1:]])


def progress() -> Progress:
    """Bars on a terminal, else a line every ten seconds; nothing after `--quiet`. On standard error."""
    from rich.console import Console

    if not LOGGER.isEnabledFor(logging.WARNING):
        return NoProgress()
    console = Console(stderr=True)
    return Bars(console) if console.is_terminal else Lines(partial(print, file=sys.stderr), short=False)


def plain(text: str, option: str, schema: Mapping[str, Any]) -> Any:
    """Return the value that a text of the command line means, as YAML has it; 30,50 is a list."""
    from fingerpad.core.plain_yaml import read_yaml

    given = [each.get("type") for each in (schema, *schema.get("anyOf", ()), *schema.get("oneOf", ()))]
    kinds = {kind for each in given for kind in (each if isinstance(each, list) else [each])}
    if schema and not {"number", "integer", "array", "boolean", "object"} & kinds:
        return text
    if "," in text and text[0] not in "[{" and (not schema or "array" in kinds):
        return [read_yaml(part.strip(), option) for part in text.split(",") if part.strip()]
    return read_yaml(text, option)


def option(
    parser: argparse.ArgumentParser, name: str, words: str, kind: Any = Path, default: Any = None
) -> None:
    """Add an option, or an argument if its name has no dashes; one with a default may be left out."""
    words = words if default in (None, False, []) else f"{words} Default: {default}."
    if kind is bool:
        parser.add_argument(name, action="store_true", help=words)
        return
    read = partial(_read, kind) if kind in (int, float) else kind
    if name.startswith("-"):
        metavar = {int: "N", float: "NUMBER", Path: "PATH"}.get(kind, "NAME")
        parser.add_argument(name, type=read, default=default, metavar=metavar, help=words)
        return
    nargs = None if default is None else "*" if default == [] else "?"
    parser.add_argument(name, type=read, default=default, nargs=nargs, metavar=name.upper(), help=words)


def _read(kind: type[int] | type[float], text: str) -> float:
    try:
        return kind(text)
    except ValueError as error:
        expected = "must be a whole number" if kind is int else "must be a number"
        raise argparse.ArgumentTypeError(f"{expected}: got {text!r}") from error


def _add(name: str, parser: argparse.ArgumentParser) -> None:
    row = TABLE[name]
    if "out" in row:
        _add_request(name, row, parser)
    for each in row.get("options", ()):
        kind = OPTION_KINDS[each.get("kind", "path")]
        option(parser, each["name"], each["help"], kind, each.get("default"))


def _add_request(name: str, row: Mapping[str, str], parser: argparse.ArgumentParser) -> None:
    """Add the options of a request: its fields, and where and how it runs."""
    what = f"YAML file of the request{f', or {main}' if (main := row.get('main')) else ''}."
    parser.add_argument("request", nargs="?", metavar="FILE", help=what)
    folder = "Folder for page, figures, results and stored indentations."
    option(parser, "--out", row.get("of_out", folder), Path, row["out"])
    option(parser, "--jobs", "Number of processes. Default: one per core.", int)
    option(parser, "--scheduler", "Press on the workers of this Dask scheduler, tcp://HOST:PORT.", str)
    option(parser, "--allow-python", "Let the file name objects of Python as module:object.", bool)
    group: Any = parser.add_argument_group("keys of the request, which replace those of the file")
    for key, schema in request_schema(name)["properties"].items():
        words = schema.get("description", "").replace("%", "%%")
        names, as_given = dict.fromkeys([f"--{key}", f"--{key.replace('_', '-')}"]), f"{KEY}{key}"
        if schema.get("type") == "boolean" or {"type": "boolean"} in schema.get("anyOf", ()):
            group.add_argument(*names, dest=as_given, action=argparse.BooleanOptionalAction, help=words)
            continue
        choices = schema.get("enum") or schema.get("items", {}).get("enum")
        words += f" One of {', '.join(map(str, choices))}." if choices else ""
        default = schema.get("default")
        words += f" Default: {default}." if isinstance(default, str | int | float) else ""
        group.add_argument(*names, dest=as_given, metavar="VALUE", help=words)


def _run_request(name: str, given: argparse.Namespace, **more: Any) -> Any:
    """Run a request, with its files in --out."""
    from fingerpad.experiments.run import REQUESTS

    schema, kind = request_schema(name), REQUESTS[name]
    keys = {
        key: value if isinstance(value, bool) else plain(value, key, schema["properties"].get(key, {}))
        for key, value in ((at.removeprefix(KEY), value) for at, value in vars(given).items() if KEY in at)
        if value is not None
    }
    if schema.get("required") and given.request is None and not keys:
        main = f", {kind.main}" if kind.main else ""
        raise InputError(name, f"needs a file{main} or options", remedy="see --help")
    with _blamed_on_options((*keys, "out", "jobs")):
        request = kind.read(given.request, keys, given.allow_python)
        return getattr(fp, name)(
            request, out=given.out, jobs=engine(given.jobs, given.scheduler), progress=progress(),
            command=command_line(), allow_python=given.allow_python, **more,
        )  # fmt: skip


@contextmanager
def _blamed_on_options(keys: tuple[str, ...]) -> Iterator[None]:
    """Name the option in the place of the key that it gives."""
    try:
        yield
    except InputError as error:
        for key in sorted(keys, key=len, reverse=True):
            place = tuple(key.split("."))
            option = key.replace(place[0], f"--{place[0].replace('_', '-')}", 1)
            if error.path[: len(place)] == place:
                within = ": " if error.path[len(place) :] else ""
                named = error.where.replace(key, option, 1).replace(f"{option}.", f"{option}{within}", 1)
                raise error.at(error.path, named).from_source("") from error
        raise


def _tell(*paragraphs: object) -> None:
    print(*paragraphs, sep="\n")


def _ask(name: str, given: argparse.Namespace) -> int:
    """Run a request, and say what came and where it is."""
    found = _run_request(name, given)
    _tell(*_sentences(name, found))
    page = given.out / TABLE[name].get("page", "")
    if page.is_file():
        _tell(f"Report: {page}")
    _tell(f"Results: {given.out / TABLE[name]['results']}")
    return INCOMPLETE if name == "validate" and found.n_predicted < found.n_rows else 0


def _sentences(name: str, found: Any) -> list[str]:
    from fingerpad.report.reproduction import count_sentence
    from fingerpad.report.results import summary

    if name == "respond":
        return [repr(found)]
    if name == "reproduce":
        return [count_sentence(found.statements, name) for name in ("paper", "human")]
    if name == "fit" and not hasattr(found, "fit"):
        return list(found.summary())
    caveats = found.skin.caveats if name == "touch" else ()
    return [*summary(name, found), *(f"Not verified: {each.text}" for each in caveats)]


def _sweep(given: argparse.Namespace) -> int:
    from fingerpad.export.sweep_results import check_outputs, write_sweep_spikes

    check_outputs(given.table, given.spikes)
    how = {"retry_failed": given.retry_failed, "any_size": given.yes, "store": given.store}
    done = _run_request("sweep", given, **how)
    _tell(*done.lines)
    if done.done and given.table is not None:
        _tell(f"Table: {fp.write_sweep_table(fp.open_sweep(given.out), given.table)}")
    if done.done and given.spikes is not None:
        _tell(f"Spikes: {write_sweep_spikes(fp.open_sweep(given.out), given.spikes)}")
    return min(10 + done.failed, MOST_FAILED) if done.failed else 0


def _reduce(given: argparse.Namespace) -> None:
    model = _run_request("reduce", given)
    varied = ", ".join(f"{axis.name} {axis.low:g} to {axis.high:g}" for axis in model.axes if axis.count > 1)
    _tell(
        f"{len(model.first_touch_mm)} poses, {varied or 'one place'}, up to {model.depth_mm:g} mm deep: "
        f"{len(model.modes)} modes, {given.out.stat().st_size / 1e6:.1f} MB."
    )
    errors = zip((*model.quantities, "force"), model.error.tolist(), strict=True)
    known = [f"{error:.1%} of the largest {name.replace('_', ' ')}" for name, error in errors if error < 1e9]
    if known:
        _tell(f"95 % of new touches stay within {', '.join(known)}.")
    _tell(f"Reduced touch: {given.out}")


def _init(given: argparse.Namespace) -> None:
    import json

    from fingerpad.core.files import check_new, write_atomically
    from fingerpad.core.values import one_of
    from fingerpad.experiments.examples import examples
    from fingerpad.experiments.schemas import TOUCH_SCHEMA

    if given.list:
        _tell(*(f"{name}: {each.what} ({each.file})" for name, each in examples().items()))
        return
    own = Path(given.what).suffix in (".yaml", ".yml")  # a name for the file of a touch
    name = "touch" if own else one_of("WHAT", given.what, tuple(examples()))
    example = examples()[name]
    path = given.out / (given.what if own else example.file)
    check_new(path)
    make_writable(path.parent, "--out")
    write_atomically(path, example.text.encode())
    if name == "touch":
        write_atomically(path.parent / TOUCH_SCHEMA, json.dumps(request_schema("touch"), indent=1).encode())
    verb = {".csv": "fit" if name == "recordings" else "validate"}.get(path.suffix, "check")
    _tell(f"Try: fingerpad {verb} {path}")


def _check(given: argparse.Namespace) -> None:
    """Check a request of any kind, which its keys tell."""
    from fingerpad.core.files import read_text
    from fingerpad.core.plain_yaml import read_yaml
    from fingerpad.experiments.requests.touch import estimate_press
    from fingerpad.experiments.run import REQUESTS
    from fingerpad.experiments.sweep.settings import estimate_sweep
    from fingerpad.export.requests import check_outputs

    content = read_yaml(read_text(given.file), str(given.file)) or {}
    keys = {"grid": "sweep", "zip": "sweep", "sample": "sweep", "range": "reduce", "standard": "discriminate",
            "recordings": "fit", "observations": "validate", "x_mm": "scan", "z_mm": "scan"}  # fmt: skip
    name = next((kind for key, kind in keys.items() if key in content), "touch")
    request: Any = REQUESTS[name].read(given.file, allow_python=given.allow_python)
    request.check()
    if name == "touch":
        check_outputs(request)
        _tell(*estimate_press(request.touch).lines)
    elif name == "scan":
        _tell(f"Lines: {request.lines}. The first:", *estimate_press(request.touches[0]).lines)
    elif name == "sweep":
        _tell(*estimate_sweep(request, processes(None)).lines)
    else:
        _tell(f"The request is possible: try fingerpad {name} {given.file}")


def _view(given: argparse.Namespace) -> None:
    if given.out.is_dir():
        raise InputError("--out", "must be a file", remedy=f"{given.out} is a folder")
    shown = {"field": given.field, "time_ms": given.time, "frames": given.frames}
    (written,) = fp.save_view(given.out, given.result, **shown, progress=progress())
    _tell(f"Open: {written}")


def _lab(given: argparse.Namespace) -> None:
    from fingerpad.lab.laboratory import Laboratory
    from fingerpad.lab.server import require_panel, serve
    from fingerpad.lab.static import write_static

    if given.static is None:
        require_panel()
    laboratory = Laboratory(given.folder, given.range, engine(given.jobs, None), given.allow_python)
    make_writable(given.folder, "--folder")
    if given.static is None:
        serve(laboratory, given.port or 0, lambda address: _tell(f"Open: {address}"))
        return
    written = write_static(laboratory, make_writable(given.static, "--static"), progress())
    _tell(f"Open: {written} ({written.stat().st_size / 1e6:.1f} MB)")


def _stream(given: argparse.Namespace) -> None:
    from fingerpad.experiments.requests.touch import ReductionRequest
    from fingerpad.experiments.stream import SpikeStream, answered

    request = ReductionRequest.read(given.file, allow_python=given.allow_python)
    model = fp.read_reduced(given.model, request.training.touch)
    stream = SpikeStream(model, request.population).warmed()
    if given.port is None:
        _exchange(answered(stream, sys.stdin), sys.stdout)
        return
    with socket.create_server((LOOPBACK, given.port)) as server:
        _tell(f"Samples: {LOOPBACK}:{server.getsockname()[1]}")
        sys.stdout.flush()
        connection, _ = server.accept()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # One file for both ways would forget what it has read ahead when it writes.
        with connection, connection.makefile() as samples, connection.makefile("w") as spikes:
            _exchange(answered(stream, samples), spikes)


def _exchange(answers: Iterator[str], out: TextIO) -> None:
    """Write each answer at once, with one thread for libraries."""
    from threadpoolctl import threadpool_limits

    # The search for libraries behind it takes as long as a step: it must not run for every sample.
    with threadpool_limits(limits=1):
        for answer in answers:
            out.write(answer)
            out.flush()


def _store(given: argparse.Namespace) -> int:
    from fingerpad.core.values import not_negative, one_of
    from fingerpad.experiments.runner import STORE_FOLDER
    from fingerpad.skin.store import Store, pruned

    one_of("ACTION", given.action, ("list", "verify", "prune"))
    if given.action == "prune" and given.days is None and given.size is None:
        raise InputError("prune", "needs --days, --size or both", "neither")
    age_s = None if given.days is None else SECONDS_PER_DAY * not_negative("--days", given.days, "days")
    most = None if given.size is None else int(1e6 * not_negative("--size", given.size, "MB"))
    inner = given.folder / STORE_FOLDER
    folder = inner if inner.is_dir() else given.folder
    stored = Store(folder).files()
    if not stored and not (folder.name == STORE_FOLDER and folder.is_dir()):
        raise InputError(
            f"FOLDER must hold stored indentations: {given.folder} has none; name that of a run."
        )
    if given.action == "list":
        for file in stored:
            written = datetime.fromtimestamp(file.written_s, UTC).strftime("%Y-%m-%d %H:%M")
            _tell(f"{file.path.stem}  {file.size / 1e6:8.2f} MB  {written} UTC")
        _tell(f"{len(stored)} indentations, {sum(file.size for file in stored) / 1e6:.1f} MB")
        return 0
    if given.action == "verify":
        faults = [f"{file.path}: {fault}" for file in stored if (fault := file.fault) is not None]
        _tell(*faults, f"{len(stored)} indentations, {len(faults)} damaged")
        return 1 if faults else 0
    chosen = pruned(stored, None if age_s is None else time.time() - age_s, most)
    try:
        for file in chosen if given.yes else ():
            file.path.unlink(missing_ok=True)
    except OSError as error:
        raise StoreError(f"{file.path} cannot be deleted: {error.strerror or error}.") from error
    verb = "deleted" if given.yes else "would be deleted; --yes deletes"
    freed = sum(file.size for file in chosen) / 1e6
    _tell(f"{len(chosen)} of {len(stored)} indentations, {freed:.1f} MB, {verb}")
    return 0


Command = tuple[str, Callable[[argparse.ArgumentParser], None], Callable[[argparse.Namespace], int | None]]
RUNS = {
    "sweep": _sweep,
    "reduce": _reduce,
    "init": _init,
    "check": _check,
    "view": _view,
    "lab": _lab,
    "store": _store,
    "stream": _stream,
}  # What runs; for any other command `_ask`.
COMMANDS: dict[str, Command] = {
    name: (row["what"], partial(_add, name), RUNS.get(name, partial(_ask, name)))
    for name, row in TABLE.items()
}
"""What each command does, what adds its options, and what runs."""
