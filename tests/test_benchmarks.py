"""The tables of benchmarks/README.md agree with the stored measurements, and scripts run on small jobs."""

import importlib
import re
import sys

import numpy as np
import pytest

from benchmarks import growth, installing, peer_block, peer_neurons
from benchmarks.__main__ import BENCHMARKS, run
from benchmarks.measuring import FailedRunError, run_job
from benchmarks.measuring import run as run_command
from benchmarks.page import PAGE, rewritten, targets_table
from benchmarks.pressing import touch_of_sphere
from benchmarks.results import Report, Table, read_all, write
from benchmarks.targets import TARGETS, Target
from fingerpad.core.signals import SpikeTrains
from fingerpad.geometry.mesh import finger_lines

TEXT = PAGE.read_text(encoding="utf-8")
MACHINE = {
    "processor": "abacus", "cores": 2, "memory_gb": 4.0, "system": "none", "python": "3.11", "packages": {},
    "commit": "0", "uncommitted": False, "load_before": 0.0, "date": "today",
}  # fmt: skip


def test_page_shows_what_was_measured_and_every_target_and_benchmark():
    reports = read_all()
    assert rewritten(TEXT, reports) == TEXT, "run `make benchmarks ARGS=--page`"
    for target in TARGETS:
        assert f"| {target.job} | {target.bound} |" in TEXT, target.key
    sections = re.findall(r"<!-- begin (\w+) -->", TEXT)
    assert set(sections) == {"targets", "machines", *BENCHMARKS}
    for name in BENCHMARKS:
        assert callable(importlib.import_module(f"benchmarks.{name}").measure)
        if name in reports:
            keys = {target.key for target in TARGETS if target.benchmark == name}
            assert reports[name].measured.keys() == keys
    for path in (PAGE.parent / "results").glob("*.json"):
        assert not re.search(r"/(home|tmp|root|work|Users)/", path.read_text(encoding="utf-8")), path.name


def test_report_survives_the_disk_and_reaches_the_page(tmp_path):
    table = Table("Seconds:", ["mesh", "s"], [["coarse", 1.5], ["none", None]])
    report = Report("sphere", "A sphere", "One press.", [table], {"sphere_s": 12.5}, ["A note."], MACHINE)
    write(report, tmp_path)
    found = read_all(tmp_path)
    text = rewritten(TEXT, found)
    for expected in ("| coarse | 1.5 |", "| none |  |", "- A note.", "commit 0; load before it 0.0; today."):
        assert expected in text
    row = next(line for line in targets_table(found).splitlines() if "| ≤ 2.7 s |" in line)
    assert "12.5 s | **no** | `sphere` |" in row
    least = Target("a", "b", "c", 2.0, "x", at_least=True)
    assert [least.met_by(value) for value in (1.9, 2.1)] == [False, True]
    with pytest.raises(ValueError, match="got \\['speed'\\] besides"):
        Report("sphere", "", "", [], {"speed": 1.0}, machine=MACHINE)
    with pytest.raises(ValueError, match="needs 2 cells"):
        Table("", ["a", "b"], [[1]])


def test_a_run_is_measured_with_its_children():
    spin = "import time; kept = b'1' * 150_000_000\nwhile time.process_time() < 0.6: pass"
    parent = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {spin!r}]); print('[1, 2]')"
    measured = run_command([sys.executable, "-c", parent], threads=1)
    assert measured.answer == [1, 2]
    assert 150.0 < measured.peak_mb < 300.0
    assert 0.4 < measured.cpu_s < measured.wall_s + 0.1


def test_a_job_runs_with_the_threads_it_is_given():
    code = "import os; print(os.environ['NUMBA_NUM_THREADS'] + os.environ['OMP_NUM_THREADS'])"
    assert run_command([sys.executable, "-c", code], threads=2).answer == 22
    assert run_job("measuring", "doubled", threads=1, number=4).answer == {"doubled": 8}
    with pytest.raises(FailedRunError, match=r"status 1:\n(.|\n)*ZeroDivisionError"):
        run_command([sys.executable, "-c", "1 / 0"], threads=1)


def test_unknown_benchmark_is_refused(capsys):
    assert run(["spheres"]) == 2
    assert f"spheres is none of {BENCHMARKS[0]}" in capsys.readouterr().err


def test_sizes_of_the_study_of_growth_span_the_target():
    nodes = []
    for factor, layers in growth.SIZES:
        touch = touch_of_sphere("standard", factor, layers)
        lines = finger_lines(touch.finger, touch.grading)
        nodes.append(lines.along_mm.size * lines.around_rad.size * lines.through.size)
        assert lines.through.size == sum(layers) + 1
    assert nodes == sorted(nodes)
    assert nodes[0] < 20_000
    assert nodes[-1] > 500_000


def test_exponent_of_growth_is_that_of_a_power_law_through_noise():
    nodes = np.array([2e4, 5e4, 1e5, 5e5])
    assert growth.exponent(nodes, 3.0 * nodes**1.1 * [1.01, 0.99, 0.99, 1.01]) == pytest.approx(1.1, abs=0.01)


def test_a_press_reports_time_size_and_result():
    found = run_job("pressing", "press", threads=2, resolution="quick")
    expected = {"nodes": 5710, "elements": 4860, "steps": 10}
    assert {name: found.answer[name] for name in expected} == expected
    assert 0.0 < found.answer["solve_s"] < found.wall_s
    assert found.answer["newton_steps"] >= found.answer["factorisations"] > 0
    here = touch_of_sphere("quick").solve()
    assert found.answer["force_mn"] == pytest.approx(here.force_mn[-1], rel=1e-3)
    assert 50.0 < found.answer["before_mb"] < found.peak_mb


def test_block_of_the_peers_is_layered_and_comes_back_from_its_file(tmp_path):
    for size, nodes in (("small", 5_800), ("large", 21_500)):
        job = peer_block.read_job(peer_block.write_block(tmp_path / f"{size}.npz", size))
        mesh = job.mesh
        assert len(mesh.nodes_mm) == pytest.approx(nodes, rel=0.02)
        assert np.ptp(mesh.nodes_mm, axis=0).tolist() == [14.0, 5.0, 12.0]
        assert mesh.full
        volumes_mm3 = np.abs(
            np.linalg.det(mesh.nodes_mm[mesh.elements[:, [1, 3, 4]]] - mesh.nodes_mm[mesh.elements[:, :1]])
        )
        thicknesses_mm = np.bincount(mesh.layer, volumes_mm3) / (14.0 * 12.0)
        assert thicknesses_mm[:2].sum() == pytest.approx(0.471)
        assert thicknesses_mm[2:] == pytest.approx([1.153, 3.376])
        assert job.indenter.radius_mm == pytest.approx(3.0)
        assert job.depths_mm == pytest.approx(np.linspace(0.0, 1.0, 11))


def test_spikes_are_paired_by_train_and_number(tmp_path):
    mine = SpikeTrains.from_lists([[1.0, 2.0, 3.0], [9.0], [], [5.0, 6.0]])
    theirs = SpikeTrains.from_lists([[1.5, 2.0], [9.0, 10.0], [4.0], [4.0, 6.0]])
    assert peer_neurons.paired_differences_ms(mine, theirs).tolist() == [0.5, 0.0, 0.0, -1.0, 0.0]
    for name, trains in (("mine", mine), ("theirs", theirs)):
        np.savez(tmp_path / f"{name}.npz", times_ms=trains.times_ms, offsets=trains.offsets)
    found = peer_neurons.timing(str(tmp_path / "mine.npz"), str(tmp_path / "theirs.npz"))
    rms_ms = pytest.approx(np.sqrt(1.25 / 5))
    assert found == {"rms_ms": rms_ms, "largest_ms": 1.0, "same_count_percent": 25.0}


def test_afferents_of_the_peers_fire_and_runge_kutta_nears_their_exact_spikes(tmp_path):
    currents = str(peer_neurons.write_currents(tmp_path / "currents.npz", afferents=40))
    fired = peer_neurons.fire(currents, str(tmp_path / "spikes.npz"))
    assert fired["spikes"] > 40 * 20
    checked = peer_neurons.check(currents, every=20)
    coarse, middle, fine = checked["differences_ms"]
    assert checked["afferents"] == 2
    assert middle < 0.2 * coarse
    assert fine < 0.2 * middle < 0.01


def test_a_peer_that_cannot_be_installed_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", str(tmp_path / "no-python"))
    with pytest.raises(installing.MissingPeerError, match="felupe could not be installed with pip"):
        installing.environment_of("felupe", tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(installing.MissingPeerError, match="package calculix-ccx"):
        installing.calculix()
