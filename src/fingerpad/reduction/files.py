"""Files of reduced touches: arrays without code, a version and a checksum."""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from fingerpad.core.checks import instance
from fingerpad.core.errors import InputError
from fingerpad.core.files import check_file, path_of, write_atomically
from fingerpad.core.keywords import known_keywords
from fingerpad.reduction.interpolation import Axis
from fingerpad.reduction.model import ReducedModel, origin_of
from fingerpad.skin.indentation import Touch

FORMAT = "fingerpad reduced touch"
VERSION = 2
LARGEST_MB = 1000.0
"""Largest file that is read. [MB]"""

ARRAYS = (
    "times_ms",
    "first_touch_mm",
    "middle_mm",
    "totals",
    "coefficients",
    "modes",
    "reach_mm",
    "largest",
    "error",
    "exponents",
)
"""Fields of `ReducedModel` that are arrays."""


@known_keywords
def write_reduced(model: ReducedModel, path: str | Path) -> None:
    """Write a reduced touch, as a whole or not at all.

    Raises
    ------
    StoreError
        If the file cannot be written.
    """
    instance("model", model, ReducedModel)
    head = {
        "format": FORMAT,
        "version": VERSION,
        "axes": [asdict(axis) for axis in model.axes],
        "depth_mm": model.depth_mm,
        "at_mm": model.at_mm,
        "quantities": model.quantities,
        "origin": model.origin,
    }
    arrays = {name: np.ascontiguousarray(getattr(model, name), dtype=np.float64) for name in ARRAYS}
    text = json.dumps(head, sort_keys=True)
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        head=np.array(text),
        checksum=np.array(_checksum(text, arrays)),
        **arrays,  # type: ignore[arg-type]
    )
    write_atomically(path_of("path", path), buffer.getvalue())


@known_keywords
def read_reduced(path: str | Path, touch: Touch | None = None) -> ReducedModel:
    """Read a reduced touch.

    Parameters
    ----------
    path : str or Path
        A file of `write_reduced` or of `fingerpad reduce`.
    touch : Touch, optional
        If given, its finger and tissues must be those of the file.
    """
    if touch is not None:
        instance("touch", touch, Touch)
    source = check_file(path_of("path", path), LARGEST_MB)
    try:
        with source.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            text, checksum = str(file["head"]), str(file["checksum"])
            arrays = {name: file[name] for name in ARRAYS}
        head = json.loads(text)
        found = head["format"], head["version"]
    except OSError as error:
        raise InputError(f"{path} must be a file that can be read: {error.strerror or error}.") from error
    except Exception as error:  # a file of unknown content may fail in any way
        raise InputError(
            f"{path} must be a whole file of a reduced touch: it is another file, or was cut short; make it "
            "again with `fingerpad reduce`."
        ) from error
    if found != (FORMAT, VERSION):
        raise InputError(
            f"{path} must be a {FORMAT} of version {VERSION}: got {found[0]!r} of version {found[1]!r}; make "
            "it again with `fingerpad reduce`."
        )
    if checksum != _checksum(text, arrays):
        raise InputError(f"{path} is damaged: its checksum is wrong; make it again with `fingerpad reduce`.")
    if touch is not None:
        for name, value in origin_of(touch).items():
            if name != "indenter" and head["origin"][name] != value:
                raise InputError(f"{path} was made with another {name}: make it again with this one.")
    return ReducedModel(
        axes=tuple(Axis(**axis) for axis in head["axes"]),
        depth_mm=head["depth_mm"],
        at_mm=tuple(head["at_mm"]),
        quantities=tuple(head["quantities"]),
        origin=head["origin"],
        **arrays,
    )


def _checksum(head: str, arrays: dict[str, np.ndarray]) -> str:
    digest = hashlib.sha256(head.encode())
    for name in ARRAYS:
        digest.update(repr(arrays[name].shape).encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()
