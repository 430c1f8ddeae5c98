"""A Dask scheduler and workers as separate processes, for tests."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


HERE = Path(__file__).parent


def slow(item, threads):
    """Take a while, in which a worker can be ended."""
    time.sleep(0.15)
    return item, threads


def wait_until(true, limit_s=60.0):
    end = time.monotonic() + limit_s
    while not true():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.005)


class RealCluster:
    """Processes of one cluster; every one is ended with the block."""

    def __init__(self, folder):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address, self.folder = f"tcp://127.0.0.1:{self.port}", folder
        self.workers, self.scheduler = [], None

    def start_scheduler(self):
        self.scheduler = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", self.port, "--no-dashboard"
        )
        wait_until(self._answers)

    def start_workers(self, count=3):
        options = ("--nthreads", 1, "--no-nanny", "--no-dashboard", "--local-directory", self.folder)
        begun = [self._start("worker", self.address, *options) for _ in range(count)]
        self.workers += begun
        return begun

    def _start(self, kind, *words):
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *map(str, words)]
        known = os.pathsep.join([str(HERE), *filter(None, [os.environ.get("PYTHONPATH")])])
        environment = os.environ | ONE_THREAD | {"PYTHONPATH": known}
        with open(self.folder / f"{kind}-{time.monotonic_ns()}.log", "wb") as log:
            return subprocess.Popen(command, stdout=log, stderr=log, env=environment)

    def _answers(self):
        with socket.socket() as one:
            return one.connect_ex(("127.0.0.1", self.port)) == 0

    def kill_scheduler(self):
        self.scheduler.send_signal(signal.SIGKILL)
        self.scheduler.wait()


@contextmanager
def real_cluster(folder, workers=3):
    """Start a scheduler and workers, and end them."""
    cluster = RealCluster(folder)
    try:
        cluster.start_scheduler()
        cluster.start_workers(workers)
        yield cluster
    finally:
        for process in [cluster.scheduler, *cluster.workers]:
            process.kill()
            process.wait()
