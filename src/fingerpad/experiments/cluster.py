"""Engine of other computers: the workers of a Dask scheduler, with the same fingerpad and the same disk.

The extra `fingerpad[cluster]` is required. docs/sweeps.md shows how to start a scheduler and its workers.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import cache, partial
from importlib import import_module
from typing import Any

from fingerpad.core.checked import value_class
from fingerpad.core.engine import Outcomes, Work
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.logger import LOGGER
from fingerpad.core.values import Finite
from fingerpad.experiments.runner import software

WAITING_IN_LINE = 512  # Most items that the scheduler knows at a time: a sweep may have a million.
Versions = dict[str, str]  # Versions of all on which the numbers of a press depend, by name.

_CONNECT_S = 10.0


@value_class
class Cluster:
    """Engine whose work is done by the workers of a Dask scheduler.

    Each task uses one thread, so that a worker shall have one process per core and one thread per process.
    A worker that ends is replaced by another one; three that end with the same item make an error. When the
    scheduler is lost, this waits until there is one at the same address, and hands over again what was not
    finished.

    Parameters
    ----------
    address : str
        Of the scheduler, such as "tcp://10.0.0.1:8786".
    patience_s : float, optional
        How long to wait for a scheduler that was lost. [s]
    """

    address: str
    patience_s: Finite = 300.0

    def check(self) -> None:
        """Raise `InputError` unless the scheduler answers and its workers have this version of fingerpad."""
        with self._client(_CONNECT_S) as client:
            for worker, found in client.run(_software).items():
                _check_same(worker, _software(), found)

    @property
    def width(self) -> int:
        """Threads of all workers, at least 1."""
        with self._client(_CONNECT_S) as client:
            return max(1, sum(client.nthreads().values()))

    def map(self, work: Work, items: Sequence[Any]) -> Outcomes:
        """Do the work; as of `Engine`.

        Raises
        ------
        StoreError
            If the scheduler is lost for longer than `patience_s`.
        """
        left = dict.fromkeys(range(len(items)))
        patience_s = _CONNECT_S
        while left:
            with self._client(patience_s) as client:
                for number, outcome in _finished(client, partial(_task, _software(), work), items, left):
                    del left[number]
                    yield number, outcome
            if left:
                LOGGER.warning("The scheduler %s was lost: waiting for it.", self.address)
            patience_s = self.patience_s

    @contextmanager
    def _client(self, patience_s: float) -> Iterator[Any]:
        """Connect, within a time; close without a word about what is cancelled."""
        distributed = _library()
        _check_address(self.address)
        began = time.monotonic()
        while True:
            try:
                client = distributed.Client(self.address, timeout=_CONNECT_S, set_as_default=False)
                break
            except (OSError, ValueError, TimeoutError) as error:
                if time.monotonic() - began + _CONNECT_S < patience_s:
                    time.sleep(1.0)
                    continue
                if patience_s > _CONNECT_S:
                    raise StoreError(
                        f"The scheduler {self.address} was lost for {patience_s:.0f} s: start it and run "
                        "again; what was finished is kept."
                    ) from error
                raise InputError(
                    "--scheduler",
                    "must be the address of a Dask scheduler that runs",
                    remedy=f"{self.address} cannot be reached; start it with dask scheduler",
                ) from error
        # That it reconnects, fails and cancels is told here, in one line.
        said = logging.getLogger("distributed.client")
        level = said.level
        said.setLevel(logging.CRITICAL)
        try:
            if not client.nthreads():
                LOGGER.warning("The scheduler %s has no workers yet: waiting for one.", self.address)
            yield client
        finally:
            try:
                client.close(timeout=_CONNECT_S)
            except Exception as error:  # a client that is closed while it reconnects raises what that raised
                LOGGER.debug("The client of %s closed with %r.", self.address, error)
            said.setLevel(level)


def _check_address(address: str) -> None:
    """Raise `InputError` for an address that nobody can have: its client could not be closed again."""
    if address.startswith("inproc://"):  # a scheduler in this process
        return
    try:
        import_module("distributed.comm").get_address_host_port(address)
    except ValueError as error:
        raise InputError(
            "--scheduler", "must be an address with a port, such as tcp://localhost:8786", repr(address)
        ) from error


def _finished(
    client: Any, task: Any, items: Sequence[Any], left: dict[int, None]
) -> Iterator[tuple[int, Callable[[], Any]]]:
    """Hand over what is left, a part at a time; give numbers with outcomes, until the scheduler is lost."""
    numbers = iter(list(left))
    under_way: dict[Any, int] = {}
    finished = _library().as_completed(loop=client.loop)
    while client.status == "running":
        for _, number in zip(range(WAITING_IN_LINE - len(under_way)), numbers, strict=False):
            future = client.submit(task, items[number], pure=False)
            under_way[future] = number
            finished.add(future)
        if not under_way:
            return
        future = next(finished)
        try:
            outcome = _outcome(future)
        except (OSError, CancelledError):  # of the connection: an error of the work is in its outcome
            return
        yield under_way.pop(future), outcome


def _task(expected: Versions, work: Work, item: Any) -> Any:
    """Do one item on a worker: with the same software, or not at all."""
    _check_same("of the cluster", expected, _software())
    return work(item, 1)


def _outcome(future: Any) -> Callable[[], Any]:
    """Fetch what a task returned or raised; workers killed again and again are an error of its item."""
    if future.status != "error":
        found = future.result()
        return lambda: found
    error = future.exception()
    if isinstance(error, _library().KilledWorker):
        error = StoreError(
            "Several workers ended with this indentation (out of memory?): give each more memory and run "
            "again."
        )
    return partial(_raise, error)


def _raise(error: Exception) -> Any:
    raise error


def _check_same(worker: str, expected: Versions, found: Versions) -> None:
    """Raise `InputError` if a worker has other software."""
    for name, version in expected.items():
        if found.get(name) != version:
            raise InputError(
                f"Worker {worker} must have {name} {version}, as this computer has: got {found.get(name)}; "
                "install the same version there."
            )


@cache
def _software() -> Versions:
    """Versions on which the numbers of a press depend."""
    found = software()
    packages = {name: found["packages"][name] for name in ("numpy", "scipy", "numba")}
    return {"fingerpad": found["version"], "code of the mechanics": found["code_hash"], **packages}


def _library() -> Any:
    try:
        return import_module("distributed")
    except ImportError as error:
        raise InputError(
            "A scheduler needs Dask: install the extra, pip install 'fingerpad[cluster]'."
        ) from error
