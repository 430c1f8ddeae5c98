"""One protocol for work that processes share: on this computer, and on the workers of a real scheduler."""

import gc
import json
import os
import pickle
import re
import shutil
import signal
import socket
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

import fingerpad as fp
from cluster import real_cluster, slow, wait_until
from fingerpad.cli import main
from fingerpad.core.engine import Processes, _signals_later, engine_of
from fingerpad.core.errors import StoreError
from fingerpad.experiments import cluster as module

pytestmark = pytest.mark.filterwarnings("default")
"""Dask's own warnings are none of ours."""


@pytest.fixture(autouse=True)
def collected():
    """Sockets that Dask leaves open warn here: collected later, they failed a test of another file."""
    yield
    gc.collect()


@pytest.fixture
def unused_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    with real_cluster(tmp_path_factory.mktemp("cluster")) as cluster:
        yield cluster


def done(engine, work, items):
    return sorted((number, outcome()) for number, outcome in engine.map(work, items))


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_item_is_done_once_and_known_by_its_number(jobs):
    found = done(Processes(jobs), slow, [7, 8, 9])
    assert [(number, item) for number, (item, _) in found] == [(0, 7), (1, 8), (2, 9)]


@pytest.mark.parametrize("jobs", [0, 1.5, "two"])
def test_a_number_of_processes_is_a_whole_number(jobs):
    with pytest.raises(fp.InputError, match="jobs must be a whole number"):
        engine_of(jobs)


def end_this_process(item, threads):
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.skipif(sys.platform == "win32", reason="it needs signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_until_a_process_has_started(number):
    came = []
    before = signal.signal(number, lambda *_: came.append(number))
    try:
        with _signals_later():
            os.kill(os.getpid(), number)
            assert came == []
        assert came == [number]
    finally:
        signal.signal(number, before)


def test_a_lost_process_is_told_in_a_sentence():
    with pytest.raises(StoreError, match="ended from outside"):
        done(Processes(2), end_this_process, [1, 2])


def test_a_killed_worker_and_a_restarted_scheduler_lose_nothing(running):
    found, engine = [], fp.Cluster(running.address, patience_s=60.0)
    for number, outcome in engine.map(slow, list(range(30))):
        found.append((number, outcome()))
        if len(found) == 3:
            running.workers[0].kill()
        if len(found) == 8:
            running.kill_scheduler()
            running.start_scheduler()
            running.start_workers(2)
    assert sorted(found) == [(number, (number, 1)) for number in range(30)]


@pytest.mark.parametrize("what", ["closing while it reconnects", "a result that cannot be fetched"])
def test_a_connection_that_fails_late_is_made_again(running, monkeypatch, what):
    distributed = pytest.importorskip("distributed")
    failures = []

    def closed(client, **options):
        close(client, **options)
        if not failures:  # a client is also closed when it is forgotten
            failures.append(client)
            raise RuntimeError("ConnectionPool is closed")

    def fetched(future, *arguments):
        if not failures:
            failures.append(future)
            raise distributed.comm.CommClosedError("in <TCP (closed)>: Stream is closed")
        return result(future, *arguments)

    close, result = distributed.Client.close, distributed.Future.result
    if what.startswith("closing"):
        monkeypatch.setattr(distributed.Client, "close", closed)
    else:
        monkeypatch.setattr(distributed.Future, "result", fetched)
    assert done(fp.Cluster(running.address), slow, [7, 8, 9]) == [(0, (7, 1)), (1, (8, 1)), (2, (9, 1))]
    assert len(failures) == 1


def test_a_sweep_on_a_cluster_has_the_bits_of_one_process_and_presses_nothing_twice(running, tmp_path):
    touch = {"object": "cylinder", "motion": {"ramp_ms": 50, "hold_ms": 60}}
    sweep = {"touch": touch, "grid": {"motion.depth_mm": [0.2, 0.3], "afferents.columns": [2, 3]}}
    here, there = tmp_path / "here", tmp_path / "there"
    assert fp.sweep(sweep, out=here / "study.zarr").pressed == 2
    (there / "indentations").mkdir(parents=True)
    kept = sorted((here / "indentations").iterdir())[0]
    shutil.copy2(kept, there / "indentations" / kept.name)
    done = fp.sweep(sweep, out=there / "study.zarr", jobs=fp.Cluster(running.address))
    assert (done.done, done.pressed, done.loaded) == (4, 1, 1)
    for kind in ("study.zarr/*/c/**/*", "indentations/*"):
        written = {path.relative_to(here): path.read_bytes() for path in here.glob(kind) if path.is_file()}
        assert written
        assert written == {
            path.relative_to(there): path.read_bytes() for path in there.glob(kind) if path.is_file()
        }


def test_a_client_that_is_killed_goes_on_with_what_is_stored(running, tmp_path):
    depths = [0.16, 0.18, 0.2, 0.22, 0.24, 0.26]
    touch = {"object": "cylinder", "motion": {"ramp_ms": 50, "hold_ms": 60}}
    sweep = {"touch": touch, "grid": {"motion.depth_mm": depths}}
    (tmp_path / "sweep.yaml").write_text(json.dumps(sweep))
    command = f"-m fingerpad sweep sweep.yaml --scheduler {running.address} --out study.zarr".split()
    client = subprocess.Popen([sys.executable, *command], cwd=tmp_path, stderr=subprocess.DEVNULL)
    stored = tmp_path / "indentations"
    wait_until(lambda: len(list(stored.glob("*.npz"))) >= 2, limit_s=120.0)
    client.kill()
    client.wait()
    written = {path: path.stat().st_mtime_ns for path in stored.glob("*.npz")}
    assert 2 <= len(written) < len(depths)
    done = fp.sweep(tmp_path / "sweep.yaml", out=tmp_path / "study.zarr", jobs=fp.Cluster(running.address))
    assert (done.done, done.failed) == (6, 0)
    assert done.pressed <= len(depths) - len(written)
    assert written.items() <= {path: path.stat().st_mtime_ns for path in stored.glob("*.npz")}.items()


def test_the_script_for_slurm_runs_as_it_is(tmp_path, unused_port):
    page = (Path(__file__).parents[1] / "docs" / "sweeps.md").read_text(encoding="utf-8")
    script = re.search(r"```text\n(#!/bin/bash\n.*?)```", page, re.DOTALL)[1]
    touch = {"object": "cylinder", "motion": {"depth_mm": 0.16, "ramp_ms": 50, "hold_ms": 60}}
    sweep = {"touch": touch, "grid": {"afferents.seed": [1, 2]}}
    (tmp_path / "sweep.yaml").write_text(json.dumps(sweep))
    # In the place of SLURM and of installed commands.
    shims = {
        "srun": 'exec "$@"',
        "hostname": "echo 127.0.0.1",
        "dask": f'exec {sys.executable} -m dask "$@"',
        "fingerpad": f'exec {sys.executable} -m fingerpad "$@"',
    }
    for name, content in shims.items():
        (tmp_path / name).write_text(f"#!/bin/bash\n{content}\n")
        (tmp_path / name).chmod(0o755)
    done = subprocess.run(
        ["bash", "-c", script.replace("8786", str(unused_port))],
        cwd=tmp_path,
        env=os.environ | {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        timeout=120.0,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("2 of 2 settings done, 0 failed; 1 pressed and 0 loaded in ")


def test_an_error_of_the_work_is_that_of_the_item(running):
    outcomes = dict(fp.Cluster(running.address).map(divmod, [4, "four"]))
    with pytest.raises(TypeError):
        outcomes[1]()


def test_a_worker_of_another_version_is_refused(running, monkeypatch):
    here = module.software()
    mine = here | {"packages": here["packages"] | {"numba": "0.1"}}
    monkeypatch.setattr(module, "software", lambda: mine)
    module._software.cache_clear()
    with pytest.raises(fp.InputError, match=r"^Worker tcp.* must have numba 0.1, as .*: got .*\.$"):
        fp.Cluster(running.address).check()
    module._software.cache_clear()


def test_a_task_of_another_version_is_refused_by_the_worker(monkeypatch):
    task = pickle.loads(pickle.dumps(partial(module._task, module._software() | {"fingerpad": "9"}, divmod)))
    with pytest.raises(fp.InputError, match="must have fingerpad 9"):
        task(1)


def test_an_address_without_a_scheduler_is_refused(monkeypatch):
    monkeypatch.setattr(module, "_CONNECT_S", 0.5)
    with pytest.raises(fp.InputError, match=r"^--scheduler must .*: .* cannot be reached; .*\.$"):
        fp.Cluster("tcp://127.0.0.1:1").check()


@pytest.mark.parametrize(
    "address", ["localhost", "tcp://localhost", "nonsense://x:1", "tcp://localhost:x", ""]
)
def test_an_address_that_nobody_can_have_is_refused_before_anything_connects(address, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(distributed, "Client", pytest.fail)
    with pytest.raises(
        fp.InputError, match=rf"with a port, such as tcp://localhost:8786: got '{address}'\.$"
    ):
        fp.Cluster(address).check()


def test_without_dask_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(fp.InputError, match=r"pip install 'fingerpad\[cluster\]'"):
        fp.Cluster("tcp://127.0.0.1:1").check()


def test_a_command_presses_on_a_scheduler_or_in_processes_here(run_program):
    status, _, said = run_program(main, "fingerpad", "reproduce", "--jobs", 2, "--scheduler", "tcp://h:1")
    assert (status, said) == (
        2,
        "fingerpad: --jobs is the number of processes here, and --scheduler tcp://h:1 has workers: leave one "
        "out.\n",
    )
