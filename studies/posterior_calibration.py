"""Calibration of a posterior: where true parameters lie among the draws, in many synthetic experiments.

If parameters come from the prior and data from the likelihood, the share of draws below the truth is uniform,
and an interval contains the truth as often as its level says (Talts et al. 2018). Truths that were computed
without the emulator test its error, too.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.stats import binomtest

from fingerpad.core.checked import result_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, Matrix

LEVELS = (0.5, 0.95)
"""Intervals whose coverage is given. [0-1]"""

SIGNIFICANT = 0.01
"""Probability below which a coverage counts as wrong, shared by all parameters."""


@result_class
class Calibration:
    """Shares of draws below the true value, (n_replicates, n_parameters), and names of the parameters."""

    names: tuple[str, ...]
    shares_below: Matrix

    def inside(self, level: float) -> FloatArray:
        """Share of the replicates whose central interval contains the truth, by parameter. [0-1]

        Examples
        --------
        >>> found = Calibration(names=("a",), shares_below=[[0.1], [0.5], [0.99], [0.3]])
        >>> found.inside(0.5).tolist(), found.inside(0.95).tolist()
        ([0.5], [0.75])
        """
        return np.asarray((np.abs(self.shares_below - 0.5) <= 0.5 * level).mean(axis=0))

    def wrong(self) -> tuple[str, ...]:
        """Parameters whose coverage is not that of the level, by a binomial test with Bonferroni's bound.

        Examples
        --------
        >>> ends = np.tile([[0.001], [0.999]], (10, 1))
        >>> Calibration(names=("too narrow",), shares_below=ends).wrong()
        ('too narrow',)
        """
        n = len(self.shares_below)
        limit = SIGNIFICANT / (len(self.names) * len(LEVELS))
        found = np.transpose([self.inside(level) for level in LEVELS])
        return tuple(
            name
            for name, both in zip(self.names, found, strict=True)
            if min(binomtest(round(x * n), n, p).pvalue for x, p in zip(both, LEVELS, strict=True)) < limit
        )


def calibrate(names: tuple[str, ...], replicates: Iterable[tuple[FloatArray, FloatArray]]) -> Calibration:
    """Compare true parameters (n_parameters,) with posterior draws (n_draws, n_parameters), by experiment."""
    shares = []
    for truth, draws in replicates:
        if truth.shape != (len(names),) or draws.shape[1:] != truth.shape:
            raise InputError(
                f"Each replicate must hold {len(names)} true parameters and draws of them: "
                f"got {truth.shape} and {draws.shape}."
            )
        shares.append((draws < truth).mean(axis=0))
    if not shares:
        raise InputError("replicates must hold at least one experiment: got none.")
    return Calibration(names=names, shares_below=np.array(shares))
