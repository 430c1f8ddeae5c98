"""Types of afferents in the fingertip: parameters of RA, PC and SAII, and published observations.

Parameters with the status *assumed* were fitted by us to the observations below them, as
docs/afferents.md describes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from fingerpad.data.published import Published, Source

_SINUSOIDS = Source(
    "our fit to the recalled thresholds of one impulse per cycle (RA_TUNING, PC_TUNING), 1 mm punch on a "
    "hold of 0.5 mm, default tissues, quick resolution",
    "assumed",
)
_SHARED_REFRACTORY = Source("shorter than any interval in RA and PC trains that are entrained", "assumed")

_RA: dict[str, Published[float] | float | str] = {
    "threshold": _SINUSOIDS("RA: band-passed stress at the threshold of the membrane", 0.082, "kPa"),
    "corner_hz": _SINUSOIDS("RA: corner frequency of the band pass", 60.0, "Hz"),
    "rise": _SINUSOIDS("RA: power of the frequency below the corner", 1.0, "1"),
    "fall": _SINUSOIDS("RA: power of the frequency above the corner", 1.0, "1"),
    "retraction": _SINUSOIDS("RA: share of the response to retraction", 0.3, "1"),
    "membrane_ms": _SINUSOIDS("RA: time constant of the membrane", 5.0, "ms"),
    "refractory_ms": _SHARED_REFRACTORY("RA: refractory period", 2.0, "ms"),
    "quantity": "compressive_stress",  # Meissner corpuscles lie at the depth of the Merkel cells.
}
PC_REACH = Published(
    "PC: radius of the skin whose mean displacement the corpuscle follows",
    3.0,
    "mm",
    "chosen by us for the published area of the field (FIELD_AREAS); corpuscles lie 2 to 3 mm deep",
    "assumed",
)
_PC: dict[str, Published[float] | float | str] = {
    "threshold": _SINUSOIDS("PC: band-passed displacement at the threshold of the membrane", 4.84e-5, "mm"),
    "corner_hz": _SINUSOIDS("PC: corner frequency of the band pass", 500.0, "Hz"),
    "rise": _SINUSOIDS("PC: power of the frequency below the corner", 2.0, "1"),
    "fall": _SINUSOIDS("PC: power of the frequency above the corner", 2.0, "1"),
    "retraction": _SINUSOIDS("PC: share of the response to retraction", 0.5, "1"),
    "membrane_ms": _SINUSOIDS("PC: time constant of the membrane", 1.0, "ms"),
    "refractory_ms": _SHARED_REFRACTORY("PC: refractory period", 1.0, "ms"),
    "quantity": "deep_displacement",  # The corpuscle lies deep; its thresholds are known as displacements.
}
SMOOTHING = Published(
    "SAI and SAII: time constant by which the dynamic term lags behind",
    17.0,
    "ms",
    "chosen by us for SAI_TUNING; a fit to the bar recordings with the paper's drive found 14 ms, which they "
    "hardly determine (docs/single-unit.md, slow dynamic term)",
    "assumed",
)
_STRETCH = Source(
    "set so that the afferent first fires at the published indentation threshold (INDENTATION_THRESHOLDS), "
    "1 mm punch, default tissues; rates of tens per second at strains of some per cent",
    "assumed",
)
_SAII: dict[str, Published[float] | float | str] = {
    "intercept_ma": 0.0,
    "static_gain": _STRETCH("SAII: static gain, inverse of the strain at threshold", 80.0, "1"),
    "dynamic_gain": _STRETCH("SAII: dynamic gain", 4000.0, "ms"),
    "time_constant_ms": _STRETCH("SAII: time constant of the membrane", 80.0, "ms"),
    "capacitance_mf": 80.0,  # Equal to the time constant, so that the resistance is 1.
    "threshold_mv": 1.0,
    "smoothing_ms": SMOOTHING,
    # Knibestöl 1975 tells SAII from SAI by their response to stretch.
    "dynamic_quantity": "skin_stretch",
    "static_quantity": "skin_stretch",
}

_DENSITY_TOTAL = Source("Johansson & Vallbo 1979, J Physiol 286:283, abstract", "read")
DENSITY_TOTAL = _DENSITY_TOTAL("density of all tactile afferents in the fingertip", 241.0, "1/cm2")
DENSITIES = Published(
    "density of SAI, RA, PC and SAII afferents in the fingertip",
    (70.0, 140.0, 21.0, 10.0),
    "1/cm2",
    "Johansson & Vallbo 1979, J Physiol 286:283: SAI, RA and PC; SAII is what is left of their total of 241 "
    "(49 is also quoted, with which the sum would be 280)",
    "recalled",
)


Number = Published[float] | float


def value_of(number: Number | str) -> float | str:
    """Return a number without its source."""
    return number.value if isinstance(number, Published) else number


@dataclass(frozen=True)
class AfferentRow:
    """One type of afferents: the chain from the skin to the spikes, its numbers, and how dense it is."""

    chain: str
    """"slow", the paper's Eqs. 1-5; or "rapid", a band pass and a membrane."""
    density_per_cm2: Number
    """In the fingertip. [1/cm2]"""
    numbers: Mapping[str, Number | str]
    """By the fields of the chain; those that are absent have its defaults."""
    of_tissues: bool = False
    """Whether the defaults are those that were fitted with the tissues."""

    @property
    def values(self) -> dict[str, float | str]:
        """The numbers without their sources; powers are whole."""
        plain = {name: value_of(number) for name, number in self.numbers.items()}
        return {name: int(value) if name in ("rise", "fall") else value for name, value in plain.items()}


TYPES: Mapping[str, AfferentRow] = MappingProxyType(
    {
        "SAI": AfferentRow("slow", DENSITIES.value[0], {"smoothing_ms": SMOOTHING}, of_tissues=True),
        "RA": AfferentRow("rapid", DENSITIES.value[1], _RA),
        "PC": AfferentRow("rapid", DENSITIES.value[2], _PC),
        "SAII": AfferentRow("slow", DENSITIES.value[3], _SAII),
    }
)
"""The types of afferents by their names: one more row is one more type, in Python, files and commands."""

INDENTATION_THRESHOLDS = Published(
    "median indentation that makes a unit fire: SAI, RA, PC, SAII",
    (56.5, 13.8, 9.2, 331.0),
    "um",
    "Johansson & Vallbo 1979, J Physiol 297:405, abstract",
    "read",
)
_VELOCITIES = Source(
    "Knibestöl 1973, J Physiol 232:427, abstract; 39 RA and 10 PC units of the human hand", "read"
)
RA_VELOCITIES = _VELOCITIES("RA: smallest and largest velocity threshold of a unit", (0.4, 39.3), "mm/s")
PC_VELOCITIES = _VELOCITIES("PC: smallest and largest velocity threshold of a unit", (0.5, 19.6), "mm/s")
SAI_DECLINE = Published(
    "SAI: mean decline of the rate in the first 12 s of a hold of 0.65 and 1.3 mm",
    (0.38, 0.36),
    "1",
    "Journal of Neuroscience 3(12), 2652, 1983, abstract; 21 monkey afferents",
    "read",
)
FIELD_AREAS = Published(
    "median area of receptive fields at four to five times the threshold: SAI, RA, PC, SAII",
    (11.0, 12.6, 101.0, 59.0),
    "mm2",
    "Johansson & Vallbo 1980, Brain Res 184:353 (a review by Delhaye, Long & Bensmaia 2018 has 10 for SAI "
    "and 50 for SAII; Table 1 of J Neurophysiol 101:1033, 2009, has less than 6, 5 to 30 and less than 25 "
    "for SAI, RA and SAII, read)",
    "recalled",
)

TUNING_FREQUENCIES = Published(
    "frequencies of the thresholds of one impulse per cycle",
    (1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0, 100.0, 150.0, 200.0, 300.0, 400.0),
    "Hz",
    "chosen by us",
    "assumed",
)
_TUNING = Source(
    "read off our memory of figures in Talbot, Darian-Smith, Kornhuber & Mountcastle 1968, Mountcastle, "
    "LaMotte & Carli 1972 and Johansson, Landström & Lundström 1982; certain to a factor of two at best",
    "recalled",
)
RA_TUNING = _TUNING(
    "RA: amplitude for one impulse per cycle at these frequencies",
    (250.0, 130.0, 50.0, 26.0, 15.0, 11.0, 12.0, 22.0, 42.0, 70.0, 150.0, 250.0),
    "um",
)
SAI_TUNING = _TUNING(
    "SAI: amplitude for one impulse per cycle at these frequencies up to 200 Hz",
    (50.0, 50.0, 50.0, 50.0, 65.0, 120.0, 180.0, 320.0, 480.0, 600.0),
    "um",
)
PC_TUNING = _TUNING(
    "PC: amplitude for one impulse per cycle at these frequencies from 10 Hz on",
    (400.0, 120.0, 28.0, 11.0, 4.0, 1.9, 1.2, 1.0, 1.3),
    "um",
)
BEST_FREQUENCIES = Published(
    "range of frequencies at which RA units are most easily excited, and lower limit for PC units",
    (8.0, 64.0, 64.0),
    "Hz",
    "Johansson, Landström & Lundström 1982, Brain Res 244:17, abstract",
    "read",
)
