"""Which quantity drives the afferent: fits of synthetic truth, scales, tables that say what was fitted."""

import numpy as np
from numpy.testing import assert_array_equal

from fingerpad.afferent import Afferent
from fingerpad.estimation.rate_problem import AfferentModel
from fingerpad.signals import SedTraces
from fingerpad.transduction import drive


def test_a_fitted_model_follows_what_its_drive_follows():
    energy = np.outer([0.0, 1.0, 0.9], [0.5, 1.0, 2.0])
    traces = SedTraces([0.0, 50.0, 1000.0], energy, [50.0], 10.0 * np.sqrt(energy), "compressive_stress")
    rates = AfferentModel(drive(traces)).rates(Afferent().parameters)
    assert_array_equal(rates, Afferent(dynamic_quantity="compressive_stress").rates(traces))
