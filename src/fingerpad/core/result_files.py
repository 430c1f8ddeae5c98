"""Files of results: JSON of a class that `result_class` makes, NaN as null, checked by a schema."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import fastjsonschema
from pydantic import TypeAdapter, ValidationError

from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.files import LARGEST_TEXT_MB, check_file, write_atomically
from fingerpad.core.values import JsonObject, JsonSchema

_Kind = TypeVar("_Kind")


def to_json(result: Any) -> bytes:
    """JSON of a result, null for NaN."""
    return TypeAdapter(type(result)).dump_json(result, indent=1)


def from_json(cls: type[_Kind], content: bytes) -> _Kind:
    """Read a result from its JSON."""
    try:
        return TypeAdapter(cls).validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"]) or "the file"
        raise InputError(f"{place} is not as {cls.__name__} needs it: {first['msg']}.") from error


def write_results(path: Path, results: Any, schema: JsonSchema) -> None:
    """Write a file of results atomically."""
    content = to_json(results)
    check_schema(path, json.loads(content), schema)
    write_atomically(path, content + b"\n")


def check_schema(path: Path, values: JsonObject, schema: JsonSchema) -> None:
    """Raise `StoreError` if the values of a file do not meet a JSON schema."""
    try:
        fastjsonschema.compile(schema)(values)
    except fastjsonschema.JsonSchemaValueException as error:
        raise StoreError(
            f"{path} must meet the schema of its format: {error.message}; run the command again, or, after a "
            "change of a type, `python -m tools.schemas`."
        ) from error


def read_format(path: Path, versions: Mapping[str, int]) -> JsonObject:
    """Read the JSON values of a file whose format and version are known."""
    try:
        values = json.loads(check_file(path, LARGEST_TEXT_MB).read_bytes())
    except InputError as error:
        raise StoreError(str(error)) from error
    except (OSError, ValueError, RecursionError) as error:
        said = "nested too deep" if isinstance(error, RecursionError) else error
        raise StoreError(f"{path} cannot be read as JSON ({said}): run the command again.") from error
    found = (values.get("format"), values.get("format_version")) if isinstance(values, dict) else (None, None)
    if found not in versions.items():
        wanted = " or ".join(f"{name}, version {version}" for name, version in versions.items())
        came = "no format" if found[0] is None else f"{found[0]}, version {found[1]}"
        raise StoreError(
            f"{path} must have the format {wanted}: got {came}; run the command again to write it anew."
        )
    return values
