"""The report draws finished numbers: all of them, escaped, in files that are whole or absent."""

import base64
import json
import re
import struct
from dataclasses import fields, replace
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.patches import Circle

from fingerpad.core.result_files import to_json
from fingerpad.data import STATUSES, all_published
from fingerpad.experiments.gerling2014.claims import Group, paired
from fingerpad.experiments.gerling2014.nerve import PopulationMaps
from fingerpad.experiments.gerling2014.percept import SphereDiscrimination
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult, SetResult
from fingerpad.experiments.gerling2014.skin import NailBorder, SkinForce, mesh_picture
from fingerpad.experiments.scores import Verdict
from fingerpad.experiments.tissue_sets import tissue_layers
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import finger_mesh
from fingerpad.report import nerve, percept, reproduction, skin, tables
from fingerpad.report import page as page_module
from fingerpad.report.page import SETS, VERDICTS, Chapter, Drawing, Page, write_html
from fingerpad.report.reproduction import SIGNS
from fingerpad.report.results import page_of, write_page
from fingerpad.report.style import BLUE, GREEN, ORANGE, RESOLUTION_DPI, STYLE, new_figure, png
from fingerpad.report.tables import Row, Table, filled, filled_table
from report_rows import caption_of, table_of
from sections import (
    CURVATURE_PER_M,
    SHIFT_MM,
    discrimination_section,
    nail_section,
    single_unit_section,
    skin_deflection_section,
    typed,
)
from tools.schemas import schema_of

QUICK = finger_mesh(Fingertip(), resolution_grading("quick", 17.37))


def synthetic_set(tissues: str = "paper") -> dict:
    """Results of one set with every section, shaped like a run and plausible in size."""
    rises = ("does not", "missed") if tissues == "paper" else ("rises", "met")
    firing = dict.fromkeys(("peak_ms", "dynamic_share_ramp", "dynamic_share_hold"), [0.5] * SHIFT_MM.size)
    firing |= {"window_ms": [0.0, 50.0], "sed_r2": 0.8}
    firing |= {"depth_mm": [0.5, 1.0], "static_rate_by_depth_hz": [10.0, 20.0]}
    return {
        "tissues": tissues,
        "mesh": json.loads(to_json(mesh_picture(QUICK, 17.37))),
        "levels": _levels(),
        "skin_force": dict.fromkeys([field.name for field in fields(SkinForce)], 0.5),
        "firing": firing,
        "single_unit": single_unit_section(),
        "single_unit_uncertainty": _single_unit_uncertainty(),
        "discrimination": discrimination_section(),
        "curvature_thresholds": _curvature_thresholds(),
        "population": _population(),
        "nail": nail_section(),
        "comparison": [
            _compared("statement", "FSS out of sample", "0.81", "0.84", "met"),
            _compared("statement", "rises", "rises", *rises),
            _compared("statement", "latency", "diverge", "0.0", "not decidable"),
            _compared("fitted", "hit rate at 296 /m", "0.58", "0.71", "missed", fitted_to="noise"),
            _compared("addition", "force under the cylinder", "–", "210 mN", "not decidable"),
        ],
    }


def synthetic_results() -> dict:
    """Results of both sets."""
    numbers = {"deflection_r2": 0.5, "hit_rate_296": (0.6, 0.6), "weber_144": None}
    sets = {name: synthetic_set(name) for name in SETS}
    rows = [typed(SetResult, sets[name]).comparison for name in SETS]
    mesh = {
        "nodes": 232000, "elements": 221000, "smallest_gauss_jacobian_mm3": 0.001,
        "smallest_scaled_jacobian": 0.55,
    }  # fmt: skip
    manifest = {
        "version": "0.1.0", "seed": 1, "resolution": "standard", "wall_s": 4210.5, "peak_memory_mb": 3100.0,
        "stages": [{"name": "spheres", "wall_s": 812.0, "indentations": 14}],
        "packages": {"numpy": "2.2.0", "scipy": "1.15.0"}, "python": "3.11.2", "platform": "Linux",
        "started": "2025-01-01T00:00:00", "code_hash": "0123456789abcdef", "materials": "trial3",
        "inputs": {}, "meshes": {"sphere": mesh},
    }  # fmt: skip
    keys = ("name", "value", "unit", "source", "status")
    inputs = [
        ("depth", 1.0, "mm", "section 2.2", "paper"),
        ("fillet", 0.3, "mm", "later model", "read"),
        ("density", 70.0, "1/cm2", "1979", "recalled"),
        ("spheres", CURVATURE_PER_M, "1/m", "lost", "assumed"),
    ]
    return sets | {
        "summary": {"paper": numbers, "human": numbers},
        "statements": [json.loads(to_json(each)) for each in paired(*rows)],
        "skin_deflection": skin_deflection_section(),
        "tissues": [json.loads(to_json(layer)) for layer in tissue_layers()],
        "inputs": [dict(zip(keys, each, strict=True)) for each in inputs],
        "manifest": manifest,
    }


def _compared(group: str, quantity: str, paper: str, ours: str, verdict: str, **more: str) -> dict:
    row = {"group": group, "quantity": quantity, "paper": paper, "ours": ours, "verdict": verdict, **more}
    return row | {"section": "3.1", "note": "mean of six folds"}


def _levels() -> dict:
    """Skin, spikes and rates of a receptor under a sphere, all of them made up."""
    along, down = np.meshgrid(np.linspace(10.0, 25.0, 31), np.linspace(-9.0, -5.0, 9), indexing="ij")
    times = np.linspace(0.0, 200.0, 41)
    return {
        "curvature_per_m": 287.0, "centre_mm": [17.4, -12.4], "ramp_ms": 50.0,
        "x_mm": along.tolist(), "y_mm": down.tolist(), "pressed": "compressive stress",
        "pressed_kpa": np.exp(-np.abs(along[:-1, :-1] - 17.4)).tolist(), "end_ms": 1000.0,
        "offset_mm": [0.0, 1.0, 2.0], "spikes_ms": [[5.0, 30.0, 70.0], [8.0, 60.0], []],
        "dynamic_rate_hz": [140.0, 200.0, 0.0], "static_rate_hz": [66.0, 58.0, 0.0],
        "times_ms": times.tolist(), "until_ms": 200.0,
        "current_ma": (1e-6 * np.exp(-times / 50.0)).tolist(), "potential_mv": (times % 50.0).tolist(),
        "rheobase_ma": 7e-7, "threshold_mv": 50.0,
    }  # fmt: skip


def _single_unit_uncertainty() -> dict:
    names = ("intercept_per_ms", "dynamic_gain_per_kpa", "static_gain_per_kpa_ms", "time_constant_ms")
    interval = {"low": 0.5, "median": 1.0, "high": 1.5}
    wave = np.abs(np.sin(SHIFT_MM))
    heights = {"new_low": 10.0, "low": 40.0, "median": 50.0, "observed": 55.0, "high": 60.0, "new_high": 90.0}
    rates = {f"{key}_hz": (height * wave).tolist() for key, height in heights.items()}
    rates |= {"share_within_new": 0.95, "probability_of_independence": 0.01}
    rates |= {"residual_deviation_hz": interval, "residual_length_mm": interval}
    profile = {"values": [0.5, 1.0, 1.5], "losses": [2.5, 0.0, 2.5], "low": 0.6, "high": None}
    six = (*names, "intercept_ma", "dynamic_gain", "static_gain", "resting_share")
    sobol = ("lower", "upper", "first", "first_half_width", "total", "total_half_width")
    return {
        "level": 0.95, "seed": 0,
        "units": dict(zip(names, ("1/ms", "1/kPa", "1/(kPa ms)", "ms"), strict=True)),
        "fit": dict.fromkeys(names, 1.0), "capacitance_mf": 6e-7, "threshold_mv": 30.0,
        "identifiability": {
            "rank": 4,
            "relative_singular_values": [1.0, 0.3, 0.2, 0.01, 1e-10, 1e-10],
        },
        "posterior": dict.fromkeys(six, interval),
        "convergence": {
            "ensembles": 4, "walkers": 80, "draws": 51200, "evaluations": 100000, "acceptance": 0.3,
            "r_hat": 1.004, "effective_draws": 400.0, "effective_draws_of_tails": 300.0,
            "draws_per_effective_draw": 128.0,
        },
        "shift_mm": SHIFT_MM.tolist(), "rates": {"dynamic": rates, "static": rates},
        "evidence_for_alike_residuals": 30.0, "profiles": [profile | {"name": name} for name in names],
        "sensitivity": {key: [0.1, 0.2, 0.3, 0.4] for key in sobol}
        | {"mean": 0.85, "standard_deviation": 0.02, "evaluations": 3072},
    }  # fmt: skip


def _curvature_thresholds() -> dict:
    def at(standard: float) -> dict:
        return {
            "standard_per_m": standard, "jnd_per_m": 0.1 * standard, "weber_fraction": 0.1,
            "ideal_weber_fraction": 0.06,
            "fitted_weber_fraction": 0.101, "fitted_interval": [0.08, 0.13],
        }  # fmt: skip

    population = {
        "layout": "paper", "rows": 3, "columns": 6, "noise_sigma": 0.14,
        "standards": [at(144.0), at(287.0)],
        "without_threshold": [{"standard_per_m": 400.0, "why_not": "No sphere reaches 75 %."}],
    }  # fmt: skip
    return {
        "seed": 0, "proportion": 0.75, "judgements": 100, "pressed_per_m": [144.0, 287.0, 400.0],
        "populations": [population],
    }  # fmt: skip


def _population() -> dict:
    x, z = np.linspace(12.0, 22.0, 11), np.linspace(-5.0, 5.0, 13)
    away = np.hypot(x[:, None] - 17.4, z[None, :])
    static = np.where(away > 4.0, 0.0, 50.0 * np.exp(-((away / 2.0) ** 2)))
    latency = [[None if r > 4.0 else 6.0 + 6.0 * r for r in row] for row in away]
    return {
        "curvature_per_m": 287.0, "x_mm": x.tolist(), "z_mm": z.tolist(), "static_rate_hz": static.tolist(),
        "dynamic_rate_hz": (4.0 * static).tolist(), "first_spike_latency_ms": latency,
        "receptors_mm": [[15.0 + i, j - 1.0] for i in range(6) for j in range(3)],
        "at_rest": {"dynamic_rate_hz": 0.0, "static_rate_hz": 4.0, "first_spike_latency_ms": 251.0},
    }  # fmt: skip


def drawn(results):
    return page_of("reproduction", typed(ReproductionResult, results))


def written(results, folder):
    return write_page("reproduction", results, folder)


DRAWINGS = drawn(synthetic_results()).drawings


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    results, settings = typed(ReproductionResult, synthetic_results()), dict(matplotlib.rcParams)
    path = written(results, tmp_path_factory.mktemp("report"))
    again = to_json(typed(ReproductionResult, synthetic_results()))
    assert to_json(results) == again, "drawing changed the results"
    assert dict(matplotlib.rcParams) == settings, "drawing changed settings that others share"
    return path


def test_the_report_is_one_page_with_its_figures_and_loads_no_other_file(report):
    files = sorted(entry for entry in report.parent.rglob("*") if entry.is_file())
    pictures = [entry for entry in files if entry.suffix == ".png"]
    assert files == sorted([report, *pictures])
    numbered = {int(path.name.split("_")[1]) for path in pictures if path.name.startswith("figure_")}
    assert numbered == {drawing.number for drawing in DRAWINGS if drawing.number} == {*range(1, 13)} - {3, 10}
    for picture in pictures:
        png = picture.read_bytes()
        start = png.index(b"pHYs") + 4
        assert struct.unpack(">I", png[start : start + 4])[0] == round(RESOLUTION_DPI / 0.0254)
    text = report.read_text(encoding="utf-8")
    inside = [base64.b64decode(code) for code in re.findall(r"data:image/png;base64,([^\"]+)", text)]
    names = [name for drawing in DRAWINGS for name in drawing.images]
    assert inside == [(report.parent / "figures" / f"{name}.png").read_bytes() for name in names]
    assert len(pictures) == len(names)
    without_pictures = re.sub(r"base64,[^\"]+", "", text)
    assert not re.search(r"<script|<link|@import|url\(|https?:", without_pictures)
    assert text.startswith("<!DOCTYPE html>")
    assert len(re.findall(r'<img alt="Figure \d+\. \w', text)) == len(inside) - 3


def test_equal_results_give_equal_bytes(report, tmp_path, monkeypatch):
    for drawing in DRAWINGS[:3]:
        for name, draw in drawing.images.items():
            assert png(draw) == (report.parent / "figures" / f"{name}.png").read_bytes()
    monkeypatch.setattr(page_module, "png", lambda draw: b"")
    results = [typed(ReproductionResult, synthetic_results()) for _ in range(2)]
    one, two = (written(each, tmp_path / f"{n}").read_bytes() for n, each in enumerate(results))
    assert one == two


def test_a_figure_that_fails_leaves_the_old_page_as_it_was(tmp_path):
    def page(draw):
        drawings = [Drawing(name, {name: draw}, "") for name in ("first", "second")]
        return Page("Skin", "", [], [Chapter("Depth", drawings)])

    write_html(page(lambda: new_figure(1.0, 1.0)), tmp_path / "page.html")
    before = {entry: entry.read_bytes() for entry in tmp_path.rglob("*.*")}
    assert len(before) == 3
    figures = iter([new_figure(2.0, 2.0)])
    with pytest.raises(StopIteration):
        write_html(page(lambda: next(figures)), tmp_path / "page.html")
    assert {entry: entry.read_bytes() for entry in tmp_path.rglob("*.*")} == before


def _page() -> Page:
    table = Table("Depths", ("name", "depth [mm]"), [Row(("skin", "1.0"), "final")], "Half of the finger.")
    drawing = Drawing("Skin", {"skin": lambda: new_figure(1.0, 1.0)}, "It yields.", number=4)
    text = "See `fp.press` & others."
    chapters = [Chapter("", [text]), Chapter("Level 1: skin", [drawing, table])]
    return Page("A title", "A subtitle.", ["A summary."], chapters)


def test_a_page_is_written_as_html(tmp_path):
    text = write_html(_page(), tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<p>See <code>fp.press</code> &amp; others.</p>" in text
    assert '<a href="#level-1-skin">' in text
    assert '<section id="level-1-skin">' in text
    assert "<figcaption><b>Figure 4. Skin.</b> It yields.</figcaption>" in text
    assert '<tr class="final"><th scope="row">skin</th><td>1.0</td></tr>' in text
    assert "Half of the finger." in text


HOSTILE = "<script>alert('x')</script>&\""


CHOICES = ("paper", "read", "recalled", "assumed", *Group, *Verdict, "")
"""Texts that are chosen from a few, and absent ones."""


def poisoned(value):
    """The same results with hostile texts and hostile names wherever a name is free."""
    if isinstance(value, dict):
        return {key: poisoned(item) for key, item in value.items()}
    if isinstance(value, list):
        return [poisoned(item) for item in value]
    return HOSTILE if isinstance(value, str) and value not in CHOICES else value


def test_texts_are_escaped_wherever_they_stand(tmp_path, monkeypatch):
    # Every figure takes the hostile texts, but none is laid out: its bytes say nothing about the page.
    monkeypatch.setattr(page_module, "png", lambda draw: repr(draw()).encode())
    results = synthetic_results()
    results |= poisoned({key: results[key] for key in ("statements", "inputs")})
    for name in SETS:
        parts = ("single_unit", "nail", "comparison")
        results[name] |= poisoned({key: results[name][key] for key in parts})
    manifest = poisoned(results["manifest"])
    manifest["packages"][HOSTILE] = HOSTILE
    results["manifest"] = manifest
    results["paper"]["single_unit"]["parameters"][HOSTILE] = 1.0
    text = written(typed(ReproductionResult, results), tmp_path).read_text(encoding="utf-8")
    assert "<script" not in text
    assert text.count("&lt;script&gt;") > 40


KEPT = (
    *("distance_mm", "shift_mm", "x_mm", "y_mm", "z_mm", "receptors_mm", "curvature_per_m", "fold"),
    *("testing_shift_mm", "is_artefact", "inputs", "iteration", "shown", "positions_mm", "radii_mm"),
    *("edges_ms", "active_edges_ms", "density_per_cm2", "area_per_afferent_mm2", "manifest"),
)
"""Numbers without which there is no axis to draw on, and the manifest, which is always complete."""


def without_numbers(value, schema, shapes):
    """The same results with None for every number that the schema lets be absent."""
    if not isinstance(schema, dict) or not schema.keys() - {"additionalProperties", "type"}:
        schema = {"additionalProperties": True} | (schema if isinstance(schema, dict) else {})
    schema = next((kind for kind in schema.get("anyOf", []) if kind.get("type") != "null"), schema)
    schema = shapes[schema["$ref"].rsplit("/")[-1]] if "$ref" in schema else schema
    if isinstance(value, dict):
        fields, others = schema.get("properties", {}), schema.get("additionalProperties")
        return {
            key: item if key in KEPT else without_numbers(item, fields.get(key, others), shapes)
            for key, item in value.items()
        }
    if isinstance(value, list):
        kinds = schema.get("prefixItems") or [schema.get("items", True)] * len(value)
        return [without_numbers(item, kind, shapes) for item, kind in zip(value, kinds, strict=True)]
    absent = schema.get("type") in (None, ["number", "null"])
    return None if absent and isinstance(value, int | float) else value


def test_what_does_not_exist_is_drawn_as_nothing_and_written_as_a_dash(tmp_path, monkeypatch):
    monkeypatch.setitem(STYLE, "savefig.dpi", 20)
    schema = schema_of(ReproductionResult)
    results = without_numbers(synthetic_results(), schema, schema["$defs"])
    assert results["human"]["discrimination"]["statistics"]["misfit"]["static"]["value"] is None
    assert results["skin_deflection"]["trial1"]["cylinder"]["r2"] is None
    text = written(typed(ReproductionResult, results), tmp_path).read_text(encoding="utf-8")
    visible = re.sub(r"base64,[^\"]+", "", text)
    assert "nan" not in re.sub(r"<[^>]+>", " ", visible).lower().split()
    assert "None" not in visible
    assert visible.count("<td>–</td>") > 50


def test_parts_beyond_the_paper_are_left_out_where_they_were_not_run():
    short = synthetic_results()
    for name in SETS:
        for key in ("single_unit_uncertainty", "curvature_thresholds"):
            short[name].pop(key)
    pages = [drawn(each) for each in (synthetic_results(), short)]
    assert [[drawing.number for drawing in page.drawings][-2:] for page in pages] == [[11, 12], [8, 9]]
    (beyond,) = (chapter for chapter in pages[1].chapters if chapter.title == "Beyond the paper")
    assert "`fingerpad reproduce --extended`" in beyond.parts[0]


def test_a_miss_is_marked_in_words_and_by_its_cell(report):
    cells = re.findall(
        r'<td class="(met|missed|open)">([✓✗○?] [^<]+)</td>', report.read_text(encoding="utf-8")
    )
    marks = [("met", "✓ met"), ("missed", "✗ missed"), ("open", "? not decidable")]
    assert set(cells) == {*marks, ("missed", "✗ missed (fitted)")}
    assert len(set(SIGNS.values())) == len(SIGNS) == len(Verdict)  # they differ without colour
    assert set(VERDICTS) == {SIGNS[each] for each in Verdict if each is not Verdict.NOT_APPLICABLE}
    made = [row.get("made") for row in page_module.PAGES["reproduction"]["parts"]]
    assert [name for name in made if name and "claims" in name] == [f"claims, {group}" for group in Group]


def test_the_first_screen_has_verdicts_and_the_contents_stand_beside_the_page(report):
    text = report.read_text(encoding="utf-8")
    page = drawn(synthetic_results())
    assert not page.paragraphs
    assert [row.cells for row in page.verdicts[0].rows] == [
        ("3.1 FSS out of sample", "✓ met", "✓ met"),
        ("3.1 rises", "✗ missed", "✓ met"),
        ("3.1 latency", "? not decidable", "? not decidable"),
        ("met", "1 of 3", "2 of 3"),
    ]
    first = text[text.index("<main>") : text.index("<section")]
    assert (first.count("<table"), first.count("<img"), first.count("<figcaption>")) == (1, 3, 3)
    deflection, afferent, hits = (drawing.caption for drawing in page.opening)
    wanted = "R² of the deflection 0.93 with Trial 1, 0.94 with Trial 2, 0.95 with Trial 3; in the paper"
    assert deflection == f"Skin: {wanted} Trial 3 is the closest."
    assert afferent == "Afferent: FSS out of sample `paper` 0.82 and `human` 0.82; the paper 0.81."
    assert "`paper` 0.12 and `human` 0.12; the paper 0.055" in hits
    contents = re.findall(r'<a href="#([^"]+)"', text[: text.index("<main>")])
    assert contents == [chapter.anchor for chapter in page.chapters]
    open_parts = re.sub(r"<details>.*?</details>", "", text, flags=re.DOTALL)
    assert open_parts.count("<table") == len(["verdicts", "steps to a hit rate"])
    assert open_parts.count("<img") == 3 + 2 * len([1, 2, 4, 5, 6, 7, 8, 9]) - 2
    assert text.count("<table") > 25


def test_inputs_are_listed_exactly_and_the_assumed_ones_are_marked():
    numbers = all_published()
    meanings = table_of("reproduction", "Status of a number", None)
    assert dict(row.cells for row in meanings.rows) == STATUSES
    listed = table_of("reproduction", "Published numbers", SimpleNamespace(inputs=numbers))
    for number, row in zip(numbers, listed.rows, strict=True):
        values = number.value if isinstance(number.value, tuple) else (number.value,)
        # Numbers are set in groups of three and with true minus signs; undone, they are the very numbers.
        texts = row.cells[1].replace("−", "-").replace("⁻", "-").split(", ")
        read = [
            text.translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789", " ")).replace("×10", "e")
            for text in texts
        ]
        assert [float(text) for text in read] == list(values)
        assert (row.kind == "assumed") == (number.status == "assumed")


def test_steps_and_searches_of_the_fit_have_a_table_each():
    section = typed(SetResult, synthetic_set()).single_unit
    steps, folds = (table_of("reproduction", each, section) for each in ("Steps of", "Folds"))
    assert "fold 3" in steps.title
    assert "start 2" in steps.note
    assert [row.cells[0] for row in steps.rows] == ["0", "1", "2", "3"]
    assert steps.rows[-1].cells[1] == "0.840"
    assert [row.cells[0] for row in folds.rows] == ["1", "2", "3", "4", "5", "6"]
    assert folds.rows[2].cells[-1] == "0.850, 0.840; 402"


def test_tables_of_discrimination_have_hit_rates_interpretations_and_readings_of_the_criterion():
    section = typed(SphereDiscrimination, discrimination_section())
    titles = ("Hit rates", "Interpretations", "Error bars")
    rates, meant, read = (table_of("reproduction", each, section) for each in titles)
    assert rates.columns[2:] == ["296 1/m", "305 1/m", "316 1/m", "328 1/m", "340 1/m", "365 1/m"]
    assert len(rates.rows) == 20
    first = section.gradient_sum["static"]
    assert rates.rows[0].cells[2] == f"{first.hit_rate[0]:.2f}\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}0.02"
    assert [row.kind for row in meant.rows] == ["final", "", "final", "final", ""]
    assert meant.rows[0].cells[:3] == ("static, eight neighbours (used)", "18 / 17", "0.460 / 0.430")
    assert meant.rows[1].cells[4] == meant.rows[1].cells[6]
    spreads = [("0.0500", "0.1000"), ("0.0020", "0.0040"), ("0.0030", "0.0060")]
    assert [row.cells[1:] for row in read.rows] == spreads


def test_every_table_is_rectangular():
    page = drawn(synthetic_results())
    parts = [part for chapter in page.chapters for part in (*chapter.parts, *chapter.folded)]
    made = [part for part in parts if isinstance(part, Table)]
    assert len(made) > 12
    for each in made:
        assert {len(row.cells) for row in each.rows} == {len(each.columns)}, each.title


def test_texts_and_tables_are_filled_with_what_lies_at_paths():
    found = {"fss": 0.5, "steps": [(1, 2.0)], "level": None, "n": {"a.b": 1, "low": None}}
    assert (
        filled("{fss}, {fss:2}, {fss:percent}, {steps:count}, {steps.0.1}", found) == "0.5, 0.50, 50 %, 1, 2"
    )
    assert filled("{level}, {level.low}, {steps.7.1}, {steps.-1.0}", found) == "–, –, –, 1"
    assert filled("{data.protocol.DEPTH.value:1} mm, {kept}", {"kept": "{fss}"}) == "1.0 mm, {fss}"
    rows = {"table": "T", "columns": ["n", "over {fss}"], "note": "{steps:count} step."}
    each = filled_table(rows | {"each": "steps", "cells": ["{0} (used)", "{1:1}"]}, found)
    assert each == Table("T", ["n", "over 0.5"], [Row(("1 (used)", "2.0"), "final")], "1 step.")
    listed = filled_table(rows | {"rows": [["x", "assumed"], ["y", "{fss}"]]}, found)
    assert listed.rows == [Row(("x", "assumed"), "assumed"), Row(("y", "0.5"))]


def test_a_figure_is_one_function_and_one_row_of_its_page(monkeypatch):
    row = {"chapter": "Skin", "both": "depth_mm"}
    shown = row | {"figure": "depths", "number": 2, "title": "Depths", "caption": "{0} mm."}
    numbers = row | {"table": "T", "columns": ["depth [mm]"], "rows": [["{0:1}"]]}
    made = row | {"table": "Twice", "columns": ["depth"], "made": "twice"}
    monkeypatch.setitem(page_module.PAGES, "page", {"parts": [shown, numbers, made]})

    @page_module.enter(page_module.DRAW, "depths")
    def draw(depth_mm):
        return new_figure(depth_mm[0], 1.0)

    @page_module.enter(page_module.ROWS, "twice")
    def make(depth_mm):
        return [(str(2.0 * depth_mm[0]),)]

    class Sets:
        paper, human = ({"depth_mm": [depth_mm]} for depth_mm in (1.0, 2.0))

    ((chapter, (drawing, *tables)),) = page_module.page_parts("page", Sets).items()
    assert (chapter, drawing.label, drawing.caption) == ("Skin", "Figure 2. Depths", "1 mm.")
    widths = {name: made().get_figwidth() for name, made in drawing.images.items()}
    assert widths == {"depths_paper": 1.0, "depths_human": 2.0}
    assert [(each.title, *each.rows[0].cells) for each in tables] == [
        ("T, paper", "1.0"), ("T, human", "2.0"), ("Twice, paper", "2.0"), ("Twice, human", "4.0"),
    ]  # fmt: skip
    Sets.human = {}
    assert page_module.page_parts("page", Sets) == {"Skin": []}


def lines(axes):
    return {line.get_label(): line for line in axes.get_lines()}


def test_figure_4_draws_the_profiles_given_and_sets_the_artefact_apart():
    section = skin_deflection_section()
    given = typed(ReproductionResult, synthetic_results()).skin_deflection
    line, cylinder = skin.draw_skin_deflection(given).axes
    for trial, name in (("trial1", "Trial 1"), ("trial2", "Trial 2"), ("trial3", "Trial 3")):
        np.testing.assert_array_equal(lines(line)[name].get_ydata(), section[trial]["line"]["deflection_mm"])
    drawn = lines(cylinder)
    assert "Trial 3, R² = 0.95" in drawn
    assert drawn["observed"].get_xdata().size == 44
    # The artefact lies on the proximal side by the results; figures have the distal side on the right.
    assert drawn["observed, artefact (left out)"].get_xdata().tolist() == [9.25]
    assert "distal" in cylinder.get_xlabel()
    assert not any("observed" in name for name in lines(line))
    assert cylinder.yaxis_inverted()


def test_figure_5_draws_the_fitted_line_over_observed_points_and_the_papers_levels():
    section = single_unit_section()
    given = typed(SetResult, synthetic_set()).single_unit
    for axes, phase in zip(nerve.draw_single_unit(given).axes, ("dynamic", "static"), strict=True):
        drawn = lines(axes)
        np.testing.assert_array_equal(drawn["model (fitted)"].get_ydata(), section[f"{phase}_rate_hz"])
        np.testing.assert_array_equal(drawn["observed"].get_ydata(), section[f"observed_{phase}_rate_hz"])
        np.testing.assert_array_equal(drawn["observed"].get_xdata(), -SHIFT_MM)
        assert drawn["observed"].get_marker() == "o"
        assert drawn["model (fitted)"].get_marker() in ("None", "")
    dynamic, static = nerve.draw_single_unit(given).axes
    levels = {
        label: [line.get_ydata()[0] for line in dynamic.get_lines() if line.get_label() == label]
        for label in ("predicted by the paper, lowest and highest", "observed, lowest and highest")
    }
    assert list(levels.values()) == [[54.0, 212.0], [70.0, 210.0]]
    assert dynamic.get_ylim()[1] > 212.0
    (difference,) = static.containers
    (low, high) = difference.lines[2][0].get_segments()[0][:, 1]
    assert (low, high - low) == (given.modulation["static"]["ours"].minimum_hz, pytest.approx(52.0))
    caption = caption_of("reproduction", "figure_5_single_unit", given)
    assert "54 and 212 spikes/s" in caption
    assert "70 and 210 spikes/s as observed" in caption


def test_figure_1_draws_the_finger_in_three_dimensions_and_every_element_of_the_planes_by_its_layer():
    section = typed(SetResult, synthetic_set()).mesh
    figure = skin.draw_mesh(section)
    whole, across, along, near = figure.axes
    n_skin, n_through = (section.x_mm.shape[0] - 1) * (section.x_mm.shape[1] - 1), section.layer.size
    assert whole.name == "3d"
    assert len(whole.collections[0].get_facecolor()) == 2 * n_skin
    for axes, plane, halves in (
        (along, section.along, 1),
        (across, section.across, 2),
        (near, section.along, 1),
    ):
        faces = [part for part in axes.collections if isinstance(part, PolyCollection)]
        assert len(faces) == halves
        for part in faces:
            assert len(part.get_paths()) == (plane.right_mm.shape[0] - 1) * n_through
            drawn = [matplotlib.colors.to_hex(colour) for colour in part.get_facecolor()[:n_through]]
            assert drawn == [skin.LAYER_COLOURS[layer] for layer in section.layer]
    (receptor,) = near.get_lines()
    assert np.hypot(*(receptor.get_xydata()[0] - section.contact_mm)) == pytest.approx(0.471, abs=0.002)
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert named == [
        "stratum corneum 0.371 mm", "living epidermis 0.1 mm", "dermis 1.153 mm", "subcutis", "bone", "nail",
    ]  # fmt: skip
    caption = caption_of("reproduction", "figure_1_mesh", section)
    assert f"{tables.number(len(QUICK.nodes_mm))} nodes and" in caption
    np.testing.assert_array_equal(
        section.across.right_mm[:, 0], QUICK.nodes_mm[QUICK.skin_grid[0], 2].round(4)
    )


def test_figure_2_draws_skin_current_potential_and_the_spikes_of_three_afferents():
    section = typed(SetResult, synthetic_set()).levels
    figure = reproduction.draw_levels(section)
    pressed, current, potential, train, spikes, bar = figure.axes
    np.testing.assert_array_equal(pressed.collections[0].get_array(), section.pressed_kpa.ravel())
    assert bar.get_ylabel() == "compressive stress\n[kPa]"
    sphere = next(patch for patch in pressed.patches if isinstance(patch, Circle))
    assert sphere.radius == pytest.approx(1000.0 / 287.0)
    np.testing.assert_array_equal(current.get_lines()[0].get_ydata(), 1e6 * section.current_ma)
    np.testing.assert_array_equal(potential.get_lines()[0].get_ydata(), section.potential_mv)
    assert lines(potential)["threshold"].get_ydata()[0] == 50.0
    assert train.collections[0].get_positions() == [5.0, 30.0, 70.0]
    assert [len(row.get_positions()) for row in spikes.collections] == [3, 2, 0]
    labels = [label.get_text() for label in spikes.get_yticklabels()]
    assert labels == ["0 mm\n140 and 66/s", "1 mm\n200 and 58/s", "2 mm\n0 and 0/s"]


def test_the_steps_of_both_codes_have_the_letters_of_the_paper_and_the_noise_of_the_run():
    steps = table_of("reproduction", "Steps to a hit rate", typed(ReproductionResult, synthetic_results()))
    texts = "\n".join(cell for row in steps.rows for cell in row.cells)
    for letter in ("a", "b", "c", "d, e", "f", "g, h", "i, j", "k", *(f"{each}*" for each in "bcdefgh")):
        assert f"({letter})" in texts
    assert "σ₁ = 0.12 (`paper`) and 0.12 (`human`)" in texts
    assert "287 1/m" in steps.note


def test_figure_6_leaves_silent_places_open_and_tells_the_rate_without_a_touch():
    section = typed(PopulationMaps, _population())
    maps = [axes for axes in nerve.draw_population(section).axes if axes.get_title()]
    assert len(maps) == 3
    for axes, name in zip(maps, nerve.QUANTITIES, strict=True):
        shown = np.ma.getmaskarray(axes.collections[0].get_array()).reshape(13, 11)
        silent = ~(getattr(section, name) > 0.0)
        assert 0 < silent.sum() < silent.size
        np.testing.assert_array_equal(shown, silent.T)
        np.testing.assert_array_equal(axes.get_lines()[0].get_xydata(), section.receptors_mm)
    untouched = table_of("reproduction", "The afferent without touch", section)
    assert [row.cells[1] for row in untouched.rows] == ["0", "4", "251"]
    nowhere = replace(section, first_spike_latency_ms=np.full_like(section.static_rate_hz, np.nan))
    assert "no afferent fires" in nerve.draw_population(nowhere).axes[2].texts[0].get_text()


def test_figure_7_has_the_papers_letters_people_and_our_curves_with_bars_of_one_deviation():
    section = typed(SphereDiscrimination, discrimination_section())
    panels = [axes for axes in percept.draw_observers(section).axes if axes.get_title()]
    titles = [axes.get_title().replace("\n", " ") for axes in panels]
    assert titles[0] == "(a) Gradient Sum, static σ₁ = 0.12"
    assert titles[3] == "(d) Euclidean, static σ₁ = 0.12"
    assert titles[4:7] == [
        "(e) Gradient Sum, static σ₁ = 0.025",
        "(f) Gradient Sum, static σ₁ = 0.085",
        "(g) Gradient Sum, static σ₁ = 0.12, 10 matrices",
    ]
    for axes in panels:
        (people,) = [bars for bars in axes.containers if bars.get_label().startswith("observed")]
        points, _, (intervals,) = people.lines
        assert points.get_xydata().tolist() == [[296.0, 0.58], [365.0, 0.95]]
        ends = [sorted(bar[:, 1].round(9).tolist()) for bar in intervals.get_segments()]
        assert ends == [[0.48, 0.68], [0.89, 0.98]]
    axes = percept.draw_observers(section).axes[1]
    rates = section.gradient_sum["dynamic"]
    ours = [bars for bars in axes.containers if bars.get_label().startswith("predicted")]
    for container, suffix, style in zip(ours, ("", "_shifted"), ("-", ":"), strict=True):
        curve, _, (bars,) = container.lines
        assert curve.get_linestyle() == style
        assert curve.get_ydata().tolist() == getattr(rates, f"hit_rate{suffix}").tolist()
        lengths = [bar[1, 1] - bar[0, 1] for bar in bars.get_segments()]
        np.testing.assert_allclose(lengths, 2.0 * getattr(rates, f"hit_rate{suffix}_sd"))


def test_figure_9_shows_the_nail_from_above_and_in_a_section_with_both_halves():
    section = typed(NailBorder, nail_section())
    above, across, profile = skin.draw_nail(section).axes[:3]
    half = 19 * 15
    seen = np.ma.getdata(above.collections[0].get_array())
    assert seen.size == 2 * half
    # The pad, with the peak under the sphere, is farthest from the eye.
    assert seen.argmax() < half
    assert len(across.collections[0].get_paths()) == 2 * len(section.across.von_mises_kpa)
    labels = [line.get_label() for line in profile.get_lines()[:2]]
    assert labels == ["surface of the skin", "living epidermis"]
    assert f"{section.ratio:.3g} times" in profile.get_title()
    scales = {(axes.collections[0].norm.vmin, axes.collections[0].norm.vmax) for axes in (above, across)}
    assert scales == {(0.0, section.border_kpa)}
    edges = [np.array(lines.get_segments()) for lines in above.collections[1:]]
    np.testing.assert_array_equal(edges[0] * [1.0, -1.0], edges[1])
    assert edges[0][0].tolist() == [[17.0, 0.0], [17.0, 5.0]]


def test_colours_of_trials_and_layers_differ_in_grey_and_lines_without_colour():
    def greys(colours):
        return [np.dot(matplotlib.colors.to_rgb(colour), (0.2126, 0.7152, 0.0722)) for colour in colours]

    trials = greys((BLUE, ORANGE, GREEN))
    assert min(abs(np.subtract.outer(trials, trials))[np.triu_indices(3, 1)]) > 0.08
    assert len({style["linestyle"] for style in skin.TRIAL_STYLES.values()}) == 3
    assert (np.diff(greys(skin.LAYER_COLOURS)) > 0.15).all()


NUMBERS = {
    0.0: "0", 999.6: "1000", 1234.5: "1234", 12345.6: "12 346", 0.00099996: "0.001",
    0.000999: "9.99 × 10⁻⁴", 9.99e-7: "9.99 × 10⁻⁷", -3e7: "−3 × 10⁷", float("nan"): "–",
    float("-inf"): "−∞",
}  # fmt: skip


def test_numbers_read_well_at_the_ends_of_each_notation():
    assert {value: tables.number(value) for value in NUMBERS} == NUMBERS
    assert tables.number(-0.0) == "0"
