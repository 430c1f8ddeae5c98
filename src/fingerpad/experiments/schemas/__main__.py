"""`python -m fingerpad.experiments.schemas`: rewrite the JSON schema of every file of results."""

from __future__ import annotations

from pathlib import Path

from fingerpad.core.files import write_json
from fingerpad.core.results import file_format, schema_of
from fingerpad.experiments.discrimination.run import DiscriminationFile
from fingerpad.experiments.fit.session import FitFile
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.schemas import file_name

RESULT_FILES: tuple[type, ...] = (ReproductionResult, FitFile, DiscriminationFile)
"""Classes of results that are written to a file of their own."""


def write_schemas(folder: Path = Path(__file__).parent) -> None:
    """Write the schemas into a folder, that of the package by default."""
    for results in RESULT_FILES:
        write_json(folder / file_name(file_format(results)[0]), schema_of(results))


if __name__ == "__main__":
    write_schemas()
