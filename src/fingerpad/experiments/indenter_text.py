"""Indenters as files and options write them: a name with sizes, such as `punch:6.35`."""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache

from fingerpad.core.errors import InputError
from fingerpad.core.units import unit_of
from fingerpad.core.values import number_in, one_of
from fingerpad.geometry.edged_indenters import INDENTERS
from fingerpad.geometry.indenters import Indenter


@lru_cache(maxsize=1024)
def indenter_named(text: str) -> Indenter:
    """Make an indenter from its name and sizes, `name:size:size`."""
    name, *given = (part.strip() for part in text.split(":"))
    body = INDENTERS[one_of("indenter", name, tuple(INDENTERS))]
    sizes = [size.name for size in fields(body)]  # type: ignore[arg-type]
    if len(given) > len(sizes):
        raise InputError(
            "indenter",
            f"must be written {':'.join([name, *sizes])}, sizes from the right may be left out",
            repr(text),
        )
    written: dict[str, str] = {}
    for place, part in enumerate(given):
        size, equals, value = (word.strip() for word in part.rpartition("="))
        size = size if equals else sizes[place]
        if size in written:
            raise InputError("indenter", f"must have {size} once", repr(text))
        written[size] = value
    return body(**{size: number_in(size, value, unit_of(size)) for size, value in written.items()})
