"""Types of the values of a description, each with the words of its error."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    Strict,
    ValidationError,
    WrapValidator,
    model_serializer,
)
from pydantic_core import CoreSchema, PydanticCustomError

from fingerpad.core.results import JsonSchema

_FORM = "form "
LISTED, VARIED, NAMED, SPELLED, UNKNOWN = (
    f"{_FORM}{form}" for form in ("listed", "varied", "named", "spelled", "unknown")
)
"""Forms that a part may have; pydantic puts them into the places of errors."""


def form_of(kind: str) -> str:
    """Form of a part of some kind."""
    return f"{_FORM}{kind}"


def kind_of(form: int | str) -> str | None:
    """Kind that a form is of; None of a key or an index."""
    return form.removeprefix(_FORM) if isinstance(form, str) and form.startswith(_FORM) else None


def with_message(words: str, allowed: Collection[Any] | None = None) -> WrapValidator:
    """Give a value one message for any error: what it must be."""

    def checked(value: Any, handler: Callable[[Any], Any]) -> Any:
        refusal = PydanticCustomError(
            "expected", "must be {words}", {"words": words, "allowed": allowed or ()}
        )
        try:
            found = handler(value)
        except ValidationError as error:
            raise refusal from error
        if allowed is not None and found not in allowed:
            raise refusal
        return found

    return WrapValidator(checked)


def choice_of(allowed: Collection[str]) -> WrapValidator:
    """Restrict a value to one of several names."""
    return _Choice(with_message(f"one of {', '.join(allowed)}", allowed).func, names=tuple(allowed))


@dataclass(frozen=True)
class _Choice(WrapValidator):
    """Check of a name, which a JSON schema lists."""

    names: tuple[str, ...] = ()

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchema:
        return handler(core) | {"enum": list(self.names)}


def _at_most(most: int) -> AfterValidator:
    """Refuse a number above `most`, at which memory or a type of numbers ends."""

    def checked(value: int) -> int:
        if value > most:
            raise PydanticCustomError(
                "expected", "must be {words}", {"words": f"at most {most:,}", "allowed": ()}
            )
        return value

    return AfterValidator(checked)


Text = Annotated[str, Field(min_length=1), with_message("a text")]
FiniteNumber = Annotated[float, Field(allow_inf_nan=False), with_message("a finite number")]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False), with_message("a number greater than 0")]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False), with_message("a number not below 0")]
Share = Annotated[float, Field(ge=0, le=1), with_message("a number within 0 ... 1")]
Seed = Annotated[int, Field(ge=0), with_message("a whole number of at least 0"), _at_most(2**63 - 1)]
Count = Annotated[int, Field(ge=1), with_message("a whole number of at least 1"), _at_most(1_000_000)]
Several = Annotated[int, Field(ge=2), with_message("a whole number of at least 2"), _at_most(1_000_000)]
Pair = Annotated[
    tuple[FiniteNumber, ...],
    Strict(False),
    Field(min_length=2, max_length=2),
    with_message("a pair of numbers"),
]
Whole = Annotated[int, with_message("a whole number")]
Truth = Annotated[bool, with_message("true or false")]
Numbers = Annotated[tuple[FiniteNumber, ...], Strict(False), with_message("a list of finite numbers")]
Pairs = Annotated[tuple[Pair, ...], Strict(False), with_message("a list of pairs of numbers")]
Outlines = Annotated[tuple[Pairs, ...], Strict(False), with_message("a list of lists of pairs of numbers")]
Content = Mapping[str, Any]
"""Keys and values of a description, as its file holds them."""
Block = Annotated[dict[str, Any], with_message("a mapping of keys to values")]
"""Keys and values that are checked once it is known what they belong to."""
LevelOrName = Annotated[float | str, Field(union_mode="left_to_right"), with_message("a number or a name")]


def as_list(value: Any) -> Any:
    """Return a list of one for a single name."""
    return [value] if isinstance(value, str) else value


class Part(BaseModel):
    """Base of all parts: unknown keys are refused, nothing is converted, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    @model_serializer(mode="wrap")
    def _as_written(self, dump: SerializerFunctionWrapHandler):  # type: ignore[no-untyped-def]
        """Leave defaults out of files: a default is not always a value that the file may give."""
        return {name: value for name, value in dump(self).items() if name in self.model_fields_set}

    @property
    def given(self) -> dict[str, Any]:
        """The values in the file, without defaults."""
        return self.chosen(*type(self).model_fields)

    def chosen(self, *names: str) -> dict[str, Any]:
        """Those of the names that the file gives a value, and not null, with that value."""
        values = {name: getattr(self, name) for name in names if name in self.model_fields_set}
        return {name: value for name, value in values.items() if value is not None}
