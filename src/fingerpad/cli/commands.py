"""The commands: what each says, its options, and what it runs."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any

import fingerpad as fp
from fingerpad.cli.running import command_line, engine, make_writable, progress
from fingerpad.core.errors import InputError, StoreError
from fingerpad.experiments.schemas import request_schema

# What a command runs is imported where it runs: help and version need none of it and come at once.

INCOMPLETE = 3  # Exit status of a validation of which some rows have no prediction.
MOST_FAILED = 99  # Largest exit status for settings of a sweep that failed: larger ones have other meanings.
SECONDS_PER_DAY = 86_400.0
ENDING = "The same command continues after the last finished indentation."

Options = dict[str, Any]


def plain(text: str, option: str = "an option", schema: Any = MappingProxyType({})) -> Any:
    """Return the value that a text of the command line means, as YAML has it; 30,50 is a list."""
    from fingerpad.core.plain_yaml import read_yaml

    kinds = {each.get("type") for each in (schema, *schema.get("anyOf", ()), *schema.get("oneOf", ()))}
    numbers = {"number", "integer", "array", "boolean", "object"} & kinds
    if schema and not numbers:
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
    read = {int: _whole, float: _number}.get(kind, kind)
    metavar = (
        {int: "N", float: "NUMBER", Path: "PATH"}.get(kind, "NAME") if name.startswith("-") else name.upper()
    )
    parser.add_argument(name, type=read, default=default, metavar=metavar, help=words)


def _add_request(name: str, parser: argparse.ArgumentParser, out: str, of_out: str, main: str = "") -> None:
    """Add the options of a request: its fields, and where and how it runs."""
    what = f"YAML file of the request, or {main}." if main else "YAML file of the request."
    parser.add_argument("request", nargs="?", metavar="FILE", help=what)
    option(parser, "--out", of_out, Path, Path(out))
    option(parser, "--jobs", "Number of processes. Default: one per core.", int)
    option(parser, "--scheduler", "Press on the workers of this Dask scheduler, tcp://HOST:PORT.", str)
    option(parser, "--allow-python", "Let the file name objects of Python as module:object.", bool)
    group: Any = parser.add_argument_group("keys of the request, which replace those of the file")
    for key, schema in request_schema(name)["properties"].items():
        words = schema.get("description", "").replace("%", "%%")
        names = [f"--{key}", f"--{key.replace('_', '-')}"][: 1 + ("_" in key)]
        if schema.get("type") == "boolean" or {"type": "boolean"} in schema.get("anyOf", ()):
            group.add_argument(*names, dest=f"key:{key}", action=argparse.BooleanOptionalAction, help=words)
            continue
        choices = schema.get("enum") or schema.get("items", {}).get("enum")
        words += f" One of {', '.join(map(str, choices))}." if choices else ""
        default = schema.get("default")
        words += f" Default: {default}." if isinstance(default, str | int | float) else ""
        group.add_argument(*names, dest=f"key:{key}", metavar="VALUE", help=words)


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"must be a whole number: got {text!r}") from error


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"must be a number: got {text!r}") from error


def _asked(name: str, given: argparse.Namespace, within: Options, main: str = "") -> tuple[Any, Options]:
    """Source of a request, and the keys that replace some of it."""
    schema = request_schema(name)["properties"]
    keys = {
        key.removeprefix("key:"): value if isinstance(value, bool) else plain(value, key, schema[key[4:]])
        for key, value in vars(given).items()
        if key.startswith("key:") and value is not None
    }
    source = given.request
    if main and source is not None and Path(source).suffix not in (".yaml", ".yml"):
        source, keys = None, {main: source} | keys
    if request_schema(name).get("required") and source is None and not keys and not within:
        raise InputError(name, f"needs a file{f', {main}' if main else ''} or options", remedy="see --help")
    return source, keys | within


def _run_request(
    name: str,
    given: argparse.Namespace,
    within: Options,
    main: str = "",
    further_check: Callable[[Any], None] = lambda request: None,
    **more: Any,
) -> Any:
    """Check and run a request, with its files in --out."""
    kind, function = getattr(fp, KINDS[name]), getattr(fp, name)
    source, keys = _asked(name, given, within, main)
    request = kind.read(source, keys, given.allow_python)
    further_check(request)
    request.check()
    by = engine(given.jobs, given.scheduler)
    make_writable(given.out.parent if given.out.suffix in (".npz", ".zarr") else given.out)
    return function(
        request, out=given.out, jobs=by, progress=progress(), command=command_line(),
        allow_python=given.allow_python, **more,
    )  # fmt: skip


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


def _tell(*paragraphs: object) -> None:
    print(*paragraphs, sep="\n")


def _touch(given: argparse.Namespace, within: Options) -> None:
    from fingerpad.export.requests import check_outputs
    from fingerpad.report.results import summary

    found = _run_request("touch", given, within, further_check=check_outputs)
    _tell(*summary("touch", found), *(f"Not verified: {each.text}" for each in found.skin.caveats))
    if (given.out / "touch.html").exists():
        _tell(f"Report: {given.out / 'touch.html'}")
    _tell(f"Results: {given.out / 'touch.json'}")


def _respond(given: argparse.Namespace, within: Options) -> None:
    _tell(_run_request("respond", given, within), f"Results: {given.out / 'spikes.csv'}")


def _fit(given: argparse.Namespace, within: Options) -> None:
    from fingerpad.report.results import summary

    found = _run_request("fit", given, within, "recordings")
    if hasattr(found, "fit"):
        _tell(*summary("fit", found), f"Report: {given.out / 'fit.html'}")
    else:
        _tell(*found.summary())
    _tell(f"Results: {given.out / 'fit.json'}")


def _discriminate(given: argparse.Namespace, within: Options) -> None:
    from fingerpad.report.results import summary

    found = _run_request("discriminate", given, within)
    _tell(
        *summary("discriminate", found),
        f"Report: {given.out / 'discriminate.html'}",
        f"Results: {given.out / 'discriminate.json'}",
    )


def _validate(given: argparse.Namespace, within: Options) -> int:
    from fingerpad.report.results import summary

    found = _run_request("validate", given, within, "observations")
    _tell(
        *summary("validate", found),
        f"Report: {given.out / 'validate.html'}",
        f"Results: {given.out / 'validate.json'}",
    )
    return INCOMPLETE if found.n_predicted < found.n_rows else 0


def _sweep(given: argparse.Namespace, within: Options) -> int:
    from fingerpad.export.sweep import check_sweep
    from fingerpad.export.sweep_results import check_outputs, write_sweep_spikes

    def check(request: fp.SweepRequest) -> None:
        check_sweep(request, given.out, given.yes)
        check_outputs(given.table, given.spikes)

    done = _run_request(
        "sweep", given, within, further_check=check,
        retry_failed=given.retry_failed, any_size=given.yes, store=given.store,
    )  # fmt: skip
    _tell(*done.lines)
    if done.done and given.table is not None:
        _tell(f"Table: {fp.write_sweep_table(fp.open_sweep(given.out), given.table)}")
    if done.done and given.spikes is not None:
        _tell(f"Spikes: {write_sweep_spikes(fp.open_sweep(given.out), given.spikes)}")
    return min(10 + done.failed, MOST_FAILED) if done.failed else 0


def _add_sweep(parser: argparse.ArgumentParser) -> None:
    _add_request("sweep", parser, "sweep.zarr", "The data set, a folder that ends in .zarr.")
    option(parser, "--store", "Folder of stored indentations. Default: indentations, beside --out.")
    option(parser, "--table", "Also write rates as a table, a .csv or .parquet file.")
    option(parser, "--spikes", "Also write the spikes of all settings as a session, a .nwb file.")
    option(parser, "--retry-failed", "Try settings again that failed before.", bool)
    option(parser, "--yes", "Run a sweep of any size.", bool)


def _reduce(given: argparse.Namespace, within: Options) -> None:
    model = _run_request("reduce", given, within)
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


def _reproduce(given: argparse.Namespace, within: Options) -> None:
    from fingerpad.report.reproduction import count_sentence

    found = _run_request("reproduce", given, within)
    _tell(
        f"Report: {given.out / 'report.html'}",
        f"Results: {given.out / 'results.json'}",
        *(count_sentence(found.statements, name) for name in ("paper", "human")),
    )


def _add_init(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", nargs="?", default="touch", metavar="WHAT", help="What it is an example of.")
    option(parser, "--out", "Folder of the file.", Path, Path())
    option(parser, "--list", "List the examples, and exit.", bool)


def _init(given: argparse.Namespace, within: Options) -> None:
    import json

    from fingerpad.core.files import check_new, write_atomically
    from fingerpad.core.values import one_of
    from fingerpad.experiments.examples import examples
    from fingerpad.experiments.schemas import TOUCH_SCHEMA

    if given.list:
        _tell(*(f"{name}: {each.what} ({each.file})" for name, each in examples().items()))
        return
    asked = Path(given.what)
    name = "touch" if asked.suffix in (".yaml", ".yml") else one_of("WHAT", given.what, tuple(examples()))
    example = examples()[name]
    path = given.out / (asked if asked.suffix in (".yaml", ".yml") else example.file)
    check_new(path)
    make_writable(path.parent)
    write_atomically(path, example.text.encode())
    if name == "touch":
        write_atomically(path.parent / TOUCH_SCHEMA, json.dumps(request_schema("touch"), indent=1).encode())
    verb = {".csv": "fit" if name == "recordings" else "validate"}.get(path.suffix, "check")
    _tell(f"Try: fingerpad {verb} {path}")


def _add_file(parser: argparse.ArgumentParser) -> None:
    option(parser, "file", "YAML file of a request.")
    option(parser, "--allow-python", "Let the file name objects of Python as module:object.", bool)


def _check(given: argparse.Namespace, _: Options) -> None:
    """Check a request of any kind, which its keys tell."""
    from fingerpad.core.files import read_text
    from fingerpad.core.plain_yaml import read_yaml
    from fingerpad.export.requests import check_outputs

    content = read_yaml(read_text(given.file), str(given.file)) or {}
    keys = {"grid": "sweep", "zip": "sweep", "sample": "sweep", "range": "reduce", "standard": "discriminate",
            "recordings": "fit", "observations": "validate"}  # fmt: skip
    name = next((kind for key, kind in keys.items() if key in content), "touch")
    request = getattr(fp, KINDS[name]).read(given.file, allow_python=given.allow_python)
    request.check()
    if name == "touch":
        from fingerpad.experiments.requests.touch import estimate_press

        check_outputs(request)
        _tell(*estimate_press(request).lines)
    elif name == "sweep":
        from fingerpad.cli.running import processes
        from fingerpad.experiments.sweep.settings import estimate_sweep

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


def _view(given: argparse.Namespace, _: Options) -> None:
    if given.out.is_dir():
        raise InputError("--out", "must be a file", remedy=f"{given.out} is a folder")
    (written,) = fp.save_view(
        given.out, given.result, field=given.field, time_ms=given.time, frames=given.frames,
        progress=progress(),
    )  # fmt: skip
    _tell(f"Open: {written}")


def _add_lab(parser: argparse.ArgumentParser) -> None:
    ranges = "YAML files of `fingerpad reduce`, each an object. Default: a ball, a cylinder and a plate."
    parser.add_argument("ranges", nargs="*", type=Path, metavar="RANGE", help=ranges)
    option(parser, "--folder", "Where presses and reduced touches are kept.", Path, Path("lab"))
    option(parser, "--port", "Port of the page. Default: one that is free.", int)
    option(parser, "--static", "Write a page that needs no server into this folder.")
    option(parser, "--jobs", "Number of processes. Default: one per core.", int)
    option(parser, "--allow-python", "Let files name objects of Python as module:object.", bool)


def _lab(given: argparse.Namespace, _: Options) -> None:
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
    make_writable(given.static, "--static")
    written = write_static(laboratory, given.static, progress())
    _tell(f"Open: {written} ({written.stat().st_size / 1e6:.1f} MB)")


def _add_store(parser: argparse.ArgumentParser) -> None:
    actions = "list, verify (exit status 1 if a file is damaged) or prune."
    parser.add_argument("action", choices=("list", "verify", "prune"), metavar="ACTION", help=actions)
    option(parser, "folder", "Folder of a run, or its folder `indentations`.")
    option(parser, "--days", "Prune what is older. [days]", float)
    option(parser, "--size", "Prune the oldest until the rest is at most so large. [MB]", float)
    option(parser, "--yes", "Delete; without it, only say what would be.", bool)


def _store(given: argparse.Namespace, _: Options) -> int:
    from fingerpad.core.values import not_negative
    from fingerpad.experiments.runner import STORE_FOLDER
    from fingerpad.skin.store import Store, pruned

    if given.action == "prune" and given.days is None and given.size is None:
        raise InputError("prune", "needs --days, --size or both", "neither")
    age_s = None if given.days is None else SECONDS_PER_DAY * not_negative("--days", given.days, "days")
    most = None if given.size is None else int(1e6 * not_negative("--size", given.size, "MB"))
    inner = given.folder / STORE_FOLDER
    found = inner if inner.is_dir() else given.folder
    if not found.is_dir():
        raise InputError(f"FOLDER must be a folder of stored indentations: {given.folder} is none.")
    files = Store(found).files()
    if found.name != STORE_FOLDER and not files:
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
        faults = {file.path: fault for file in files if (fault := file.fault) is not None}
        _tell(*(f"{path}: {fault}" for path, fault in faults.items()),
              f"{len(files)} indentations, {len(faults)} damaged")  # fmt: skip
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
    return lambda parser: _add_request(name, parser, out or name, of_out, main)


FOLDER = "Folder for page, figures, results and stored indentations."
FILE = "File of the reduced touch; presses are stored beside it."

Command = tuple[
    str, Callable[[argparse.ArgumentParser], None], Callable[[argparse.Namespace, Options], int | None]
]
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
