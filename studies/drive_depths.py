"""How deep the end organ lies: the paper's model, its energy density read in every layer of elements.

Of all quantities only the stored energy density is kept in the whole finger; the others are kept where the
paper puts the end organs, in the living epidermis. The paper's model is fitted alike in each layer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.core.results import Number, result_class
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.geometry.mesh import LAYERS, Mesh
from fingerpad.inference.fitting.methods import Method
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings
from fingerpad.neuron.transduction import drive
from fingerpad.skin.fields import FIELDS, Place
from fingerpad.skin.sampling import SkinResponse
from studies.drive_fits import (
    DriveFit,
    drive_fit,
    judge,
    quick_method,
    relative_model,
    scaled_starts,
)


@result_class
class LayerFit:
    """Fit with the energy density sampled in one layer of elements.

    Parameters
    ----------
    tissue : str
        Of the layer.
    from_mm, to_mm : float
        Depths of its borders. [mm]
    largest_sed_kpa : float
        At the receptor. [kPa]
    fit : DriveFit
        Its gain is over the living epidermis.
    """

    tissue: str
    from_mm: float
    to_mm: float
    largest_sed_kpa: Number
    fit: DriveFit


@result_class
class DepthStudy:
    """Fits by sampling depth.

    Parameters
    ----------
    method : str
        Name of the method.
    own_layer : int
        Number of the layer where the paper puts the end organs.
    layers : tuple of LayerFit
        From the skin downwards.
    """

    method: str
    own_layer: int
    layers: tuple[LayerFit, ...]


def borders_mm(mesh: Mesh) -> FloatArray:
    """Depths of the borders between layers of elements below the receptor, from 0, the skin. [mm]"""
    midline = mesh.midline_nodes
    above = midline[np.argmin(np.abs(mesh.nodes_mm[midline, 0] - RECEPTOR_X_MM))]
    ((along, around), *_) = np.argwhere(mesh.skin_grid == above)
    column = mesh.nodes_mm[mesh.grid[along, around]]
    return np.linalg.norm(column - column[0], axis=1)


def read_in(skin: SkinResponse, layer: int) -> SkinResponse:
    """Return the same touch with end organs in another layer of elements, counted from the skin, from 0.

    Parameters
    ----------
    skin : SkinResponse
        One touch.
    layer : int
        Which.

    Returns
    -------
    SkinResponse
        It holds the stored energy density only.

    Raises
    ------
    InputError
        If there is no such layer.
    """
    mesh = skin.mesh
    through = mesh.shape[2]
    if not 0 <= layer < through:
        raise InputError(f"layer must be one of the {through} of this mesh, from 0: got {layer}.")
    # Elements of one place on the skin are numbered in a row, from the skin downwards.
    elements = mesh.living_epidermis - mesh.living_epidermis % through + layer
    everywhere = {
        name: values for name, values in skin.fields.items() if FIELDS[name].place is not Place.WATCHED
    }
    return replace(skin, mesh=replace(mesh, living_epidermis=elements), fields=everywhere)


def result(
    responses: Sequence[SkinResponse],
    recordings: RateRecordings,
    generator: np.random.Generator,
    method: Method | None = None,
) -> DepthStudy:
    """Fit the paper's model with its energy density read at every depth.

    Parameters
    ----------
    responses : sequence of SkinResponse
        One per shift of the bar, on one mesh.
    recordings : RateRecordings
        Observed rates.
    generator : numpy.random.Generator
        Draws the bootstrap.
    method : Method, optional
        For the relative numbers; `quick_method` by default.

    Returns
    -------
    DepthStudy
    """
    method = method or quick_method()
    mesh = responses[0].mesh
    borders, own = borders_mm(mesh), int(mesh.living_epidermis.flat[0]) % mesh.shape[2]
    drives = [
        drive(single_unit.receptor_traces([read_in(skin, layer) for skin in responses], STORED_ENERGY))
        for layer in range(mesh.shape[2])
    ]
    reference = drives[own]
    judged = [
        judge(
            RateProblem(
                relative_model(AfferentModel.of_drive(driven), scaled_starts(driven, reference)[0]),
                recordings,
            ),
            method,
        )
        for driven in drives
    ]
    return DepthStudy(
        method=method.name,
        own_layer=own,
        layers=tuple(
            LayerFit(
                tissue=LAYERS[mesh.layer[layer]],
                from_mm=borders[layer],
                to_mm=borders[layer + 1],
                largest_sed_kpa=driven.sed_kpa.max(),
                fit=drive_fit(one, judged[own], recordings, generator),
            )
            for layer, (driven, one) in enumerate(zip(drives, judged, strict=True))
        ),
    )
