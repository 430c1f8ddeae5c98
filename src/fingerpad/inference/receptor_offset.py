"""An afferent whose end organ lies some way from where it is believed to be, along the finger.

The centre of a receptive field is read off the rates themselves, to the nearest position of the stimulus. A
seventh parameter lets the receptor lie a little beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray, finite, float_array, increasing
from fingerpad.core.errors import InputError
from fingerpad.core.signals import SedTraces
from fingerpad.data import neuron
from fingerpad.inference.rate_problem import AfferentModel
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.transduction import Drive, drive

OFFSET_NAME = "offset_mm"
"""Name of the parameter; positive is distal. [mm]"""


@dataclass(frozen=True)
class ReceptorOffset:
    """The paper's model with a receptor that may lie beside the middle of its field.

    Parameters
    ----------
    offsets_mm : array (n_offsets,)
        Places along the finger at which the drive is known, distal positive, increasing. [mm]
    drives : sequence of Drive
        What each place feels, one column per stimulus, all at the same times. Between two places it is
        interpolated linearly.
    refractory_ms : float
        Rest after each spike, which is not fitted. [ms]

    Raises
    ------
    InputError
        If there are not two places at least with one drive each, or the drives differ in shape.

    Examples
    --------
    >>> near, far = (SedTraces([0.0, 50.0, 1000.0], [[0.0], [peak], [peak]]) for peak in (2.0, 1.0))
    >>> model = receptor_offset([0.0, 0.2], [near, far])
    >>> model.drive_at(0.1).sed_kpa[-1].tolist()
    [1.5]
    >>> model.names[-1]
    'offset_mm'
    """

    offsets_mm: FloatArray
    drives: Sequence[Drive]
    refractory_ms: float = neuron.REFRACTORY.value

    def __post_init__(self) -> None:
        offsets = increasing("offsets_mm", float_array("offsets_mm", self.offsets_mm, 1))
        shapes = {(drive.times_ms.tobytes(), drive.sed_kpa.shape) for drive in self.drives}
        if offsets.size < 2 or offsets.size != len(self.drives) or len(shapes) > 1:
            raise InputError(
                "ReceptorOffset needs two places or more, each with a drive of the same times and stimuli: "
                f"got {offsets.size} places and {len(self.drives)} drives of {len(shapes)} kinds."
            )
        object.__setattr__(self, "offsets_mm", offsets)

    @property
    def names(self) -> tuple[str, ...]:
        """The six parameters of an afferent, then the offset."""
        return (*PARAMETER_NAMES, OFFSET_NAME)

    @property
    def n_stimuli(self) -> int:
        """Number of columns of each drive."""
        return self.drives[0].n_sites

    def drive_at(self, offset_mm: float) -> Drive:
        """Return what a receptor feels that lies there.

        Raises
        ------
        InputError
            If the offset lies outside of the places at which the drive is known.
        """
        offset = finite(OFFSET_NAME, offset_mm, "mm")
        if not self.offsets_mm[0] <= offset <= self.offsets_mm[-1]:
            raise InputError(
                f"{OFFSET_NAME} must lie within {self.offsets_mm[0]:g} ... {self.offsets_mm[-1]:g} mm, "
                f"where the skin was sampled: got {offset:g}."
            )
        before = min(int(np.searchsorted(self.offsets_mm, offset, "right")) - 1, len(self.drives) - 2)
        share = (offset - self.offsets_mm[before]) / (self.offsets_mm[before + 1] - self.offsets_mm[before])
        near, far = self.drives[before], self.drives[before + 1]
        return Drive(
            near.times_ms,
            (1.0 - share) * near.sed_kpa + share * far.sed_kpa,
            (1.0 - share) * near.rate_kpa_per_ms + share * far.rate_kpa_per_ms,
            near.dynamic_quantity,
        )

    def rates(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates of the afferent with these seven parameters. [spikes/s]"""
        return AfferentModel(self.drive_at(parameters[-1]), self.refractory_ms).rates(parameters[:-1])


def receptor_offset(offsets_mm: Sequence[float], traces: Sequence[SedTraces]) -> ReceptorOffset:
    """Make the model from traces at each place.

    Parameters
    ----------
    offsets_mm : sequence of float
        Places along the finger relative to the believed one, distal positive. [mm]
    traces : sequence of SedTraces
        Strain energy density there, one column per stimulus.

    Returns
    -------
    ReceptorOffset

    Examples
    --------
    >>> flat = SedTraces([0.0, 1000.0], [[0.0], [1.0]])
    >>> receptor_offset([-0.1, 0.0, 0.1], [flat] * 3).n_stimuli
    1
    """
    return ReceptorOffset(np.array(offsets_mm, dtype=np.float64), tuple(drive(trace) for trace in traces))
