"""Results: frozen dataclasses that are checked on construction, written as JSON and described by a schema.

A class of results is declared with `@result_class`. Its fields say what a file holds: names carry units,
types carry shapes (`Vector`, `Matrix`, `Array`), and a misspelt or missing field is an error. `to_json` and
`from_json` convert between an instance and JSON; NaN is null there. `schema_of` gives the JSON schema.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Protocol, TypeVar, dataclass_transform

import fastjsonschema
import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BeforeValidator,
    ConfigDict,
    GetPydanticSchema,
    PlainSerializer,
    TypeAdapter,
    ValidationError,
    WithJsonSchema,
    model_validator,
)
from pydantic.dataclasses import dataclass
from pydantic_core import ArgsKwargs, core_schema

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.files import LARGEST_TEXT_MB, check_file, write_atomically

JsonSchema = dict[str, Any]  # JSON schema, as `json` reads it.

_Kind = TypeVar("_Kind")


def _array(dtype: type, ndim: int | None, item: JsonSchema) -> GetPydanticSchema:
    """Make the validation, JSON and schema of a read-only array; null stands for NaN."""

    def validated(value: Any) -> NDArray[Any]:
        try:
            array: NDArray[Any] = np.array(value, dtype=dtype)
        except TypeError as error:  # which pydantic does not take for an unfit value
            raise ValueError(f"must hold numbers of type {np.dtype(dtype)}") from error
        if ndim is not None and array.ndim != ndim:
            if array.size == 0 and array.ndim < ndim:
                array = array.reshape((0,) * ndim)
            else:
                raise ValueError(f"must have {ndim} dimension(s): got shape {array.shape}")
        array.setflags(write=False)
        return array

    def schema(source: Any, handler: Any) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(
            validated, serialization=core_schema.plain_serializer_function_ser_schema(_listed)
        )

    json_schema = dict(item)
    for _ in range(ndim or 0):
        json_schema = {"type": "array", "items": json_schema}
    if ndim is None:
        json_schema = {"type": ["array", "number", "null"]}
    return GetPydanticSchema(schema, lambda core, handler: json_schema)


def _listed(array: NDArray[Any]) -> Any:
    """Nested lists of an array, with None for what is not finite."""
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        values = array.astype(object)
        values[~np.isfinite(array)] = None
        return values.tolist()
    return array.tolist()


_NUMBER = {"type": ["number", "null"]}
_WHOLE = {"type": "integer"}
_TRUTH = {"type": "boolean"}

Array = Annotated[FloatArray, _array(np.float64, None, _NUMBER)]  # Float array of any shape.
Vector = Annotated[FloatArray, _array(np.float64, 1, _NUMBER)]  # Float array (n,).
Matrix = Annotated[FloatArray, _array(np.float64, 2, _NUMBER)]  # Float array (n, m).
Stack = Annotated[FloatArray, _array(np.float64, 3, _NUMBER)]  # Float array (n, m, k).
WholeVector = Annotated[NDArray[np.int64], _array(np.int64, 1, _WHOLE)]  # Integer array (n,).
TruthVector = Annotated[NDArray[np.bool_], _array(np.bool_, 1, _TRUTH)]  # Boolean array (n,).
TruthMatrix = Annotated[NDArray[np.bool_], _array(np.bool_, 2, _TRUTH)]  # Boolean array (n, m).
Number = Annotated[
    float,
    BeforeValidator(lambda value: np.nan if value is None else value),
    PlainSerializer(lambda value: value if np.isfinite(value) else None),
    WithJsonSchema(_NUMBER),
]
"""A float that may be NaN, which is null in a file."""


class ResultFile(Protocol):
    """Results that are a file of their own: both fields are literals with a default."""

    @property
    def format(self) -> str:
        """Name of the format; the schema of that name lies in the package."""
        ...

    @property
    def format_version(self) -> int:
        """Raised when a reader of the version before would not understand the file."""
        ...


@dataclass_transform(frozen_default=True, kw_only_default=True)
def result_class(cls: type[_Kind]) -> type[_Kind]:
    """Make a class a frozen dataclass with named fields that are checked on construction."""
    cls._plain_scalars = model_validator(mode="before")(_plain_scalars)  # type: ignore[attr-defined]
    made: Any = dataclass(frozen=True, kw_only=True, config=ConfigDict(extra="forbid"))(cls)
    return made


def _plain_scalars(values: Any) -> Any:
    """Python's numbers in the place of NumPy's scalars, in fields and in what they nest."""
    if isinstance(values, ArgsKwargs):
        return ArgsKwargs(values.args, _plain(values.kwargs or {}))
    return _plain(values) if isinstance(values, Mapping) else values


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {_plain(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_plain(item) for item in value) if type(value) in (list, tuple) else value
    return value


def to_json(result: Any, indent: int | None = 1) -> bytes:
    """JSON of a result, null for NaN."""
    return TypeAdapter(type(result)).dump_json(result, indent=indent)


def from_json(cls: type[_Kind], content: bytes) -> _Kind:
    """Read a result from its JSON."""
    try:
        return TypeAdapter(cls).validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"]) or "the file"
        raise InputError(f"{place} is not as {cls.__name__} needs it: {first['msg']}.") from error


def schema_of(cls: type) -> JsonSchema:
    """JSON schema of a class of results, as a file holds it."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema"} | TypeAdapter(cls).json_schema(
        mode="serialization"
    )


def write_results(path: Path, results: ResultFile, schema: JsonSchema) -> None:
    """Write a file of results atomically."""
    content = to_json(results)
    check_schema(path, json.loads(content), schema)
    write_atomically(path, content + b"\n")


def check_schema(path: Path, values: dict[str, Any], schema: JsonSchema) -> None:
    """Raise `StoreError` if the values of a file do not meet a JSON schema."""
    try:
        fastjsonschema.compile(schema)(values)
    except fastjsonschema.JsonSchemaValueException as error:
        raise StoreError(
            f"{path} must meet the schema of its format: {error.message}; run the command again, or, after a "
            "change of a type, `python -m fingerpad.experiments.schemas`."
        ) from error


def read_results(path: Path, cls: type[_Kind]) -> _Kind:
    """Read a file of results."""
    content, _ = _json_of_format(path, dict([file_format(cls)]))
    try:
        return from_json(cls, content)
    except InputError as error:
        raise StoreError(f"{path} is damaged: {error} Run the command again.") from error


def read_format(path: Path, versions: Mapping[str, int]) -> dict[str, Any]:
    """Read the JSON values of a file whose format and version are known."""
    return _json_of_format(path, versions)[1]


def _json_of_format(path: Path, versions: Mapping[str, int]) -> tuple[bytes, dict[str, Any]]:
    """Content of a file and its JSON values: the classes of some fields accept texts only from JSON."""
    try:
        content = check_file(path, LARGEST_TEXT_MB).read_bytes()
        values = json.loads(content)
    except RecursionError as error:
        raise StoreError(
            f"{path} cannot be read as JSON (nested too deep): run the command again."
        ) from error
    except InputError as error:
        raise StoreError(str(error)) from error
    except (OSError, ValueError) as error:
        raise StoreError(f"{path} cannot be read as JSON ({error}): run the command again.") from error
    found = (values.get("format"), values.get("format_version")) if isinstance(values, dict) else (None, None)
    if found not in versions.items():
        wanted = " or ".join(f"{name}, version {version}" for name, version in versions.items())
        came = "no format" if found[0] is None else f"{found[0]}, version {found[1]}"
        raise StoreError(
            f"{path} must have the format {wanted}: got {came}; run the command again to write it anew."
        )
    return content, values


def file_format(cls: Any) -> tuple[str, int]:
    """Format and version that a class of result files declares."""
    declared = cls.__dataclass_fields__
    return declared["format"].default, declared["format_version"].default
