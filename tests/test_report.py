"""The report draws finished numbers: all of them, escaped, and whole or not at all."""

import numpy as np

SHIFT_MM = np.linspace(-3.5, 3.5, 36)
CURVATURE_PER_M = [287.0, 296.0, 305.0, 316.0, 328.0, 340.0, 365.0]
PARAMETERS = {
    "intercept_ma": 4.1e-7,
    "dynamic_gain": 2.2e-4,
    "static_gain": 8.3e-7,
    "time_constant_ms": 71.0,
    "capacitance_mf": 1e-6,
    "threshold_mv": 50.0,
}


def synthetic_results() -> dict:
    """Results with every section, shaped like a run and plausible in size."""
    return {
        "skin_deflection": _skin_deflection(),
        "single_unit": _single_unit(),
        "discrimination": _discrimination(),
        "population": _population(),
        "nail": _nail(),
        "comparison": [
            _compared("FSS out of sample", "0.81", "0.84", "+0.03", True),
            _compared("hit rate at 296 /m", "0.58", "0.71", "+0.13", False),
            _compared("force under the cylinder", "–", "210 mN", "–", None),
        ],
        "inputs": [
            {"name": "depth", "value": 1.0, "unit": "mm", "source": "section 2.2", "status": "paper"},
            {"name": "fillet", "value": 0.3, "unit": "mm", "source": "later model", "status": "read"},
            {"name": "density", "value": 70.0, "unit": "1/cm2", "source": "1979", "status": "recalled"},
            {
                "name": "spheres",
                "value": CURVATURE_PER_M,
                "unit": "1/m",
                "source": "lost",
                "status": "assumed",
            },
        ],
        "manifest": {
            "version": "0.1.0",
            "seed": 1,
            "resolution": "standard",
            "wall_s": 4210.5,
            "peak_memory_mb": 3100.0,
            "nodes": 232000,
            "elements": 221000,
            "stages": [{"name": "spheres", "wall_s": 812.0, "indentations": 14}],
            "packages": {"numpy": "2.2.0", "scipy": "1.15.0"},
            "python": "3.11.2",
            "platform": "Linux",
            "started": "2025-01-01T00:00:00",
            "code_hash": "0123456789abcdef",
            "worst_scaled_jacobian": 0.55,
        },
    }


def _compared(quantity: str, paper: str, ours: str, difference: str, met: bool | None) -> dict:
    return {
        "quantity": quantity,
        "paper": paper,
        "ours": ours,
        "difference": difference,
        "status": "paper / assumed materials",
        "met": met,
        "note": "mean of six folds",
    }


def _skin_deflection() -> dict:
    distance = np.arange(-10.0, 10.01, 0.1)

    def profile(width: float, **more: float) -> dict:
        deflection = np.exp(-((np.abs(distance) / width) ** 1.2))
        return {"distance_mm": distance.tolist(), "deflection_mm": deflection.tolist(), **more}

    widths = {"trial1": 2.6, "trial2": 3.8, "trial3": 3.1}
    section: dict = {
        trial: {
            "line": profile(0.6 * width, force_mn=90.0),
            "cylinder": profile(width, force_mn=210.0, r2=0.9 + 0.01 * index, r2_mirrored=0.88),
        }
        for index, (trial, width) in enumerate(widths.items())
    }
    observed = np.linspace(-9.25, 9.25, 45)
    section["observed"] = {
        "distance_mm": observed.tolist(),
        "deflection_mm": (np.round(20.0 * np.exp(-((np.abs(observed) / 3.0) ** 1.2))) / 20.0).tolist(),
        "is_artefact": [True] + [False] * 44,
    }
    return section


def _single_unit() -> dict:
    edges = np.exp(-(((np.abs(SHIFT_MM) - 1.6) / 0.5) ** 2))
    dynamic, static = 130.0 * edges + 70.0 * (np.abs(SHIFT_MM) < 1.5), 55.0 * edges
    observed = {"maximum_hz": 210.0, "minimum_hz": 70.0, "difference_hz": 140.0, "index": 0.5}
    ours = {"maximum_hz": 205.0, "minimum_hz": 64.0, "difference_hz": 141.0, "index": 0.52}
    history = [
        {
            "iteration": index,
            "fss": 0.7 + 0.03 * index,
            "parameters": {**PARAMETERS, "time_constant_ms": 68.0 + index},
        }
        for index in range(5)
    ]
    return {
        "fss_in_sample": 0.86,
        "fss_in_sample_dynamic": 0.7,
        "fss_in_sample_static": 0.92,
        "fss_out_of_sample": 0.84,
        "parameters": PARAMETERS,
        "units": {
            "intercept_ma": "mA",
            "dynamic_gain": "mA ms/kPa",
            "static_gain": "mA/kPa",
            "time_constant_ms": "ms",
            "capacitance_mf": "mF",
            "threshold_mv": "mV",
        },
        "shift_mm": SHIFT_MM.tolist(),
        "dynamic_rate_hz": dynamic.tolist(),
        "static_rate_hz": static.tolist(),
        "observed_dynamic_rate_hz": np.round(0.95 * dynamic + 4.0).tolist(),
        "observed_static_rate_hz": np.round(0.9 * static + 2.0).tolist(),
        "start_points": [
            {**PARAMETERS, "intercept_ma": 0.0, "dynamic_gain": 2.0e-4, "static_gain": 7.0e-7},
            {**PARAMETERS, "intercept_ma": 0.0, "dynamic_gain": 2.05e-4, "static_gain": 3.0e-7},
        ],
        "folds": [
            {
                "fold": fold,
                "start": 1 + fold % 2,
                "testing_shift_mm": SHIFT_MM[fold - 1 :: 6].tolist(),
                "fss_train": 0.85,
                "fss_test": 0.80 + 0.01 * fold,
                "parameters": PARAMETERS,
                "history": history,
            }
            for fold in range(1, 7)
        ],
        "modulation": {phase: {"observed": observed, "ours": ours} for phase in ("dynamic", "static")},
        "edge_response": {"peak_distance_mm": 1.6, "profile_hz": SHIFT_MM.tolist()},
    }


def _discrimination() -> dict:
    rise = 1.0 - 0.5 * np.exp(-(np.array(CURVATURE_PER_M[1:]) - 287.0) / 30.0)

    def rates(shift: float, spread: float) -> dict:
        return {
            "hit_rate": rise.tolist(),
            "hit_rate_sd": [spread] * 6,
            "hit_rate_shifted": (rise - shift).tolist(),
            "hit_rate_shifted_sd": [spread] * 6,
        }

    return {
        "curvature_per_m": CURVATURE_PER_M,
        "noise_sigma": 0.12,
        "noise_sigma_paper": 0.055,
        "goodwin": {"curvature_per_m": [296.0, 365.0], "hit_rate": [0.58, 0.95]},
        "gradient_sum": {
            "static": rates(0.01, 0.02),
            "dynamic": rates(0.1, 0.03),
            "latency": rates(0.08, 0.04),
        },
        "euclidean": {"static": rates(0.02, 0.02)},
        "variants": {
            "sigma_0.025": rates(0.0, 0.01),
            "sigma_0.055": rates(0.0, 0.01),
            "sigma_0.085": rates(0.0, 0.02),
            "ten_matrices": rates(0.02, 0.06),
            "criterion_0.01": rates(0.01, 0.03),
            "criterion_0.02": rates(0.01, 0.06),
        },
    }


def _population() -> dict:
    x, z = np.linspace(12.0, 22.0, 21), np.linspace(-5.0, 5.0, 21)
    away = np.hypot(x[:, None] - 17.4, z[None, :])
    static = 50.0 * np.exp(-((away / 2.0) ** 2))
    latency = [[None if r > 4.0 else 6.0 + 6.0 * r for r in row] for row in away]
    return {
        "curvature_per_m": 287.0,
        "x_mm": x.tolist(),
        "z_mm": z.tolist(),
        "dynamic_rate_hz": (4.0 * static).tolist(),
        "static_rate_hz": static.tolist(),
        "first_spike_latency_ms": latency,
        "receptors_mm": [[15.0 + i, j - 1.0] for i in range(6) for j in range(3)],
    }


def _nail() -> dict:
    along, angle = np.meshgrid(np.linspace(0.0, 31.0, 40), np.linspace(0.0, np.pi, 30), indexing="ij")
    taper = np.sqrt(1.0 - (along / 31.78) ** 6)
    y = -np.cos(angle) * np.where(angle < np.pi / 2, 10.0, 4.5) * taper
    z = 9.8 * np.sin(angle) * taper
    sed = 3.0 * np.exp(-np.hypot(along - 17.4, np.hypot(y + 9.85, z)) / 1.5) + 0.02 * np.exp(
        -((angle - 2.3) ** 2) / 0.05
    )
    columns, rows = np.meshgrid(np.arange(0.0, 30.0, 1.0), np.arange(-9.0, 3.0, 1.0), indexing="ij")
    corners_x = columns.ravel()[:, None] + [0.0, 1.0, 1.0, 0.0]
    corners_y = rows.ravel()[:, None] + [0.0, 0.0, 1.0, 1.0]
    return {
        "x_mm": along.tolist(),
        "y_mm": y.tolist(),
        "z_mm": z.tolist(),
        "sed_kpa": sed.tolist(),
        "ratio": 3.2,
        "text": "Skin at the border holds 3.2 times what skin as far from the sphere holds elsewhere.",
        "section": {
            "x_mm": corners_x.tolist(),
            "y_mm": corners_y.tolist(),
            "sed_kpa": (3.0 * np.exp(-np.hypot(columns - 17.0, rows + 9.0) / 2.0)).ravel().tolist(),
            "displaced": True,
        },
    }
