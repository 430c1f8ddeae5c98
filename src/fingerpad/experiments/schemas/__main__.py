"""`python -m fingerpad.experiments.schemas`: rewrite the JSON schemas of files of results and of touches."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fingerpad.core.files import write_atomically
from fingerpad.core.result_files import file_format, schema_of
from fingerpad.experiments.descriptions.explained import explained_schema
from fingerpad.experiments.descriptions.pressed import TouchFile
from fingerpad.experiments.descriptions.touch import TouchDescription
from fingerpad.experiments.discrimination.run import DiscriminationFile
from fingerpad.experiments.fit.session import ChosenNumbersFile, FitFile
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.schemas import TOUCH_SCHEMA, file_name
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


def write_schemas(folder: Path = Path(__file__).parent) -> None:
    """Write the schemas into a folder, that of the package by default."""
    for results in RESULT_FILES:
        content = json.dumps(structure(schema_of(results)), indent=1).encode()
        write_atomically(folder / file_name(file_format(results)[0]), content)
    content = json.dumps(explained_schema(TouchDescription), indent=1).encode()
    write_atomically(folder / TOUCH_SCHEMA, content)


def structure(schema: Any) -> Any:
    """Return a schema without titles and descriptions: a docstring is no part of a format."""
    if isinstance(schema, list):
        return [structure(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    named = ("properties", "$defs")
    return {
        key: {name: structure(item) for name, item in value.items()} if key in named else structure(value)
        for key, value in schema.items()
        if key not in ("title", "description")
    }


if __name__ == "__main__":
    write_schemas()
