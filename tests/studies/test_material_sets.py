"""Sets of tissues on three levels: closed forms, a search that recovers the truth, and one tiny run."""

import re
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.results import from_json, to_json
from fingerpad.core.signals import SedTraces
from fingerpad.data import protocol
from fingerpad.data import tissues as published
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.grading import Grading
from fingerpad.mechanics.laws import Hyperfoam, Polynomial
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.neuron.afferent import Afferent
from fingerpad.skin.sampling import SurfaceProfile
from fingerpad.skin.store import Store
from studies import __main__ as command
from studies import material_sets, material_study, trial_order
from studies.hyperfoam_fit import (
    hyperfoam_stress_kpa,
    polynomial_of_hyperfoam,
    polynomial_stress_terms,
)
from studies.material_candidates import candidates, deflection_candidates, layered, wu_polynomials
from studies.material_sets import (
    CylinderDeflection,
    Effort,
    EvaluatedSet,
    FittedAfferent,
    Levels,
    MaterialSet,
    UnsolvedSet,
    bar_sed,
    compare,
    pareto_front,
    touches,
)
from studies.material_study import LevelsMet, MaterialStudy, meets
from studies.pages.markdown import markdown, write_markdown
from studies.pages.material_sets import materials_page
from studies.trial_order import Excess, TrialDifference, TrialOrder

WU_SKIN = (published.WU_SKIN_HYPERFOAM_MU.value, published.WU_SKIN_HYPERFOAM_ALPHA.value)


# Hyperfoam and polynomial in uniaxial load


def energy_kpa(law, stretches):
    """Energy of a law at principal stretches, through the package's own formula."""
    logs = np.log(stretches)
    return law.energy.derivatives([*(logs - logs.mean()), logs.sum()])[0]


@pytest.mark.parametrize("stretch", [0.5, 0.8, 1.3])
@pytest.mark.parametrize("poisson", [0.3, 0.4, 0.48])
def test_hyperfoam_stress_is_the_slope_of_the_law_that_the_mechanics_solve(stretch, poisson):
    law, step = Hyperfoam(*WU_SKIN, poisson), 1e-5

    def along(length, side):
        return energy_kpa(law, [length, side, side])

    side = stretch**-poisson
    sideways = (along(stretch, side + step) - along(stretch, side - step)) / (2 * step)
    slope = (along(stretch + step, side) - along(stretch - step, side)) / (2 * step)
    assert sideways == pytest.approx(0.0, abs=1e-6 * law.shear_modulus_kpa * 10)
    assert hyperfoam_stress_kpa([stretch], *WU_SKIN, poisson)[0] == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("stretch", [0.5, 0.8, 1.3])
@pytest.mark.parametrize("name", ["c10", "c01", "c20", "c11", "c02"])
def test_polynomial_stress_is_the_slope_of_each_term(stretch, name):
    coefficients = dict.fromkeys(("c10", "c01", "c20", "c11", "c02"), 0.0) | {name: 1.0}
    # A law needs an initial stiffness: that of 1 kPa in c10 is taken off again.
    law = Polynomial(**{**coefficients, "c10": coefficients["c10"] + 1.0}, bulk_linear=100.0)
    base, step = Polynomial(c10=1.0, bulk_linear=100.0), 1e-5

    def term(length):
        stretches = [length, length**-0.5, length**-0.5]
        return energy_kpa(law, stretches) - energy_kpa(base, stretches)

    slope = (term(stretch + step) - term(stretch - step)) / (2 * step)
    column = list(coefficients).index(name)
    assert polynomial_stress_terms([stretch])[0, column] == pytest.approx(slope, rel=1e-6)


def test_the_fit_recovers_a_polynomial_that_is_also_a_hyperfoam():
    # With alpha = 2 and no change of volume, the foam is neo-Hookean with C10 = mu / 2.
    coefficients, misfit = polynomial_of_hyperfoam([4.0], [2.0], 0.49999999)
    assert coefficients == pytest.approx([2.0, 0.0, 0.0, 0.0, 0.0], abs=1e-6)
    assert misfit < 1e-6


@pytest.mark.parametrize("poisson", [0.40, 0.48])
@pytest.mark.parametrize("compression", [0.3, 0.5])
def test_polynomials_follow_wus_compression_closely_and_are_stable(poisson, compression):
    coefficients, misfit = polynomial_of_hyperfoam(*WU_SKIN, poisson, compression)
    stretch = np.linspace(1.0 - compression, 0.99, 50)
    foam = hyperfoam_stress_kpa(stretch, *WU_SKIN, poisson)
    error = polynomial_stress_terms(stretch) @ coefficients - foam
    assert np.abs(error).max() < 0.02 * np.abs(foam).max()
    assert misfit < 0.005
    assert (coefficients >= 0.0).all()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: hyperfoam_stress_kpa([0.0], [1.0], [2.0], 0.4), "stretch must be above 0"),
        (lambda: hyperfoam_stress_kpa([1.0], [1.0, 2.0], [2.0], 0.4), "one entry per term: got 2 and 1"),
        (lambda: hyperfoam_stress_kpa([1.0], [1.0], [2.0], 0.5), "poisson must be at least 0 and below 0.5"),
        (lambda: polynomial_of_hyperfoam([1.0], [2.0], 0.4, 1.0), "compression must lie between 0 and 1"),
    ],
)
def test_unusable_laws_are_refused(call, said):
    with pytest.raises(InputError, match=re.escape(said)):
        call()


# Candidates and their presses


def test_candidates_have_different_names_and_a_source():
    every = (*candidates(), *deflection_candidates())
    assert len({candidate.name for candidate in every}) == len(every) >= 30
    statuses = ("assumed", "recalled", "read")
    assert all(any(word in candidate.basis for word in statuses) for candidate in every)


def test_wus_polynomials_keep_their_ratio_of_compressibility():
    for poisson in (0.40, 0.48):
        for material in wu_polynomials(0.40, poisson):
            assert material.poisson == pytest.approx(poisson)
            assert (material.law.c02 > 0.0, material.law.c20) == (True, 0.0)


def test_a_candidate_is_pressed_by_cylinder_bar_and_three_spheres():
    candidate = MaterialSet("own", layered(40.0, 20.0, 5.0), "assumed")
    pressed = touches(candidate, Conditions("quick"))
    assert [key for key in pressed if key[0] != "sphere"] == [("cylinder", 3.17), ("bar", 0.0)]
    assert [key[1] for key in pressed if key[0] == "sphere"] == [287.0, 296.0, 365.0]
    assert all(touch.tissues == candidate.tissues for touch in pressed.values())
    shifted = touches(candidate, Conditions("quick"), shifted_bars=True)
    assert tuple(key[1] for key in shifted if key[0] == "bar") == protocol.BAR_SHIFTS.value


def test_the_one_bar_has_its_edges_on_the_mesh_and_all_sites_in_the_fine_zone():
    grading = touches(candidates()[0], Conditions("quick"))["bar", 0.0].grading
    assert grading.half_length_mm > max(map(abs, protocol.BAR_SHIFTS.value))
    assert grading.size_x_mm == Conditions("quick").bar_grading().size_x_mm


class Skin:
    """Skin whose energy density is x, so that a trace tells where it was sampled."""

    def __init__(self, offset=0.0):
        self.offset = offset

    def sed(self, sites):
        at = np.asarray(sites, dtype=float)[:, 0] + self.offset
        return SedTraces(np.array([0.0, 50.0, 1000.0]), np.outer([0.0, 1.0, 1.0], at), np.array([50.0]))


def test_one_bar_is_read_where_a_shifted_bar_would_have_the_receptor():
    shifts = np.array(protocol.BAR_SHIFTS.value)
    read = bar_sed({("bar", 0.0): Skin(), ("sphere", 287.0): None}, tilt_deg=60.0)
    assert read.sed_kpa[-1] == pytest.approx(RECEPTOR_X_MM + 0.5 * shifts)


def test_shifted_bars_are_read_at_the_receptor_in_the_order_of_the_shifts():
    bars = {("bar", shift): Skin(offset=shift) for shift in reversed(protocol.BAR_SHIFTS.value)}
    read = bar_sed(bars, tilt_deg=60.0)
    assert read.sed_kpa[-1] == pytest.approx(RECEPTOR_X_MM + np.array(protocol.BAR_SHIFTS.value))


# An afferent for each candidate

TIMES_MS = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 100.0, 300.0, 1000.0])


def ramp_and_hold(peaks_kpa):
    course = np.concatenate([np.linspace(0.0, 1.0, 6) ** 2, [0.98, 0.96, 0.95]])
    return SedTraces(TIMES_MS, np.outer(course, peaks_kpa), np.array([50.0]))


def synthetic_levels(scale=1.0, seed=3):
    shift = np.array(protocol.BAR_SHIFTS.value)
    bar = ramp_and_hold(scale * (0.2 + 1.8 * np.exp(-((np.abs(shift) - 1.4) ** 2))))
    receptor = np.arange(18.0)
    spheres = [
        ramp_and_hold(scale * peak * np.exp(-(((receptor % 6) - 2.5) ** 2 + (receptor // 6 - 1) ** 2) / 4))
        for peak in (2.0, 2.05, 2.4)
    ]
    return Levels(bar, spheres, seed)


EFFORT = Effort(generations=25, population=8)
TRUTH = np.array([2e-7, 1.2e-4, 1.4e-6, 50.0, 1e-6, 50.0])


def test_the_search_finds_an_afferent_that_answers_like_the_one_that_made_the_rates():
    levels = synthetic_levels()
    dynamic, static = levels.problem.model.evaluate(TRUTH)
    recordings = replace(levels.problem.recordings, dynamic_rate_hz=dynamic, static_rate_hz=static)
    levels.problem = replace(levels.problem, recordings=recordings)
    assert static.max() > 20.0
    found = levels.search(EFFORT, percept_weight=0.0)
    assert levels.fss(found) > 0.99
    assert levels.evaluated(found).fss == levels.fss(found)


def test_a_common_factor_on_all_moduli_does_not_change_the_fit():
    soft, stiff = synthetic_levels(1.0), synthetic_levels(8.0)
    found = [levels.search(Effort(generations=3, population=4), 0.0) for levels in (soft, stiff)]
    assert soft.fss(found[0]) == pytest.approx(stiff.fss(found[1]), abs=1e-9)
    assert found[1][1:3] == pytest.approx(found[0][1:3] / 8.0, rel=1e-9)
    assert soft.hit_rates(found[0], 0.1) == pytest.approx(stiff.hit_rates(found[1], 0.1), abs=1e-9)


def test_the_joint_search_trades_fss_for_hit_rates_only():
    levels = synthetic_levels()
    alone, joint = (levels.search(EFFORT, weight) for weight in (0.0, 1.0))
    assert levels.percept_error(joint) < levels.percept_error(alone)
    assert levels.fss(joint) < levels.fss(alone) + 1e-3


def test_no_noise_is_fitted_to_equal_responses():
    levels = synthetic_levels()
    levels.spheres = [levels.spheres[0]] * 3
    found = levels.evaluated(TRUTH)
    assert found.hit_rate == pytest.approx([0.5, 0.5])
    assert np.isnan(found.noise_sigma)


def test_the_search_is_the_same_for_the_same_seed():
    effort = Effort(generations=1, population=3)
    first, second, other = (synthetic_levels(seed=seed).search(effort, 1.0) for seed in (1, 1, 2))
    assert first.tolist() == second.tolist() != other.tolist()


@pytest.mark.parametrize(
    "wrong", [{"generations": 0}, {"population": 1}, {"percept_weight": -1.0}, {"percept_weight": np.nan}]
)
def test_unusable_effort_is_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        Effort(**wrong)


# Verdicts


def row(r2=0.97, fss=0.85, hit_rate=(0.6, 0.93)):
    """A material set; only these numbers decide which levels it meets."""
    deflection = {"r2": r2, "r2_mirrored": r2, "distance_mm": [1.0], "deflection_mm": [0.5], "force_mn": 9.0}
    afferent = FittedAfferent(
        fss=fss,
        fss_dynamic=fss,
        fss_static=fss,
        noise_sigma=0.05,
        noise_fit_error=0.0,
        hit_rate=hit_rate,
        percept_error=0.0,
        parameters={},
    )
    return EvaluatedSet(
        name="one",
        basis="assumed",
        shear_kpa={},
        deflection=CylinderDeflection(**deflection),
        sed_peak_kpa=1.0,
        firing=afferent,
        joint=afferent,
    )


@pytest.mark.parametrize(
    ("changed", "missed"),
    [
        ({}, None),
        ({"r2": 0.959}, "deflection"),
        ({"fss": 0.809}, "firing"),
        ({"hit_rate": (0.64, 0.95)}, "discrimination"),
        ({"hit_rate": (0.58, 1.0 + 1e-9)}, "discrimination"),
    ],
)
def test_a_level_is_met_or_missed_by_itself(changed, missed):
    levels = meets(row(**changed))
    assert [level for level, reached in asdict(levels).items() if not reached] == ([missed] if missed else [])
    assert levels.all is (missed is None)


def test_equal_sets_do_not_beat_each_other():
    merits = np.array([[0.97, 0.85, 0.0], [0.97, 0.85, 0.0], [0.9, 0.85, 0.0]])
    assert pareto_front(merits).tolist() == [True, True, False]


def test_a_set_that_cannot_be_solved_is_named_and_the_others_are_evaluated(monkeypatch, tmp_path):
    def solve(runner, wanted, stage):
        asked.append(stage)
        if wanted[0].tissues == named_tissues("trial1"):
            raise ConvergenceError("no answer", [])

    asked = []
    monkeypatch.setattr(Runner, "solve", solve)
    monkeypatch.setattr(Store, "load", lambda store, touch: None)
    monkeypatch.setattr(material_sets, "evaluate", lambda candidate, *rest: candidate.name)
    chosen = [candidate for candidate in candidates() if candidate.name in ("Trial 1", "Trial 3")]
    rows = compare(chosen, Runner(tmp_path), Conditions("quick"))
    assert rows[0].name == "Trial 1"
    assert "no answer" in rows[0].unsolved
    assert rows[1] == "Trial 3"
    assert asked == ["Trial 1", "Trial 3"]


def test_names_must_differ(tmp_path):
    twice = [candidates()[0]] * 2
    with pytest.raises(InputError, match="must have different names"):
        compare(twice, Runner(tmp_path), Conditions("quick"))


# Order of the trials


def press(deflection_mm, force_mn):
    """A press with one profile per time, flat along the finger."""
    distance = np.array([-10.0, 0.0, 10.0])

    def surface_profile(step=-1):
        return SurfaceProfile(distance, np.full(3, deflection_mm[step]))

    times = np.array([0.0, 25.0, 50.0, 1000.0])
    return SimpleNamespace(
        times_ms=times, kinks_ms=(50.0,), force_mn=np.array(force_mn), surface_profile=surface_profile
    )


@pytest.mark.parametrize(("force_mn", "deflection_mm"), [(5.0, 0.25), (10.0, 0.5), (20.0, 0.75), (30.0, 1.0)])
def test_a_profile_is_found_at_its_force_on_the_ramp(force_mn, deflection_mm):
    skin = press([0.0, 0.5, 1.0, 1.0], [0.0, 10.0, 30.0, 20.0])
    assert trial_order.profile_at_force(skin, force_mn).at(0.0) == pytest.approx(deflection_mm)


def test_a_force_beyond_the_ramp_is_refused():
    with pytest.raises(InputError, match="at most 30 mN"):
        trial_order.profile_at_force(press([0.0, 0.5, 1.0, 1.0], [0.0, 10.0, 30.0, 40.0]), 31.0)


def test_excess_is_computed_for_each_region():
    distance = np.linspace(-10.0, 10.0, 2001)
    deeper = SurfaceProfile(distance, np.where(np.abs(distance) <= 0.52, 0.3, 0.1))
    flat = SurfaceProfile(distance, np.zeros(2001))
    assert asdict(trial_order.excess(deeper, flat)) == pytest.approx({"near_mm": 0.3, "far_mm": 0.1})


def test_observations_do_not_exceed_themselves():
    observed = trial_order.cylinder_deflection()
    mirrored = SurfaceProfile(-observed.distance_mm[::-1], observed.deflection_mm[::-1])
    excess = trial_order.excess_over_observed(mirrored)
    assert asdict(excess) == pytest.approx({"near_mm": 0.0, "far_mm": 0.0})


@pytest.mark.parametrize(("sign", "upwards", "downwards"), [(1.0, True, False), (-1.0, False, True)])
def test_the_papers_order_depends_on_which_way_the_axis_points(sign, upwards, downwards):
    def difference(value):
        same = Excess(near_mm=value, far_mm=value)
        return TrialDifference(same_depth=same, same_force=same, force_ratio=1.0)

    found = TrialOrder(
        observed={}, inner_layers={"x": difference(sign)}, stiff_epidermis={"x": difference(-sign)}
    )
    assert trial_order.order_holds(found, "x", "same_depth") is upwards
    assert trial_order.order_holds(found, "x", "same_depth", direction=-1.0) is downwards


# One tiny run


class Coarse(Conditions):
    """A mesh of a few hundred elements for every study."""

    def deflection_grading(self, indenter=None):
        return Grading(RECEPTOR_X_MM, 4.0, 1.5, 1.0, 0.75, stratum_corneum=1, dermis=1, subcutis=2)

    bar_grading = sphere_grading = deflection_grading


def use_few(patch):
    """Leave two inner layers and one candidate for the cylinder."""
    few = {"Maeno": named_tissues("trial1"), "identified": named_tissues("trial3")}
    patch.setattr(trial_order, "inner_layers", lambda: few)
    patch.setattr(material_study, "deflection_candidates", lambda: deflection_candidates()[:1])


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    folder = tmp_path_factory.mktemp("materials")
    effort = Effort(generations=2, population=4)

    def run():
        return material_study.run(Runner(folder), Coarse("quick"), effort, ("Trial 1", "Trial 3"))

    with pytest.MonkeyPatch.context() as patch:
        use_few(patch)
        return SimpleNamespace(run=run, results=run())


def test_each_set_is_judged_on_all_levels(tiny):
    first, third = tiny.results.sets
    assert (first.name, third.name) == ("Trial 1", "Trial 3")
    assert first.deflection.force_mn > third.deflection.force_mn > 0.0
    for found in (first, third):
        for afferent in (found.firing, found.joint):
            again = Afferent.from_parameters(list(afferent.parameters.values()))
            assert again.time_constant_ms > 0.0
            assert all(0.0 <= rate <= 1.0 for rate in afferent.hit_rate)
        assert found.joint.fss <= found.firing.fss + 0.5
    assert list(tiny.results.meets) == ["Trial 1", "Trial 3"]
    assert tiny.results.pareto


def test_a_stiff_epidermis_spreads_the_deflection_at_equal_depth(tiny):
    for inner in ("Maeno", "identified"):
        found = tiny.results.order.stiff_epidermis[inner]
        assert found.same_depth.far_mm > 0.0
        assert found.force_ratio > 1.0


def test_a_second_run_solves_nothing_and_has_the_same_results(tiny, monkeypatch):
    monkeypatch.setattr("fingerpad.skin.store._compute", pytest.fail)
    use_few(monkeypatch)
    again = replace(tiny.run(), manifest=tiny.results.manifest)
    assert to_json(from_json(MaterialStudy, to_json(again))) == to_json(again) == to_json(tiny.results)


def test_the_page_shows_every_set_and_its_numbers(tiny, tmp_path):
    text = write_markdown(materials_page(tiny.results), tmp_path / "materials.md").read_text(encoding="utf-8")
    assert (tmp_path / "images" / "material_sets.png").read_bytes().startswith(b"\x89PNG")
    for number, found in enumerate(tiny.results.sets, start=1):
        assert f"| {number} | {found.name} |" in text
        assert f"| {number} | {found.deflection.r2:.3f}".replace("-", "−") in text
    (alone,) = tiny.results.deflection_only
    assert f"| {alone.name} | 20 | 25.4 | 2.373 | {alone.deflection.r2:.3f}".replace("-", "−") in text
    assert "](images/material_sets.png)" in text
    assert tiny.results.manifest.started[:10] in text


def test_the_page_names_unsolved_sets_and_those_that_meet_all_levels(tiny):
    good = tiny.results.sets[0]
    met = {good.name: LevelsMet(deflection=True, firing=True, discrimination=True)}
    unsolved = UnsolvedSet(name="odd", basis="assumed", unsolved="It folded.")
    text = markdown(materials_page(replace(tiny.results, sets=(good, unsolved), meets=met)))
    assert f"Sets that meet all three levels: {good.name}." in text
    assert "| 2 | odd | - | - | - | assumed |" in text
    assert "Set 2 could not be solved: It folded." in text
    assert "No set meets all three levels" in markdown(
        materials_page(replace(tiny.results, sets=(unsolved,), meets={}))
    )


def test_an_unknown_set_is_refused(tmp_path):
    with pytest.raises(InputError, match="each of names must be one of"):
        material_study.run(Runner(tmp_path), Conditions("quick"), names=("Trial 4",))


def test_the_command_hands_over_what_was_asked_and_writes_page_and_numbers(
    tiny, tmp_path, monkeypatch, run_program
):
    asked = []

    def run(runner, conditions, effort, names):
        asked.append((tuple(names), effort.shifted_bars, conditions.seed, runner.jobs))
        return replace(tiny.results, shifted_bars=effort.shifted_bars)

    monkeypatch.setattr(material_study, "run", run)
    out = tmp_path / "out"
    words = ("--out", out, "--name", "Trial 3", "--shifted-bars", "--seed", "5", "--jobs", "1")
    status, said, _ = run_program(command.main, "studies", "materials", *words)
    assert status == 0
    assert asked == [(("Trial 3",), True, 5, 1)]
    written = from_json(MaterialStudy, (out / "materials.json").read_bytes())
    assert to_json(written) == to_json(replace(tiny.results, shifted_bars=True))
    assert said.startswith(f"Page: {out / 'materials.md'}")
    assert "36 indentations of the bar" in (out / "materials.md").read_text(encoding="utf-8")


def test_conditions_take_tissues_of_ones_own():
    own = layered(40.0, 20.0, 5.0)
    conditions = replace(Conditions("quick"), materials=own)
    assert conditions.touch(trial_order.Cylinder(), RECEPTOR_X_MM, conditions.bar_grading()).tissues == own


def test_polynomials_of_the_page_are_those_of_the_candidates():
    rows = [found for found in material_study.polynomials() if found.compression == 0.5]
    own = {(found.layer, found.poisson): found.coefficients_kpa for found in rows}
    dermis, subcutis = wu_polynomials(0.48, 0.48)
    for layer, material in (("dermis", dermis), ("subcutis", subcutis)):
        law = material.law
        assert own[layer, 0.48].tolist() == [law.c10, law.c01, law.c20, law.c11, law.c02]


def test_the_stiffening_set_is_trial_3_with_another_coefficient():
    for stiffens, plain in zip(
        named_tissues("trial3_stiffening").layers, named_tissues("trial3").layers, strict=True
    ):
        assert stiffens.shear_modulus_kpa == pytest.approx(plain.shear_modulus_kpa)
        assert stiffens.bulk_modulus_kpa == pytest.approx(plain.bulk_modulus_kpa)
    ratios = [layer.law.c20 / layer.law.c10 for layer in named_tissues("trial3_stiffening").layers]
    assert ratios == pytest.approx([0.0, 0.0, 5.0, 5.0])


def test_named_sets_are_the_candidates_to_four_digits():
    every = {candidate.name: candidate.tissues for candidate in candidates()}
    pairs = {
        "trial3_wu": "Wu polynomial",
        "trial2_wu": "Wu polynomial, stiff epidermis",
    }
    for name, candidate in pairs.items():
        for ours, theirs in zip(named_tissues(name).layers, every[candidate].layers, strict=True):
            for coefficient in ("c10", "c01", "c20", "c11", "c02"):
                expected = getattr(theirs.law, coefficient)
                assert getattr(ours.law, coefficient) == pytest.approx(expected, abs=5.1e-5)
            assert ours.poisson == pytest.approx(0.48)
            assert ours.prony == theirs.prony
