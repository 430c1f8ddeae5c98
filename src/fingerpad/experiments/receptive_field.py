"""The receptive field of an afferent: which places of the skin it answers when a probe is pressed there."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from scipy.ndimage import center_of_mass, gaussian_filter, label, maximum_filter

from fingerpad.core.checked import checked, result_class
from fingerpad.core.displayed import Columns, Contents, Result
from fingerpad.core.errors import InputError
from fingerpad.core.regions import around_zero
from fingerpad.core.values import FloatArray, Pair, Positive, Vector, choice
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments.conditions import Conditions
from fingerpad.geometry.bodies import FlatPunch
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.geometry.grading import RESOLUTIONS
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.materials import Tissues
from fingerpad.neuron.afferent import AnyAfferent
from fingerpad.neuron.afferent_types import afferent_of
from fingerpad.neuron.end_organs import EndOrgans
from fingerpad.neuron.population import Population
from fingerpad.skin.sampling import SkinResponse

PROBE, PROBING_MM_PER_MS, PROBED_MS = FlatPunch(1.0, 0.2), 0.02, 300.0
"""Probe of receptive fields, its speed and its hold, as assumed of Vega-Bermudez & Johnson 1999."""
FIELD_MM, PLACES_MM = 4.0, 0.2  # Places are probed so far from the receptor, so far apart.
SHARE_OF_PEAK = 0.1
"""Share of the spikes at the most sensitive place that a place within a receptive field elicits; assumed."""
SHARE_OF_HOT_SPOT, BETWEEN_SPOTS = 0.5, 0.5  # The same of a hot spot, and spikes less between two; assumed.
MOST_ALONG = 201  # Most places along a side of the grid.


@result_class
class ReceptiveField(Result):
    """Spikes that a probe elicits from an afferent, by the place of the probe."""

    x_mm: Vector  #: Places along the finger from the afferent, distal positive, (n,). [mm]
    z_mm: Vector  #: Places across, (m,). [mm]
    spike_count: np.ndarray  #: Spikes of the whole touch at each place, (n, m).
    depth_mm: float  #: How deep the probe was pressed. [mm]

    def __repr__(self) -> str:
        spots, least = len(self.hot_spots_mm), "at least " if self.is_cut_off else ""
        return f"ReceptiveField({least}{self.area_mm2:.3g} mm2, {spots} hot spot{'s' * (spots != 1)})"

    @property
    def spacing_mm(self) -> float:
        """Distance of neighbouring places. [mm]"""
        return float(self.x_mm[1] - self.x_mm[0])

    @property
    def within(self) -> np.ndarray:
        """Whether each place lies within the field: the probe elicits a tenth of the most spikes, (n, m)."""
        return within_field(self.spike_count)

    @property
    def is_cut_off(self) -> bool:
        """Whether the field reaches the border of the grid, so that it is larger than its area here."""
        return bool(self.within[[0, -1]].any() or self.within[:, [0, -1]].any())

    @property
    def area_mm2(self) -> float:
        """Area of the field. [mm²]"""
        return float(self.spacing_mm**2 * self.within.sum())

    @property
    def centre_mm(self) -> Pair:
        """Mean place of the field, weighted by spikes; NaN where nothing elicits one. [mm]"""
        spikes = np.where(self.within, self.spike_count, 0.0)
        total = spikes.sum() or np.nan
        return float(spikes.sum(axis=1) @ self.x_mm / total), float(spikes.sum(axis=0) @ self.z_mm / total)

    @property
    def hot_spots_mm(self) -> FloatArray:
        """Places where a probe elicits the most spikes, the best one first, (n_spots, 2). [mm]

        Numbers of spikes are whole, so that they are smoothed over neighbouring places first. Between two
        spots lie places with half a spike less.
        """
        smooth = gaussian_filter(self.spike_count.astype(float), sigma=1.0)
        enough = (self.spike_count > 0) & (smooth >= SHARE_OF_HOT_SPOT * smooth.max())
        tops, n_tops = label(enough & (smooth == maximum_filter(smooth, size=3)), np.ones((3, 3)))
        numbers = sorted(range(1, n_tops + 1), key=lambda number: -smooth[tops == number].max())
        spots: list[int] = []
        for number in numbers:
            around, _ = label(smooth > smooth[tops == number].max() - BETWEEN_SPOTS, np.ones((3, 3)))
            better = around[np.isin(tops, spots)]
            if around[tops == number].max() not in better:
                spots.append(number)
        rows, columns = np.reshape(center_of_mass(smooth, tops, spots), (-1, 2)).T
        return np.column_stack(
            [self.x_mm[0] + self.spacing_mm * rows, self.z_mm[0] + self.spacing_mm * columns]
        )

    def columns(self) -> Columns:
        x, z = np.meshgrid(self.x_mm, self.z_mm, indexing="ij")
        places = {"x_mm": x.ravel(), "z_mm": z.ravel()}
        return {"place": np.arange(x.size), **places, "spike_count": self.spike_count.ravel()}

    def contents(self) -> Contents:
        axes = {name: ((name,), getattr(self, name), {"units": "mm"}) for name in ("x_mm", "z_mm")}
        return {**axes, "spike_count": (("x_mm", "z_mm"), self.spike_count, {"units": "1"})}, {
            "depth_mm": self.depth_mm
        }


def within_field(counts: np.ndarray) -> np.ndarray:
    """Whether places lie within a receptive field, by the spikes that a probe elicits from each."""
    return counts >= max(1.0, SHARE_OF_PEAK * counts.max())


def probing(depth_mm: float) -> RampAndHold:
    """Motion of the probe of receptive fields."""
    return RampAndHold(depth_mm, depth_mm / PROBING_MM_PER_MS, PROBED_MS)


@checked
def receptive_field(
    afferent: AnyAfferent | str | None = None,
    depth_mm: Positive = 0.2,
    *,
    finger: Finger | None = None,
    tissues: str | Tissues = DEFAULT_TISSUES,
    resolution: Annotated[str, choice(RESOLUTIONS)] = "quick",
    probe: Indenter = PROBE,
    receptor_depth_mm: Positive | None = None,
    reach_mm: Positive = FIELD_MM,
    spacing_mm: Positive = PLACES_MM,
    ends: EndOrgans | None = None,
) -> ReceptiveField:
    """Map the receptive field of an afferent in the middle of the pad.

    The probe is pressed once, and the afferent is put at each place of a grid instead: skin is taken as the
    same everywhere on the grid. The probe goes along the normal of the skin at 20 mm/s and stays for 300 ms.

    Parameters
    ----------
    afferent : AnyAfferent or str, optional
        An afferent, or its type, such as "RA"; by default the SAI of the tissues.
    depth_mm : float, optional
        How deep the probe is pressed. [mm]
    finger : Fingertip, optional
        Default: `Fingertip()`.
    tissues, resolution : optional
        As of `indent`.
    probe : Indenter, optional
        Default: a punch of 1 mm with a fillet of 0.2 mm, as of Vega-Bermudez & Johnson (1999).
    receptor_depth_mm : float, optional
        Depth of the end organs; by default the border of epidermis and dermis. [mm]
    reach_mm, spacing_mm : float, optional
        How far from the afferent places are probed, along and across, and how far apart. [mm]
    ends : EndOrgans, optional
        End organs of this one afferent about (0, 0), as from `EndOrgans.scattered`; by default its own.

    Returns
    -------
    ReceptiveField
        Spikes by place, with `area_mm2`, `centre_mm` and `hot_spots_mm`.

    Raises
    ------
    InputError
        If the grid leaves the volar skin of the mesh.
    ConvergenceError
        If the probe cannot be pressed.

    Examples
    --------
    >>> import fingerpad as fp
    >>> field = fp.receptive_field("RA", depth_mm=0.2)
    >>> round(field.area_mm2), len(field.hot_spots_mm)
    (12, 1)
    """
    settings = Conditions(resolution=resolution, tissues=tissues, finger=finger or Fingertip())
    if isinstance(afferent, str):
        afferent = afferent_of(afferent, tissues)
    places_mm = places_about(reach_mm, spacing_mm)
    population = afferents_at(settings, places_mm, afferent or settings.afferent, receptor_depth_mm, ends)
    touch = settings.probe_touch(probe, probing(depth_mm), depths_mm=population.kept_depths_mm)
    touch.check_sites(population.sites_mm)
    return field_of(touch.solve(), population, places_mm)


def places_about(reach_mm: float = FIELD_MM, spacing_mm: float = PLACES_MM) -> FloatArray:
    """Places along a line, as far as `reach_mm` to both sides of 0. [mm]"""
    count = 2 * round(reach_mm / spacing_mm) + 1
    if not 3 <= count <= MOST_ALONG:
        words = f"must be 1 to {MOST_ALONG // 2} times spacing_mm"
        raise InputError("reach_mm", words, f"{reach_mm:g} and {spacing_mm:g} mm")
    return spacing_mm * around_zero(count)


def afferents_at(
    settings: Conditions,
    places_mm: FloatArray,
    afferent: AnyAfferent,
    depth_mm: float | None = None,
    ends: EndOrgans | None = None,
) -> Population:
    """Put an afferent at each place of a square grid about the middle of the pad."""
    along = settings.receptor_x_mm + settings.along_skin * places_mm
    places = np.stack(np.meshgrid(along, places_mm, indexing="ij"), axis=-1).reshape(-1, 2)
    if ends is not None:
        if ends.positions_mm.shape[::2] != (1, 2):
            raise InputError("ends", "must be those of one afferent, x and z about (0, 0)", f"{len(ends)}")
        of_each = places[:, None] + ends.positions_mm[0] * (settings.along_skin, 1.0)
        ends = replace(ends, positions_mm=of_each, weights=np.asarray(ends.weights)[0])
    return Population(places, float(places_mm[1] - places_mm[0]), afferent, ends=ends, depth_mm=depth_mm)


def field_of(skin: SkinResponse, population: Population, places_mm: FloatArray) -> ReceptiveField:
    """Read the field from the afferents at each place below one probe."""
    counts = population.respond(skin).spikes.counts.reshape(places_mm.size, -1)
    # The afferent moved instead of the probe: its places are those of the probe about it, mirrored.
    return ReceptiveField(
        x_mm=places_mm, z_mm=places_mm, spike_count=counts[::-1, ::-1], depth_mm=float(skin.depth_mm.max())
    )
