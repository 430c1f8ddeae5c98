"""Typed results: checks on construction, contents of files, and refused files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from fingerpad.core.checked import result_class
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.result_files import from_json, read_format, to_json, write_results
from fingerpad.core.values import Matrix, Number, Vector, WholeVector
from tools.schemas import schema_of


@result_class
class Fold:
    score: Number
    shift_mm: Vector


@result_class
class Found:
    format: Literal["fingerpad test"] = "fingerpad test"
    format_version: Literal[2] = 2
    folds: tuple[Fold, ...]
    rate_hz: Matrix
    counts: WholeVector
    by_name: dict[str, float]


def found() -> Found:
    return Found(
        folds=(Fold(score=np.nan, shift_mm=[0.1, np.nan]), Fold(score=np.float64(0.1) * 3, shift_mm=[])),
        rate_hz=np.array([[1.0, 2.0], [3.0, np.inf]]),
        counts=np.array([1, 2]),
        by_name={"static": np.float32(0.5)},
    )


def test_a_result_comes_back_from_its_json_bit_by_bit_and_is_frozen_arrays_included():
    again = from_json(Found, to_json(found()))
    assert again.folds[1].score == 0.1 * 3
    assert np.isnan(again.folds[0].score)
    np.testing.assert_array_equal(again.folds[0].shift_mm, [0.1, np.nan])
    # What is not finite has one name in a file.
    np.testing.assert_array_equal(again.rate_hz, [[1.0, 2.0], [3.0, np.nan]])
    assert to_json(again) == to_json(found())
    result = found()
    with pytest.raises(AttributeError):
        result.rate_hz = np.zeros((1, 1))  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        result.rate_hz[0, 0] = 5.0


@pytest.mark.parametrize(
    "changed",
    [
        {"rates_hz": [[1.0]]}, {"rate_hz": [1.0]}, {"counts": ["two"]}, {"counts": [None]},
        {"folds": [{"score": 1.0}]},
    ],
)  # fmt: skip
def test_an_unknown_missing_or_unfit_field_is_an_error(changed: dict[str, object]) -> None:
    fields = json.loads(to_json(found())) | changed
    with pytest.raises(InputError) as refused:
        Found(**fields)
    assert refused.value.path[:1] == tuple(changed)
    with pytest.raises(InputError, match=next(iter(changed))):
        from_json(Found, json.dumps(fields).encode())


def test_a_file_meets_its_schema_or_is_not_written(tmp_path: Path) -> None:
    path, schema = tmp_path / "found.json", schema_of(Found)
    write_results(path, found(), schema)
    assert read_format(path, {"fingerpad test": 2}) == json.loads(to_json(found()))
    path.unlink()
    schema["properties"]["absent"] = {"type": "number"}
    schema["required"] = ["absent"]
    with pytest.raises(StoreError, match="absent"):
        write_results(path, found(), schema)
    assert not path.exists()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"{}", "no format"),
        (b'{"format": "fingerpad test", "format_version": 1}', "version 1"),
        (b"[1]", "no format"),
        (b"half of a fi", "cannot be read as JSON"),
    ],
)
def test_a_file_of_another_format_is_refused_with_a_sentence(
    tmp_path: Path, content: bytes, said: str
) -> None:
    path = tmp_path / "found.json"
    path.write_bytes(content)
    with pytest.raises(StoreError, match=said):
        read_format(path, {"fingerpad test": 2})
