"""The paper's statements about discrimination beside the numbers of this run.

Each verdict compares a statistic with a bound, or two statistics with each other. Where chance could decide,
a difference counts if it exceeds two Monte-Carlo errors.
"""

from __future__ import annotations

from fingerpad.data import psychophysics
from fingerpad.experiments.gerling2014.claim_row import MATERIALS, ClaimRow, measured_row
from fingerpad.experiments.gerling2014.discrepancy import EuclideanFit
from fingerpad.experiments.gerling2014.discrimination_statistics import DiscriminationStatistics, Estimate
from fingerpad.experiments.gerling2014.sphere_discrimination import SphereDiscrimination

STATUS = MATERIALS + "; curvatures 316, 328, 340 /m assumed"
ERRORS = 2.0
"""Monte-Carlo errors by which two numbers must differ for the difference to count."""

CLOSE_POINTS = 0.03
"""Within this of people's hit rates, and of each other, hit rates count as the same."""

FROM_LINE = 0.05
"""Within this of the line in z, hit rates between the two points count as on it."""

PLACES = ("0.0 mm", "0.2 mm")
MEASURES = ("static", "dynamic", "latency")


def discrimination_claims(found: SphereDiscrimination) -> list[ClaimRow]:
    """Judge the paper's statements about discrimination.

    Parameters
    ----------
    found : SphereDiscrimination
        From `discriminate_spheres`.

    Returns
    -------
    list of ClaimRow
    """
    statistics = found.statistics
    return [
        _noise(found),
        *_targets(found),
        _fits_best(statistics),
        *_shift(statistics),
        *_rises(found),
        *_variants(statistics),
        _euclidean(statistics, found.reasons.euclidean),
    ]


def _row(quantity: str, paper: str, ours: str, met: bool, note: str, difference: str = "") -> ClaimRow:
    """Return the row of a statement about discrimination; all rest on the same inputs."""
    return ClaimRow(
        quantity=quantity, paper=paper, ours=ours, difference=difference, status=STATUS, met=met, note=note
    )


def _noise(found: SphereDiscrimination) -> ClaimRow:
    rises, needed = (rise["static"] for rise in (found.reasons.rise, found.reasons.rise_for_paper_noise))
    expected = " and ".join(f"{rise:.0%}" if rise == rise else "none" for rise in needed)
    return measured_row(
        "Noise sigma_1 that fits Goodwin's two points",
        psychophysics.NOISE_SIGMA,
        found.noise_sigma,
        STATUS,
        note=f"our static sum increases by {' and '.join(f'{rise:.0%}' for rise in rises)} from 287 to "
        f"365 /m at the two positions; the paper's noise would need {expected}",
    )


def _targets(found: SphereDiscrimination) -> list[ClaimRow]:
    people, targets = found.goodwin, dict(zip(PLACES, found.statistics.targets, strict=True))
    at_points = [
        _at_point(place, curvature, observed, target.at_goodwin[index])
        for index, (curvature, observed) in enumerate(
            zip(people.curvature_per_m, people.hit_rate, strict=True)
        )
        for place, target in targets.items()
    ]
    between = [
        _row(
            f"Static hit rates between Goodwin's points, largest distance from their line in z, at {place}",
            "on the line (two points)",
            _text(target.largest_from_line),
            target.largest_from_line.value <= FROM_LINE,
            f"judged: within {FROM_LINE:g}; only 296 and 365 /m were observed, the line is interpolated",
        )
        for place, target in targets.items()
    ]
    return at_points + between


def _at_point(place: str, curvature_per_m: float, observed: float, ours: Estimate) -> ClaimRow:
    return _row(
        f"Hit rate at {curvature_per_m:g} /m, static Gradient Sum at {place}, noise fitted",
        f"{observed:g} (Goodwin)",
        _text(ours),
        bool(abs(ours.value - observed) <= CLOSE_POINTS),
        f"judged: within {CLOSE_POINTS:g}; one noise for both positions",
        f"{ours.value - observed:+.3f}",
    )


def _fits_best(statistics: DiscriminationStatistics) -> ClaimRow:
    misfit, above = statistics.misfit, statistics.misfit_above_static
    return _row(
        "Static rates fit best, by root mean square distance to Goodwin's points",
        "static best of three",
        ", ".join(f"{name} {_text(misfit[name])}" for name in MEASURES if name in misfit),
        all(_more(above[name]) for name in MEASURES[1:] if name in above),
        "judged: the others at least two Monte-Carlo errors farther; noise fitted to static rates",
    )


def _shift(statistics: DiscriminationStatistics) -> list[ClaimRow]:
    shift, above = statistics.shift, statistics.shift_above_static
    reasons = {
        "dynamic": "",
        "latency": "; the sum consists of differences between early receptors and late ones far from the "
        "sphere, and a shift along the finger changes both in the same way",
    }
    return [
        _row(
            "Static hit rates with the 0.2 mm shift, largest change",
            "robust",
            _text(shift["static"]),
            shift["static"].value <= CLOSE_POINTS,
            f"judged: at most {CLOSE_POINTS:g}",
        ),
        *(
            _row(
                f"Hit rates diverge with the 0.2 mm shift, {name}, largest change",
                "diverge",
                _text(shift[name]),
                _more(above[name]) and shift[name].value > CLOSE_POINTS,
                f"judged: more than {CLOSE_POINTS:g}, and than static by two Monte-Carlo errors{reason}",
                f"{above[name].value:+.3f} against static",
            )
            for name, reason in reasons.items()
            if name in shift
        ),
    ]


def _rises(found: SphereDiscrimination) -> list[ClaimRow]:
    return [
        _row(
            f"Hit rate rises with curvature, {measure} Gradient Sum at {place}",
            "rises",
            "rises" if _more(step) else "does not",
            _more(step),
            f"{', '.join(f'{rate:.2f}' for rate in rates)}; smallest step {_text(step)}, judged against two "
            "Monte-Carlo errors",
        )
        for measure in MEASURES
        if (drawn := found.gradient_sum.get(measure))
        for place, rates, step in zip(
            PLACES,
            (drawn.hit_rate, drawn.hit_rate_shifted),
            found.statistics.smallest_rise[measure],
            strict=True,
        )
    ]


def _variants(statistics: DiscriminationStatistics) -> list[ClaimRow]:
    fall, unsteady = statistics.noise_lowers, statistics.unsteadiness
    few, wide = statistics.ten_matrices, statistics.criterion
    return [
        _row(
            "More noise lowers the curve, smallest fall of the mean hit rate from one noise to the next",
            "lowers",
            _text(fall.smallest_fall),
            _more(fall.smallest_fall),
            f"sigma_1 of {fall.noise_sigma[0]:g} to {fall.noise_sigma[-1]:g} in steps of 0.01",
        ),
        _row(
            "10 noise matrices instead of 100 widen the error bars",
            "wider",
            f"{_text(few.ratio, 2)} times",
            _more(few.ratio, 1.0),
            f"largest change of a mean {_text(few.change)}",
        ),
        _row(
            "A criterion that varies by 0.02 instead of 0.01 widens the error bars",
            "wider",
            f"{_text(wide.ratio, 2)} times",
            _more(wide.ratio, 1.0),
            "the decision point varies; if beta varied, the bars would be below a tenth of these (reasons)",
        ),
        _row(
            "A criterion that varies by 0.02 instead of 0.01 does not change the means, largest change",
            "unchanged",
            _text(wide.change),
            wide.change.value <= CLOSE_POINTS,
            f"judged: at most {CLOSE_POINTS:g}",
        ),
        _row(
            "The mean of 10 hit rates is not stable, that of 100 is: standard deviation of the means",
            "10 unstable",
            f"{_text(unsteady.few, 4)} against {_text(unsteady.many, 4)}",
            _more(unsteady.ratio, 1.0),
            "repeated judgements of the same sums",
            f"{unsteady.ratio.value:.2f} times",
        ),
    ]


def _euclidean(statistics: DiscriminationStatistics, own: EuclideanFit) -> ClaimRow:
    misfit, above = statistics.misfit, statistics.misfit_above_static
    others = [misfit[name].value for name in MEASURES[1:] if name in misfit]
    ours = misfit["euclidean"].value
    alone = (
        f"with a separate noise of {own.noise_sigma:.3f}: {own.misfit:.3f}"
        if own.hit_rate is not None
        else "no separate noise fits the points"
    )
    return _row(
        "Euclidean Distance of static rates fits too, by root mean square distance to Goodwin's points",
        "fits",
        _text(misfit["euclidean"]),
        ours <= FROM_LINE and all(ours < other for other in others),
        f"judged: at most {FROM_LINE:g} and closer than dynamic rates and latencies; {alone}",
        f"{above['euclidean'].value:+.3f} against the static Gradient Sum",
    )


def _text(estimate: Estimate, digits: int = 3) -> str:
    return f"{estimate.value:.{digits}f} ± {estimate.error:.{digits}f}"


def _more(estimate: Estimate, than: float = 0.0) -> bool:
    """Whether an estimate is larger than a number by two of its errors."""
    return estimate.value - than > ERRORS * estimate.error
