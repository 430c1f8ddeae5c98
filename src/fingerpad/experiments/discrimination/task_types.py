"""What a key of a question may hold: kinds of values, each with the words for what it must be."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError, WrapValidator
from pydantic_core import PydanticCustomError


def expected(words: str, allowed: Collection[Any] | None = None) -> WrapValidator:
    """Let a part of a question say in a few words what it must be, whatever is wrong with it.

    Parameters
    ----------
    words : str
        Goes on after "must be".
    allowed : collection, optional
        The values that it may have.

    Returns
    -------
    WrapValidator
        For the annotation of a field.

    Examples
    --------
    >>> from pydantic import TypeAdapter
    >>> try:
    ...     TypeAdapter(Positive).validate_python(-1.0)
    ... except ValidationError as error:
    ...     print(error.errors()[0]["msg"])
    must be a number greater than 0
    """

    def checked(value: Any, handler: Callable[[Any], Any]) -> Any:
        try:
            found = handler(value)
        except ValidationError as error:
            raise PydanticCustomError("expected", "must be {words}", {"words": words}) from error
        if allowed is not None and found not in allowed:
            raise PydanticCustomError("expected", "must be {words}", {"words": words})
        return found

    return WrapValidator(checked)


def one_of(allowed: Collection[str]) -> WrapValidator:
    """Let a part of a question be one of several names.

    Examples
    --------
    >>> from pydantic import TypeAdapter
    >>> TypeAdapter(Annotated[str, one_of(("mean", "sum"))]).validate_python("sum")
    'sum'
    """
    return expected(f"one of {', '.join(allowed)}", allowed)


Text = Annotated[str, Field(min_length=1), expected("a text")]
Number = Annotated[float, Field(allow_inf_nan=False), expected("a finite number")]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False), expected("a number greater than 0")]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False), expected("a number not below 0")]
Share = Annotated[float, Field(ge=0, le=1), expected("a number within 0 ... 1")]
Seed = Annotated[int, Field(ge=0), expected("a whole number of at least 0")]
Count = Annotated[int, Field(ge=1), expected("a whole number of at least 1")]
Several = Annotated[int, Field(ge=2), expected("a whole number of at least 2")]
Pair = Annotated[
    tuple[Number, ...], Strict(False), Field(min_length=2, max_length=2), expected("a pair of numbers")
]
Place = Annotated[float | str, Field(union_mode="left_to_right"), expected("a number or a name")]


def as_list(value: Any) -> Any:
    """Let one stand for a list of one."""
    return [value] if isinstance(value, str) else value


class Part(BaseModel):
    """What all parts share: unknown keys are refused, nothing is converted, nothing changes."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    @property
    def given(self) -> dict[str, Any]:
        """What the file says itself, without defaults."""
        return self.chosen(*type(self).model_fields)

    def chosen(self, *names: str) -> dict[str, Any]:
        """Those of the names that the file gives a value, and not null, with that value."""
        values = {name: getattr(self, name) for name in names if name in self.model_fields_set}
        return {name: value for name, value in values.items() if value is not None}
