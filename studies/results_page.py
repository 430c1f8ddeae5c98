"""The numbers of a reproduction that pages show: docs/results.md and the table of the README.

A number that several pages need is in these tables only; the other pages link to them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from fingerpad.core.checked import result_class
from fingerpad.core.result_files import from_json
from fingerpad.core.values import Number, Vector
from fingerpad.experiments import schemas
from fingerpad.experiments.gerling2014.claims import ClaimRow, Group, Statement, Summary
from fingerpad.experiments.gerling2014.nerve import SingleUnitResult
from fingerpad.experiments.gerling2014.percept import SphereDiscrimination
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.report.reproduction import count_sentence, side_by_side, statement_cells
from fingerpad.report.tables import ABSENT, fixed, number
from studies.pages import joined, replaced, table

COMMAND = "python -m studies results"
README_START, README_END = f"<!-- {COMMAND} writes this table -->", "<!-- end of the table -->"
SET_COLUMNS = ("the paper", "`paper`", "", "`human`", "")  # Values and verdicts of both sets.


@result_class
class HitRates:
    """Hit rates of one code at both places of the sphere, (n_curvatures,)."""

    code: str
    hit_rate: Vector
    hit_rate_shifted: Vector


@result_class
class Percept:
    """Hit rates of the codes and of people, with 95 % intervals."""

    standard_per_m: float  #: Curvature of the standard. [1/m]
    curvature_per_m: Vector  #: Curvatures of the comparisons, (n_curvatures,). [1/m]
    codes: tuple[HitRates, ...]  #: The model's.
    noise_sigma: Number  #: Noise of all codes, fitted to people with the first.
    people_curvature_per_m: Vector
    people: Vector
    people_low: Vector
    people_high: Vector  #: Hit rates of people and their binomial intervals, (n_people,).


@result_class
class Excerpt:
    """What of a run the pages show.

    Dictionaries go by the two sets, `paper` and `human`. `indentations` counts them by part of the run;
    `single_unit` is the fit to the rates, fold by fold; `criterion` has the error bars of a varied criterion.
    """

    version: str
    resolution: str
    seed: int
    summary: dict[str, Summary]
    indentations: dict[str, int]
    statements: tuple[Statement, ...]
    comparison: dict[str, tuple[ClaimRow, ...]]
    single_unit: dict[str, SingleUnitResult]
    percept: dict[str, Percept]
    criterion: dict[str, dict[str, Vector]]


def read_excerpt(path: Path) -> Excerpt:
    """Take from results.json of `fingerpad reproduce --extended` what the pages show."""
    schemas.read(path, "fingerpad reproduction")  # refuses any other file
    return excerpt(from_json(ReproductionResult, path.read_bytes()))


def excerpt(results: ReproductionResult) -> Excerpt:
    """Pick from whole results what the pages show."""
    manifest, sets = results.manifest, {"paper": results.paper, "human": results.human}
    return Excerpt(
        version=manifest.version,
        resolution=manifest.resolution,
        seed=manifest.seed,
        summary=results.summary,
        indentations={stage.name: stage.indentations for stage in manifest.stages if stage.indentations},
        statements=results.statements,
        comparison={name: found.comparison for name, found in sets.items()},
        single_unit={name: found.single_unit for name, found in sets.items()},
        percept={name: _percept(found.discrimination) for name, found in sets.items()},
        criterion={name: found.discrimination.reasons.criterion for name, found in sets.items()},
    )


def _percept(found: SphereDiscrimination) -> Percept:
    measured = [phase for phase in ("static", "dynamic", "latency") if phase in found.gradient_sum]
    codes = {f"Gradient Sum, {phase}": found.gradient_sum[phase] for phase in measured}
    codes["Euclidean Distance, static"] = found.euclidean["static"]
    return Percept(
        standard_per_m=found.curvature_per_m[0],
        curvature_per_m=found.curvature_per_m[1:],
        codes=tuple(
            HitRates(code=name, hit_rate=rates.hit_rate, hit_rate_shifted=rates.hit_rate_shifted)
            for name, rates in codes.items()
        ),
        noise_sigma=found.noise_sigma,
        people_curvature_per_m=found.goodwin.curvature_per_m,
        people=found.goodwin.hit_rate,
        people_low=found.goodwin.low,
        people_high=found.goodwin.high,
    )


def results_page(shown: Excerpt) -> str:
    """Return docs/results.md."""
    noise = ", ".join(f"{fixed(each.noise_sigma, 3)} (`{name}`)" for name, each in shown.percept.items())
    page = joined(
        "# Results of the reproduction",
        f"One run of `fingerpad reproduce --resolution {shown.resolution} --extended` (fingerpad "
        f"{shown.version}, seed {shown.seed}, {sum(shown.indentations.values())} indentations). "
        f"`{COMMAND}` writes this page from `results.json`. [Which sets and "
        "why](decisions/paper-and-human.md); every number of the paper is on [the paper, section by "
        "section](paper.md).",
        "## Summary of both sets",
        _summaries(shown.summary),
        "## Statements of the paper that can fail",
        _statements(shown.statements),
        "## One afferent under the bar",
        _single_units(shown.single_unit),
        "FSS: fractional sum of squares, Eqs. 12-14; dynamic and static have weights 1:3. Rates in spikes/s.",
        "## Hit rates",
        "Of each sphere against one of 287 /m, with the sphere at 0.0 and at 0.2 mm. The noise is fitted to "
        f"people's two hit rates with the static Gradient Sum: {noise}.",
        _hit_rates(shown.percept),
        _criteria(shown.criterion),
    )
    return f"{page}\n"


SUMMARY_ROWS = (
    ("deflection_r2", "deflection under the cylinder, R²", "later model 0.93", "chose the moduli", 3),
    (
        "force_plate_1mm_n",
        "force of a plate 1.0 mm deep [N]",
        "people 0.11-0.23",
        "chose the factor of `human`",
        2,
    ),
    (
        "force_plate_2mm_n",
        "force of a plate 2.0 mm deep [N]",
        "people 0.50-1.04",
        "chose the factor of `human`",
        2,
    ),
    ("force_disc_1mm_n", "force of a disc of 6.35 mm 1.0 mm deep [N]", ABSENT, "predicted", 3),
    ("fss_out_of_sample", "FSS out of sample", "0.81", "predicted by folds", 3),
    ("fss_in_sample", "FSS in sample", "0.82 (fold 3)", "fitted", 3),
    ("static_difference_hz", "static rate, difference [spikes/s]", "52", "fitted", 0),
    ("resting_rate_hz", "rate without a touch [spikes/s]", "0", "bound of the fit", 1),
    ("noise_sigma", "noise that fits people", "0.055", "fitted", 3),
    (
        "euclidean_rms_same_noise",
        "Euclidean Distance at that noise, rms to people",
        "fits",
        "fitted with `human`",
        3,
    ),
    ("hit_rate_296", "hit rate at 296 /m, at 0.0 and at 0.2 mm", "people 0.58", "fitted", 3),
    ("hit_rate_365", "hit rate at 365 /m, at 0.0 and at 0.2 mm", "people 0.95", "fitted", 3),
    ("weber_144", "Weber fraction at 144 /m", "people 0.10-0.14", "predicted", 3),
    ("weber_287", "Weber fraction at 287 /m", "people 0.10-0.14", "predicted", 3),
)
"""Field, name, value of the paper or of people, whether it was fitted or chosen in sample, and digits."""


def _summaries(summary: Mapping[str, Summary]) -> str:
    def shown(value: object, digits: int) -> str:
        values = value if isinstance(value, tuple) else (value,)
        return ", ".join(fixed(each, digits) for each in values)

    rows = [
        (name, paper, *(shown(each[field], digits) for each in summary.values()), basis)
        for field, name, paper, basis, digits in SUMMARY_ROWS
    ]
    columns = ("quantity", "paper or people", "`paper`", "`human`", "fitted or predicted")
    return table(columns, rows)


def _statements(statements: Sequence[Statement]) -> str:
    columns = ("section", "statement", *SET_COLUMNS)
    return table(columns, [(each.section, *statement_cells(each)) for each in statements])


def _single_units(units: Mapping[str, SingleUnitResult]) -> str:
    def modulation(phase: str, ours: bool) -> list[str]:
        found = [unit.modulation[phase]["ours" if ours else "observed"] for unit in units.values()]
        return [f"{number(one.maximum_hz)}, {number(one.minimum_hz)}, {number(one.index)}" for one in found]

    rows = [
        ("FSS of the six folds", *(_folds(unit) for unit in units.values()), ""),
        *(
            (f"FSS of the {phase} rates", *_scores(units, f"fss_in_sample_{phase}"), "")
            for phase in ("dynamic", "static")
        ),
        *(
            (f"{phase} rate: largest, under the flat face, index (Eq. 11)",
             *modulation(phase, ours=True), modulation(phase, ours=False)[0])
            for phase in ("dynamic", "static")
        ),
    ]  # fmt: skip
    return table(("quantity", *(f"`{name}`" for name in units), "recorded"), rows)


def _folds(unit: SingleUnitResult) -> str:
    return " ".join(fixed(fold.fss_test, 2) for fold in unit.folds)


def _scores(units: Mapping[str, SingleUnitResult], name: str) -> list[str]:
    return [fixed(getattr(unit, name), 3) for unit in units.values()]


def _criteria(criterion: Mapping[str, Mapping[str, Vector]]) -> str:
    bars = "; ".join(
        f"`{name}` {fixed(each['point'][0], 3)} and {fixed(each['point'][1], 3)}"
        for name, each in criterion.items()
    )
    sigma = " and ".join(number(each) for each in next(iter(criterion.values()))["criterion_sigma"])
    return f"Mean error bar of a static hit rate with a decision point that varies by {sigma}: {bars}."


def _hit_rates(percepts: Mapping[str, Percept]) -> str:
    first = next(iter(percepts.values()))
    people = dict(zip(first.people_curvature_per_m, first.people, strict=True))
    rows = [
        (f"`{name}`", code.code, *(f"{fixed(one, 2)} {fixed(other, 2)}" for one, other in both))
        for name, percept in percepts.items()
        for code in percept.codes
        for both in [zip(code.hit_rate, code.hit_rate_shifted, strict=True)]
    ]
    observed = (fixed(people.get(each), 2) for each in first.curvature_per_m)
    columns = ("set", "code", *(f"{number(each)} /m" for each in first.curvature_per_m))
    return table(columns, [*rows, ("people", "Goodwin et al.", *observed)])


def readme_table(shown: Excerpt) -> str:
    """Return the table of the README: every statement that can fail, with both sets."""
    return _statements(shown.statements)


SECTIONS = {
    "2.1.1": ("Skin mechanics sub-model", "Mesh, layers and depth of the receptor are inputs here."),
    "2.1.2": (
        "Receptor membrane transduction sub-model",
        "Eqs. 1 and 2 are implemented as printed, but for h.",
    ),
    "2.1.3": (
        "Neural dynamics sub-model",
        "Eqs. 3 to 5 are solved exactly; the paper's Runge-Kutta is an option.",
    ),
    "2.1.4": ("Populations of receptors", "Layout and density are inputs."),
    "2.2.1": ("Skin mechanics validation", "Protocol; what it found is in 3.1."),
    "2.2.2": (
        "Single-unit fitting",
        "Eqs. 6 to 14, folds and response surfaces as printed; results are in 3.2.",
    ),
    "2.2.3": ("Population validation", "Protocol; people's 0.58 and 0.95 are inputs. Results are in 3.3."),
    "3.1": ("Skin mechanics validation, results", ""),
    "3.2": ("Single-unit fitting, results", ""),
    "3.3": ("Population validation, results", ""),
    "4": ("Discussion", ""),
    "4.2": ("Metrics of single-unit coding", ""),
    "4.3": ("Other sources of information", ""),
    "4.4": ("Model limitations", ""),
}
"""Sections of the paper that state something of the model: title, and what of it cannot fail here."""


KINDS_OF_ROWS = {
    Group.FITTED: "fitted or chosen in sample",
    Group.DEFINITION: "follows from definitions",
    Group.ADDITION: "our own addition",
}


def paper_page(shown: Excerpt) -> str:
    """Return docs/paper.md: the paper section by section, each statement with the verdict of both sets."""
    columns = ("statement", *SET_COLUMNS)
    rows: dict[str, list[tuple[str, ...]]] = {section: [] for section in SECTIONS}
    for each in shown.statements:
        rows[each.section].append(statement_cells(each))
    for first, found in side_by_side(*shown.comparison.values()):
        if first.section and first.group is not Group.STATEMENT:
            quantity, *cells, _ = found
            rows[first.section].append((f"{quantity} ({KINDS_OF_ROWS[first.group]})", *cells))
    parts = [
        "# The paper, section by section",
        "Gerling et al. 2014. Every statement that the run judges, where the paper makes it, with our value "
        f"and verdict of both sets; from the same run as [results](results.md), written by `{COMMAND}`. "
        f"{_counts(shown.statements)}",
    ]
    for section, (title, told) in SECTIONS.items():
        parts += [f"## {section} {title}", told, table(columns, rows[section]) if rows[section] else ""]
    return joined(*parts) + "\n"


def _counts(statements: Sequence[Statement]) -> str:
    return " ".join(count_sentence(statements, name) for name in ("paper", "human"))


def with_table(readme: str, shown: Excerpt) -> str:
    """Return the README with its table written anew."""
    return replaced(readme, README_START, README_END, readme_table(shown))
