"""Indenters as files and options write them: a name with sizes, such as `punch:6.35`."""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache

from fingerpad.core.checks import number_in, one_of
from fingerpad.core.errors import InputError
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.names import INDENTERS, SIZE_UNITS


@lru_cache(maxsize=1024)
def indenter_named(text: str) -> Indenter:
    """Make an indenter from its name and sizes, `name:size:size`.

    Parameters
    ----------
    text : str
        A name of `INDENTERS`. Sizes follow after colons, in the order of the parameters of its class or by
        name, each in its unit of `SIZE_UNITS`; those that are left out are the paper's.

    Returns
    -------
    Indenter

    Raises
    ------
    InputError
        If a name is unknown, a size is no number or cannot be, or there are more sizes than the body has.

    Examples
    --------
    >>> indenter_named("punch:6.35")
    FlatPunch(diameter_mm=6.35, fillet_mm=0.3)
    >>> indenter_named("sphere:287"), indenter_named("plate")
    (Sphere(curvature_per_m=287.0), Plate())
    >>> indenter_named("grating:period_mm=2:duty=0.25")
    Grating(ridge_mm=0.5, groove_mm=1.5, lip_mm=0.2)
    """
    name, *given = (part.strip() for part in text.split(":"))
    body = INDENTERS[one_of("indenter", name, tuple(INDENTERS))]
    sizes = [size.name for size in fields(body)]  # type: ignore[arg-type]
    if len(given) > len(sizes):
        raise InputError(
            f"indenter must be written {':'.join([name, *sizes])}, sizes from the right may be left out: "
            f"got {text!r}."
        )
    written: dict[str, str] = {}
    for place, part in enumerate(given):
        size, equals, value = (word.strip() for word in part.rpartition("="))
        size = size if equals else sizes[place]
        if size in written:
            raise InputError(f"indenter must have {size} once: got {text!r}.")
        written[size] = value
    return body(**{size: number_in(size, value, SIZE_UNITS.get(size, "")) for size, value in written.items()})
