"""Comparison of a reproduction with the numbers of the paper: one row per statement, in four groups."""

from __future__ import annotations

import numpy as np

from fingerpad.data import paper, tissues
from fingerpad.experiments.gerling2014.claim_row import (
    MATERIALS,
    ClaimRow,
    Group,
    Verdict,
    judged,
    measured_row,
)
from fingerpad.experiments.gerling2014.curvature_thresholds import CurvatureThresholds
from fingerpad.experiments.gerling2014.discrimination_claims import discrimination_claims
from fingerpad.experiments.gerling2014.nail_border import NailBorder
from fingerpad.experiments.gerling2014.single_unit import SingleUnitResult
from fingerpad.experiments.gerling2014.skin_deflection import IndenterDeflection, SkinDeflectionResult
from fingerpad.experiments.gerling2014.skin_force import SkinForce
from fingerpad.experiments.gerling2014.sphere_discrimination import SphereDiscrimination
from fingerpad.inference.rates_and_hit_rates import ToRatesAndHitRates

LEAST_R2 = 0.93
"""R² that Trial 3 must reach under the cylinder: the laboratory's own later fit."""

CHOSEN_BY_DEFLECTION = ("trial2", "trial3", "trial3_stiffening", "paper", "human")
"""Sets of tissues whose moduli were identified from the deflection under the cylinder
(docs/decisions/lost-hyperelastic-coefficients.md, docs/decisions/paper-and-human.md)."""

CHOSEN_BY_RATES = ("paper", "human")
"""Sets whose moduli, Poisson's ratio and drive were chosen by the rates under the bar, among others."""

CHOSEN_BY_FORCE = ("human",)
"""Sets of tissues with a common factor on the moduli that was chosen by the force of a flat plate."""


def comparison(
    materials: str,
    skin: SkinDeflectionResult,
    force: SkinForce,
    unit: SingleUnitResult,
    discrimination: SphereDiscrimination,
    nail: NailBorder,
    curvature_thresholds: CurvatureThresholds | None = None,
) -> list[ClaimRow]:
    """Rows of the table that compares a reproduction with the paper.

    Parameters
    ----------
    materials : str
        Name of the tissues of the run: what was fitted depends on them.
    skin, force, unit, discrimination, nail
        Results of the three levels.
    curvature_thresholds : optional
        Result beyond the paper.

    Returns
    -------
    list of ClaimRow
    """
    return [
        *_deflection(skin),
        *_force(materials, force),
        *_single_unit(materials, unit),
        *discrimination_claims(discrimination, unit.method == ToRatesAndHitRates.name),
        *(weber_claims(curvature_thresholds) if curvature_thresholds else ()),
        _nail(nail),
    ]


def _deflection(found: SkinDeflectionResult) -> list[ClaimRow]:
    later, third = paper.LATER_DEFLECTION_R2.value, found.trial3
    return [
        ClaimRow(
            group=Group.FITTED,
            quantity="Trial 3, deflection under the cylinder, R²",
            paper=f"matches (figure); laboratory's later model {later:g}",
            ours=f"{third.cylinder.r2:.3f}",
            difference=f"{third.cylinder.r2 - later:+.3f}",
            status=MATERIALS,
            verdict=judged(third.cylinder.r2 >= LEAST_R2),
            fitted_to="the inner moduli were identified from this profile",
            note=f"with the opposite direction of the observations {third.cylinder.r2_mirrored:.3f}",
        ),
        _order_of_trials(found),
    ]


def _order_of_trials(found: SkinDeflectionResult) -> ClaimRow:
    """Judge the order as the figure is drawn: its deflection axis points down."""
    more_mm = {
        (number, indenter): _mean_excess(getattr(trial, indenter), getattr(found.trial3, indenter))
        for number, trial in ((1, found.trial1), (2, found.trial2))
        for indenter in ("line", "cylinder")
    }
    as_drawn = all(more < 0.0 if number == 1 else more > 0.0 for (number, _), more in more_mm.items())
    return ClaimRow(
        group=Group.STATEMENT,
        quantity="Order of the three trials: deflection of Trials 1 and 2 less that of Trial 3 [mm]",
        paper="Trial 1 overshoots, Trial 2 undershoots",
        ours="; ".join(
            f"Trial {number} {more_mm[number, 'line']:+.3f} under the line, "
            f"{more_mm[number, 'cylinder']:+.3f} under the cylinder"
            for number in (1, 2)
        ),
        status=MATERIALS,
        verdict=judged(as_drawn),
        reading="as the figure is drawn" if as_drawn else "",
        note="mean within 5 mm; on a deflection axis that points down, the smaller deflection lies above: "
        "docs/decisions/order-of-the-trials.md",
    )


def _force(materials: str, found: SkinForce) -> list[ClaimRow]:
    """Deflection and force with the tissues of the run."""
    by_profile, by_force = materials in CHOSEN_BY_DEFLECTION, materials in CHOSEN_BY_FORCE
    return [
        ClaimRow(
            group=_fitted_if(by_profile),
            quantity="Tissues of the run, deflection under the cylinder, R²",
            paper=f"laboratory's later model {paper.LATER_DEFLECTION_R2.value:g}",
            ours=f"{found.deflection_r2:.3f}",
            status=MATERIALS,
            verdict=judged(found.deflection_r2 >= LEAST_R2),
            fitted_to="the ratios of the moduli came from this profile" if by_profile else "",
        ),
        *(
            ClaimRow(
                group=_fitted_if(by_force),
                quantity=f"Tissues of the run, force of a flat plate {depth_mm:g} mm deep [N]",
                paper=f"people {low:g} to {high:g}",
                ours=f"{ours:.2f}",
                status=MATERIALS + "; observed range read",
                verdict=judged(low <= ours <= high),
                fitted_to="the common factor on the moduli was chosen by this force" if by_force else "",
                note="end of the hold",
            )
            for depth_mm, (low, high), ours in (
                (1.0, tissues.PLATE_FORCE_1MM.value, found.plate_1mm_n),
                (2.0, tissues.PLATE_FORCE_2MM.value, found.plate_2mm_n),
            )
        ),
    ]


def _fitted_if(chosen: bool) -> Group:
    """Return the group of our own addition, by whether something was chosen by it."""
    return Group.FITTED if chosen else Group.ADDITION


def _mean_excess(ours: IndenterDeflection, reference: IndenterDeflection) -> float:
    """Mean deflection above the reference's, over the nodes within 5 mm that both have. [mm]"""
    near = np.abs(ours.distance_mm) <= 5.0
    return float((ours.deflection_mm - reference.deflection_mm)[near].mean())


SESSION_START = 2
"""Start point of the session of fold 3 that the paper tells of, counted from 1."""

FITTED_TO_RATES = "the afferent was fitted to the rates at all 36 shifts"


def _before_folds(materials: str, fitted_to_people: bool) -> str:
    """Say what had been chosen on all 36 shifts before a fold left any out."""
    if fitted_to_people:
        starts = "each fit starts from a search in its training set; the hit rates of people enter each fold"
    else:
        starts = "the start gains were chosen on all 36 shifts (docs/decisions/dynamic-gain-rescaled.md)"
    if materials not in CHOSEN_BY_RATES:
        return starts
    return f"{starts}; drive, moduli and Poisson's ratio of {materials} were chosen with all 36 shifts"


def _single_unit(materials: str, found: SingleUnitResult) -> list[ClaimRow]:
    status = MATERIALS + "; recordings read, from monkeys"
    dynamic, static = found.modulation.dynamic.ours, found.modulation.static.ours
    rates = (
        ("Dynamic rate, smallest under the flat face", paper.DYNAMIC_RATE_MINIMUM, dynamic.minimum_hz),
        ("Dynamic rate, largest", paper.DYNAMIC_RATE_MAXIMUM, dynamic.maximum_hz),
        ("Dynamic rate, difference", paper.DYNAMIC_RATE_DIFFERENCE, dynamic.difference_hz),
        ("Static rate, difference", paper.STATIC_RATE_DIFFERENCE, static.difference_hz),
    )
    return [
        measured_row(
            Group.STATEMENT,
            "Single unit, FSS out of sample (mean of six folds)",
            paper.FSS_OUT_OF_SAMPLE,
            found.fss_out_of_sample,
            status,
            at_least=True,
            note=_before_folds(materials, found.method == ToRatesAndHitRates.name),
        ),
        measured_row(
            Group.FITTED,
            "Single unit, FSS in sample (all 36 shifts)",
            paper.FOLD_3_FSS_FITTED,
            found.fss_in_sample,
            status + "; the paper's value is of fold 3",
            at_least=True,
            fitted_to=FITTED_TO_RATES,
        ),
        _fold_3(found, status),
        *(
            measured_row(
                Group.FITTED,
                f"{quantity} [spikes/s]",
                published,
                ours,
                status,
                digits=0,
                fitted_to=FITTED_TO_RATES,
            )
            for quantity, published, ours in rates
        ),
    ]


def _fold_3(found: SingleUnitResult, status: str) -> ClaimRow:
    """Show the paper's session of fold 3; a fit without its second start point has no such session."""
    fold, session = found.folds[2], SESSION_START
    climbs = {climb.start: climb for climb in fold.climbs}
    if session in climbs:
        start, fitted, test = fold.fss_start[session - 1], climbs[session].fss_train, climbs[session].fss_test
        note = ""
    else:
        start, fitted, test = np.nan, fold.fss_train, fold.fss_test
        note = f"; this fit has no start point {session}"
    published = (paper.FOLD_3_FSS_START, paper.FOLD_3_FSS_FITTED, paper.FOLD_3_FSS_TEST)
    return ClaimRow(
        group=Group.STATEMENT,
        quantity=f"Fold 3, start point {session}: FSS at the start, fitted, of the testing set",
        paper=", ".join(f"{number.value:g}" for number in published),
        ours=", ".join("–" if np.isnan(fss) else f"{fss:.3f}" for fss in (start, fitted, test)),
        status=status,
        verdict=Verdict.NOT_JUDGED,
        note="the shifts of the paper's fold 3 are unknown (docs/decisions/folds.md)" + note,
    )


def weber_claims(found: CurvatureThresholds) -> list[ClaimRow]:
    """Compare Weber fractions with observed ones, one row per population."""
    low, high = found.literature.weber_fractions
    rows = []
    for population in found.populations:
        fractions = [threshold.weber_fraction for threshold in population.standards]
        at = ", ".join(f"{threshold.standard_per_m:g}" for threshold in population.standards)
        missed = [missing.why_not for missing in population.without_threshold]
        within = all(low <= round(share, 2) <= high for share in fractions)
        at_which = f"static Gradient Sum, standards {at} /m; judged in whole per cent"
        rows.append(
            ClaimRow(
                group=Group.ADDITION,
                quantity=f"Curvature threshold at 75 %, {population.rows} by {population.columns} receptors",
                paper=f"observed: {low:.0%} to {high:.0%} of the standard",
                ours=", ".join(f"{fraction:.1%}" for fraction in fractions),
                status=MATERIALS + "; observed fractions recalled",
                verdict=judged(bool(fractions) and not missed and within),
                note="; ".join([at_which, *missed]),
            )
        )
    return rows


def _nail(found: NailBorder) -> ClaimRow:
    low, high = found.ratio_range
    return ClaimRow(
        group=Group.ADDITION,
        quantity="Von Mises stress of the skin at the border of the nail over that 2 to 3 mm away (Figure 9)",
        paper="high concentrations (figure)",
        ours=f"{found.ratio:.1f} times",
        status=MATERIALS + "; width of the nail assumed",
        verdict=Verdict.NOT_JUDGED,
        note=f"{low:.1f} to {high:.1f} over the sections, {found.border_kpa:.2g} kPa at most; energy "
        f"density in the living epidermis {found.ratio_energy:.1f} times; the paper gives no number",
    )
