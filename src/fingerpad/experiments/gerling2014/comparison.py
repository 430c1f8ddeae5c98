"""The paper's numbers beside ours, misses included."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fingerpad.data import paper
from fingerpad.data.published import Published
from fingerpad.experiments.gerling2014.claim_row import MATERIALS, ClaimRow, claim_row, measured_row
from fingerpad.experiments.gerling2014.curvature_thresholds import weber_rows
from fingerpad.experiments.gerling2014.percept_claims import percept_rows

LEAST_R2 = 0.93
"""R² that Trial 3 must reach under the cylinder: the laboratory's own later fit."""


def comparison(results: Mapping[str, Any]) -> list[ClaimRow]:
    """Rows of the table "paper | ours | difference | status of the inputs".

    Parameters
    ----------
    results : dict
        The finished studies.

    Returns
    -------
    list of ClaimRow
    """
    return [
        *_deflection(results["skin_deflection"]),
        *_single_unit(results["single_unit"]),
        *percept_rows(results["discrimination"]),
        *weber_rows(results.get("curvature_thresholds")),
        *_nail(results["nail"]),
    ]


def _deflection(found: Mapping[str, Any]) -> list[ClaimRow]:
    later: Published = paper.LATER_DEFLECTION_R2
    trial_3 = found["trial3"]["cylinder"]
    r2 = trial_3["r2"]
    rows = [
        claim_row(
            "Trial 3, deflection under the cylinder, R²",
            f"matches (figure); laboratory's later model {later.value:g}",
            f"{r2:.3f}",
            f"{r2 - later.value:+.3f}",
            MATERIALS,
            r2 >= LEAST_R2,
            f"with the observations' direction read the other way {trial_3['r2_mirrored']:.3f}",
        )
    ]
    for trial, expected, sign in (("trial1", "overshoots", 1), ("trial2", "undershoots", -1)):
        for indenter in ("line", "cylinder"):
            excess = _mean_excess(found[trial][indenter], found["trial3"][indenter])
            rows.append(
                claim_row(
                    f"Trial {trial[-1]}, deflection under the {indenter}, against Trial 3",
                    expected,
                    f"{'more' if excess > 0 else 'less'} by {abs(excess):.3f} mm on average within 5 mm",
                    "",
                    MATERIALS,
                    sign * excess > 0,
                    "on an axis that points down, as skin that yields does, this is the paper's order: "
                    "docs/decisions/order-of-the-trials.md",
                )
            )
    return rows


def _mean_excess(trial: Mapping[str, Any], reference: Mapping[str, Any]) -> float:
    """Mean deflection above the reference's, over the nodes within 5 mm that both have. [mm]"""
    pairs = [
        a - b
        for x, a, b in zip(
            trial["distance_mm"], trial["deflection_mm"], reference["deflection_mm"], strict=True
        )
        if abs(x) <= 5.0
    ]
    return float(sum(pairs) / len(pairs))


def _single_unit(found: Mapping[str, Any]) -> list[ClaimRow]:
    status = MATERIALS + "; recordings read"
    rows = [
        measured_row(
            "Single unit, FSS out of sample (mean of six folds)",
            paper.FSS_OUT_OF_SAMPLE,
            found["fss_out_of_sample"],
            status,
            at_least=True,
        ),
        measured_row(
            "Single unit, FSS in sample (all 36 shifts)",
            paper.FOLD_3_FSS_FITTED,
            found["fss_in_sample"],
            status + "; the paper's value is of fold 3",
            at_least=True,
        ),
    ]
    fold_3 = found["folds"][2]
    rows += [
        measured_row("Fold 3, FSS at start point 2", paper.FOLD_3_FSS_START, fold_3["fss_start"][1], status),
        measured_row(
            "Fold 3, FSS of the testing set", paper.FOLD_3_FSS_TEST, fold_3["fss_test"], status, at_least=True
        ),
    ]
    dynamic, static = found["modulation"]["dynamic"]["ours"], found["modulation"]["static"]["ours"]
    for quantity, published, ours in (
        (
            "Dynamic rate, smallest under the flat face [spikes/s]",
            paper.DYNAMIC_RATE_MINIMUM,
            dynamic["minimum_hz"],
        ),
        ("Dynamic rate, largest [spikes/s]", paper.DYNAMIC_RATE_MAXIMUM, dynamic["maximum_hz"]),
        ("Dynamic rate, difference [spikes/s]", paper.DYNAMIC_RATE_DIFFERENCE, dynamic["difference_hz"]),
        ("Static rate, difference [spikes/s]", paper.STATIC_RATE_DIFFERENCE, static["difference_hz"]),
    ):
        rows.append(measured_row(quantity, published, ours, status, digits=0))
    return rows


def _nail(found: Mapping[str, Any]) -> list[ClaimRow]:
    low, high = found["ratio_range"]
    return [
        claim_row(
            "Von Mises stress of the skin at the border of the nail over that 2 to 3 mm away (Figure 9)",
            "high concentrations (figure)",
            f"{found['ratio']:.1f} times",
            "",
            MATERIALS + "; width of the nail assumed",
            None,
            f"{low:.1f} to {high:.1f} over the sections, {found['border_kpa']:.2g} kPa at most; energy "
            f"density in the living epidermis {found['ratio_energy']:.1f} times; the paper gives no number",
        )
    ]
