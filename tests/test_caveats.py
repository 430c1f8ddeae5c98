"""Caveats: results outside of what was verified say so, and their figures and pages show it."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad.experiments.manifest import StageSummary
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import FlatPunch, Sphere
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.inertia import LARGEST_SHARE
from fingerpad.neuron.population import Population
from fingerpad.report import touch as touch_figure
from fingerpad.skin.caveats import LARGEST_SED_RATIO
from fingerpad.skin.indentation import touch_of
from fingerpad.skin.sampling import SkinResponse


@pytest.fixture(scope="module")
def skin() -> SkinResponse:
    sphere = touch_of(Fingertip(), Sphere(curvature_per_m=287), RampAndHold(0.3), resolution="quick")
    coarse = replace(sphere.grading, largest_mm=4.0, dermis=1, subcutis=1, stratum_corneum=1)
    return replace(sphere, grading=coarse).solve(threads=1)


def names(skin: SkinResponse) -> list[str]:
    return [caveat.name for caveat in skin.caveats]


def test_an_ordinary_touch_has_no_caveat(skin):
    assert skin.caveats == ()


def test_strain_beyond_the_stability_of_laws_is_a_caveat(skin):
    strain = skin.fields["compressive_strain"]
    deep = skin.with_fields(compressive_strain=strain * 0.8 / strain.max())
    assert names(deep) == ["strain"]
    assert "stretch of 0.45" in deep.caveats[0].text
    assert deep.caveats[0].value > deep.caveats[0].limit == pytest.approx(np.log(2))


def test_energy_density_above_what_was_compared_is_a_caveat(skin):
    epidermis = skin.touch.tissues.layers[1].shear_modulus_kpa
    sheet = skin.sed_kpa[:, skin.mesh.living_epidermis.ravel()]
    for ratio, found in ((0.99, []), (1.01, ["energy density"])):
        scaled = skin.with_fields(sed_kpa=skin.sed_kpa * ratio * LARGEST_SED_RATIO * epidermis / sheet.max())
        assert names(scaled) == found


def test_a_motion_beyond_quasi_static_is_a_caveat(skin):
    with pytest.warns(match="inertia"):
        fast = replace(skin.touch, stimulus=RampAndHold(0.3, ramp_ms=4.0))
    found = replace(skin, touch=fast).caveats
    assert [caveat.name for caveat in found] == ["inertia"]
    assert found[0].value > LARGEST_SHARE


def test_edges_below_the_mesh_are_a_caveat(skin):
    punch = touch_of(Fingertip(), FlatPunch(6.0, 0.001), RampAndHold(0.3), resolution="quick")
    assert names(replace(skin, touch=punch)) == ["edge radius"]
    blunt = touch_of(Fingertip(), FlatPunch(6.0, 0.5), RampAndHold(0.3), resolution="quick")
    assert names(replace(skin, touch=blunt)) == []


def test_figures_and_manifests_show_caveats(skin, tmp_path):
    deep = skin.with_fields(sed_kpa=skin.sed_kpa * 1e4)
    response = Population.grid(rows=1, columns=1).respond(skin)
    drawn = [text.get_text() for text in touch_figure.draw(deep, response).texts]
    assert not any("Not verified" in text.get_text() for text in touch_figure.draw(skin, response).texts)
    assert any("Not verified: The strain energy density" in text for text in drawn)
    runner = Runner(tmp_path)
    with runner.stage("press", 1):
        pass
    runner.note([skin, deep, deep])
    (stage,) = runner._stages
    assert isinstance(stage, StageSummary)
    assert stage.indentations == 3
    assert stage.caveats == (deep.caveats[0].text,)


def test_a_response_without_its_touch_has_caveats_of_its_fields_only(skin):
    assert replace(skin, touch=None).caveats == ()


def test_work_missing_from_the_balance_of_energies_is_a_caveat(skin):
    assert names(replace(skin, energy_imbalance=0.024)) == ["energy balance"]
    assert "0.024 of the indenter's work" in replace(skin, energy_imbalance=0.024).caveats[0].text
    assert names(replace(skin, energy_imbalance=0.0049)) == []
