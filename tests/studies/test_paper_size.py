"""Quick and standard against the paper's size: indentations, and how a known difference is shown."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from fingerpad.core.results import from_json, to_json
from fingerpad.experiments import runner
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import single_unit, skin_deflection, sphere_discrimination
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.indenters import Sphere
from fingerpad.geometry.mesh import block_mesh, finger_mesh
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.skin.indentation import touch_of
from studies import paper_size
from studies.mesh_refinement import PEAK_SHIFT
from studies.pages.markdown import markdown
from studies.pages.paper_size import PAPER_SIZE, draw, summary
from studies.paper_size import PaperSize
from studies.study import TISSUES

COARSE = Grading(RECEPTOR_X_MM, 1.0, 1.0, 1.0, 1.0, stratum_corneum=1, dermis=1, subcutis=1)
ERRORS = {"quick": 0.2, "standard": 0.05, "paper": 0.0, "deeper": -0.1}
"""Made-up: by how much energy, deflection and force lie above those of the paper's size."""


@pytest.fixture(scope="module")
def touches():
    return {name: paper_size.Touches.of(name) for name in paper_size.MESHES}


@pytest.mark.parametrize("name", paper_size.MESHES)
def test_touches_are_those_of_the_studies_on_half_of_the_finger(touches, name):
    conditions, mine = Conditions(name, tissues=TISSUES), touches[name]
    bars = single_unit.bar_touches(conditions)
    asked = [
        *(bars[shift] for shift in paper_size.CHOSEN_SHIFTS),
        *(
            touch
            for (_, curvature), touch in sphere_discrimination.discrimination_touches(conditions).items()
            if curvature in paper_size.CURVATURES
        ),
        *skin_deflection.deflection_touches(conditions).values(),
    ]
    assert [replace(touch.grading, full=False) for touch in asked] == [touch.grading for touch in mine.all()]
    assert [
        replace(touch, grading=same.grading) for touch, same in zip(asked, mine.all(), strict=True)
    ] == mine.all()
    assert (len(mine.deflection), len(mine.spheres)) == (6, 8)


def test_only_the_mesh_differs_between_standard_and_the_papers_size(touches):
    for standard, paper in zip(touches["standard"].all(), touches["paper"].all(), strict=True):
        assert replace(standard, grading=paper.grading) == paper
        assert standard.grading.counts == paper.grading.counts
        assert (paper.grading.size_x_mm, paper.grading.size_z_mm) == (0.1, 0.1)


def test_checks_differ_in_what_they_check(touches):
    sphere, whole = touches["paper"].spheres[paper_size.STANDARD_SPHERE], paper_size.whole_touch()
    assert whole.grading.full
    assert paper_size.half(whole) == sphere
    deeper = paper_size.deeper_touches()
    assert replace(deeper["sphere"], grading=sphere.grading) == sphere
    bar = touches["paper"].bars[PEAK_SHIFT]
    assert replace(deeper["bar"], grading=bar.grading) == bar
    for touch in deeper.values():
        assert replace(touch.grading, dermis=4, subcutis=4) == sphere.grading == bar.grading
        assert (touch.grading.dermis, touch.grading.subcutis) == (8, 8)


def test_the_preset_meets_the_papers_description():
    """Fewer bricks than the paper's bricks and wedges but more nodes; as wedges there would be more."""
    preset = paper_size.preset()
    assert preset.nodes >= 232_000
    assert preset.elements < 276_000 <= preset.elements_with_subcutis_of_wedges
    for edges in (preset.skin_edges, preset.border_edges):
        assert edges.count > 15_000
        assert edges.largest_mm < 0.106
        assert edges.median_mm == pytest.approx(0.1, abs=0.002)


def test_edges_of_the_pad_are_those_of_a_block():
    lines = np.arange(-8.0, 8.1, 0.5)
    block = block_mesh(lines, [0.0, 0.4, 0.5, 2.0], lines, layers=[0, 1, 2])
    x, depth, z = block.nodes_mm.T
    narrowing = np.column_stack([x * (1.0 - 0.2 * depth), depth - 10.0, 0.5 * z])
    for below, along in ((0, 0.5), (2, 0.45)):
        edges = paper_size.pad_edges(replace(block, nodes_mm=narrowing), 0.0, below)
        assert (edges.smallest_mm, edges.largest_mm) == pytest.approx((0.25, along))
    nodes = ((lines[:, None] / 5.5) ** 2 + (0.5 * lines / 4.5) ** 2 < 1.0).sum()
    assert 1.8 * nodes < edges.count < 2.0 * nodes


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results of a run whose skin is a formula with a known error; nothing but a tiny finger is pressed."""
    touch = touch_of(Fingertip(), Sphere(curvature_per_m=287.0), RampAndHold(depth_mm=0.2), grading=COARSE)
    pressed = replace(touch, settings=PressSettings(1, 1)).solve()
    mesh = finger_mesh(Fingertip(), COARSE)
    x, _, z = mesh.nodes_mm[mesh.elements].mean(axis=1)[np.repeat(mesh.living_epidermis.ravel(), 4)].T
    over_time = np.array([0.0, 1.0, 0.9])[:, None]
    solved = []

    def mesh_of(touch):
        if touch.grading.dermis == 8:
            return "deeper"
        resolutions = {2: "quick", 4: "standard"}
        return "paper" if touch.grading.half_width_mm == 5.0 else resolutions[touch.grading.stratum_corneum]

    class Formula:
        def __init__(self, folder):
            pass

        def missing(self, touches):
            return {touch: touch for touch in touches if touch not in solved}

        def load(self, touch):
            assert touch in solved
            factor = 1.0 + ERRORS[mesh_of(touch)]
            if touch.grading.full:
                factor = 1.0 + 1e-7
            width = 1000.0 / touch.indenter.curvature_per_m if isinstance(touch.indenter, Sphere) else 3.0
            bump = 5.0 / width * np.exp(-(((x - touch.at_mm[0]) / width) ** 2) - (z / width) ** 2)
            return pressed.with_fields(
                sed_kpa=over_time * bump * factor,
                skin_displacement_mm=pressed.skin_displacement_mm * factor,
                force_mn=pressed.force_mn * factor,
            )

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "Store", Formula)
        patch.setattr(runner, "solve_missing", lambda missing, *rest: solved.extend(missing.values()))
        found = paper_size.run(runner.Runner(tmp_path_factory.mktemp("paper_size")))
    return found, solved, pressed


def test_a_run_presses_each_mesh_once_and_finds_the_known_errors(results):
    found, solved, pressed = results
    assert len(solved) == len(set(solved)) == 3 * 20 + 3
    deepest = pressed.surface_profile().deflection_mm.max()
    for name in ("quick", "standard"):
        error = ERRORS[name]
        for row in found.deflection.errors[name].values():
            assert row.profile_mm.max == pytest.approx(error * deepest, rel=0.02)
            assert row.force == row.peak_force == pytest.approx(error)
        sed = found.bars.errors[name].sed
        assert [sed[phase].max for phase in ("ramp", "hold")] == pytest.approx([error] * 2, rel=1e-6)
        for position in ("0", "0.2"):
            row = found.spheres.errors[name][position]
            assert row.touches == len(paper_size.CURVATURES)
            assert row.force.max == pytest.approx(error, rel=1e-6)
        assert found.spheres.errors[name]["0"].sed["ramp"].max == pytest.approx(error, rel=1e-6)
    latencies = [found.bars.errors[name].latency_ms.max for name in ("quick", "standard")]
    assert latencies[0] > latencies[1] > 0.0
    for changes in found.twice_as_deep.values():
        for change in asdict(changes).values():
            assert change == pytest.approx(ERRORS["deeper"])
    assert found.half_against_whole.sed["ramp"].max == pytest.approx(1e-7, rel=1e-3)


def test_profiles_count_proximal_as_positive_and_only_cylinders_have_observations(results):
    found, _, pressed = results
    profile = pressed.surface_profile()
    shown = found.deflection.deflection_mm["paper"]["trial 3, line"]
    proximal = found.deflection.distance_mm.tolist().index(3.0)
    assert shown[proximal] == pytest.approx(profile.at(-3.0))
    assert shown[proximal] != pytest.approx(profile.at(3.0))
    for trial, row in found.deflection.errors["quick"].items():
        assert np.isnan(row.r2) == (trial.split(", ")[1] == "line")
    cylinder = found.deflection.errors["quick"]["trial 1, cylinder"]
    assert cylinder.r2_reference == skin_deflection.deflection_r2(profile)


def test_hit_rates_are_at_every_position_and_share_their_random_numbers(results):
    spheres = results[0].spheres
    for positions in spheres.hit_rates.values():
        assert set(positions) == {"0", "0.2"}
        for rates in positions.values():
            assert np.diff(rates["static"]).min() > 0.0
    static = [spheres.hit_rates[name]["0"]["static"] for name in ("paper", "quick")]
    assert not np.array_equal(*static)
    assert spheres.position_mm.tolist().count(0.2) == len(paper_size.CURVATURES)


def test_the_mesh_of_the_wire_is_finer_than_the_others(results):
    sizes = results[0].meshes
    assert {size["line"].size_x_mm for size in sizes.values()} == {0.025}
    nodes = {kind: size.nodes for kind, size in sizes["paper"].items()}
    assert nodes["line"] > nodes["cylinder"] == nodes["bar"] == nodes["sphere"]


def test_pages_show_the_errors_of_every_mesh(results):
    found = results[0]
    assert to_json(from_json(PaperSize, to_json(found))) == to_json(found)
    page = markdown(PAPER_SIZE.page(found))
    assert PAPER_SIZE.section(found) == f"#{page}"
    assert "](images/paper_size.png)" in page
    assert "| bar | −10.0 % | −10.0 % | −10.0 % |" in page
    assert "| trial 3, line | standard |" in page
    for name in ("quick", "standard"):
        assert f"| {name} | {100 * ERRORS[name]:.1f} % |" in page
        assert page.count(f"| {name} | 0.2 |") == 2
        rates = found.spheres.hit_rates[name]["0.2"]
        shown = [f"{100 * rate:.1f} %" for measure in ("dynamic", "static") for rate in rates[measure]]
        assert f"| {name} | 0.2 | {' | '.join(shown)} |" in page
    tables = [block.splitlines() for block in page.split("\n\n") if block.startswith("|")]
    assert len(tables) == 8
    for lines in tables:
        assert len({line.count("|") for line in lines}) == 1


def test_the_summary_holds_the_worst_of_every_touch(results):
    found = results[0]
    errors = {name: dict(rows) for name, rows in found.deflection.errors.items()}
    worst = errors["standard"]["trial 2, line"]
    worst = replace(worst, profile_mm=replace(worst.profile_mm, max=0.123))
    errors["standard"]["trial 2, line"] = worst
    found = replace(found, deflection=replace(found.deflection, errors=errors))
    rows = dict(line.strip("| ").split(" | ", 1) for line in summary(found).splitlines())
    deepest = max(found.deflection.deflection_mm["paper"]["trial 1, line"])
    assert rows["skin, six deflections [µm]"] == f"{200 * deepest:.0f} | 123"
    for quantity in ("their force", "energy density at the receptor, bar"):
        assert rows[quantity] == "20.0 % | 5.0 %"
    rates = [
        max(
            row.rate_hz["dynamic"].max
            for row in (found.bars.errors[name], *found.spheres.errors[name].values())
        )
        for name in ("quick", "standard")
    ]
    assert rows["dynamic rate, bar and spheres [spikes/s]"] == " | ".join(f"{rate:.1f}" for rate in rates)
    hits = found.spheres.hit_rates
    points = [
        max(
            abs(np.subtract(hits[name][position]["static"], hits["paper"][position]["static"])).max()
            for position in ("0", "0.2")
        )
        for name in ("quick", "standard")
    ]
    assert rows["hit rate, static [points]"] == " | ".join(f"{100 * point:.1f}" for point in points)


def test_the_figure_draws_every_mesh(results):
    figure = draw(results[0])
    deflection, errors, bars, rates = figure.axes
    assert [line.get_label() for line in bars.get_lines()] == list(paper_size.MESHES)
    assert len(deflection.get_lines()) == len(rates.get_lines()) == 6
    assert len(errors.get_lines()) == 12
