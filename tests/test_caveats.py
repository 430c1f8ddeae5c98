"""Caveats: results outside of what was verified say so, and their figures and pages show it."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad import Fingertip, FlatPunch, Population, RampAndHold, Sphere, touch_of
from fingerpad.experiments.runner import Runner, StageSummary
from fingerpad.mechanics.inertia import LARGEST_SHARE
from fingerpad.report import skin as touch_figure
from fingerpad.skin.caveats import LARGEST_SED_RATIO


@pytest.fixture(scope="module")
def skin():
    sphere = touch_of(Fingertip(), Sphere(curvature_per_m=287), RampAndHold(0.3), resolution="quick")
    coarse = replace(sphere.grading, largest_mm=4.0, dermis=1, subcutis=1, stratum_corneum=1)
    return replace(sphere, grading=coarse).solve(threads=1)


def names(skin):
    return [caveat.name for caveat in skin.caveats]


def test_fields_and_work_beyond_what_was_verified_are_caveats(skin):
    assert skin.caveats == replace(skin, touch=None).caveats == ()
    epidermis = skin.touch.tissues.layers[1].shear_modulus_kpa
    sheet = skin.sed_kpa[:, skin.mesh.living_epidermis.ravel()]
    for ratio, found in ((0.99, []), (1.01, ["energy density"])):
        scaled = skin.with_fields(sed_kpa=skin.sed_kpa * ratio * LARGEST_SED_RATIO * epidermis / sheet.max())
        assert names(scaled) == found
    strain = skin.fields["compressive_strain"]
    deep = skin.with_fields(compressive_strain=strain * 0.8 / strain.max())
    assert names(deep) == ["strain"]
    assert "stretch of 0.45" in deep.caveats[0].text
    assert deep.caveats[0].value > deep.caveats[0].limit == pytest.approx(np.log(2))
    for imbalance, found in ((0.0049, []), (0.024, ["energy balance"])):
        assert names(replace(skin, energy_imbalance=imbalance)) == found


def test_fast_motions_and_edges_below_the_mesh_are_caveats(skin):
    with pytest.warns(match="inertia"):
        fast = replace(skin.touch, stimulus=RampAndHold(0.3, ramp_ms=4.0))
    (caveat,) = replace(skin, touch=fast).caveats
    assert caveat.name == "inertia"
    assert caveat.value > LARGEST_SHARE
    for edge_mm, found in ((0.001, ["edge radius"]), (0.5, [])):
        punch = touch_of(Fingertip(), FlatPunch(6.0, edge_mm), RampAndHold(0.3), resolution="quick")
        assert names(replace(skin, touch=punch)) == found


def test_figures_and_manifests_show_caveats(skin, tmp_path):
    deep = skin.with_fields(sed_kpa=skin.sed_kpa * 1e4)
    response = Population.grid(rows=1, columns=1).respond(skin)
    drawn = [text.get_text() for text in touch_figure.draw_touch(deep, response).texts]
    assert not any(
        "Not verified" in text.get_text() for text in touch_figure.draw_touch(skin, response).texts
    )
    assert any("Not verified: The strain energy density" in text for text in drawn)
    runner = Runner(tmp_path)
    with runner.stage("press", 1):
        pass
    deeper = skin.with_fields(sed_kpa=skin.sed_kpa * 1e5)
    runner.note([skin, deep, deeper, deep])
    (stage,) = runner._stages
    assert isinstance(stage, StageSummary)
    assert stage.indentations == 4
    assert stage.caveats == deeper.caveats
