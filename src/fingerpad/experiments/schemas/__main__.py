"""`python -m fingerpad.experiments.schemas`: rewrite the JSON schemas of files of results and of touches."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fingerpad.core.files import write_atomically
from fingerpad.core.result_files import file_format, schema_of
from fingerpad.experiments.discrimination.analysis import DiscriminationFile
from fingerpad.experiments.discrimination.request import DiscriminationRequest
from fingerpad.experiments.fit.request import ChosenNumbersFile, FitFile, FitRequest
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.requests.explained import explained_schema
from fingerpad.experiments.requests.parts import Request
from fingerpad.experiments.requests.reduction import ReductionRequest
from fingerpad.experiments.requests.touch import RespondRequest, TouchFile, TouchRequest
from fingerpad.experiments.run import ReproductionRequest
from fingerpad.experiments.schemas import file_name
from fingerpad.experiments.sweep.request import SweepRequest
from fingerpad.experiments.validation.request import ValidationRequest
from fingerpad.experiments.validation.validation import ValidationFile

RESULT_FILES: tuple[type, ...] = (
    ReproductionResult,
    FitFile,
    ChosenNumbersFile,
    DiscriminationFile,
    ValidationFile,
    TouchFile,
)
"""Classes of results that are written to a file of their own."""

REQUESTS: dict[str, type[Request]] = {
    "touch": TouchRequest,
    "respond": RespondRequest,
    "fit": FitRequest,
    "discriminate": DiscriminationRequest,
    "validate": ValidationRequest,
    "sweep": SweepRequest,
    "reduce": ReductionRequest,
    "reproduce": ReproductionRequest,
}
"""Requests by the names of their commands."""


def write_schemas(folder: Path = Path(__file__).parent) -> None:
    """Write the schemas into a folder, that of the package by default."""
    for results in RESULT_FILES:
        content = json.dumps(structure(schema_of(results)), indent=1).encode()
        write_atomically(folder / file_name(file_format(results)[0]), content)
    for name, request in REQUESTS.items():
        content = json.dumps(explained_schema(request), indent=1).encode()
        write_atomically(folder / f"fingerpad-{name}-request.schema.json", content)


def structure(schema: Any) -> Any:
    """Return a schema without titles and descriptions: a docstring is no part of a format."""
    if isinstance(schema, list):
        return [structure(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    named = ("properties", "$defs")
    return {
        # A text may be a name, and how an object of Python is shown: two forms that are one here.
        {"oneOf": "anyOf"}.get(key, key): (
            {name: structure(item) for name, item in value.items()} if key in named else structure(value)
        )
        for key, value in schema.items()
        if key not in ("title", "description")
    }


if __name__ == "__main__":
    write_schemas()
