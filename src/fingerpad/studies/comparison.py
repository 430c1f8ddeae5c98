"""The paper's numbers beside ours, misses included."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from fingerpad.parameters import paper, psychophysics
from fingerpad.parameters.published import Published

CLOSE = 0.2
"""A number of the paper counts as met within this share of it, unless more is better."""

LEAST_R2 = 0.93
"""R² that Trial 3 must reach under the cylinder: the laboratory's own later fit."""


def comparison(results: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of the table "paper | ours | difference | status of the inputs".

    Parameters
    ----------
    results : dict
        The finished studies.

    Returns
    -------
    list of dict
        `quantity`, `paper`, `ours`, `difference`, `status`, `met` (None where the paper gives no criterion)
        and `note`.
    """
    return [
        *_deflection(results["skin_deflection"]),
        *_single_unit(results["single_unit"]),
        *_percept(results["discrimination"]),
        *_nail(results["nail"]),
    ]


def _row(
    quantity: str,
    published: str,
    ours: str,
    difference: str = "",
    status: str = "",
    met: bool | None = None,
    note: str = "",
) -> dict[str, Any]:
    return {
        "quantity": quantity,
        "paper": published,
        "ours": ours,
        "difference": difference,
        "status": status,
        "met": met,
        "note": note,
    }


MATERIALS = "materials assumed (Tables 1 and 2 are lost), geometry read"


def _deflection(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    later: Published = paper.LATER_DEFLECTION_R2
    trial_3 = found["trial3"]["cylinder"]
    r2 = trial_3["r2"]
    rows = [
        _row(
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
                _row(
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


def _single_unit(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    status = MATERIALS + "; recordings read"
    rows = [
        _measured(
            "Single unit, FSS out of sample (mean of six folds)",
            paper.FSS_OUT_OF_SAMPLE,
            found["fss_out_of_sample"],
            status,
            at_least=True,
        ),
        _measured(
            "Single unit, FSS in sample (all 36 shifts)",
            paper.FOLD_3_FSS_FITTED,
            found["fss_in_sample"],
            status + "; the paper's value is of fold 3",
            at_least=True,
        ),
    ]
    fold_3 = found["folds"][2]
    rows += [
        _measured("Fold 3, FSS at start point 2", paper.FOLD_3_FSS_START, fold_3["fss_start"][1], status),
        _measured(
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
        rows.append(_measured(quantity, published, ours, status, digits=0))
    return rows


def _measured(
    quantity: str, published: Published, ours: float, status: str, digits: int = 3, at_least: bool = False
) -> dict[str, Any]:
    """Row of a number that the paper prints: met from it on, or close to it."""
    close = abs(ours - published.value) <= CLOSE * published.value
    return _row(
        quantity,
        f"{published.value:g}",
        f"{ours:.{digits}f}",
        f"{ours - published.value:+.{digits}f}",
        status,
        bool(ours >= published.value if at_least else close),
        "" if at_least else f"judged: within {CLOSE:.0%}",
    )


def _percept(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    status = MATERIALS + "; curvatures 316, 328, 340 /m assumed"
    rows = [
        _measured(
            "Noise sigma_1 that fits Goodwin's two points",
            psychophysics.NOISE_SIGMA,
            found["noise_sigma"],
            status,
        )
    ]
    static = found["gradient_sum"]["static"]
    for curvature, observed in zip(
        found["goodwin"]["curvature_per_m"], found["goodwin"]["hit_rate"], strict=True
    ):
        column = list(found["curvature_per_m"]).index(curvature) - 1
        ours = float(static["hit_rate"][column])
        rows.append(
            _row(
                f"Hit rate at {curvature:g} /m, static Gradient Sum, noise fitted",
                f"{observed:g} (Goodwin)",
                f"{ours:.3f}",
                f"{ours - observed:+.3f}",
                status,
                abs(ours - observed) <= 0.05,
                "judged: within 0.05",
            )
        )
    for measure in ("static", "dynamic", "latency"):
        for name, key in (("0.0 mm", "hit_rate"), ("0.2 mm", "hit_rate_shifted")):
            rates = [float(rate) for rate in found["gradient_sum"][measure][key]]
            rises = all(later > earlier for earlier, later in pairwise(rates))
            rows.append(
                _row(
                    f"Hit rate rises with curvature, {measure} Gradient Sum at {name}",
                    "rises",
                    "rises" if rises else "does not",
                    "",
                    status,
                    rises,
                    ", ".join(f"{rate:.2f}" for rate in rates),
                )
            )
    change = {
        measure: max(abs(a - b) for a, b in zip(both["hit_rate"], both["hit_rate_shifted"], strict=True))
        for measure, both in found["gradient_sum"].items()
    }
    rows.append(
        _row(
            "Largest change of hit rate by the 0.2 mm shift",
            "static robust, dynamic and latency diverge",
            ", ".join(f"{measure} {value:.3f}" for measure, value in change.items()),
            "",
            status,
            change["static"] < min(change["dynamic"], change["latency"]),
            "judged: static changes least",
        )
    )
    return rows


def _nail(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    low, high = found["ratio_range"]
    return [
        _row(
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
