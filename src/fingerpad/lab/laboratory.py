"""The objects of the laboratory, their reduced touches, and the answers to its states."""

from __future__ import annotations

import hashlib
import multiprocessing
import queue
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checked import checked_class
from fingerpad.core.engine import Engine
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of
from fingerpad.core.progress import Progress
from fingerpad.core.values import Flag, Whole
from fingerpad.experiments.requests.touch import ReductionRequest
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.fingertip import FINGERS
from fingerpad.lab.answer import Answer, LabState, in_full, motion_of, reduced_answer
from fingerpad.mechanics.tissues import TISSUES
from fingerpad.neuron.afferent_types import afferent_types
from fingerpad.reduction.model import ReducedModel, read_reduced, write_reduced
from fingerpad.skin.code_hash import code_hash

KEPT_ANSWERS = 16  # Answers that are kept, so that a comparison and a second user do not compute again.


@dataclass(frozen=True)
class Making:
    """A computation that is under way."""

    what: str  #: In words.
    done: int = 0
    total: int = 0  #: Finished presses, and all of them; 0 before that is known.


@checked_class
class Laboratory:
    """Objects to press, and what was made of them so far.

    Parameters
    ----------
    folder : str or Path
        Where presses and reduced touches are kept from one run to the next.
    ranges : sequence of Path, optional
        Files of `fingerpad reduce`, each an object by the name of its file; default: those of the package.
    jobs : int or Engine, optional
        Processes that press.
    allow_python : bool, optional
        Whether the files may name objects of Python as module:object, from a module beside them.
    """

    def __init__(
        self,
        folder: str | Path,
        ranges: Sequence[Path] = (),
        jobs: Whole | Engine = 1,
        allow_python: Flag = False,
    ):
        self.folder, self._engine = path_of("folder", folder), jobs
        self.allow_python = allow_python
        self._files = {path.stem: path for path in ranges or shipped()}
        if len(self._files) < len(ranges):
            raise InputError("The files of ranges must have different names, by which objects are chosen.")
        self._described: dict[tuple[str, str, str], ReductionRequest] = {}
        self._models: dict[Path, ReducedModel] = {}
        self._answers: OrderedDict[tuple[LabState, bool], Answer] = OrderedDict()
        self._making: dict[object, tuple[Future[Any], _Told]] = {}
        self._lock = threading.RLock()
        # Reduced touches, full solutions, and errors, which nobody waits for: each one after the other.
        self._worker, self._full, self._later = _Worker(), _Worker(), _Worker()
        for name in self._files:
            self.described(LabState(name))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objects."""
        return tuple(self._files)

    def source(self, state: LabState) -> Path:
        """File of the range of a state."""
        return self._files[state.object]

    def close(self) -> None:
        """End all computations; what they have stored stays."""
        for process in multiprocessing.active_children():
            process.kill()

    def described(self, state: LabState) -> ReductionRequest:
        """Describe the range of a state."""
        for name, known in (("object", self._files), ("finger", ("", *FINGERS)), ("tissues", ("", *TISSUES))):
            if getattr(state, name) not in known:
                words = ", ".join(each for each in known if each)
                raise InputError(name, f"must be one of {words}", repr(getattr(state, name)[:40]))
        key = state.object, state.finger, state.tissues
        with self._lock:
            if key not in self._described:
                replaced = {
                    name: getattr(state, name) for name in ("finger", "tissues") if getattr(state, name)
                }
                request: ReductionRequest = ReductionRequest.read(
                    self.source(state), replaced, self.allow_python
                )
                request.check()
                # A reduced touch of the laboratory keeps what any type of afferents follows.
                types = afferent_types(request.tissues).values()
                followed = [q for one in types for q in (one.dynamic_quantity, one.static_quantity)]
                kept = tuple(dict.fromkeys([*request.quantities, *followed]))
                self._described[key] = request.changed(quantities=kept)
            return self._described[key]

    def path(self, state: LabState) -> Path:
        """File of the reduced touch of a state, by what it depends on: of the afferents, what they follow."""
        described = self.described(state)
        text = repr((described.model_dump(exclude={"afferents"}), described.kept)) + code_hash()
        return self.folder / f"{state.object}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.npz"

    def model(self, state: LabState) -> ReducedModel | None:
        """Return the reduced touch of a state, if it was made already."""
        path = self.path(state)
        with self._lock:
            if path not in self._models and path.exists():
                self._models[path] = read_reduced(path, self.described(state).training.touch)
            return self._models.get(path)

    def make(self, state: LabState, with_error: Flag = False, told: Progress | None = None) -> ReducedModel:
        """Make the reduced touch of a state, without its error or with it."""
        described, path = self.described(state), self.path(state)
        if not with_error:
            described = described.changed(calibration=0)
        model = described.run(Runner(self.folder, self._engine, told))
        write_reduced(model, path)
        with self._lock:
            self._models[path] = model
            self._answers.clear()
        return model

    def measured(self, state: LabState) -> bool:
        """Whether the error of the reduced touch of a state is known, or not wanted by its file."""
        model = self.model(state)
        wanted = self.described(state).calibration > 0
        return not wanted or (model is not None and bool(np.isfinite(model.error).all()))

    def answer(self, state: LabState, exact: Flag = False, told: Progress | None = None) -> Answer:
        """Answer a state by its reduced touch, which is made if there is none, or by the full solver."""
        described, key = self.described(state), (alone(state), exact)
        if (kept := self._kept(key)) is not None:
            return kept
        model = self.model(state)
        if exact:
            motion, shape = motion_of(described, model, state)
            touch = described.training.touch_with(shape, motion)
            runner = Runner(self.folder, self._engine, told)
            skin = runner.responses({"exact": {0: touch}})["exact"][0]
            answer = in_full(described, motion, state, skin)
        else:
            model = model or self.make(state, told=told)
            answer = reduced_answer(described, model, state)
        with self._lock:
            # Meanwhile the reduced touch may have got its error.
            if exact or self._models.get(self.path(state)) is model:
                self._answers[key] = answer
            if len(self._answers) > KEPT_ANSWERS:
                self._answers.popitem(last=False)
        return answer

    def poll(self, state: LabState, exact: Flag = False) -> Answer | Making:
        """Answer at once: what needs a press goes on in the background, and the answer is how far it is.

        Until there is a reduced touch, the full solution of the same touch is the answer.
        """
        ready = self.model(state) is not None
        # Before an answer that is kept: it may be kept before the first poll that finds a model.
        if ready and not self.measured(state) and (later := ("error", self.path(state))) not in self._making:
            told = _Told("errors")
            self._making[later] = self._later.submit(lambda: self.make(state, True)), told
        if ready and not exact:
            return self._kept((alone(state), False)) or self.answer(state)
        making = None if ready else self.making(state)
        if not ready and making is None:
            return self.poll(state, exact)
        full = alone(state), True
        if (kept := self._kept(full)) is not None:
            return kept
        # While somebody moves an object about, only one of the places is solved at a time.
        if making is not None and full not in self._making and self._full.busy:
            return making
        told = _Told(f"the full solution of {state.object}")
        solving = self._under_way(full, self._full, lambda: self.answer(state, True, told), told)
        return self.poll(state, exact) if solving is None else making or solving

    def making(self, state: LabState) -> Making | None:
        """Start or go on with the reduced touch of a state, and tell how far it is; None if it is there."""
        if self.model(state) is not None:
            return None
        told = _Told(f"a reduced touch of {state.object}")
        # It serves many states, which wait for one computation.
        return self._under_way(self.path(state), self._worker, lambda: self.make(state, told=told), told)

    def _under_way(
        self, key: object, worker: _Worker, work: Callable[[], object], told: _Told
    ) -> Making | None:
        """Start a computation, or tell how far it is; None once it has ended well."""
        with self._lock:
            if key not in self._making:
                self._making[key] = worker.submit(work), told
            future, told = self._making[key]
            if not future.done():
                return told.making
            del self._making[key]
        future.result()
        return None

    def _kept(self, key: tuple[LabState, bool]) -> Answer | None:
        with self._lock:
            if key in self._answers:
                self._answers.move_to_end(key)
            return self._answers.get(key)


def alone(state: LabState) -> LabState:
    """Without what does not change the answer."""
    return replace(state, other="", other_size=0.0)


def shipped() -> list[Path]:
    return sorted(Path(str(resources.files("fingerpad.lab") / "ranges")).glob("*.yaml"))


class _Worker:
    """Thread that does one thing after the other, and does not keep the process from its end."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[tuple[Future[Any], Callable[[], Any]]] = queue.SimpleQueue()
        self._last: Future[Any] | None = None
        threading.Thread(target=self._run, daemon=True).start()

    def submit(self, work: Callable[[], Any]) -> Future[Any]:
        future: Future[Any] = Future()
        self._last = future
        self._queue.put((future, work))
        return future

    @property
    def busy(self) -> bool:
        return self._last is not None and not self._last.done()

    def _run(self) -> None:
        while True:
            future, work = self._queue.get()
            try:
                future.set_result(work())
            except Exception as error:  # raised where the result is asked for
                future.set_exception(error)


class _Told:
    """Progress of a computation, for those who ask."""

    def __init__(self, what: str):
        self.making = Making(what)

    @contextmanager
    def stage(self, name: str, total: int) -> Iterator[Callable[[], None]]:
        if total:
            self.making = replace(self.making, done=0, total=total)

        def advance() -> None:
            self.making = replace(self.making, done=self.making.done + 1)

        yield advance
