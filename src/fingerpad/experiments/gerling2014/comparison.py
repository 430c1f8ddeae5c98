"""Comparison of a reproduction with the numbers of the paper."""

from __future__ import annotations

import numpy as np

from fingerpad.data import paper
from fingerpad.data.published import Published
from fingerpad.experiments.gerling2014.claim_row import MATERIALS, ClaimRow, claim_row, measured_row
from fingerpad.experiments.gerling2014.curvature_thresholds import CurvatureThresholds, weber_claims
from fingerpad.experiments.gerling2014.discrimination_claims import discrimination_claims
from fingerpad.experiments.gerling2014.nail_border import NailBorder
from fingerpad.experiments.gerling2014.single_unit import SingleUnitResult
from fingerpad.experiments.gerling2014.skin_deflection import IndenterDeflection, SkinDeflectionResult
from fingerpad.experiments.gerling2014.sphere_discrimination import SphereDiscrimination

LEAST_R2 = 0.93
"""R² that Trial 3 must reach under the cylinder: the laboratory's own later fit."""


def comparison(
    skin: SkinDeflectionResult,
    unit: SingleUnitResult,
    discrimination: SphereDiscrimination,
    nail: NailBorder,
    curvature_thresholds: CurvatureThresholds | None = None,
) -> list[ClaimRow]:
    """Rows of the table that compares a reproduction with the paper.

    Parameters
    ----------
    skin, unit, discrimination, nail
        Results of the three levels.
    curvature_thresholds : optional
        Result beyond the paper.

    Returns
    -------
    list of ClaimRow
    """
    return [
        *_deflection(skin),
        *_single_unit(unit),
        *discrimination_claims(discrimination),
        *weber_claims(curvature_thresholds),
        *_nail(nail),
    ]


def _deflection(found: SkinDeflectionResult) -> list[ClaimRow]:
    later: Published = paper.LATER_DEFLECTION_R2
    r2 = found.trial3.cylinder.r2
    rows = [
        claim_row(
            "Trial 3, deflection under the cylinder, R²",
            f"matches (figure); laboratory's later model {later.value:g}",
            f"{r2:.3f}",
            f"{r2 - later.value:+.3f}",
            MATERIALS,
            r2 >= LEAST_R2,
            f"with the opposite direction of the observations {found.trial3.cylinder.r2_mirrored:.3f}",
        )
    ]
    third = found.trial3
    for number, trial, expected, sign in (
        (1, found.trial1, "overshoots", 1),
        (2, found.trial2, "undershoots", -1),
    ):
        for indenter, ours, reference in (
            ("line", trial.line, third.line),
            ("cylinder", trial.cylinder, third.cylinder),
        ):
            excess = _mean_excess(ours, reference)
            rows.append(
                claim_row(
                    f"Trial {number}, deflection under the {indenter}, against Trial 3",
                    expected,
                    f"{'more' if excess > 0 else 'less'} by {abs(excess):.3f} mm on average within 5 mm",
                    "",
                    MATERIALS,
                    sign * excess > 0,
                    "on a deflection axis that points down this is the paper's order: "
                    "docs/decisions/order-of-the-trials.md",
                )
            )
    return rows


def _mean_excess(ours: IndenterDeflection, reference: IndenterDeflection) -> float:
    """Mean deflection above the reference's, over the nodes within 5 mm that both have. [mm]"""
    near = np.abs(ours.distance_mm) <= 5.0
    return float((ours.deflection_mm - reference.deflection_mm)[near].mean())


def _single_unit(found: SingleUnitResult) -> list[ClaimRow]:
    status = MATERIALS + "; recordings read"
    rows = [
        measured_row(
            "Single unit, FSS out of sample (mean of six folds)",
            paper.FSS_OUT_OF_SAMPLE,
            found.fss_out_of_sample,
            status,
            at_least=True,
        ),
        measured_row(
            "Single unit, FSS in sample (all 36 shifts)",
            paper.FOLD_3_FSS_FITTED,
            found.fss_in_sample,
            status + "; the paper's value is of fold 3",
            at_least=True,
        ),
    ]
    fold_3 = found.folds[2]
    rows += [
        measured_row(
            "Fold 3, FSS at start point 2", paper.FOLD_3_FSS_START, float(fold_3.fss_start[1]), status
        ),
        measured_row(
            "Fold 3, FSS of the testing set", paper.FOLD_3_FSS_TEST, fold_3.fss_test, status, at_least=True
        ),
    ]
    dynamic, static = found.modulation.dynamic.ours, found.modulation.static.ours
    for quantity, published, ours in (
        (
            "Dynamic rate, smallest under the flat face [spikes/s]",
            paper.DYNAMIC_RATE_MINIMUM,
            dynamic.minimum_hz,
        ),
        ("Dynamic rate, largest [spikes/s]", paper.DYNAMIC_RATE_MAXIMUM, dynamic.maximum_hz),
        ("Dynamic rate, difference [spikes/s]", paper.DYNAMIC_RATE_DIFFERENCE, dynamic.difference_hz),
        ("Static rate, difference [spikes/s]", paper.STATIC_RATE_DIFFERENCE, static.difference_hz),
    ):
        rows.append(measured_row(quantity, published, ours, status, digits=0))
    return rows


def _nail(found: NailBorder) -> list[ClaimRow]:
    low, high = found.ratio_range
    return [
        claim_row(
            "Von Mises stress of the skin at the border of the nail over that 2 to 3 mm away (Figure 9)",
            "high concentrations (figure)",
            f"{found.ratio:.1f} times",
            "",
            MATERIALS + "; width of the nail assumed",
            None,
            f"{low:.1f} to {high:.1f} over the sections, {found.border_kpa:.2g} kPa at most; energy "
            f"density in the living epidermis {found.ratio_energy:.1f} times; the paper gives no number",
        )
    ]
