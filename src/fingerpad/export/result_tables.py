"""Results as tables of pandas and as labelled data sets of xarray: what `to_pandas` and `to_xarray` return.

A table has one row per time, afferent, spike, stimulus or parameter, as `TABLES` says for each type. A data
set has the same values with named dimensions and units. The extra `fingerpad[netcdf]` is required.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerpad.core.displayed import Result
from fingerpad.core.signals import HitRates, ResponseMap, SpikeTrains, Traces
from fingerpad.core.units import QUANTITY_UNITS, unit_of, units_of
from fingerpad.export.dataset import library, part_variable, response_values, touch_dataset, udunits
from fingerpad.skin.fields import Place, stored_fields

if TYPE_CHECKING:
    import pandas
    import xarray

    from fingerpad.experiments.discrimination.analysis import TaskResult
    from fingerpad.experiments.fit.results import FitResult
    from fingerpad.inference.spike_fit import SpikeFit
    from fingerpad.psychophysics.curve_fit import PsychometricFit
    from fingerpad.reduction.streaming import ReducedSample
    from fingerpad.skin.sampling import SkinResponse, SurfaceProfile

Columns = Mapping[Any, Any]  # Columns of a table by name, the index first.


def skin_columns(skin: SkinResponse) -> Columns:
    """Return every quantity of the whole press, by time."""
    numbers = (each.name for each in stored_fields() if each.place is Place.PRESS and each.components == 1)
    return {name: skin.fields[name] for name in numbers if name in skin.fields}


def profile_columns(profile: SurfaceProfile) -> Columns:
    """Deflection of the skin, by the distance from the object's axis."""
    return {"distance_mm": profile.distance_mm, "deflection_mm": profile.deflection_mm}


def traces_columns(traces: Traces) -> Columns:
    """Values, a column per site, by time; a time is repeated where a current jumps."""
    return {"time_ms": traces.times_ms} | dict(enumerate(traces.values.T))


def spike_columns(trains: SpikeTrains) -> Columns:
    """Spikes, by afferent."""
    counts = np.diff(trains.offsets)
    return {"afferent": np.repeat(np.arange(counts.size), counts), "time_ms": trains.times_ms}


def response_columns(response: ResponseMap) -> Columns:
    """Place, rates, latency and number of spikes, by afferent."""
    axes = ("x_mm", "z_mm") if response.positions_mm.shape[1] == 2 else ("x_mm", "y_mm", "z_mm")
    rates = (
        "dynamic_rate_hz",
        "static_rate_hz",
        "dynamic_count_hz",
        "static_count_hz",
        "first_spike_latency_ms",
    )
    return {
        "afferent": np.arange(len(response.spikes)),
        **({"type": response.types} if response.types else {}),
        **dict(zip(axes, response.positions_mm.T, strict=True)),
        **{name: getattr(response, name) for name in rates},
        "spikes": response.spike_count,
    }


def hit_rate_columns(rates: HitRates) -> Columns:
    """Hit rate and its standard deviation, by comparison."""
    comparison = np.arange(1, rates.hit_rate.size + 1)
    return {"comparison": comparison, "hit_rate": rates.hit_rate, "hit_rate_sd": rates.hit_rate_sd}


def psychometric_columns(fit: PsychometricFit) -> Columns:
    """Judgements, and the proportion that was observed and fitted, by level."""
    counts = fit.counts
    return {
        "level": counts.levels,
        "n_correct": counts.n_correct,
        "n_trials": counts.n_trials,
        "observed": counts.proportion,
        "fitted": fit.predict(counts.levels),
    }


def fit_columns(fit: FitResult) -> Columns:
    """Rates that were observed, fitted and predicted without the stimulus' fold, by stimulus and phase."""
    phases, n_stimuli = fit.phases, len(fit.stimulus)
    unknown = np.full(n_stimuli, np.nan)
    observed = [unknown if part.observed_hz is None else part.observed_hz for part in phases.values()]
    return {
        "stimulus": np.tile(fit.stimulus, len(phases)),
        "phase": np.repeat(list(phases), n_stimuli),
        "fold": np.tile(fit.fold, len(phases)),
        "observed_hz": np.concatenate(observed),
        "fitted_hz": np.concatenate([part.fitted_hz for part in phases.values()]),
        "out_of_sample_hz": np.concatenate([part.out_of_sample_hz for part in phases.values()]),
    }


def spike_fit_columns(fit: SpikeFit) -> Columns:
    """Value, standard error and unit, by parameter."""
    return {
        "parameter": fit.names,
        "value": fit.parameters,
        "standard_error": fit.standard_errors,
        "unit": list(units_of(fit.names).values()),
    }


def task_columns(task: TaskResult) -> Columns:
    """Return what each decoding makes of each comparison; NaN where it has no answer."""
    n_comparisons, decodings = len(task.stimulus) - 1, task.decodings
    level = np.full(n_comparisons, np.nan) if task.level is None else task.level[1:]
    columns: dict[str, Any] = {
        "comparison": np.tile(task.stimulus[1:], len(decodings)),
        "level": np.tile(level, len(decodings)),
        "code": np.repeat([decoding.code for decoding in decodings], n_comparisons),
        "measure": np.repeat([decoding.measure for decoding in decodings], n_comparisons),
    }
    for name in ("hit_rate", "hit_rate_sd", "d_prime", "efficiency"):
        given = (getattr(decoding, name) for decoding in decodings)
        columns[name] = np.concatenate(
            [np.full(n_comparisons, np.nan) if values is None else values for values in given]
        )
    return columns


def sample_columns(sample: ReducedSample) -> Columns:
    """Each quantity, and the error within which that of a full solution lies, by receptor."""
    n_receptors = len(next(iter(sample.fields.values())))
    errors = {f"{name}_error": np.full(n_receptors, error) for name, error in sample.field_errors.items()}
    return {"receptor": np.arange(n_receptors), **sample.fields, **errors}


TABLES: Mapping[str, Callable[[Any], Columns]] = {
    "SkinResponse": skin_columns,
    "SurfaceProfile": profile_columns,
    "Traces": traces_columns,
    "SpikeTrains": spike_columns,
    "ResponseMap": response_columns,
    "HitRates": hit_rate_columns,
    "PsychometricFit": psychometric_columns,
    "FitResult": fit_columns,
    "SpikeFit": spike_fit_columns,
    "TaskResult": task_columns,
    "ReducedSample": sample_columns,
}
"""Columns by the name of a result's class; the first is the index of the table."""


def table(result: Result) -> pandas.DataFrame:
    """Return a result as a table; see `Result.to_pandas`."""
    columns = TABLES[type(result).__name__](result)
    made: pandas.DataFrame = library("pandas").DataFrame(columns)
    return made.set_index(next(iter(columns)))


def traces_dataset(traces: Traces) -> xarray.Dataset:
    """Return each quantity by time and site; a time is repeated where a current jumps."""
    variables = {
        each.quantity: (("time", "site"), each.values, {"units": udunits(each.unit)})
        for each in (traces, traces.dynamic_term)
    }
    coordinates = {"time": ("time", traces.times_ms, {"units": "ms"})}
    made: xarray.Dataset = library("xarray").Dataset(variables, coordinates)
    return made


def response_dataset(response: ResponseMap) -> xarray.Dataset:
    """Receptors and spikes as `write_touch` writes them."""
    variables = {name: part_variable(name, values) for name, values in response_values(response).items()}
    made: xarray.Dataset = library("xarray").Dataset(variables)
    made["spike_count"].attrs["sample_dimension"] = "spike"
    return made


DATASETS: Mapping[str, Callable[[Any], xarray.Dataset]] = {
    "SkinResponse": touch_dataset,
    "Traces": traces_dataset,
    "ResponseMap": response_dataset,
}
"""Data sets with more dimensions than a table, by the name of a result's class."""


def dataset(result: Result) -> xarray.Dataset:
    """Return a result as a labelled data set; see `Result.to_xarray`.

    What has no data set of its own is the table, with the row as its dimension.
    """
    made_by = DATASETS.get(type(result).__name__)
    if made_by is not None:
        return made_by(result)
    library("xarray")
    rows = table(result).reset_index()
    made: xarray.Dataset = rows.rename_axis("row").to_xarray().drop_vars("row")
    for name, values in made.data_vars.items():
        if values.dtype.kind in "fiu":
            quantity = str(name).removesuffix("_error")
            values.attrs["units"] = udunits(QUANTITY_UNITS.get(quantity) or unit_of(str(name)))
    return made
