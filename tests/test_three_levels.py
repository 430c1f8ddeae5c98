"""Figures 1 and 2: planes of a mesh, and a membrane's potential between spikes that are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fingerpad import Fingertip, Traces
from fingerpad.experiments.gerling2014.skin import mesh_picture, outline_elements, outline_nodes
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import finger_mesh
from fingerpad.neuron.lif import LeakyIntegrateAndFire, membrane_potential
from fingerpad.report.skin import layer_thicknesses_mm

CONTACT_X_MM = 17.37


@pytest.fixture(scope="module", params=[False, True], ids=["half", "full"])
def mesh(request):
    grading = resolution_grading("quick", CONTACT_X_MM)
    return finger_mesh(Fingertip(), type(grading)(**{**vars(grading), "full": request.param}))


def test_the_outline_lies_on_the_plane_and_its_elements_beside_it(mesh):
    nodes, elements = outline_nodes(mesh), outline_elements(mesh)
    assert np.abs(mesh.nodes_mm[nodes][..., 2]).max() < 1e-9
    assert elements.shape == (nodes.shape[0] - 1, nodes.shape[1] - 1)
    corners = np.stack([nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]], axis=-1)
    for face, element in zip(corners.reshape(-1, 4), elements.ravel(), strict=True):
        assert set(face) <= set(mesh.elements[element])


def test_figure_1_has_the_layers_of_the_finger_and_its_nail_on_the_back(mesh):
    finger, picture = Fingertip(), mesh_picture(mesh, CONTACT_X_MM)
    wanted = (finger.stratum_corneum_mm, finger.living_epidermis_mm, finger.dermis_mm)
    assert_allclose(layer_thicknesses_mm(picture)[:3], wanted, atol=0.002)
    # The section across lies at the proximal end, where there is no nail.
    assert picture.along.under_nail.any()
    assert not picture.across.under_nail.any()
    assert (picture.along.up_mm[picture.along.under_nail, 0] > 0.0).all()
    assert picture.contact_mm == pytest.approx((CONTACT_X_MM, -9.85), abs=0.02)
    assert_array_equal(picture.layer, np.sort(picture.layer))
    assert (picture.across.right_mm.min() < -5.0) == mesh.full


@pytest.mark.parametrize("seed", range(4))
def test_the_potential_meets_the_threshold_at_every_spike_and_nowhere_before(seed):
    random = np.random.default_rng(seed)
    membrane = LeakyIntegrateAndFire(20.0 + 60.0 * random.random(), 1e-6, 50.0, 1.0)
    knots = np.concatenate([[0.0, 0.0], np.cumsum(random.uniform(1.0, 30.0, 12))])
    current = Traces(knots, random.uniform(0.0, 1.2e-5, (knots.size, 1)), quantity="current")
    spikes = membrane.spikes(current)[0]
    assert spikes.size > 10
    assert_allclose(membrane_potential(membrane, current, spikes, spikes), membrane.threshold_mv, rtol=1e-9)
    between = np.setdiff1d(np.arange(0.0, knots[-1], 0.37), spikes)
    potential = membrane_potential(membrane, current, spikes, between)
    assert potential.max() < membrane.threshold_mv
    refractory = membrane_potential(membrane, current, spikes, spikes + 0.5 * membrane.refractory_ms)
    assert_array_equal(refractory, 0.0)
