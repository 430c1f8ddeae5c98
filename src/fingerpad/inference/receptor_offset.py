"""A rate model whose receptor may lie beside its assumed position, along the finger.

The centre of a receptive field is taken from the rates themselves, to the nearest position of the stimulus. A
seventh parameter is the offset of the receptor from it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingerpad.core.checks import FloatArray, finite, float_array, increasing
from fingerpad.core.errors import InputError
from fingerpad.core.signals import Traces
from fingerpad.inference.rate_model import AfferentModel, Rates, evaluate_rows
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.rate_windows import Windows
from fingerpad.neuron.transduction import Drive

OFFSET_NAME = "offset_mm"  # Name of the parameter; positive is distal. [mm]


@dataclass(frozen=True)
class ReceptorOffset:
    """The paper's model with the offset of the receptor as a seventh parameter; a `RateModel`.

    Between two sampled offsets the drive is interpolated linearly.
    """

    offsets_mm: FloatArray
    """Offsets at which the drive is sampled, distal positive, increasing, (n_offsets,). [mm]"""
    models: Sequence[AfferentModel]  # The model at each offset, all with the same stimuli and times.

    def __post_init__(self) -> None:
        offsets = increasing("offsets_mm", float_array("offsets_mm", self.offsets_mm, 1))
        kinds = {
            tuple(
                (columns.tobytes(), driven.times_ms.tobytes())
                for columns, driven in zip(model.stimuli, model.drives, strict=True)
            )
            for model in self.models
        }
        if offsets.size < 2 or offsets.size != len(self.models) or len(kinds) > 1:
            raise InputError(
                "ReceptorOffset needs at least two offsets, each with a model of the same stimuli and times: "
                f"got {offsets.size} offsets and {len(self.models)} models of {len(kinds)} kinds."
            )
        object.__setattr__(self, "offsets_mm", offsets)

    @classmethod
    def of_traces(
        cls, traces: Mapping[float, Traces | Sequence[Traces]], windows_ms: Windows | None = None
    ) -> ReceptorOffset:
        """Make the model from what drives the afferent at each offset."""
        return cls(
            np.array(list(traces), dtype=np.float64),
            [AfferentModel.of_traces(each, windows_ms) for each in traces.values()],
        )

    @property
    def names(self) -> tuple[str, ...]:
        return (*PARAMETER_NAMES, OFFSET_NAME)

    @property
    def n_stimuli(self) -> int:
        return self.models[0].n_stimuli

    def at(self, offset_mm: float) -> AfferentModel:
        offset = finite(OFFSET_NAME, offset_mm, "mm")
        if not self.offsets_mm[0] <= offset <= self.offsets_mm[-1]:
            raise InputError(
                f"{OFFSET_NAME} must lie within {self.offsets_mm[0]:g} ... {self.offsets_mm[-1]:g} mm, "
                f"where the skin was sampled: got {offset:g}."
            )
        before = min(int(np.searchsorted(self.offsets_mm, offset, "right")) - 1, len(self.models) - 2)
        share = (offset - self.offsets_mm[before]) / (self.offsets_mm[before + 1] - self.offsets_mm[before])
        near, far = self.models[before], self.models[before + 1]
        return replace(
            near, drives=tuple(_between(*pair, share) for pair in zip(near.drives, far.drives, strict=True))
        )

    def evaluate(self, parameters: FloatArray) -> Rates:
        return self.at(parameters[-1]).evaluate(parameters[:-1])

    def evaluate_batch(self, points: FloatArray) -> Rates:
        """Rates (n_points, n_stimuli) for rows of seven parameters, bit-equal to `evaluate`. [spikes/s]"""
        return evaluate_rows(self, points)


def _between(near: Drive, far: Drive, share: float) -> Drive:
    """Drive interpolated linearly: `near` for a share of 0, `far` for 1."""
    return replace(
        near,
        values=(1.0 - share) * near.values + share * far.values,
        rate_per_ms=(1.0 - share) * near.rate_per_ms + share * far.rate_per_ms,
    )
