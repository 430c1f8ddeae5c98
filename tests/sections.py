"""Inputs of several test files: sections of results as JSON holds them, and skins given by a formula."""

import json
from copy import deepcopy
from dataclasses import replace
from typing import TypeVar

import numpy as np

import fingerpad as fp
from fingerpad.core.result_files import from_json
from fingerpad.core.signals import STORED_ENERGY, Traces
from fingerpad.geometry.mesh import block_mesh
from fingerpad.neuron.afferent import Afferent
from fingerpad.skin.indentation import Touch

SMALL_TOUCH = Touch(
    finger=fp.Fingertip(),
    indenter=fp.Sphere(curvature_per_m=287),
    stimulus=fp.RampAndHold(depth_mm=0.3),
    tissues=fp.named_tissues("trial3"),
    grading=fp.Grading(17.37, 1.2, 1.2, 0.8, 0.8, largest_mm=4.0, stratum_corneum=1, dermis=1, subcutis=1),
    settings=fp.PressSettings(ramp_steps=2, hold_steps=1),
)
"""A shallow press into a coarse finger, which takes a second."""

CURVATURE_PER_M = [287.0, 296.0, 305.0, 316.0, 328.0, 340.0, 365.0]
CODES = ("static", "dynamic", "latency", "euclidean")
Kind = TypeVar("Kind")


class SphereSkin:
    """SED below a sphere: the more curved, the higher and narrower."""

    def __init__(self, position_mm, curvature_per_m, width_mm=2.0, powers=(1.5, 0.5)):
        self.centre = np.array([17.37 + position_mm, 0.0])
        sharpness = curvature_per_m / 287.0
        self.peak_kpa, self.width_mm = 2.5 * sharpness ** powers[0], width_mm / sharpness ** powers[1]

    @classmethod
    def wide(cls, curvature_per_m):
        """A wider field at the receptor that depends less on curvature."""
        return cls(0.0, curvature_per_m, width_mm=2.5, powers=(1.0, 0.25))

    def sed(self, sites):
        squared = np.square(np.asarray(sites)[:, [0, -1]] - self.centre).sum(axis=1)
        peaks = self.peak_kpa * np.exp(-squared / self.width_mm**2)
        return Traces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 0.85], peaks), kinks_ms=[50.0])


DEPTHS_MM = np.array([0.0, 0.2, 0.371, 0.471, 1.0, 1.624, 5.0])
LAYER_OF_INTERVAL = [0, 0, 1, 2, 2, 3]


def layered_block(centre_mm=0.0, symmetric=True):
    """A flat block with the layers of the finger, fine about its centre; half of it where symmetric."""
    lines = np.concatenate([[0.0], np.cumsum(0.25 * 1.1 ** np.arange(8))])
    both = np.concatenate([-lines[:0:-1], lines])
    across = lines if symmetric else both
    return block_mesh(centre_mm + both, DEPTHS_MM, across, LAYER_OF_INTERVAL, symmetric=symmetric)


SKINS = {
    (position, curvature): SphereSkin(position, curvature)
    for position in (0.0, 0.2)
    for curvature in CURVATURE_PER_M
}


def sed_driven(parameters, refractory_ms=1.0):
    """An afferent of six numbers that follows SED in both terms."""
    quantities = {"dynamic_quantity": STORED_ENERGY, "static_quantity": STORED_ENERGY}
    return Afferent.from_parameters(parameters, refractory_ms=refractory_ms, **quantities)


def followed_by(afferent, traces):
    """The same course of both quantities that an afferent follows."""
    dynamic = replace(traces, quantity=afferent.dynamic_quantity)
    if afferent.dynamic_quantity == afferent.static_quantity:
        return dynamic
    return replace(traces, quantity=afferent.static_quantity, dynamic=dynamic)


SED_DRIVEN = sed_driven(Afferent.for_tissues("trial3").parameters)
"""It starts at rest and follows SED in both terms, the only quantity of the skins given by a formula."""

SENSITIVE = replace(SED_DRIVEN, static_gain=1.2e-6)
RESTLESS = replace(SENSITIVE, intercept_ma=8e-7)
"""It fires without a touch: beta tau / C is above the threshold."""


def typed(cls: type[Kind], section: dict) -> Kind:
    """The section as its class."""
    return from_json(cls, json.dumps(section).encode())


SHIFT_MM = np.linspace(-3.5, 3.5, 36)
PARAMETERS = {
    "intercept_ma": 4.1e-7, "dynamic_gain": 2.2e-4, "static_gain": 8.3e-7, "time_constant_ms": 71.0,
    "capacitance_mf": 1e-6, "threshold_mv": 50.0,
}  # fmt: skip


def skin_deflection_section() -> dict:
    """Deflection of the three trials, of which Trial 3 is closest to the observed one, as in the paper."""
    distance = np.arange(-10.0, 10.1, 0.5)

    def profile(scale: float, **more: float) -> dict:
        deflection = scale * np.exp(-np.abs(distance))
        return {"distance_mm": distance.tolist(), "deflection_mm": deflection.tolist(), **more}

    section: dict = {
        trial: {
            "line": profile(scale, force_mn=90.0),
            "cylinder": profile(scale, force_mn=210.0, r2=r2, r2_mirrored=0.91),
        }
        for trial, scale, r2 in (("trial1", 0.9, 0.93), ("trial2", 1.1, 0.94), ("trial3", 1.0, 0.95))
    }
    observed = np.linspace(-9.25, 9.25, 45)
    section["observed"] = {
        "distance_mm": observed.tolist(),
        "deflection_mm": (np.round(20.0 * np.exp(-np.abs(observed))) / 20.0).tolist(),
        "is_artefact": [True] + [False] * 44,
        "source": "Dandekar 1995", "status": "read",
    }  # fmt: skip
    return section


def single_unit_section() -> dict:
    """A fit of the paper's afferent that reaches what the paper states."""
    edges = np.exp(-(((np.abs(SHIFT_MM) - 1.6) / 0.5) ** 2))
    dynamic, static = 130.0 * edges + 70.0 * (np.abs(SHIFT_MM) < 1.5), 55.0 * edges
    history = [{"iteration": n, "fss": 0.78 + 0.02 * n, "parameters": PARAMETERS} for n in range(4)]
    scores = {"fss_train": 0.85, "fss_test": 0.84}
    climbs = [{"start": n, "runs": 400 + n, "history": history, **scores} for n in (1, 2)]
    folds = [
        {
            "fold": fold, "start": 1 + fold % 2,
            "testing_shift_mm": SHIFT_MM[fold - 1 :: 6].tolist(), "climbs": deepcopy(climbs), **scores,
        }
        for fold in range(1, 7)
    ]  # fmt: skip

    def modulated(minimum: float, maximum: float, index: float) -> dict:
        ours = {"minimum_hz": minimum, "maximum_hz": maximum, "index": index}
        ours |= {"difference_hz": maximum - minimum}
        return {"ours": ours, "observed": ours | {"minimum_hz": 70.0, "maximum_hz": 210.0}}

    return {
        "fss_in_sample": 0.83, "fss_in_sample_dynamic": 0.7, "fss_in_sample_static": 0.9,
        "fss_out_of_sample": 0.82, "method": "response surface",
        "dynamic_quantity": "stored", "static_quantity": "stored", "parameters": dict(PARAMETERS),
        "units": dict(zip(PARAMETERS, ("mA", "mA ms/kPa", "mA/kPa", "ms", "mF", "mV"), strict=True)),
        "shift_mm": SHIFT_MM.tolist(), "dynamic_rate_hz": dynamic.tolist(), "static_rate_hz": static.tolist(),
        "observed_dynamic_rate_hz": np.round(0.95 * dynamic + 4.0).tolist(),
        "observed_static_rate_hz": np.round(0.9 * static + 2.0).tolist(),
        "start_points": [PARAMETERS, PARAMETERS | {"static_gain": 3.0e-7}], "folds": folds,
        "modulation": {"dynamic": modulated(54.0, 212.0, 0.6), "static": modulated(5.0, 57.0, 0.8)},
    }  # fmt: skip


def discrimination_section() -> dict:
    """Discrimination of spheres with which the paper would agree, apart from the noise."""

    def sure(value: float) -> dict:
        return {"value": value, "error": 0.001}

    rise = 1.0 - 0.5 * np.exp(-(np.array(CURVATURE_PER_M[1:]) - 287.0) / 30.0)

    def rates(shift: float, spread: float) -> dict:
        deviations = dict.fromkeys(("hit_rate_sd", "hit_rate_shifted_sd"), [spread] * 6)
        return {"hit_rate": rise.tolist(), "hit_rate_shifted": (rise - shift).tolist()} | deviations

    def named(names: tuple[str, ...], values: tuple[float, ...]) -> dict:
        return dict(zip(names, map(sure, values), strict=True))

    goodwin = {
        "curvature_per_m": [296.0, 365.0], "hit_rate": [0.58, 0.95], "trials": 100, "low": [0.48, 0.89],
        "high": [0.68, 0.98],
    }  # fmt: skip
    target = {
        "at_goodwin": [sure(0.58), sure(0.95)], "largest_from_line": sure(0.02),
    }  # fmt: skip
    statistics = {
        "misfit": named(CODES, (0.01, 0.06, 0.08, 0.02)),
        "misfit_above_static": named(CODES[1:], (0.05, 0.07, 0.01)),
        "shift": named(CODES, (0.01, 0.1, 0.12, 0.01)),
        "shift_above_static": named(CODES[1:], (0.09, 0.11, 0.0)),
        "smallest_rise": {name: [sure(0.05), sure(0.04)] for name in CODES},
        "noise_lowers": {"smallest_fall": sure(0.02)},
        "ten_matrices": {"ratio": sure(3.2), "change": sure(0.01)},
        "criterion": {"ratio": sure(2.0), "change": sure(0.005)},
        "unsteadiness": named(("few", "many", "ratio"), (0.007, 0.002, 3.2)),
        "targets": [target, target],
    }
    readings = {
        "static, eight neighbours (used)": 0.01,
        "static, four neighbours": None,
        "dynamic, eight neighbours (used)": 0.06,
        "latency of receptors that fire under every sphere (used)": 0.08,
        "latency, waiting until the ramp ends": 0.12,
    }
    shared = {"receptors": [18, 17], "rise": [0.46, 0.43], "largest_shift": 0.01}
    of_noise = ("noise_sigma", "misfit", "own_largest_shift")
    reasons = {
        "criterion": {
            "criterion_sigma": [0.01, 0.02], "point": [0.05, 0.1], "fraction": [0.002, 0.004],
            "likelihood": [0.003, 0.006],
        },
        "euclidean": {"noise_sigma": 0.05, "misfit": 0.02},
        "rise_for_paper_noise": {"static": [0.16, None]},
        "misfit_curve": {
            "noise_sigma": [0.01, 0.1, 0.2],
            "misfit": {name: [0.3, 0.1, 0.2] for name in ("static", "latency", "euclidean")},
        },
        "readings": [
            {"reading": name} | shared | dict.fromkeys(of_noise, noise) for name, noise in readings.items()
        ],
    }  # fmt: skip
    return {
        "curvature_per_m": CURVATURE_PER_M, "seed": 1, "noise_sigma": 0.12,
        "noise_sigma_paper": 0.055, "sessions": 5, "goodwin": goodwin, "silent": [],
        "statistics": statistics,
        "reasons": reasons,
        "gradient_sum": {
            "static": rates(0.01, 0.02), "dynamic": rates(0.1, 0.03), "latency": rates(0.08, 0.04),
        },
        "euclidean": {"static": rates(0.02, 0.02)},
        "variants": {
            "sigma_0.025": rates(0.0, 0.01), "sigma_0.055": rates(0.0, 0.01), "sigma_0.085": rates(0.0, 0.02),
            "ten_matrices": rates(0.02, 0.06), "criterion_0.01": rates(0.01, 0.03),
            "criterion_0.02": rates(0.01, 0.06),
        },
    }  # fmt: skip


def nail_section() -> dict:
    """A tube with a closed end, its pad below, and stress under the sphere and at the nail."""
    along, angle = np.meshgrid(np.linspace(0.0, 31.0, 20), np.linspace(0.0, np.pi, 16), indexing="ij")
    taper = np.sqrt(1.0 - (along / 31.78) ** 6)
    y = -np.cos(angle) * np.where(angle < np.pi / 2, 10.0, 4.5) * taper
    z = 9.8 * np.sin(angle) * taper

    def stress(x, y, z):
        return 20.0 * np.exp(-np.hypot(x - 17.4, np.hypot(y + 9.85, z)) / 1.5) + 0.4 * (y > 2.0)

    x_faces, y_faces, z_faces = (values[:-1, :-1] for values in (along, y, z))
    rows = np.arange(-9.0, 3.0, 1.0)
    corners_y = rows[:, None] + [0.0, 0.0, 1.0, 1.0]
    nail = np.array([[[17.0, 3.0, 0.0], [17.0, 2.5, 5.0]], [[17.0, 2.5, 5.0], [28.0, 1.0, 5.0]]])
    distance = np.arange(-1.75, 5.0, 0.5)
    course = [[0.2, 0.4 + 0.1 * np.exp(-abs(d)), 0.6] if abs(d) > 0.3 else [None] * 3 for d in distance]
    across = corners_y.tolist()
    return {
        "x_mm": along.tolist(), "y_mm": y.tolist(), "z_mm": z.tolist(),
        "von_mises_kpa": stress(x_faces, y_faces, z_faces).tolist(), "nail_mm": nail.tolist(),
        "ratio": 1.8, "ratio_range": [1.5, 3.9], "ratio_energy": 1.5, "border_kpa": 0.8,
        "profile": {"distance_mm": distance.tolist(), "surface_kpa": course, "living_epidermis_kpa": course},
        "across": {
            "x_mm": 22.0, "y_mm": across, "z_mm": across,
            "von_mises_kpa": np.linspace(0.0, 0.8, 12).tolist(),
        },
    }  # fmt: skip
