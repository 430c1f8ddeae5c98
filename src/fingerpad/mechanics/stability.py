"""Whether a law is stable: does it take more stress to strain it more?"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from fingerpad.core.checks import FloatArray
from fingerpad.mechanics.energy import SECOND
from fingerpad.mechanics.laws import Energy, Law

STABLE_STRETCHES = (0.5, 2.0)
"""Range in which a material must be stable, or a warning names the stretch."""


@lru_cache(maxsize=256)
def instability(law: Law) -> str:
    """Where a law first loses stability between stretches of 0.5 and 2, in words; empty if nowhere.

    Stable means that the Kirchhoff stress rises with the logarithmic strain in every direction (Drucker):
    the Hessian of the energy with respect to the logarithms of the stretches is positive definite, for a law
    with its own volumetric energy at constant volume. Uniaxial, equibiaxial and planar stretch are examined,
    from 1 outwards; for a law that couples shape and volume with stress-free sides, and change of volume.
    """
    energy = law.energy
    for far in STABLE_STRETCHES:
        for mode, path in (_COUPLED_PATHS if energy.is_coupled else _ISOCHORIC_PATHS).items():
            for log in np.log(np.linspace(1.0, far, 51)[1:]):
                if not np.linalg.eigvalsh(path(energy, log))[0] > 0.0:
                    side = "tension" if far > 1.0 else "compression"
                    return f"in {mode} {side} from stretch {np.exp(log):.3g} on"
    return ""


def _isochoric_stiffness(energy: Energy, logs: tuple[float, float, float]) -> FloatArray:
    """Hessian of the energy on the two directions that keep the volume, (2, 2). [kPa]"""
    hessian = energy.derivatives([*logs, 0.0])[SECOND]
    return _CONSTANT_VOLUME @ hessian[:3, :3] @ _CONSTANT_VOLUME.T


def _free_stiffness(energy: Energy, log: float, pulled: int, free: int) -> FloatArray:
    """Hessian of the energy in the logarithmic strains (3, 3); free sides carry no stress. [kPa]"""
    # The first `pulled` sides have stretch exp(log), the last `free` ones find theirs, any other stays at 1.

    def state(side: float) -> FloatArray:
        strain = np.array([log] * pulled + [0.0] * (3 - pulled - free) + [side] * free)
        return energy.derivatives([*(strain - strain.mean()), strain.sum()])

    def stress(side: float) -> float:
        first = state(side)
        return float(first[3] - first[1:4].mean() + first[4])

    if free and stress(-_WIDEST_LOG) * stress(_WIDEST_LOG) > 0.0:
        return -np.eye(3)  # the free sides find no rest at all
    derivatives = state(brentq(stress, -_WIDEST_LOG, _WIDEST_LOG) if free else 0.0)
    return _TO_SHAPE_AND_VOLUME.T @ derivatives[SECOND] @ _TO_SHAPE_AND_VOLUME


_WIDEST_LOG = 3.0
_CONSTANT_VOLUME = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, -2.0]]) / np.sqrt([[2.0], [6.0]])
_TO_SHAPE_AND_VOLUME = np.vstack([np.eye(3) - 1 / 3, np.ones(3)])  # of ln lambda_a
_Path = Callable[[Energy, float], FloatArray]
_ISOCHORIC_PATHS: dict[str, _Path] = {
    "uniaxial": lambda energy, log: _isochoric_stiffness(energy, (log, -log / 2, -log / 2)),
    "equibiaxial": lambda energy, log: _isochoric_stiffness(energy, (log, log, -2 * log)),
    "planar": lambda energy, log: _isochoric_stiffness(energy, (log, 0.0, -log)),
}
_COUPLED_PATHS: dict[str, _Path] = {
    "uniaxial": lambda energy, log: _free_stiffness(energy, log, pulled=1, free=2),
    "equibiaxial": lambda energy, log: _free_stiffness(energy, log, pulled=2, free=1),
    "planar": lambda energy, log: _free_stiffness(energy, log, pulled=1, free=1),
    "volumetric": lambda energy, log: _free_stiffness(energy, log / 3, pulled=3, free=0),
}
