"""Run of a sweep: what is not done yet is pressed by an engine, and written as it comes."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.errors import InputError
from fingerpad.core.progress import NoProgress, Progress
from fingerpad.core.values import Flag, Whole
from fingerpad.experiments.runner import STORE_FOLDER, software
from fingerpad.experiments.sweep.request import SweepRequest
from fingerpad.experiments.sweep.settings import Case, observe, settle, unsettled
from fingerpad.export.sweep_file import DONE, FAILED, LEFT_OUT, PENDING, SweepFile
from fingerpad.mechanics.kernels import KERNELS

MOST_SETTINGS = 10_000  # Larger sweeps need the consent of who runs them.

_WRITE_EVERY_S, _WRITE_EVERY = 5.0, 256
"""How often what is done is written: after so much time, or so many settings."""


@dataclass(frozen=True)
class SweepOutcome:
    """What a run of a sweep did."""

    path: Path  # The data set.
    settings: int
    done: int
    failed: int
    left_out: int
    """Number of settings: all, those with a result, those that failed, those that `where` leaves out."""
    pressed: int
    loaded: int  # Presses that this run solved, and those that it read from the store.
    press_s: float
    wall_s: float  # Time of all presses, summed over processes, and on the clock. [s]

    @property
    def lines(self) -> tuple[str, ...]:
        return (
            f"{self.done} of {self.settings - self.left_out} settings done, {self.failed} failed; "
            f"{self.pressed} pressed and {self.loaded} loaded in {self.wall_s:.1f} s."
            + (" The variable `reason` says why; --retry-failed tries again." if self.failed else ""),
            f"Results: {self.path}",
        )


def check_sweep(sweep: SweepRequest, out: Path, any_size: bool = False) -> None:
    """Raise `InputError` if a sweep is impossible, larger than `MOST_SETTINGS`, or has no place."""
    if out.suffix != ".zarr":
        raise InputError(f"A sweep is written as .zarr: got {out.name}.")
    for shape, of in ((sweep.shape, "settings"), (sweep.observer_shape, "settings of its observer")):
        if (size := int(np.prod(shape))) > MOST_SETTINGS and not any_size:
            raise InputError(
                f"{sweep.origin.name} must have at most {MOST_SETTINGS} {of}, or --yes be given: it has "
                f"{size}, {' x '.join(map(str, shape))}."
            )
    sweep.check()


@checked
def sweep(
    request: Any = None,
    *,
    out: str | Path,
    jobs: Whole | Engine = 1,
    progress: Progress | None = None,
    command: str | None = None,
    allow_python: Flag = False,
    retry_failed: Flag = False,
    any_size: Flag = False,
    store: str | Path | None = None,
    **given: Any,
) -> SweepOutcome:
    """Press all settings of a sweep, let the afferents respond, and write one labelled data set.

    What is done already is not done again: the same call goes on after an interruption. A setting that cannot
    be pressed has its reason in the data set, and the others are pressed.

    Parameters
    ----------
    request : str, Path, mapping or SweepRequest, optional
        A YAML file (docs/sweeps.md), or its content.
    out : str or Path
        The data set, a folder that ends in .zarr.
    jobs : int or Engine
        Number of processes, or a `Cluster`; the numbers do not depend on it.
    progress, command, allow_python
        As of `touch`.
    retry_failed : bool
        Whether settings that failed are tried again.
    any_size : bool
        Whether there may be more than `MOST_SETTINGS` settings.
    store : str or Path, optional
        Folder of stored indentations; by default `indentations` beside `out`.
    **given
        Keys of the request, such as `touch` and `grid`.

    Raises
    ------
    InputError
        If the sweep is impossible or too large, or `out` holds something else; nothing is pressed then.
    StoreError
        If something cannot be written; what is finished is kept.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> touch = {"object": "sphere", "motion": {"hold_ms": 100}}
    >>> with TemporaryDirectory() as folder:
    ...     outcome = sweep(touch=touch, grid={"motion.depth_mm": [0.2]}, out=Path(folder) / "study.zarr")
    >>> outcome.done, outcome.pressed
    (1, 1)
    """
    asked: SweepRequest = SweepRequest.read(request, given, allow_python)
    out, began = Path(out), time.perf_counter()
    check_sweep(asked, out, any_size)
    folder = out.parent / STORE_FOLDER if store is None else Path(store)
    engine = engine_of(jobs, KERNELS)
    file = SweepFile(out, asked, _attributes(asked, command or ""))
    status = file.status()
    _leave_out(file, asked, status)
    status = file.status()
    todo = (status == PENDING) | ((status == FAILED) & retry_failed)
    cases = unsettled(asked, ~todo, folder)
    pressed, loaded, press_s = _settle(engine, cases, file, progress or NoProgress())
    if asked.observers and (cases or not file.observed):
        _observe(file, progress or NoProgress())
    done, failed, left_out = (int((file.status() == kind).sum()) for kind in (DONE, FAILED, LEFT_OUT))
    wall_s = time.perf_counter() - began
    return SweepOutcome(out, asked.size, done, failed, left_out, pressed, loaded, press_s, wall_s)


def _settle(
    engine: Engine, cases: Sequence[Case], file: SweepFile, progress: Progress
) -> tuple[int, int, float]:
    """Do the cases; count those pressed and loaded, and sum the time of the presses."""
    pressed, loaded, press_s = 0, 0, 0.0
    waiting, written = 0, time.monotonic()
    try:
        with progress.stage("presses", len(cases)) as advance, closing(engine.map(settle, cases)) as outcomes:
            for _, outcome in outcomes:
                settled = outcome()
                file.add(settled)
                pressed += settled.pressed
                loaded += not settled.pressed and bool(settled.skin)
                press_s += settled.seconds
                waiting += len(settled.responses) + len(settled.failures)
                if waiting >= _WRITE_EVERY or time.monotonic() - written > _WRITE_EVERY_S:
                    file.flush()
                    waiting, written = 0, time.monotonic()
                advance()
    finally:
        file.finish()
    return pressed, loaded, press_s


def _observe(file: SweepFile, progress: Progress) -> None:
    sweep = file.sweep
    along, _ = sweep.stimuli_axis(sweep.observers[0])
    with progress.stage("observers", sweep.size // sweep.shape[along]) as advance:
        if responses := file.responses():
            done = file.status().reshape(sweep.shape) == DONE
            file.write_hit_rates(observe(sweep, responses, done, advance))
    file.finish()


def _leave_out(file: SweepFile, sweep: SweepRequest, status: np.ndarray) -> None:
    """Note the settings that do not meet the constraints, once."""
    if sweep.where and not (status == LEFT_OUT).any():
        allowed = np.fromiter((sweep.allowed(setting) for setting in range(sweep.size)), bool, sweep.size)
        if not allowed.all():
            file.leave_out(~allowed)


def _attributes(sweep: SweepRequest, command: str) -> Mapping[str, object]:
    """Provenance of a data set."""
    found = software()
    sample = sweep.sample
    return {
        "title": sweep.title,
        "sweep": json.dumps(sweep.written()),
        "source": sweep.origin.name,
        "inputs_sha256": hashlib.sha256(sweep.hashed.encode()).hexdigest(),
        "version": found["version"],
        "code_hash": found["code_hash"],
        "packages": found["packages"],
        "platform": found["platform"],
        "seed": sweep.described(0).afferents.seed,
        **({} if sample is None else {"sample_seed": sample.seed}),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": command,
    }
