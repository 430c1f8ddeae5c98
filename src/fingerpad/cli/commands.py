"""The commands: what each says, its options, and what it runs."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import fingerpad as fp
from fingerpad.cli.running import command_line, engine, processes, progress
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.files import make_writable
from fingerpad.experiments.schemas import request_schema

# What a command runs is imported where it runs: help and version need none of it and come at once.

INCOMPLETE = 3  # Exit status of a validation of which some rows have no prediction.
MOST_FAILED = 99  # Largest exit status for settings of a sweep that failed: larger ones have other meanings.
SECONDS_PER_DAY = 86_400.0
ENDING = "The same command continues after the last finished indentation."
KEY = "key:"  # Begin of what argparse calls the value of a key of the request.

KINDS = {
    "touch": "TouchRequest",
    "respond": "RespondRequest",
    "fit": "FitRequest",
    "discriminate": "DiscriminationRequest",
    "validate": "ValidationRequest",
    "sweep": "SweepRequest",
    "reduce": "ReductionRequest",
    "reproduce": "ReproductionRequest",
}
"""Public name of the request of each command."""


def plain(text: str, option: str, schema: Mapping[str, Any]) -> Any:
    """Return the value that a text of the command line means, as YAML has it; 30,50 is a list."""
    from fingerpad.core.plain_yaml import read_yaml

    kinds = {each.get("type") for each in (schema, *schema.get("anyOf", ()), *schema.get("oneOf", ()))}
    if schema and not {"number", "integer", "array", "boolean", "object"} & kinds:
        return text
    if "," in text and text[0] not in "[{" and (not schema or "array" in kinds):
        return [read_yaml(part.strip(), option) for part in text.split(",") if part.strip()]
    return read_yaml(text, option)


def option(
    parser: argparse.ArgumentParser, name: str, words: str, kind: Any = Path, default: Any = None
) -> None:
    """Add an option, or an argument if its name has no dashes."""
    words = words if default in (None, False) else f"{words} Default: {default}."
    if kind is bool:
        parser.add_argument(name, action="store_true", help=words)
        return
    metavar = {int: "N", float: "NUMBER", Path: "PATH"}.get(kind, "NAME")
    metavar = metavar if name.startswith("-") else name.upper()
    read = partial(_read, kind) if kind in (int, float) else kind
    parser.add_argument(name, type=read, default=default, metavar=metavar, help=words)


def _read(kind: type[int] | type[float], text: str) -> float:
    try:
        return kind(text)
    except ValueError as error:
        expected = "must be a whole number" if kind is int else "must be a number"
        raise argparse.ArgumentTypeError(f"{expected}: got {text!r}") from error


def _add_request(name: str, out: str, of_out: str, main: str, parser: argparse.ArgumentParser) -> None:
    """Add the options of a request: its fields, and where and how it runs."""
    what = f"YAML file of the request{f', or {main}' if main else ''}."
    parser.add_argument("request", nargs="?", metavar="FILE", help=what)
    option(parser, "--out", of_out, Path, Path(out))
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
    schema, kind = request_schema(name), getattr(fp, KINDS[name])
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
        for place in (tuple(key.split(".")) for key in keys):
            if error.path[: len(place)] == place:
                named = error.where.replace(place[0], f"--{place[0].replace('_', '-')}", 1)
                raise error.at(error.path, named).from_source("") from error
        raise


def _tell(*paragraphs: object) -> None:
    print(*paragraphs, sep="\n")


def _tell_files(folder: Path, page: str, results: str) -> None:
    if (folder / page).exists():
        _tell(f"Report: {folder / page}")
    _tell(f"Results: {folder / results}")


def _touch(given: argparse.Namespace) -> None:
    from fingerpad.report.results import summary

    found = _run_request("touch", given)
    _tell(*summary("touch", found), *(f"Not verified: {each.text}" for each in found.skin.caveats))
    _tell_files(given.out, "touch.html", "touch.json")


def _respond(given: argparse.Namespace) -> None:
    _tell(_run_request("respond", given), f"Results: {given.out / 'spikes.csv'}")


def _fit(given: argparse.Namespace) -> None:
    from fingerpad.report.results import summary

    found = _run_request("fit", given)
    _tell(*(summary("fit", found) if hasattr(found, "fit") else found.summary()))
    _tell_files(given.out, "fit.html", "fit.json")


def _discriminate(given: argparse.Namespace) -> None:
    from fingerpad.report.results import summary

    _tell(*summary("discriminate", _run_request("discriminate", given)))
    _tell_files(given.out, "discriminate.html", "discriminate.json")


def _validate(given: argparse.Namespace) -> int:
    from fingerpad.report.results import summary

    found = _run_request("validate", given)
    _tell(*summary("validate", found))
    _tell_files(given.out, "validate.html", "validate.json")
    return INCOMPLETE if found.n_predicted < found.n_rows else 0


def _add_sweep(parser: argparse.ArgumentParser) -> None:
    _add_request("sweep", "sweep.zarr", "The data set, a folder that ends in .zarr.", "", parser)
    option(parser, "--store", "Folder of stored indentations. Default: indentations, beside --out.")
    option(parser, "--table", "Also write rates as a table, a .csv or .parquet file.")
    option(parser, "--spikes", "Also write the spikes of all settings as a session, a .nwb file.")
    option(parser, "--retry-failed", "Try settings again that failed before.", bool)
    option(parser, "--yes", "Run a sweep of any size.", bool)


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


def _reproduce(given: argparse.Namespace) -> None:
    from fingerpad.report.reproduction import count_sentence

    found = _run_request("reproduce", given)
    _tell_files(given.out, "report.html", "results.json")
    _tell(*(count_sentence(found.statements, name) for name in ("paper", "human")))


def _add_init(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", nargs="?", default="touch", metavar="WHAT", help="What it is an example of.")
    option(parser, "--out", "Folder of the file.", Path, Path())
    option(parser, "--list", "List the examples, and exit.", bool)


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


def _add_file(parser: argparse.ArgumentParser) -> None:
    option(parser, "file", "YAML file of a request.")
    option(parser, "--allow-python", "Let the file name objects of Python as module:object.", bool)


def _check(given: argparse.Namespace) -> None:
    """Check a request of any kind, which its keys tell."""
    from fingerpad.core.files import read_text
    from fingerpad.core.plain_yaml import read_yaml
    from fingerpad.experiments.requests.touch import estimate_press
    from fingerpad.experiments.sweep.settings import estimate_sweep
    from fingerpad.export.requests import check_outputs

    content = read_yaml(read_text(given.file), str(given.file)) or {}
    keys = {"grid": "sweep", "zip": "sweep", "sample": "sweep", "range": "reduce", "standard": "discriminate",
            "recordings": "fit", "observations": "validate"}  # fmt: skip
    name = next((kind for key, kind in keys.items() if key in content), "touch")
    request = getattr(fp, KINDS[name]).read(given.file, allow_python=given.allow_python)
    request.check()
    if name == "touch":
        check_outputs(request)
        _tell(*estimate_press(request).lines)
    elif name == "sweep":
        _tell(*estimate_sweep(request, processes(None)).lines)
    else:
        _tell(f"The request is possible: try fingerpad {name} {given.file}")


def _add_view(parser: argparse.ArgumentParser) -> None:
    option(parser, "result", "Touch as .nc or .zarr, or the folder that holds touch.nc or touch.zarr.")
    option(parser, "--out", "File: .png, .gif, or .mp4 with the program ffmpeg.", Path, Path("view.png"))
    fields = "sed, displacement, pressure, shear, slip, or another variable of RESULT."
    option(parser, "--field", fields, str, "sed")
    option(parser, "--time", "Time of a picture. Default: that of the largest depth. [ms]", float)
    option(parser, "--frames", "Number of pictures of a film.", int, 40)


def _view(given: argparse.Namespace) -> None:
    if given.out.is_dir():
        raise InputError("--out", "must be a file", remedy=f"{given.out} is a folder")
    shown = {"field": given.field, "time_ms": given.time, "frames": given.frames}
    (written,) = fp.save_view(given.out, given.result, **shown, progress=progress())
    _tell(f"Open: {written}")


def _add_lab(parser: argparse.ArgumentParser) -> None:
    ranges = "YAML files of `fingerpad reduce`, each an object. Default: a ball, a cylinder and a plate."
    parser.add_argument("ranges", nargs="*", type=Path, metavar="RANGE", help=ranges)
    option(parser, "--folder", "Where presses and reduced touches are kept.", Path, Path("lab"))
    option(parser, "--port", "Port of the page. Default: one that is free.", int)
    option(parser, "--static", "Write a page that needs no server into this folder.")
    option(parser, "--jobs", "Number of processes. Default: one per core.", int)
    option(parser, "--allow-python", "Let files name objects of Python as module:object.", bool)


def _lab(given: argparse.Namespace) -> None:
    from fingerpad.lab.laboratory import Laboratory
    from fingerpad.lab.server import require_panel, serve
    from fingerpad.lab.static import write_static

    if given.static is None:
        require_panel()
    laboratory = Laboratory(given.folder, given.ranges, engine(given.jobs, None), given.allow_python)
    make_writable(given.folder, "--folder")
    if given.static is None:
        serve(laboratory, given.port or 0, lambda address: _tell(f"Open: {address}"))
        return
    written = write_static(laboratory, make_writable(given.static, "--static"), progress())
    _tell(f"Open: {written} ({written.stat().st_size / 1e6:.1f} MB)")


def _add_store(parser: argparse.ArgumentParser) -> None:
    actions = "list, verify (exit status 1 if a file is damaged) or prune."
    parser.add_argument("action", choices=("list", "verify", "prune"), metavar="ACTION", help=actions)
    option(parser, "folder", "Folder of a run, or its folder `indentations`.")
    option(parser, "--days", "Prune what is older. [days]", float)
    option(parser, "--size", "Prune the oldest until the rest is at most so large. [MB]", float)
    option(parser, "--yes", "Delete; without it, only say what would be.", bool)


def _store(given: argparse.Namespace) -> int:
    from fingerpad.core.values import not_negative
    from fingerpad.experiments.runner import STORE_FOLDER
    from fingerpad.skin.store import Store, pruned

    if given.action == "prune" and given.days is None and given.size is None:
        raise InputError("prune", "needs --days, --size or both", "neither")
    age_s = None if given.days is None else SECONDS_PER_DAY * not_negative("--days", given.days, "days")
    most = None if given.size is None else int(1e6 * not_negative("--size", given.size, "MB"))
    inner = given.folder / STORE_FOLDER
    folder = inner if inner.is_dir() else given.folder
    files = Store(folder).files()
    if not files and not (folder.name == STORE_FOLDER and folder.is_dir()):
        raise InputError(
            f"FOLDER must hold stored indentations: {given.folder} has none; name that of a run."
        )
    if given.action == "list":
        for file in files:
            written = datetime.fromtimestamp(file.written_s, UTC).strftime("%Y-%m-%d %H:%M")
            _tell(f"{file.path.stem}  {file.size / 1e6:8.2f} MB  {written} UTC")
        _tell(f"{len(files)} indentations, {sum(file.size for file in files) / 1e6:.1f} MB")
        return 0
    if given.action == "verify":
        faults = [f"{file.path}: {fault}" for file in files if (fault := file.fault) is not None]
        _tell(*faults, f"{len(files)} indentations, {len(faults)} damaged")
        return 1 if faults else 0
    chosen = pruned(files, None if age_s is None else time.time() - age_s, most)
    try:
        for file in chosen if given.yes else ():
            file.path.unlink(missing_ok=True)
    except OSError as error:
        raise StoreError(f"{file.path} cannot be deleted: {error.strerror or error}.") from error
    verb = "deleted" if given.yes else "would be deleted; --yes deletes"
    freed = sum(file.size for file in chosen) / 1e6
    _tell(f"{len(chosen)} of {len(files)} indentations, {freed:.1f} MB, {verb}")
    return 0


def _of(name: str, of_out: str, out: str = "", main: str = "") -> Callable[[argparse.ArgumentParser], None]:
    return partial(_add_request, name, out or name, of_out, main)


FOLDER = "Folder for page, figures, results and stored indentations."
FILE = "File of the reduced touch; presses are stored beside it."

Command = tuple[str, Callable[[argparse.ArgumentParser], None], Callable[[argparse.Namespace], int | None]]
COMMANDS: dict[str, Command] = {
    "touch": ("Press an object into a finger, and let afferents respond.", _of("touch", FOLDER), _touch),
    "respond": ("Let afferents respond to a touch.", _of("respond", FOLDER), _respond),
    "fit": (
        "Fit an afferent to recordings: firing rates or spike times under known stimuli.",
        _of("fit", FOLDER, main="the recordings"), _fit,
    ),
    "discriminate": (
        "Predict hit rates, psychometric curves and thresholds of a discrimination task.",
        _of("discriminate", FOLDER, main="the name of an example"), _discriminate,
    ),
    "validate": (
        "Score the model against observations of force, deflection or firing rates.",
        _of("validate", FOLDER, main="the observations"), _validate,
    ),
    "sweep": ("Press all settings of a sweep, and write one labelled data set.", _add_sweep, _sweep),
    "reduce": (
        "Press a range of poses in full, and make a reduced touch that answers within a millisecond.",
        _of("reduce", FILE, "reduced.npz"), _reduce,
    ),
    "reproduce": (
        "Reproduce Gerling et al. (2014): the paper's own system, then the set human, beside the paper.",
        _of("reproduce", FOLDER, "reproduction"), _reproduce,
    ),
    "init": ("Write an example: a touch, recordings, observations or a task.", _add_init, _init),
    "check": ("Check a request and press nothing; time and memory of a touch or a sweep.", _add_file, _check),
    "view": ("Draw a touch in three dimensions, as a picture or a film.", _add_view, _view),
    "lab": ("Press objects into the finger in the browser, on this computer alone.", _add_lab, _lab),
    "store": ("List, verify or prune the stored indentations of a folder.", _add_store, _store),
}  # fmt: skip
"""What each command does, its options, and what runs."""
