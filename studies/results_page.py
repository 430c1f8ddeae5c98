"""The numbers of a reproduction that pages show: docs/results.md and the table of the README.

A number that several pages need is in these tables only; the other pages link to them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.results import Number, Vector, from_json, read_results, result_class
from fingerpad.experiments.gerling2014.claim_row import ClaimRow, Group
from fingerpad.experiments.gerling2014.discrepancy import CriterionErrorBars
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.gerling2014.single_unit import SingleUnitResult
from fingerpad.experiments.gerling2014.sphere_discrimination import SphereDiscrimination
from fingerpad.experiments.gerling2014.statements import Statement
from fingerpad.experiments.gerling2014.summary import Summaries
from fingerpad.report.comparison import (
    comparison_tables,
    count_sentence,
    notes_table,
    side_by_side,
    statement_cells,
    statement_table,
)
from fingerpad.report.discrimination import criterion_table
from fingerpad.report.formatting import ABSENT, fixed, number
from fingerpad.report.parts import Chapter, Paragraph
from fingerpad.report.single_unit import single_unit_tables
from studies.drive_quantities import DriveResult
from studies.drive_study import DriveStudy
from studies.fit_methods import FitMethods, MethodsStudy
from studies.pages.drive_quantities import QUANTITIES
from studies.pages.markdown import markdown_blocks
from studies.pages.markdown import markdown_table as table
from studies.sed_readings import Reading, ReadingsStudy, readings_table

COMMAND = "python -m studies results"
Kind = TypeVar("Kind")
README_START, README_END = f"<!-- {COMMAND} writes this table -->", "<!-- end of the table -->"


@result_class
class Method:
    """FSS of one method of fitting."""

    method: str
    free_numbers: int
    fss_in_sample: Number
    fss_training_mean: Number
    fss_out_of_sample: Number
    fss_test: Vector
    runs: int


@result_class
class Model:
    """FSS of one variant of the model; the offset of its receptor is 0 if it is not fitted. [mm]"""

    model: str
    fss_in_sample_dynamic: Number
    fss_in_sample_static: Number
    fss_in_sample: Number
    fss_out_of_sample: Number
    offset_mm: Number


@result_class
class Drive:
    """FSS with one quantity in the static and one in the dynamic term."""

    static: str
    dynamic: str
    fss_in_sample: Number
    fss_out_of_sample: Number
    fss_out_of_sample_dynamic: Number
    fss_out_of_sample_static: Number


@result_class
class HitRates:
    """Hit rates of one code at both places of the sphere, (n_curvatures,)."""

    code: str
    hit_rate: Vector
    hit_rate_shifted: Vector


@result_class
class Percept:
    """Hit rates of the codes and of people, with 95 % intervals.

    Parameters
    ----------
    standard_per_m : float
        Curvature of the standard. [1/m]
    curvature_per_m : array (n_curvatures,)
        Curvatures of the comparisons. [1/m]
    codes : tuple of HitRates
        The model's.
    noise_sigma : float
        Noise of all codes, fitted to people with the first.
    people_curvature_per_m, people, people_low, people_high : array (n_people,)
        Hit rates of people and their binomial intervals.
    """

    standard_per_m: float
    curvature_per_m: Vector
    codes: tuple[HitRates, ...]
    noise_sigma: Number
    people_curvature_per_m: Vector
    people: Vector
    people_low: Vector
    people_high: Vector


@result_class
class Excerpt:
    """What of a run the pages show.

    Dictionaries go by the two sets, `paper` and `human`. `indentations` counts them by part of the run;
    `single_unit` is the fit to the rates, fold by fold; `criterion` has the error bars of a varied criterion.
    """

    version: str
    resolution: str
    seed: int
    summary: Summaries
    indentations: dict[str, int]
    statements: tuple[Statement, ...]
    comparison: dict[str, tuple[ClaimRow, ...]]
    single_unit: dict[str, SingleUnitResult]
    methods: tuple[Method, ...]
    models: tuple[Model, ...]
    drives: tuple[Drive, ...]
    readings: tuple[Reading, ...]
    percept: dict[str, Percept]
    criterion: dict[str, CriterionErrorBars]


def read_excerpt(
    path: Path,
    methods: Path | None = None,
    drives: Path | None = None,
    readings: Path | None = None,
    before: Excerpt | None = None,
) -> Excerpt:
    """Take from the results of `fingerpad reproduce --extended` what the pages show.

    Parameters
    ----------
    path : Path
        Its results.json.
    methods : Path, optional
        The methods.json of `python -m studies methods`.
    drives : Path, optional
        The drives.json of `python -m studies drives`.
    readings : Path, optional
        The sed-readings.json of `python -m studies sed-readings`.
    before : Excerpt, optional
        What the pages show now; they keep those of its rows that no file replaces.

    Raises
    ------
    StoreError
        If a file cannot be read.
    """
    results = read_results(path, ReproductionResult)
    compared = None if methods is None else _studied(methods, MethodsStudy, "methods").methods
    driven = None if drives is None else _studied(drives, DriveStudy, "drives").quantities
    shown = excerpt(results, compared, driven)
    if before is not None and compared is None:
        shown = replace(shown, methods=before.methods, models=before.models)
    if before is not None and driven is None:
        shown = replace(shown, drives=before.drives)
    if readings is not None:
        return replace(shown, readings=_studied(readings, ReadingsStudy, "sed-readings").readings)
    return shown if before is None else replace(shown, readings=before.readings)


def _studied(path: Path, kind: type[Kind], study: str) -> Kind:
    try:
        return from_json(kind, path.read_bytes())
    except (OSError, InputError) as error:
        raise StoreError(f"{path} must come from `python -m studies {study}`: {error}") from error


def excerpt(
    results: ReproductionResult, compared: FitMethods | None = None, drives: DriveResult | None = None
) -> Excerpt:
    """Pick from whole results what the pages show; what a run did not compute stays empty."""
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
        methods=tuple(
            Method(
                method=row.method,
                free_numbers=row.free_numbers,
                fss_in_sample=row.fss_in_sample,
                fss_training_mean=row.fss_training_mean,
                fss_out_of_sample=row.fss_out_of_sample,
                fss_test=row.fss_test,
                runs=row.runs,
            )
            for row in (compared.methods if compared else ())
        ),
        models=tuple(
            Model(
                model=row.model,
                fss_in_sample_dynamic=row.fss_in_sample_dynamic,
                fss_in_sample_static=row.fss_in_sample_static,
                fss_in_sample=row.fss_in_sample,
                fss_out_of_sample=row.fss_out_of_sample,
                offset_mm=row.parameters.get("offset_mm", 0.0),
            )
            for row in (compared.models if compared else ())
        ),
        drives=tuple(
            Drive(
                static=candidate.static,
                dynamic=candidate.dynamic,
                fss_in_sample=candidate.fit.fss_in_sample,
                fss_out_of_sample=candidate.fit.fss_out_of_sample,
                fss_out_of_sample_dynamic=candidate.fit.fss_out_of_sample_dynamic,
                fss_out_of_sample_static=candidate.fit.fss_out_of_sample_static,
            )
            for candidate in (drives.candidates if drives else ())
        ),
        readings=(),
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
    parts = [
        "# Results of the reproduction",
        "The numbers on this page come from one run of "
        f"`fingerpad reproduce --resolution {shown.resolution} --extended` "
        f"(fingerpad {shown.version}, seed {shown.seed}). "
        f"`{COMMAND}` writes the page from `results.json`; do not edit it by hand. Other pages link to it. "
        "The times are in the [benchmarks](../benchmarks/README.md).",
        "## Summary of both sets",
        "The paper's value, or that of people, beside each set with its own drive and its own fit "
        "([which and why](decisions/paper-and-human.md)). The deflection and the force chose the moduli. The "
        "noise and the hit rates chose the afferent of the set `human`.",
        _summaries(shown.summary),
        "## Indentations",
        _indentations(shown.indentations),
        *map(
            _linked,
            markdown_blocks(
                Chapter(
                    "This run and the paper",
                    [
                        Paragraph(GROUPS),
                        statement_table(shown.statements),
                        notes_table(*shown.comparison.values()),
                        *comparison_tables(*shown.comparison.values()),
                    ],
                )
            ),
        ),
        *(
            block
            for name, unit in shown.single_unit.items()
            for block in markdown_blocks(
                Chapter(f"One afferent under the bar, `{name}`", single_unit_tables(unit))
            )
        ),
        "## FSS by method of fitting",
        "Fractional sum of squares (FSS, Eqs. 12-14) of one afferent under the bar. "
        "Out of sample: mean of six folds. From `python -m studies methods`, on the same recordings. "
        "[Settings of the methods](decisions.md#methods-of-fitting), "
        "[limits of the fit](single-unit.md#what-limits-the-fit).",
        _methods(shown.methods),
        "## FSS by variant of the model, and the offset of the receptor",
        "All fitted by CMA-ES. The offset is the distance of the receptor from its nominal position "
        "along the finger ([decision](decisions.md#receptor-offset)).",
        _models(shown.models),
        "## FSS by the quantity that drives the afferent",
        "All fitted by least squares, with `python -m studies drives` "
        "([discussion](single-unit.md#quantities-that-drive-the-afferent)).",
        _drives(shown.drives),
        *markdown_blocks(Chapter("Readings of the border", [readings_table(shown.readings)])),
        "## Hit rates",
        "Hit rate of each sphere against one of 287 /m. The noise is fitted to the two observed hit rates "
        "with the static Gradient Sum ([decision](decisions.md#noise-fitted)); all codes use it.",
        *(
            f"### `{name}`, noise {fixed(percept.noise_sigma, 3)}\n\n{_hit_rates(percept)}"
            for name, percept in shown.percept.items()
        ),
        *(
            block
            for name, bars in shown.criterion.items()
            for block in markdown_blocks(Chapter(f"Varied criterion, `{name}`", [criterion_table(bars)]))
        ),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


GROUPS = (
    "Each row belongs to one group. A number that was fitted, or by which something was chosen, is never "
    "counted as a met prediction. The report of a run also has the differences and the status of the inputs."
)
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
    ("dynamic_flat_hz", "dynamic rate under the flat face [spikes/s]", "54", "fitted", 0),
    ("dynamic_max_hz", "dynamic rate, largest [spikes/s]", "212", "fitted", 0),
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


def _summaries(summary: Summaries) -> str:
    def shown(value: object, digits: int) -> str:
        values = value if isinstance(value, tuple) else (value,)
        return ", ".join(fixed(each, digits) for each in values)

    rows = [
        (
            name,
            paper,
            *(shown(getattr(each, field), digits) for each in (summary.paper, summary.human)),
            basis,
        )
        for field, name, paper, basis, digits in SUMMARY_ROWS
    ]
    columns = ("quantity", "paper or people", "`paper`", "`human`", "fitted or predicted")
    return table(columns, rows)


def _linked(text: str) -> str:
    """Pages that a text names, as links from docs/."""
    page = r"docs/(decisions(?:/([\w-]+)\.md|\.md#([\w-]+)))"
    return re.sub(page, lambda match: f"[{match[2] or match[3]}]({match[1]})", text)


def _indentations(counts: Mapping[str, int]) -> str:
    rows = [(name, str(count)) for name, count in counts.items()]
    return table(("part of the run", "indentations"), [*rows, ("total", f"**{sum(counts.values())}**")])


def _methods(rows: Sequence[Method]) -> str:
    columns = ("method", "free parameters", "all shifts", "training", "out of sample", "fold by fold", "runs")
    return table(
        columns,
        [
            (
                row.method,
                str(row.free_numbers),
                *(fixed(score, 3) for score in (row.fss_in_sample, row.fss_training_mean)),
                f"**{fixed(row.fss_out_of_sample, 3)}**",
                " ".join(fixed(score, 2) for score in row.fss_test),
                str(row.runs),
            )
            for row in rows
        ],
    )


def _models(rows: Sequence[Model]) -> str:
    columns = ("model", "dynamic", "static", "all shifts", "out of sample", "offset [mm]")
    return table(
        columns,
        [
            (
                row.model,
                *(
                    fixed(score, 3)
                    for score in (row.fss_in_sample_dynamic, row.fss_in_sample_static, row.fss_in_sample)
                ),
                f"**{fixed(row.fss_out_of_sample, 3)}**",
                fixed(row.offset_mm, 3) if row.offset_mm else ABSENT,
            )
            for row in rows
        ],
    )


def _drives(rows: Sequence[Drive]) -> str:
    columns = ("static term", "dynamic term", "in sample", "out of sample", "dynamic", "static")
    return table(
        columns,
        [
            (
                *(QUANTITIES[term] for term in (row.static, row.dynamic)),
                fixed(row.fss_in_sample, 3),
                f"**{fixed(row.fss_out_of_sample, 3)}**",
                *(fixed(score, 3) for score in (row.fss_out_of_sample_dynamic, row.fss_out_of_sample_static)),
            )
            for row in rows
        ],
    )


def _hit_rates(percept: Percept) -> str:
    columns = ("code", "sphere at [mm]", *(f"{number(each)} /m" for each in percept.curvature_per_m))
    rows = [
        (code.code, place, *(fixed(rate, 2) for rate in rates))
        for code in percept.codes
        for place, rates in (("0.0", code.hit_rate), ("0.2", code.hit_rate_shifted))
    ]
    people = dict(zip(percept.people_curvature_per_m, percept.people, strict=True))
    observed = (fixed(people.get(each), 2) for each in percept.curvature_per_m)
    return table(columns, [*rows, ("observed (Goodwin et al.)", "", *observed)])


def readme_table(shown: Excerpt) -> str:
    """Return the table of the README: every statement that can fail, with both sets."""
    found = statement_table(shown.statements)
    return table(tuple(found.columns), [tuple(row.cells) for row in found.rows])


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
    columns = ("statement", "the paper", "`paper`", "", "`human`", "")
    rows: dict[str, list[tuple[str, ...]]] = {section: [] for section in SECTIONS}
    for each in shown.statements:
        rows[each.section].append(statement_cells(each))
    for first, row in side_by_side(*shown.comparison.values()):
        if first.section:
            quantity, *cells, _ = row.cells
            rows[first.section].append((f"{quantity} ({KINDS_OF_ROWS[first.group]})", *cells))
    parts = [
        "# The paper, section by section",
        "Gerling et al. 2014. Every statement that the run judges, where the paper makes it, with our value "
        f"and verdict of both sets; from the same run as [results](results.md), written by `{COMMAND}`. "
        f"{_counts(shown.statements)}",
    ]
    for section, (title, told) in SECTIONS.items():
        parts += [f"## {section} {title}", told, table(columns, rows[section]) if rows[section] else ""]
    return "\n\n".join(part for part in parts if part) + "\n"


def _counts(statements: Sequence[Statement]) -> str:
    return " ".join(count_sentence(statements, name) for name in ("paper", "human"))


def with_table(readme: str, shown: Excerpt) -> str:
    """Return the README with its table written anew.

    Raises
    ------
    InputError
        If the marks around the table are missing.
    """
    start, end = readme.find(README_START), readme.find(README_END)
    if start < 0 or end < start:
        raise InputError(f"README.md must hold {README_START} and {README_END}, in this order: it does not.")
    return readme[: start + len(README_START)] + f"\n{readme_table(shown)}\n" + readme[end:]
