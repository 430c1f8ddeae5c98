"""Level 3, Figure 6: responses of afferents all over the pad to a sphere.

A dense sheet of afferents, square as seen from below, represents populations of any density: an afferent at
some place responds as the sheet does there.
"""

from __future__ import annotations

import numpy as np

from fingerpad.core.results import Matrix, Number, Vector, result_class
from fingerpad.core.signals import ResponseMap, Traces
from fingerpad.data import protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.rate_windows import PAPER_WINDOWS_MS
from fingerpad.neuron.spikes import first_spike_latency_ms
from fingerpad.skin.sampling import SkinResponse

REACH_MM, STEP_MM = 5.0, 0.25
"""Half the side of the sheet, and its pitch. [mm]"""


@result_class
class RestingResponse:
    """Response of an afferent without any touch."""

    dynamic_rate_hz: float
    static_rate_hz: float
    """Rates in the windows of the ramp and the hold. [spikes/s]"""
    first_spike_latency_ms: Number
    """NaN without a spike. [ms]"""


@result_class
class ResponseSheet:
    """Responses of a sheet of afferents as tables over x (rows) and z (columns)."""

    x_mm: Vector
    z_mm: Vector
    """Places of the afferents, (n_x,). [mm]"""
    dynamic_rate_hz: Matrix
    static_rate_hz: Matrix
    """Rates, (n_x, n_z). [spikes/s]"""
    first_spike_latency_ms: Matrix
    """NaN without a spike, (n_x, n_z). [ms]"""


@result_class
class PopulationMaps(ResponseSheet):
    """Responses of a dense sheet of afferents under the standard sphere (Figure 6)."""

    curvature_per_m: float
    """Of the sphere. [1/m]"""
    at_rest: RestingResponse
    """Of the same afferent."""
    receptors_mm: Matrix
    """Places of the paper's receptors, (18, 2). [mm]"""


def population_maps(standard: SkinResponse, afferent: Afferent) -> PopulationMaps:
    """Simulate a dense sheet of afferents under the standard sphere (Figure 6)."""
    return PopulationMaps(
        curvature_per_m=protocol.STANDARD_CURVATURE.value,
        at_rest=resting_response(afferent),
        **vars(response_sheet(sheet(afferent).respond(standard))),
        receptors_mm=Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0)).positions_mm,
    )


def resting_response(afferent: Afferent) -> RestingResponse:
    """Simulate an afferent without any touch."""
    end_ms = protocol.RAMP.value + protocol.HOLD.value
    traces = Traces.at_rest(end_ms, afferent.dynamic_quantity, afferent.static_quantity)
    dynamic_hz, static_hz = afferent.rates(traces, *PAPER_WINDOWS_MS)
    return RestingResponse(
        dynamic_rate_hz=float(dynamic_hz[0]),
        static_rate_hz=float(static_hz[0]),
        first_spike_latency_ms=float(first_spike_latency_ms(afferent.spikes(traces))[0]),
    )


def sheet(afferent: Afferent, reach_mm: float = REACH_MM, step_mm: float = STEP_MM) -> Population:
    """Place afferents side by side on a square about the contact point, ordered by x, then by z."""
    offsets = step_mm * np.arange(-round(reach_mm / step_mm), round(reach_mm / step_mm) + 1)
    x, z = RECEPTOR_X_MM + offsets, offsets
    sites = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    return Population(positions_mm=sites, pitch_mm=step_mm, afferent=afferent)


def response_sheet(response: ResponseMap) -> ResponseSheet:
    """Arrange the responses of a `sheet` as tables."""
    x, z = (np.unique(coordinate) for coordinate in response.positions_mm.T)
    shape = (x.size, z.size)
    return ResponseSheet(
        x_mm=x,
        z_mm=z,
        dynamic_rate_hz=response.dynamic_rate_hz.reshape(shape),
        static_rate_hz=response.static_rate_hz.reshape(shape),
        first_spike_latency_ms=response.first_spike_latency_ms.reshape(shape),
    )
