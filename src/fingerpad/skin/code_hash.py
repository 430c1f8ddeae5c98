"""Hash of the sources on which the numbers of a press depend, for the key of a stored indentation."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.resources import files

from fingerpad.core.errors import StoreError

PACKAGE = "fingerpad"

MECHANICAL_SOURCES = (
    "core/units.py",
    "core/threads.py",
    "core/numba_internals.py",
    "geometry",
    "mechanics",
    "skin/fields.py",
    "skin/indentation.py",
)
"""Files and folders of the package on which the numbers of a stored indentation depend."""


@cache
def code_hash() -> str:
    """Hash of the bytes of the mechanical sources, 16 hexadecimal digits."""
    package = files(PACKAGE)
    entries = [package / name for name in MECHANICAL_SOURCES]
    sources = [
        source
        for entry in entries
        for source in ([entry] if entry.is_file() else entry.iterdir())
        if source.name.endswith(".py")
    ]
    if not sources:
        raise StoreError(
            f"Stored indentations are found by the sources of {PACKAGE}, but it was installed without its "
            ".py files: install it from a wheel or a source archive."
        )
    contents = sorted(source.read_bytes() for source in sources)
    return hashlib.sha256(b"\0".join(contents)).hexdigest()[:16]
