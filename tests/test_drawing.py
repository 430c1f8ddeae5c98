"""Results draw themselves, show a picture in notebooks, and say in one line what they are."""

import json
import warnings

import matplotlib
import numpy as np
import pandas
import pytest
import xarray
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from pynwb import NWBHDF5IO

import fingerpad as fp
from fingerpad.core.displayed import Result
from fingerpad.core.signals import RECEPTOR_COLUMNS, HitRates
from fingerpad.experiments.discrimination.analysis import analyse
from fingerpad.experiments.fit.fit import fit_recordings
from fingerpad.experiments.receptive_field import ReceptiveField
from fingerpad.experiments.scan import ScanRequest, ScanResult
from fingerpad.inference.spike_likelihood import SpikeFit
from fingerpad.psychophysics.curve_fit import fit_psychometric
from fingerpad.reduction.streaming import ReducedSample
from fingerpad.report.drawing import DRAWINGS
from fingerpad.report.percept import draw_task_responses
from fingerpad.report.skin import draw_spikes
from refusals import refused

TASK = {
    "question": "How strong?",
    "tissues": "trial3",
    "object": {"kind": "sphere"},
    "stimuli": {"vary": "object.curvature_per_m", "values": [200, 220, 240]},
    "standard": 200,
    "afferents": {"rows": 3, "columns": 3},
    "code": ["gradient_sum"],
    "measure": ["static", "latency"],
    "noise": 0.1,
    "experiment": {"seed": 5, "distributions": 5, "hit_rates": 10},
}


class Strength:
    """A skin that is pressed the more strongly, the more the sphere is curved."""

    caveats = ()

    def __init__(self, curvature_per_m):
        self.peak_kpa = curvature_per_m / 70.0

    def sed(self, sites, *quantities):
        squared = np.square(np.asarray(sites)[:, [0, -1]] - [17.37, 0.0]).sum(axis=1)
        peaks = self.peak_kpa * np.exp(-squared / 4.0)
        return fp.Traces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 0.9], peaks), kinks_ms=[50.0])


def discriminated():
    task = fp.DiscriminationRequest.read(TASK)
    return analyse(task, {each.name: Strength(each.indenter.curvature_per_m) for each in task.pressed})


def fitted():
    afferent = fp.Afferent.for_tissues("paper")
    times_ms = np.array([0.0, 25.0, 50.0, 100.0, 300.0, 1000.0])
    traces = fp.Traces(times_ms, np.outer([0, 0.3, 1, 0.9, 0.8, 0.7], np.linspace(2, 9, 6)), [50.0])
    names = tuple(f"height {number}" for number in range(6))
    return fit_recordings(traces, fp.RateRecordings(names, *afferent.rates(traces)), np.arange(6) % 2)


def scanned():
    asked = ScanRequest.read(
        {"object": "sphere", "x_mm": 2.0, "afferents": fp.Population([[17.0, 0.0]], 1.0)}
    )
    response = fp.ResponseMap(
        [[17.0, 0.0]], 1.0, fp.SpikeTrains.from_lists([[10.0, 210.0, 260.0]]), [0.0], [0.0], [10.0]
    )
    return ScanResult(asked, (), (response,), None)


@pytest.fixture(scope="module")
def results():
    """One result of each type that draws itself, by the name of the type."""
    finger = fp.Fingertip()
    motion, settings = fp.RampAndHold(depth_mm=0.6, hold_ms=60), fp.PressSettings(3, 2)
    skin = fp.indent(finger, fp.Sphere(radius_mm=4.0), motion, settings=settings)
    response = fp.Population.grid(density_per_cm2=200).respond(skin, static_window_ms=(60, 110))
    return {
        "SkinResponse": skin,
        "ResponseMap": response,
        "SpikeTrains": response.spikes,
        "Traces": skin.sed([(17.37, 0.0), (19.0, 0.0)]),
        "SurfaceProfile": skin.surface_profile(),
        "HitRates": HitRates([0.6, 0.9], [0.05, 0.02], seed=1),
        "FitResult": fitted(),
        "SpikeFit": SpikeFit(
            np.array([0.01, 4.0, 0.02, 40.0, 0.5]),
            np.diag([1e-6, 0.04, 1e-5, 9.0, 0.01]),
            -120.0,
            60,
            (-120.0,),
        ),
        "TaskResult": discriminated(),
        "ReducedSample": ReducedSample(
            12.0,
            0.4,
            25.0,
            9.0,
            {"stored": np.array([0.1, 0.4])},
            force_error_mn=0.2,
            field_errors={"stored": 0.02},
        ),
        "PsychometricFit": fit_psychometric([10.0, 20.0, 40.0], [55, 70, 95], [100] * 3),
        "Fingertip": finger,
        "ReceptiveField": ReceptiveField(
            x_mm=[-1.0, 0.0, 1.0],
            z_mm=[0.0, 1.0],
            spike_count=np.array([[0, 1], [9, 3], [0, 1]]),
            depth_mm=0.2,
        ),
        "ScanResult": scanned(),
        "TactileImage": scanned().image("SAI"),
    }


@pytest.mark.parametrize(("kind", "what"), DRAWINGS)
def test_every_drawing_fills_axes_that_say_what_they_show(results, kind, what):
    axes = Figure().add_subplot()
    assert results[kind].plot(axes, what) is axes
    assert axes.has_data()
    assert axes.get_xlabel()
    assert axes.get_ylabel()


def test_rasters_begin_on_top_and_maps_have_distal_to_the_right(results):
    response = results["ResponseMap"]
    by_touch, task = Figure(), draw_task_responses(results["TaskResult"])
    draw_spikes(by_touch.add_subplot(), results["SkinResponse"], response)
    rasters, maps = list(by_touch.axes), [task.axes[0]]
    for kind, what in DRAWINGS:
        into = {"raster": rasters, "map": maps, "pad": maps}.get(what)
        if into is not None:
            into.append(results[kind].plot(Figure().add_subplot(), what))
    assert (len(rasters), len(maps)) == (3, 3)
    for axes in rasters:
        bottom, top = axes.get_ylim()
        assert bottom > top
        assert axes.get_xlabel() == "time [ms]"
    first = rasters[1].collections[0]  # of the first afferent that fires
    assert first.get_lineoffset() == 1
    for axes in maps:
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("x, distal [mm]", "z, lateral [mm]")
        assert np.diff(axes.get_xlim()) > 0.0
        distal = max(offsets[:, 0].max() for dots in axes.collections if len(offsets := _places(dots)))
        assert distal == pytest.approx(response.positions_mm[:, 0].max(), abs=7.0)


def _places(drawn):
    """Places of dots, or the corners of a mesh."""
    return drawn.get_coordinates().reshape(-1, 2) if isinstance(drawn, QuadMesh) else drawn.get_offsets()


def test_drawings_show_the_numbers_of_the_result(results):
    skin, axes = results["SkinResponse"], Figure().add_subplot()
    (line,) = skin.plot(axes).lines
    assert line.get_ydata().tolist() == skin.force_mn.tolist()
    shown = results["ResponseMap"].plot(Figure().add_subplot(), "map", quantity="dynamic_rate_hz")
    assert shown.collections[0].get_array().tolist() == results["ResponseMap"].dynamic_rate_hz.tolist()
    pad = skin.plot(Figure().add_subplot(), "pad", quantity="compressive_stress", reach_mm=2.0)
    middle = skin.sample("compressive_stress", [(skin.axis_x_mm, 0.0)])[-1, 0]
    assert pad.collections[0].get_array().reshape(61, 61)[30, 30] == pytest.approx(middle, rel=1e-9)


def test_few_sites_have_a_key_and_many_have_none(results):
    times_ms, current_ma = [0.0, 50.0], np.outer([0.0, 2e-5], np.arange(1.0, 7.0))
    few = fp.Traces(times_ms, current_ma, quantity="current").plot(Figure().add_subplot())
    assert [text.get_text() for text in few.get_legend().get_texts()] == [f"site {n}" for n in range(1, 7)]
    styles = {(line.get_color(), str(line._dash_pattern)) for line in few.lines}
    assert len(styles) == 6
    assert few.get_ylabel() == "current [nA]"
    assert few.lines[0].get_ydata().tolist() == pytest.approx([0.0, 20.0])
    one = fp.Traces([0.0, 50.0, 50.0, 90.0], [[0.0], [2e-3], [1e-3], [1e-3]], quantity="current")
    assert one.plot(Figure().add_subplot()).get_legend() is None
    assert one.to_dataset().current.units == "mA"
    axes = fp.SpikeTrains.from_lists([[], []]).plot(Figure().add_subplot())
    assert "no afferent fires" in axes.texts[0].get_text()
    axes = Figure().add_subplot()
    fp.ResponseMap.joined({"SAI": results["ResponseMap"], "RA": results["ResponseMap"]}).plot(axes, "map")
    axes.figure.draw_without_rendering()
    assert axes.get_legend().get_window_extent().x0 >= axes.get_window_extent().x1  # beside the map
    matplotlib.use("agg")
    from matplotlib import pyplot

    axes = results["SkinResponse"].plot()
    assert axes.figure is pyplot.gcf()
    pyplot.close(axes.figure)
    many = fp.Traces(times_ms, np.ones((2, 7)), quantity="current").plot(Figure().add_subplot())
    assert many.get_legend() is None


@pytest.mark.parametrize("kind", dict.fromkeys(kind for kind, _ in DRAWINGS))
def test_a_notebook_shows_a_small_picture_and_one_line(results, kind):
    html, line = results[kind]._repr_html_(), repr(results[kind])
    assert 'src="data:image/png;base64,iVBOR' in html
    assert len(html) < 150_000
    assert "\n" not in line
    assert 20 < len(line) < 160
    if isinstance(results[kind], Result):
        table, data = results[kind].to_frame(), results[kind].to_dataset()
        assert len(table) > 0
        assert table.index.name
        variables = data.data_vars.values()
        numbers = [values for values in variables if values.dtype.kind == "f" or "units" in values.attrs]
        assert numbers
        assert all("units" in values.attrs for values in numbers)


@pytest.mark.parametrize(
    ("kind", "arguments", "options", "said"),
    [
        ("SkinResponse", (), {"what": "sed"}, "what must be one of force, section"),
        ("ResponseMap", (None, "map"), {"quantity": "rate"}, "quantity must be one of"),
        ("SkinResponse", ("force",), {}, "axes must be axes of Matplotlib: got 'force'"),
        ("SkinResponse", (), {"quantity": "stored"}, "Options of the drawing force are: none; got quantity"),
        ("SkinResponse", (None, "pad"), {"reach": 2.0}, "drawing pad are: quantity, reach_mm; got reach"),
    ],
)  # fmt: skip
def test_unknown_drawings_and_quantities_are_refused(results, kind, arguments, options, said):
    with pytest.raises(fp.InputError, match=said):
        results[kind].plot(*arguments, **options)


def test_progress_that_has_no_stages_is_refused():
    with refused("progress"):
        fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287.0), progress=True)


def test_tables_hold_the_numbers_of_the_result(results):
    skin, response, traces = results["SkinResponse"], results["ResponseMap"], results["Traces"]
    table = response.to_frame()
    assert table.static_rate_hz.tolist() == response.static_rate_hz.tolist()
    assert table.spike_count.sum() == response.spikes.times_ms.size
    assert skin.to_frame().force_mn.tolist() == skin.force_mn.tolist()
    assert np.array_equal(skin.to_dataset(response).force_mn.values, skin.force_mn)
    assert np.array_equal(traces.to_frame().values, traces.values)
    assert np.array_equal(traces.to_dataset().stored.values, traces.values)
    spikes = response.spikes.to_frame()
    for number, train in enumerate(response.spikes):
        assert spikes.time_ms[spikes.index == number].tolist() == train.tolist()
    assert response.to_dataset().spike_time_ms.units == "ms"
    mixed = fp.ResponseMap.joined({"SAI": response, "RA": response}).to_frame()
    assert mixed.type.value_counts().to_dict() == {"SAI": len(response.spikes), "RA": len(response.spikes)}
    fit = results["FitResult"]
    static = fit.to_frame().query("phase == 'static'")
    assert static.observed_hz.tolist() == fit.phases["static"].observed_hz.tolist()
    task = results["TaskResult"]
    decoded = task.to_frame().query("measure == 'static'")
    assert decoded.hit_rate.tolist() == task.decodings[0].hit_rate.tolist()
    spike_fit = results["SpikeFit"]
    assert spike_fit.to_frame().standard_error.tolist() == spike_fit.standard_errors.tolist()


@pytest.mark.parametrize(
    "kind", ["ResponseMap", "Traces", "SkinResponse", "HitRates", "FitResult", "TaskResult"]
)
def test_a_result_is_saved_by_the_ending_of_the_name_and_read_back(results, kind, tmp_path):
    result = results[kind]
    table, data = result.to_frame(), result.to_dataset()
    read = pandas.read_csv(result.save(tmp_path / "deeper" / "a.csv"), dtype=str)
    for name, values in table.reset_index().items():
        held = read[str(name)].to_numpy(values.dtype if values.dtype.kind in "fi" else str)
        assert np.array_equal(held, values, equal_nan=values.dtype.kind == "f"), name
    parquet = pandas.read_parquet(result.save(tmp_path / "a.parquet"))
    assert np.array_equal(parquet.iloc[:, -1], table.iloc[:, -1], equal_nan=True)
    with xarray.open_dataset(result.save(tmp_path / "a.nc"), decode_times=False) as written:
        xarray.testing.assert_equal(written, data)
    options = {"consolidated": False, "decode_times": False}
    with xarray.open_zarr(result.save(tmp_path / "a.zarr"), **options) as written:
        xarray.testing.assert_equal(written, data)
    with np.load(result.save(tmp_path / "a.npz")) as arrays:
        for name, values in data.variables.items():
            assert np.array_equal(arrays[name], values, equal_nan=values.dtype.kind == "f"), name
    content = json.loads(result.save(tmp_path / "a.json").read_text())
    if result.whole_as_json:
        assert content["stimulus"] == list(result.stimulus)
    else:
        back = xarray.Dataset.from_dict(content)
        assert set(back.variables) == set(data.variables)
        for name, values in data.variables.items():
            if values.dtype.kind == "f":
                assert np.array_equal(back[name].astype(float), values, equal_nan=True), name
    for ending, head in (("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")):
        assert result.save(tmp_path / f"a.{ending}").read_bytes().startswith(head)
    assert {path.name for path in tmp_path.iterdir()} == {
        "deeper", *(f"a.{ending}" for ending in ("parquet", "nc", "zarr", "npz", "json", "png", "pdf", "svg"))
    }  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "name", "options", "said"),
    [
        ("HitRates", "a.xyz", {}, r"A HitRates is saved as \.csv, .*: got a\.xyz"),
        ("HitRates", "a.nwb", {}, r"saved as .*: got a\.nwb"),
        ("HitRates", "a.csv", {"sep": ";"}, r"A file \.csv has no options: got sep"),
        ("SkinResponse", "a.nc", {"seeds": 3}, "seeds"),
        ("SkinResponse", "a.pvd", {}, r"solve the touch with whole=True"),
        ("SpikeTrains", "a.nwb", {}, "A session needs the places of the afferents"),
        ("ResponseMap", "a.png", {"what": "heat"}, "what must be one of raster, map"),
    ],
)
def test_what_a_result_cannot_be_saved_as_is_refused(results, tmp_path, kind, name, options, said):
    with pytest.raises(fp.InputError, match=said):
        results[kind].save(tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("mixed", [False, True])
def test_every_column_of_a_response_is_in_every_table_and_file(results, mixed, tmp_path):
    """The columns are those that are annotated in `ResponseMap`: no list of them is kept elsewhere."""
    one = results["ResponseMap"]
    response = fp.ResponseMap.joined({"SAI": one, "RA": one}) if mixed else one
    path = response.to_nwb(tmp_path / "a.nwb", duration_ms=5000.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with NWBHDF5IO(str(path), "r") as file:
            units = file.read().units.to_dataframe()
    header = response.save(tmp_path / "a.csv").read_text().splitlines()[0].split(",")
    assert len(RECEPTOR_COLUMNS) >= 7
    for name in RECEPTOR_COLUMNS:
        values = getattr(response, name)
        assert np.array_equal(response.to_frame()[name], values, equal_nan=True)
        assert np.array_equal(response.to_dataset()[name], values, equal_nan=True)
        assert np.array_equal(np.array([row[0] for row in units[name]]), values, equal_nan=True)
        assert name in header
        shown = response.plot(Figure().add_subplot(), "map", quantity=name) if not mixed else None
        assert mixed or np.array_equal(shown.collections[0].get_array(), values, equal_nan=True)


def test_spikes_go_to_pynapple_and_neo_with_what_is_known_of_each_afferent(results):
    one = results["ResponseMap"]
    response = fp.ResponseMap.joined({"SAI": one, "RA": one})
    group, block = response.to_pynapple(), response.to_neo()
    trains = block.segments[0].spiketrains
    assert len(group) == len(trains) == len(response.spikes)
    for number, train in enumerate(response.spikes):
        np.testing.assert_allclose(group[number].times("ms"), train, rtol=0, atol=1e-6)
        np.testing.assert_array_equal(trains[number].magnitude, train)
    assert group["type"].tolist() == [train.annotations["type"] for train in trains] == list(response.types)
    assert group["x_mm"].tolist() == response.positions_mm[:, 0].tolist()
    assert str(trains[0].units.dimensionality) == "ms"
    assert group.time_support.end.tolist() == [one.duration_ms / 1000.0]
    (epoch,) = block.segments[0].epochs
    assert epoch.labels.tolist() == [phase.name for phase in one.phases]
    assert (epoch.times + epoch.durations).magnitude.tolist() == [phase.end_ms for phase in one.phases]
    assert results["SpikeTrains"].to_pynapple()[3].times("ms").size == one.spikes[3].size
    assert len(results["SpikeTrains"].to_neo().segments[0].spiketrains) == len(one.spikes)
