"""Samples in, spikes out: one at a time as from the whole touch, in words, and through a socket."""

import socket
import subprocess
import sys

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.core.errors import InputError
from fingerpad.experiments.requests.touch import ReductionRequest
from fingerpad.experiments.stream import answered

RANGE = """
object: {kind: sphere, radius_mm: 4}
range: {depth_mm: 0.6}
calibration: 0
afferents: {densities_per_cm2: {SAI: 70, RA: 140, PC: 21}, rows: 3, columns: 3}
"""
DEPTHS_MM = np.minimum(0.02 * np.arange(1, 61), 0.5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with a range and the reduced touch that was made of it."""
    made = tmp_path_factory.mktemp("stream")
    (made / "range.yaml").write_text(RANGE, encoding="utf-8")
    fp.reduce(made / "range.yaml", out=made / "reduced.npz")
    return made


@pytest.fixture
def population(folder):
    return ReductionRequest.read(folder / "range.yaml").population


@pytest.fixture
def stream(folder, population):
    return fp.SpikeStream(fp.read_reduced(folder / "reduced.npz"), population)


@pytest.mark.slow
def test_spikes_are_those_of_the_whole_touch(folder, population, stream):
    fired = {name: [[] for _ in range(len(part))] for name, part in population.parts.items()}
    for time_ms, depth_mm in enumerate(DEPTHS_MM.tolist(), 1):
        for name, trains in stream.step(float(time_ms), depth_mm).items():
            for afferent, train in enumerate(trains):
                fired[name][afferent].extend(train)
    times_ms = np.arange(DEPTHS_MM.size + 1.0)
    for name, part in population.parts.items():
        touch = fp.ReducedTouch(fp.read_reduced(folder / "reduced.npz"), part.sites_mm)
        samples = [
            touch.step(float(t), float(d)).fields for t, d in zip(times_ms[1:], DEPTHS_MM, strict=True)
        ]
        dynamic, static = (
            np.array([np.zeros(len(part.sites_mm)), *(each[quantity] for each in samples)])
            for quantity in part.quantities
        )
        other, quantity = part.quantities
        rate_of = None if other == quantity else fp.Traces(times_ms, dynamic, quantity=other)
        traces = fp.Traces(times_ms, static, times_ms[1:-1], quantity, rate_of)
        whole = part.respond_to(traces, (1.0, 20.0), (20.0, 60.0)).spikes
        assert whole.times_ms.size > 0, name
        for mine, theirs in zip(fired[name], whole, strict=True):
            np.testing.assert_allclose(mine, theirs, atol=1e-6)


@pytest.mark.slow
def test_lines_have_the_clock_of_the_samples(stream):
    samples = ["time_ms, depth_mm\n", "5000,0\n", "\n"]
    samples += [f"{5000 + time},{depth}\n" for time, depth in enumerate(DEPTHS_MM.tolist(), 1)]
    header, *answers = answered(stream.warmed(), samples)
    assert header == "type,afferent,time_ms\n"
    assert len(answers) == DEPTHS_MM.size
    spikes = [line.split(",") for line in "".join(answers).splitlines()]
    assert {kind for kind, _, _ in spikes} == {"SAI", "RA", "PC"}
    assert 5000.0 < min(float(time) for *_, time in spikes) < 5010.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["time_ms,deep_mm"], "line 1: column must be one of time_ms"),
        (["depth_mm"], "line 1: columns must have time_ms"),
        (["time_ms,depth_mm", "0,0", "1"], "line 3: entries must be 2"),
        (["time_ms,depth_mm", "0,0", "1,x"], "line 3: depth_mm must be a finite number"),
        (["time_ms,depth_mm", "0,0", "1,9"], "line 3: The indenter must stay within 0.6 mm"),
        (["time_ms,depth_mm", "0,0", "-1,0"], "line 3: time_ms must not go back"),
        (["time_ms,depth_mm,force_mn", "0,0,0", "1,0,0"], "line 3: A step needs either"),
        (["time_ms,force_mn", "0,0", "1,-5"], "line 3: force_mn"),
    ],
)
def test_a_wrong_line_is_told_by_its_number(stream, lines, said):
    with pytest.raises(InputError, match=said.replace("(", r"\(")):
        list(answered(stream, lines))


@pytest.mark.slow
def test_a_device_exchanges_lines_with_the_command(folder):
    command = [sys.executable, "-m", "fingerpad", "stream", "range.yaml"]
    samples = "time_ms,depth_mm\n0,0\n" + "".join(f"{t},{d}\n" for t, d in enumerate(DEPTHS_MM.tolist(), 1))
    piped = subprocess.run(
        command, input=samples, capture_output=True, text=True, cwd=folder, check=True, timeout=120
    )
    assert piped.stdout.startswith("type,afferent,time_ms\n")
    assert piped.stdout.count("\n") > 5
    with subprocess.Popen([*command, "--port", "0"], stdout=subprocess.PIPE, text=True, cwd=folder) as run:
        host, port = run.stdout.readline().removeprefix("Samples: ").split(":")
        with socket.create_connection((host, int(port)), timeout=60) as device:
            device.sendall(samples.encode())
            device.shutdown(socket.SHUT_WR)
            with device.makefile(encoding="utf-8") as answers:
                assert answers.read() == piped.stdout
        assert run.wait(60) == 0
