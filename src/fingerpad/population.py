"""Many afferents side by side: where they end in the skin, and what they answer to one touch."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from fingerpad.afferent import Afferent
from fingerpad.checks import FloatArray, finite, float_array, positive, whole
from fingerpad.errors import InputError
from fingerpad.parameters import fingertip, protocol, psychophysics
from fingerpad.signals import STORED_ENERGY, ResponseMap, Skin
from fingerpad.spikes import firing_rate_hz, first_spike_latency_ms

MM_PER_CM = 10.0
CENTRE_MM = (fingertip.CONTACT_POINT.value[0], 0.0)
"""Middle of the default layout: the laboratory's contact point, on the midline. [mm]"""


@dataclass(frozen=True)
class Population:
    """Equal afferents at different places of the skin.

    Parameters
    ----------
    positions_mm : array (n_receptors, 2)
        x (distal positive) and z (lateral) of each end organ. [mm]
    pitch_mm : float
        Distance between neighbours of the layout. [mm]
    afferent : Afferent, optional
        What every one of them is.

    Raises
    ------
    InputError
        If the positions are not pairs of finite numbers or the pitch is not positive.
    """

    positions_mm: FloatArray
    pitch_mm: float
    afferent: Afferent = field(default_factory=Afferent)

    def __post_init__(self) -> None:
        positions = float_array("positions_mm", self.positions_mm, 2)
        if positions.shape[1] != 2 or len(positions) == 0:
            raise InputError(f"positions_mm must have rows of x and z: got shape {positions.shape}.")
        positive("pitch_mm", self.pitch_mm, "mm")
        object.__setattr__(self, "positions_mm", positions)

    @classmethod
    def grid(
        cls,
        density_per_cm2: float = psychophysics.RECEPTOR_DENSITY.value,
        rows: int = 3,
        columns: int = 6,
        centre_mm: tuple[float, float] = CENTRE_MM,
        afferent: Afferent | None = None,
    ) -> Population:
        """Lay a square lattice around a point, symmetric about it.

        The paper's 18 receptors, of which 9 are drawn for reasons of symmetry, are 3 along the finger by
        6 across.

        Parameters
        ----------
        density_per_cm2 : float, optional
            Receptors per area; the pitch is one over its square root. [1/cm2]
        rows, columns : int, optional
            Receptors along x and along z.
        centre_mm : (float, float), optional
            x and z of the middle of the lattice. [mm]
        afferent : Afferent, optional
            Default: `Afferent()`.

        Returns
        -------
        Population
            Ordered by x, then by z.

        Raises
        ------
        InputError
            If the density is not positive or there is not at least one row and one column.

        Examples
        --------
        >>> population = Population.grid(100.0, rows=1, columns=2, centre_mm=(17.0, 0.0))
        >>> population.pitch_mm, population.positions_mm.tolist()
        (1.0, [[17.0, -0.5], [17.0, 0.5]])
        """
        pitch_mm = MM_PER_CM / math.sqrt(positive("density_per_cm2", density_per_cm2, "1/cm2"))
        centre_x, centre_z = (finite("centre_mm", value, "mm") for value in centre_mm)
        x = centre_x + pitch_mm * _around_zero(whole("rows", rows, 1))
        z = centre_z + pitch_mm * _around_zero(whole("columns", columns, 1))
        positions = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
        return cls(positions, pitch_mm, afferent or Afferent())

    def respond(
        self,
        skin: Skin,
        dynamic_window_ms: tuple[float, ...] = protocol.DYNAMIC_WINDOW.value,
        static_window_ms: tuple[float, ...] = protocol.STATIC_WINDOW.value,
    ) -> ResponseMap:
        """Sample the skin at every receptor and let each afferent answer.

        Parameters
        ----------
        skin : Skin
            Anything with `sed(sites)`, such as a solved indentation.
        dynamic_window_ms, static_window_ms : (float, float), optional
            Windows of the two firing rates. [ms]

        Returns
        -------
        ResponseMap
            Spikes, rates and first-spike latencies, receptor by receptor.

        Raises
        ------
        InputError
            If the skin does not answer with one trace per receptor.
        """
        dynamic_quantity = self.afferent.dynamic_quantity
        # Skins that know nothing but their energy need not know the extension either.
        further = () if dynamic_quantity == STORED_ENERGY else (dynamic_quantity,)
        sed = skin.sed(self.positions_mm, *further)
        if sed.n_sites != len(self.positions_mm):
            raise InputError(
                f"skin.sed must give one trace per receptor: got {sed.n_sites} for {len(self.positions_mm)}."
            )
        spikes = self.afferent.spikes(sed)
        return ResponseMap(
            positions_mm=self.positions_mm,
            pitch_mm=self.pitch_mm,
            spikes=spikes,
            dynamic_rate_hz=firing_rate_hz(spikes, dynamic_window_ms),
            static_rate_hz=firing_rate_hz(spikes, static_window_ms),
            first_spike_latency_ms=first_spike_latency_ms(spikes),
        )


def _around_zero(count: int) -> FloatArray:
    return np.arange(count, dtype=np.float64) - 0.5 * (count - 1)
