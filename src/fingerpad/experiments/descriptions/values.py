"""What all parts of files share: forms of a value, values that have one message, and the base of parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    ValidationInfo,
    WrapValidator,
    model_serializer,
)

from fingerpad.core.errors import InputError, shown

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


def with_message(words: str) -> WrapValidator:
    """Give a value of several types one message for any error: what it must be."""

    def validated(value: Any, handler: Callable[[Any], Any], info: ValidationInfo) -> Any:
        try:
            return handler(value)
        except ValidationError as error:
            raise InputError(info.field_name or "value", f"must be {words}", shown(value)) from error

    return WrapValidator(validated)


Content = Mapping[str, Any]
"""Keys and values of a description, as its file holds them."""
Block = Annotated[dict[str, Any], with_message("a mapping of keys to values")]
"""Keys and values that are checked once it is known what they belong to."""
LevelOrName = Annotated[float | str, Field(union_mode="left_to_right"), with_message("a number or a name")]


def as_list(value: Any) -> Any:
    """Return a list of one for a single name."""
    return [value] if isinstance(value, str) else value


class Part(BaseModel):
    """Base of all parts: unknown keys are refused, values are frozen."""

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
