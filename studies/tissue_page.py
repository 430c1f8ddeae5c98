"""Blocks of docs/tissues.md: every named set of tissues, the search among candidates, and the posterior."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from math import isfinite

from fingerpad.experiments.tissue_sets import TissueLayer, tissue_layers
from fingerpad.report.page import edition
from fingerpad.report.tables import fixed, number
from studies.pages import joined, share, table
from studies.posterior_calibration import LEVELS as COVERED
from studies.tissue_candidates import LEVELS
from studies.tissue_posterior import TissuePosterior
from studies.tissue_search import Row, TissueSearch, met

SET_COLUMNS = ("set", "law of dermis and subcutis", "shear moduli [kPa]", "nu", "relaxing share", "status")
SEARCH_COLUMNS = ("candidate", "R²", "plate [N]", "FSS", "noise", "meets")
POSTERIOR_COLUMNS = (
    "parameter", "prior", "posterior", "95 %", "`human`", *(f"inside {level:.0%}" for level in COVERED),
)  # fmt: skip
LETTERS = dict(zip(LEVELS, "dfrp", strict=True))


def set_blocks() -> dict[str, str]:
    """Return one row per named set, moduli from the outside in."""
    rows = [_set(name, list(layers)) for name, layers in groupby(tissue_layers(), lambda each: each.tissues)]
    return {"sets": table(SET_COLUMNS, rows)}


def _set(name: str, layers: Sequence[TissueLayer]) -> tuple[str, ...]:
    return (
        f"`{name}`",
        layers[-1].law,
        " / ".join(number(layer.shear_kpa) for layer in layers),
        _once([fixed(layer.poisson, 2) for layer in layers]),
        _once([fixed(sum(layer.prony_shares), 2) for layer in layers]),
        _once([layer.modulus_status for layer in layers]),
    )


def _once(texts: Sequence[str]) -> str:
    """Values of four layers, each of them once.

    >>> _once(["0.40", "0.40", "0.40", "0.40"]), _once(["0.48", "0.48", "0.40", "0.40"])
    ('0.40', '0.48 / 0.40')
    """
    return " / ".join(dict.fromkeys(texts))


def search_blocks(results: TissueSearch) -> dict[str, str]:
    """Return one row per candidate, and who meets the targets of all levels."""
    wanted = results.targets
    (low, high), (deeper_low, deeper_high) = wanted.plate_force_n
    quiet, loud = wanted.noise_sigma
    legend = (
        f"Targets: R² of {wanted.r2:g} under the cylinder (d); plate {low:g}–{high:g} N at 1 mm and "
        f"{deeper_low:g}–{deeper_high:g} N at 2 mm (f); FSS out of sample of {wanted.fss:g} (r); noise "
        f"{quiet:g}–{loud:g} with the Euclidean Distance within {wanted.euclidean_rms:g} of people (p). "
        f"{_written('tissue-search', edition(results.manifest))}"
    )
    unsolved = [f"{row.name} could not be solved: {row.unsolved}" for row in results.rows if not row.levels]
    rows = [_candidate(row, results) for row in results.rows]
    return {"search": joined(table(SEARCH_COLUMNS, rows), legend, *unsolved)}


def _candidate(row: Row, results: TissueSearch) -> tuple[str, ...]:
    if row.levels is None:
        return (row.name, *["–"] * (len(SEARCH_COLUMNS) - 1))
    found, firing, percept = row.levels.deflection, row.levels.firing, row.levels.percept
    return (
        row.name,
        fixed(found.r2, 3),
        ", ".join(fixed(force, 2) for force in found.plate_force_n),
        fixed(firing.fss_out_of_sample, 3),
        fixed(percept.noise_sigma, 3),
        " ".join(LETTERS[level] for level in met(row.levels, results.targets)) or "–",
    )


def posterior_blocks(results: TissuePosterior) -> dict[str, str]:
    """Return one row per parameter, the targets, and the errors of emulator and calibration."""
    n = len(results.calibration.shares_below)
    inside = [results.calibration.inside(level) for level in COVERED]
    rows = [
        (
            one.name,
            _number(one.prior.median),
            _number(one.posterior.median),
            f"{_number(one.posterior.low)} to {_number(one.posterior.high)}",
            _number(one.human),
            *(f"{round(each[place] * n)}/{n}" for each in inside),
        )
        for place, one in enumerate(results.marginals)
    ]
    least = min(results.targets, key=lambda one: one.probability)
    found = results.convergence
    errors = ", ".join(
        f"{one.quantity} {_number(one.rms, 2)} ({_number(one.residual, 2)})"
        for one in results.errors
        if isfinite(one.residual)
    )
    wrong = results.calibration.wrong()
    return {
        "posterior": joined(
            table(POSTERIOR_COLUMNS, rows),
            f"All {len(results.targets)} targets of `human` hold at once with probability "
            f"{fixed(results.all_targets, 2)}; the least probable is {least.name} "
            f"({fixed(least.probability, 2)}). R-hat is at most {fixed(found.r_hat, 3)}, effective sample "
            f"sizes at least {min(found.effective_draws, found.effective_draws_of_tails):.0f}. "
            f"{results.n_tissues} tissues were pressed. Rms errors of the emulator at tissues that it has "
            f"not seen (deviation of the observations): {errors}.",
            "Inside: synthetic experiments with pressed tissues whose interval contains the truth. Over all "
            f"parameters {' and '.join(share(float(each.mean()), 0) for each in inside)} do; "
            f"{results.unsolved} experiments have not converged. {_coverage(wrong)} "
            + _written("tissue-posterior", edition(results.manifest)),
        )
    }


def _coverage(wrong: Sequence[str]) -> str:
    if wrong:
        return f"The coverage is wrong by binomial tests for: {', '.join(wrong)}."
    return "No coverage differs from its level by a binomial test at 1 %, shared by all rows."


def _written(study: str, made: str) -> str:
    return f"Written by `python -m studies {study}`: {made}."


def _number(value: float, digits: int = 3) -> str:
    """Significant digits, with a typographic minus."""
    return f"{value:.{digits}g}".replace("-", "−")
