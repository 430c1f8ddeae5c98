"""fingerpad: from a touch on the skin to spikes to a percept.

Examples
--------
>>> import fingerpad as fp
>>> skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.5))
>>> response = fp.Population.grid(density_per_cm2=100).respond(skin)
>>> len(response.spikes)
18

Notes
-----
The public names are loaded when they are first used, so that this import takes hundredths of a second.
They are listed once, in `__init__.pyi`, for people, type checkers and the loading.
"""

import re as _re
from importlib import import_module as _import_module
from pathlib import Path as _Path

__version__ = "0.1.0"

_HOME = {
    name: module
    for module, name in _re.findall(
        r"^from (\S+) import (\w+) as", _Path(__file__).with_suffix(".pyi").read_text("utf-8"), _re.MULTILINE
    )
}
"""Module that defines each public name."""

__all__ = sorted(_HOME)


def __getattr__(name: str) -> object:
    """Fetch a public name when it is first used: Numba and SciPy take most of a second to load."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = _HOME[name]
    value = vars(_import_module(home)).get(name) or _import_module(f"{home}.{name}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Public names, those not fetched yet included."""
    return [*__all__, "__version__"]
