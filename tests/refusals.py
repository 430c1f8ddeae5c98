"""What is refused: an `InputError` that leads to what cannot be used, or says why it cannot."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from fingerpad import InputError

Told = str | tuple[int | str, ...]


@contextmanager
def refused(*path: int | str) -> Iterator[None]:
    """Expect an `InputError` with this path."""
    with pytest.raises(InputError) as error:
        yield
    assert error.value.path == path, str(error.value)


def refusals(*rows: tuple[object, Told], call: Callable = lambda wrong: wrong()) -> Callable:
    """Make a test of what is refused: a path stands for itself, a text is a pattern of the sentence."""

    @pytest.mark.parametrize(("wrong", "told"), rows)
    def test(wrong, told):
        with pytest.raises(InputError) as error:
            call(wrong)
        assert "\n" not in str(error.value)
        if isinstance(told, tuple):
            assert error.value.path == told, str(error.value)
        else:
            assert re.search(told, str(error.value))

    return test


def misused(outcome: tuple[int, str, str], said: str, program: str = "fingerpad") -> None:
    """Check the outcome of a misused command: status 2 and one sentence of errors, which says this."""
    status, out, errors = outcome
    assert (status, out) == (2, "")
    assert re.fullmatch(rf"{program}: .*[^.][.?]\n", errors), errors
    assert said in errors
