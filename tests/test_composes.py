"""What composes: each extension of a user's own with each thing that a user does (docs/composes.md)."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import composing
import fingerpad as fp
from fingerpad.experiments.requests.stimuli import read_stimuli
from fingerpad.lab.answer import LabState
from fingerpad.lab.laboratory import Laboratory

COLUMNS = ("touch", "population", "fit", "discriminate", "validate", "sweep", "stream", "laboratory")

MOTION = {"depth_mm": 1.2, "ramp_ms": 50, "hold_ms": 100}
WINDOWS = {"dynamic": [0, 50], "static": [60, 150]}
BASE = {"object": fp.Sphere(radius_mm=4.0), "grading": composing.COARSE}

ROWS = {
    "own transduction": {"afferent": composing.TRANSDUCTION},
    "own afferent type": {"afferent": composing.COUNTER},
    "RA": {"afferent": "RA"},
    "PC": {"afferent": "PC"},
    "SAII": {"afferent": "SAII"},
    "mixed population": {"population": composing.MIXED},
    "own law": {"tissues": composing.TISSUES},
    "own indenter": {"object": composing.BALL},
    "own grading": {"grading": composing.GRADING},
    "other quantity": {"afferent": {"dynamic_quantity": "von_mises", "static_quantity": "von_mises"}},
    "other depth": {"depth_mm": 1.0},
}
"""What differs from a touch of names: keys of the block `afferents`, or of the touch."""

FREE = {"own afferent type": "step_kpa", "RA": "threshold", "PC": "threshold"}
"""Number that is fitted, where it is not the static gain."""

REFUSED = {
    ("own transduction", "fit"): "free must be one of respond, membrane",
    ("mixed population", "fit"): "afferent must be like AnyAfferent",
    ("mixed population", "validate"): "afferent must be like AnyAfferent",
    ("other depth", "laboratory"): "afferents.depth_mm must be left out",
}
"""Cells that do not work, with what is said."""

IN_A_FILE = {
    "own transduction": "afferents: {afferent: 'composing:TRANSDUCTION'}",
    "own afferent type": "afferents: {afferent: 'composing:COUNTER'}",
    "mixed population": "afferents: {population: 'composing:MIXED'}",
    "own law": "tissues: composing:TISSUES",
    "own indenter": "object: composing:BALL",
    "own grading": "grading: composing:GRADING",
    "other quantity": "afferents: {afferent: {dynamic_quantity: von_mises, static_quantity: von_mises}}",
    "other depth": "afferents: {depth_mm: 1.0}",
}
"""Rows as a file writes them; the others are names of types in the laboratory."""


def keys(row):
    """Keys of the block `afferents`, and those of the touch."""
    own = ROWS[row]
    pressed = {key: value for key, value in own.items() if key in ("tissues", "object", "grading")}
    return {key: value for key, value in own.items() if key not in pressed}, BASE | pressed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder of all presses, of which most cells share theirs."""
    return tmp_path_factory.mktemp("composes")


def touch(row, folder):
    own, pressed = keys(row)
    found = fp.touch(
        **pressed, motion=MOTION, afferents=own | {"windows_ms": WINDOWS}, outputs=["csv"], out=folder
    )
    assert found.summary.largest_depth_mm == pytest.approx(1.2)
    assert len(found.response.spikes) == found.summary.afferents
    assert found.response.spikes.times_ms.size > 0


def population(row, folder):
    own, pressed = keys(row)
    wanted = {"receptor_depths_mm": (1.0,)} if row == "other depth" else {}
    tissues = pressed.get("tissues", "human")
    motion = fp.RampAndHold(1.2, 50.0, 100.0)
    skin = fp.indent(fp.Fingertip(), pressed["object"], motion, tissues, grading=pressed["grading"], **wanted)
    response = fp.respond(skin, **own, windows_ms=WINDOWS)
    again = fp.respond(skin, **own, windows_ms=WINDOWS)
    assert response.spikes.times_ms.size > 0
    assert_array_equal(response.spikes.times_ms, again.spikes.times_ms)


def stimuli(folder, levels):
    path = folder / "stimuli.yaml"
    path.write_text(
        f"motion: {{ramp_ms: 50, hold_ms: 100}}\nstimuli: {{vary: motion.depth_mm, values: {levels}}}\n"
        "object: sphere\nresolution: quick\n",
        encoding="utf-8",
    )
    return path


def fit(row, folder):
    own, pressed = keys(row)
    if "population" in own:
        own = {"afferent": own["population"]}
    names = ("0.6", "0.9", "1.2")
    recordings = fp.RateRecordings(names, [20.0, 60.0, 90.0], None)
    listed = read_stimuli(stimuli(folder, "[0.6, 0.9, 1.2]"), object=pressed["object"])
    found = fp.fit(
        recordings=recordings, stimuli=listed, free=[FREE.get(row, "static_gain")], folds=3,
        windows_ms={"dynamic": [0, 50], "static": [60, 150]}, out=folder,
        **{"afferent": "SAI", **own},
        **{key: value for key, value in pressed.items() if key != "object"},
    )  # fmt: skip
    (value,) = found.fitted.values()
    assert value > 0.0


def discriminate(row, folder):
    own, pressed = keys(row)
    found = fp.discriminate(
        stimuli={"vary": "motion.depth_mm", "values": [1.2, 1.6]}, standard=1.2, noise=0.1,
        measure="static" if row == "SAII" else "dynamic", motion={"ramp_ms": 50, "hold_ms": 100},
        afferents=own | {"windows_ms": WINDOWS},
        experiment={"presentations": 50, "distributions": 5, "pairs": 5, "hit_rates": 5},
        code="euclidean", resolution="quick", out=folder, **pressed,
    )  # fmt: skip
    (decoding,) = found.discrimination.decodings
    assert decoding.hit_rate[0] > 0.5


def validate(row, folder):
    own, pressed = keys(row)
    if "population" in own:
        own = {"afferent": own["population"]}
    path = folder / "observed.csv"
    body = pressed.pop("object")
    if row == "own indenter":
        path.write_text("indenter,depth_mm,force_n\nball,0.5,0.03\n", encoding="utf-8")
        own["objects"] = {"ball": body}
    else:
        path.write_text("force_n,curvature_per_m,rate_hz\n0.05,250,40\n", encoding="utf-8")
    found = fp.validate(observations=path, resolution="quick", out=folder, **own, **pressed)
    assert found.n_predicted == 1, found.predictions[0].reason
    assert np.isfinite(found.predictions[0].predicted)


def sweep(row, folder):
    own, pressed = keys(row)
    asked = {**pressed, "motion": MOTION, "afferents": own | {"windows_ms": WINDOWS}}
    out = folder / f"{row.replace(' ', '_')}.zarr"
    done = fp.sweep(touch=asked, grid={"motion.depth_mm": [0.9, 1.2]}, out=out)
    assert (done.done, done.failed) == (2, 0), str(fp.open_sweep(out).reason.values)
    rates = fp.open_sweep(out).dynamic_rate_hz.values
    assert np.nanmax(rates[1]) >= np.nanmax(rates[0])


def stream(row, folder):
    """Samples of a full solution go through the stream one by one, and give the spikes of the trace."""
    own, pressed = keys(row)
    asked = fp.TouchRequest.read(
        None, {**pressed, "motion": MOTION, "afferents": own | {"windows_ms": WINDOWS}}
    )
    skin = fp.touch(asked, out=folder).skin
    laid = asked.population
    for part in laid.parts.values() or [laid]:
        dynamic, static = part.quantities
        traces = [skin.sample(name, part.sites_mm[:2], part.depth_mm) for name in (dynamic, static)]
        online = fp.AfferentStream(part.afferent, 2)
        fired = 0
        for time, rate_of, value in zip(skin.times_ms[1:], *(each[1:] for each in traces), strict=True):
            fired += online.step(time, value, None if dynamic == static else rate_of).times_ms.size
        whole = part.afferent.spikes(
            fp.Traces(skin.times_ms, traces[1], skin.times_ms[1:-1], static,
                      None if dynamic == static else fp.Traces(skin.times_ms, traces[0], quantity=dynamic))
        )  # fmt: skip
        assert fired == whole.times_ms.size


def laboratory(row, folder):
    body = "object: {kind: sphere, radius_mm: 4}\n" if row != "own indenter" else ""
    grading = "grading: composing:COARSE\n" if row != "own grading" else ""
    here = folder / "lab" / row.replace(" ", "_")
    here.mkdir(parents=True)
    own = Path(composing.__file__).read_text("utf-8")
    module = f"composing_{here.name}"  # Python knows one module of a name.
    (here / f"{module}.py").write_text(own, encoding="utf-8")
    content = f"{body}{grading}range: {{depth_mm: 1.3}}\ncalibration: 0\n{IN_A_FILE.get(row, '')}\n"
    path = here / "range.yaml"
    path.write_text(content.replace("composing:", f"{module}:"), encoding="utf-8")
    state = LabState("range", afferent="range" if row in IN_A_FILE else row, depth_mm=1.2, hold_ms=100.0)
    answer = Laboratory(folder / "lab", [path], allow_python=True).answer(state)
    assert answer.force_mn.max() > 1.0
    assert answer.response.spikes.times_ms.size > 0


@pytest.mark.parametrize("column", COLUMNS)
@pytest.mark.parametrize("row", ROWS)
def test_what_a_user_adds_serves_all_that_a_user_does(row, column, folder):
    cell = globals()[column]
    if (row, column) not in REFUSED:
        cell(row, folder)
        return
    with pytest.raises(fp.InputError) as error:
        cell(row, folder)
    assert re.search(REFUSED[row, column], str(error.value)), str(error.value)
    assert "\n" not in str(error.value)


def test_the_page_has_the_same_table():
    page = (Path(__file__).parent.parent / "docs" / "composes.md").read_text("utf-8")
    lines = [line.split("|")[1:-1] for line in page.splitlines() if line.startswith("| ")]
    table = {row.strip(): [cell.strip() for cell in cells] for row, *cells in lines}
    assert len(ROWS) * len(COLUMNS) - len(REFUSED) >= 80
    for row in ROWS:
        assert table[row] == ["no" if (row, column) in REFUSED else "yes" for column in COLUMNS]
