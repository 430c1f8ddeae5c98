"""JSON schemas of the files of results, generated from their types; a file is checked before it is written.

`python -m tools.schemas` rewrites them after a change of a type.
"""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the help of commands needs schemas alone
    from fingerpad.core.values import JsonObject, JsonSchema


TOUCH_SCHEMA = "fingerpad-touch.schema.json"  # Schema of the request of a touch, from which editors complete.


@cache
def schema(file_format: str) -> JsonSchema:
    """JSON schema of a format, as packaged."""
    return _packaged(file_name(file_format))


@cache
def request_schema(name: str) -> JsonSchema:
    """JSON schema of a request, with its explanations, by the name of its command."""
    return _packaged(f"fingerpad-{name}-request.schema.json")


def _packaged(name: str) -> JsonSchema:
    return json.loads((files(__name__) / name).read_text(encoding="utf-8"))


def file_name(file_format: str) -> str:
    """Name of the file that holds the schema of a format."""
    return file_format.replace(" ", "-") + ".schema.json"


def write(path: Path, results: Any) -> None:
    """Write a file of results that meets the schema of its format."""
    from fingerpad.core.result_files import write_results

    write_results(path, results, schema(results.format))


def read(path: Path, *formats: str) -> JsonObject:
    """Read the values of a file of results without its types; it may have any format if none is named."""
    from fingerpad.core.result_files import check_schema, read_format

    known = formats or all_formats()
    versions = {name: schema(name)["properties"]["format_version"]["const"] for name in known}
    values = read_format(path, versions)
    check_schema(path, values, schema(values["format"]))
    return values


def all_formats() -> list[str]:
    """Names of the formats of all files of results."""
    names = sorted(entry.name for entry in files(__name__).iterdir() if entry.name.endswith(".schema.json"))
    return [_packaged(name)["properties"]["format"]["const"] for name in names if "-request." not in name]
