"""The parts of Numba that are not documented behave as this package expects."""

import re
from pathlib import Path

import numba
import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

import fingerpad
from fingerpad.core.numba_internals import ALIGNMENT, TRIED, is_compiled, small_array

N_ROWS = 3

PRIVATE = re.compile(r"llvmlite|numba\.(?:core|np|extending)\b|\b_cache_file\b")


def test_this_version_of_numba_was_tried():
    version = ".".join(numba.__version__.split(".")[:2])
    assert version in TRIED, (
        f"Numba {numba.__version__} is not one of the versions tried with core/numba_internals.py "
        f"({', '.join(TRIED)}): run the tests of the mechanics with it and, if they pass, add it to TRIED."
    )


def test_undocumented_parts_are_used_in_one_file_only():
    folder = Path(fingerpad.__file__).parent
    users = [path.name for path in folder.rglob("*.py") if PRIVATE.search(path.read_text(encoding="utf-8"))]
    assert users == ["numba_internals.py"]


def test_a_kernel_in_memory_is_compiled_and_anything_else_need_not_be():
    @njit
    def twice(x):
        return 2 * x

    twice(1)
    assert is_compiled(twice)
    assert is_compiled(len)


@njit
def read_and_written(values, results):
    """Copy (3, 5) numbers through two arrays on the stack, one of them handed on to another function."""
    first, second = small_array((N_ROWS, 5)), small_array((5,))
    for i in range(N_ROWS):
        for j in range(5):
            first[i, j] = values[i, j]
    for i in range(N_ROWS):
        second[:] = 0.0
        add(first[i], second)
        for j in range(5):
            results[i, j] = second[j]
    return first.shape, first.strides, first.ctypes.data % ALIGNMENT


@njit
def add(row, total):
    for j in range(len(row)):
        total[j] += row[j]


def test_numbers_stay_where_they_are_put():
    values, results = np.random.default_rng(5).normal(size=(3, 5)), np.empty((3, 5))
    assert read_and_written(values, results) == ((3, 5), (40, 8), 0)
    np.testing.assert_array_equal(results, values)


@njit
def addresses_of_rounds(addresses):
    for k in range(len(addresses)):
        addresses[k] = small_array((64,)).ctypes.data


def test_an_array_made_in_a_loop_takes_memory_once():
    """Else the stack would grow from round to round and overflow in a long loop."""
    addresses = np.empty(100, dtype=np.int64)
    addresses_of_rounds(addresses)
    assert len(set(addresses)) == 1


def test_sizes_must_be_constant():
    @njit
    def of_any_size(shape):
        return small_array(shape).sum()

    for shape in ((3, 4), 3):  # unknown sizes, and no tuple
        with pytest.raises(TypingError, match="needs a tuple of constant sizes"):
            of_any_size(shape)
