"""All cases, in the order of the page."""

from . import (
    balance,
    half_space,
    kernel,
    laws,
    locking,
    manufactured,
    oracles,
    patches,
    relaxation,
    release,
    sliding,
    small_bodies,
    symmetry,
)  # fmt: skip
from .case import CASES

THEMES = (
    patches.THEME, kernel.THEME, laws.THEME, manufactured.THEME, locking.THEME, half_space.THEME,
    relaxation.THEME, release.THEME, sliding.THEME, balance.THEME, symmetry.THEME, oracles.THEME,
    small_bodies.THEME,
)  # fmt: skip
ORDERED = sorted(CASES, key=lambda case: THEMES.index(case.theme))
