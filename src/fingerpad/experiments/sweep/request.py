"""A sweep: one request with a touch, and which of its fields vary.

docs/sweeps.md explains every key.
"""

from __future__ import annotations

import ast
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field, Strict

from fingerpad.core.errors import InputError
from fingerpad.core.values import Count, Finite, NotNegative, Pair, Positive, Seed, Text, choice
from fingerpad.experiments.discrimination.request import CODES, IDEAL, MEASURES, ExperimentSettings
from fingerpad.experiments.requests.parts import (
    Block,
    Content,
    LevelOrName,
    Part,
    Request,
    as_list,
    at,
    part_from,
    with_value,
)
from fingerpad.experiments.requests.touch import TouchRequest
from fingerpad.psychophysics.encoding import LARGEST_NOISE
from fingerpad.skin.fields import stored_fields

AFFERENTS = "afferents"  # Block of a touch whose fields do not change the skin.
OBSERVER = "observer"  # Block of a sweep whose fields change hit rates alone.
NOT_SWEPT = ("title", "outputs")
LINEAR, LOGARITHMIC = "linear", "logarithmic"
SOBOL, LATIN_HYPERCUBE = "sobol", "latin_hypercube"
ZIP, SAMPLE = "zip", "sample"  # Dimensions of fields that vary together.
MOST_CHECKED = 1000  # Most points of an axis whose values are checked before anything is pressed.
_COMPARED = "a constraint must be a comparison such as a.b < 2 * c.d"
_ARITHMETIC = (
    ast.Expression, ast.Compare, ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.Constant, ast.Name, ast.Attribute,
    ast.Load, ast.And, ast.Or, ast.USub, ast.Add, ast.Sub, ast.Mult, ast.Div,
    ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq,
)  # fmt: skip


class EvenValues(Part):
    """Evenly spaced values of a field."""

    start: Finite
    stop: Finite  #: First and last value. [unit of the field]
    count: Count  #: How many.
    spacing: Annotated[str, choice((LINEAR, LOGARITHMIC))] = LINEAR
    """Whether differences or ratios are equal."""

    @property
    def values(self) -> list[float]:
        if self.spacing == LINEAR:
            return np.linspace(self.start, self.stop, self.count).tolist()
        if min(self.start, self.stop) <= 0.0:
            raise InputError(
                f"start and stop must be above 0 with logarithmic spacing: got {self.start:g} and "
                f"{self.stop:g}."
            )
        return np.geomspace(self.start, self.stop, self.count).tolist()


class SampleSettings(Part):
    """Points that fill a box of several fields."""

    method: Annotated[str, choice((SOBOL, LATIN_HYPERCUBE))] = SOBOL
    """How: a scrambled Sobol sequence, or a Latin hypercube."""
    count: Count  #: Number of points; powers of two suit Sobol.
    seed: Seed = 0  #: Of the random numbers.
    fields: dict[str, Pair]  #: Lower and upper bound by field. [unit of the field]

    @property
    def values(self) -> dict[str, list[float]]:
        if not self.fields:
            raise InputError("fields", "must name a field or more", remedy="it is empty")
        from scipy.stats import qmc

        from fingerpad.core.random_streams import published_generator

        kind = qmc.Sobol if self.method == SOBOL else qmc.LatinHypercube
        # All powers of two from the next one on begin with the same points, without a warning.
        size = 1 << (self.count - 1).bit_length() if self.method == SOBOL else self.count
        points = kind(len(self.fields), rng=published_generator(self.seed)).random(size)[: self.count]
        low, high = np.array(list(self.fields.values())).T
        if (low >= high).any():
            raise InputError("fields", "must have a lower bound and then a higher one", remedy="one has not")
        scaled = low + (high - low) * points
        return dict(zip(self.fields, scaled.T.tolist(), strict=True))


class ObserverSettings(Part):
    """An observer who discriminates the stimuli along one dimension of a sweep from one of them."""

    along: Text  #: Field of the touch that varies from stimulus to stimulus, as "object.curvature_per_m".
    standard: LevelOrName  #: Its value under the standard, that all others are discriminated from.
    code: Annotated[str, choice(tuple(code for code in CODES if code != IDEAL))] = CODES[0]
    """How the population is decoded."""
    measure: Annotated[str, choice(MEASURES)] = MEASURES[0]  #: What is measured of each afferent.
    latest_ms: Positive | None = None
    """Latest first spike that counts, as `windows_ms.latency` of a task. [ms]"""
    noise: Annotated[NotNegative, Field(le=LARGEST_NOISE)]  #: Standard deviation of the multiplicative noise.
    experiment: ExperimentSettings = ExperimentSettings()  #: Repetitions, criterion and seed.


def _as_block(value: Any) -> Any:
    """Return the keys of a touch that is given as a request."""
    if isinstance(value, TouchRequest):
        return value.set_in_order
    return value


@dataclass(frozen=True)
class Axis:
    """One dimension of a sweep."""

    name: str  #: Of the dimension: that of its field with underscores, "zip" or "sample".
    values: Mapping[str, list[Any]]  #: Values by field, all of one length.

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def presses(self) -> bool:
        """Whether it changes the skin."""
        return any(field.partition(".")[0] not in (AFFERENTS, OBSERVER) for field in self.values)

    @property
    def observes(self) -> bool:
        """Whether it changes the observer, and nothing else."""
        kinds = {field.partition(".")[0] == OBSERVER for field in self.values}
        if len(kinds) > 1:
            raise InputError(
                f"{', '.join(self.values)} must not vary together: leave fields of the observer to grid."
            )
        return kinds.pop()


class SweepRequest(Request):
    """A sweep, as `fingerpad.sweep` runs it and a file describes it: a touch of which some fields vary.

    A setting is a number from 0 to `size` - 1, in the order of a C array of `shape`; so is a press within
    `press_shape`.
    """

    word: ClassVar[str] = "sweep"

    title: Text = "A sweep"  #: What it is, in words.
    touch: Annotated[Block, BeforeValidator(_as_block)]
    """The touch, with the keys of `TouchRequest`; what varies need not be given."""
    observer: Block | None = None
    """An observer of the responses, with the keys of `ObserverSettings`; what varies need not be given."""
    grid: Block = Field(default={})
    """Values by field, such as "motion.depth_mm": each field is a dimension, and settings are all
    combinations."""
    zip: Block = Field(default={})
    """Fields that vary together, one value of each per setting: one dimension."""
    sample: SampleSettings | None = None  #: Fields that vary together over a box: one dimension.
    where: Annotated[tuple[Text, ...], Strict(False), BeforeValidator(as_list)] = ()
    """Constraints such as "motion.depth_mm < 0.5 * object.radius_mm": other settings are left out."""
    fields: Annotated[
        tuple[Annotated[str, choice([field.name for field in stored_fields()])], ...],
        Strict(False),
        BeforeValidator(as_list),
    ] = ()
    """Fields of the skin that the result holds beside force, depth and contact, by the names of
    `fingerpad.skin.fields.FIELDS`."""

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The dimensions of the settings: those that change the skin first."""
        return tuple(axis for axis in self._all_axes if not axis.observes)

    @property
    def observer_axes(self) -> tuple[Axis, ...]:
        """The dimensions that change the observer alone."""
        return tuple(axis for axis in self._all_axes if axis.observes)

    @cached_property
    def _all_axes(self) -> tuple[Axis, ...]:
        """All dimensions; InputError if a field has no values, or is given twice."""
        found = []
        with self.origin.located():
            for field, values in self.grid.items():
                with at("grid", field):
                    found.append(Axis(field.replace(".", "_"), {field: _listed(values)}))
            if self.zip:
                with at("zip"):
                    together = {field: _listed(values) for field, values in self.zip.items()}
                    lengths = {field: len(values) for field, values in together.items()}
                    if len(set(lengths.values())) > 1:
                        raise InputError(f"all fields must have as many values: got {lengths}.")
                    found.append(Axis(ZIP, together))
            if self.sample is not None:
                with at("sample"):
                    found.append(Axis(SAMPLE, self.sample.values))
            if not found:
                raise InputError("grid, zip or sample must name a field that varies: none does.")
            for field, count in Counter(field for axis in found for field in axis.values).items():
                if count > 1:
                    raise InputError(field, "must vary in one way", remedy="it is given twice")
                if field.partition(".")[0] in NOT_SWEPT or field == f"{OBSERVER}.along":
                    raise InputError(f"{field} cannot vary: leave it out.")
            if all(axis.observes for axis in found):
                raise InputError("grid, zip or sample must name a field of the touch that varies: none does.")
        return tuple(sorted(found, key=lambda axis: not axis.presses))

    @property
    def shape(self) -> tuple[int, ...]:
        """Settings along each axis."""
        return tuple(map(len, self.axes))

    @property
    def press_shape(self) -> tuple[int, ...]:
        """Settings along each axis that changes the press."""
        return tuple(len(axis) for axis in self.axes if axis.presses)

    @property
    def size(self) -> int:
        """Number of settings, those that are left out included."""
        return int(np.prod(self.shape))

    @property
    def presses(self) -> int:
        """Number of presses, those that are left out included."""
        return int(np.prod(self.press_shape))

    @property
    def observer_shape(self) -> tuple[int, ...]:
        """Settings along each axis of the observer."""
        return tuple(map(len, self.observer_axes))

    @cached_property
    def observers(self) -> tuple[ObserverSettings, ...]:
        """Observers in the order of a C array of `observer_shape`; none without a block `observer`."""
        with self.origin.located():
            if self.observer is not None:
                return tuple(self._observer(place) for place in np.ndindex(self.observer_shape))
            if self.observer_axes:
                raise InputError("observer", "must be given where its fields vary", remedy="it is missing")
        return ()

    def _observer(self, place: tuple[int, ...]) -> ObserverSettings:
        content: Content = dict(self.observer or {})
        with at(OBSERVER):
            for axis, number in zip(self.observer_axes, place, strict=True):
                for field, values in axis.values.items():
                    content = with_value(content, field.split(".")[1:], values[number])
            asked = part_from(ObserverSettings, content)
            self.stimuli_axis(asked)
        return asked

    def stimuli_axis(self, observer: ObserverSettings) -> tuple[int, int]:
        """Return which axis the stimuli of an observer lie along, and where the standard lies on it."""
        for number, axis in enumerate(self.axes):
            if axis.presses and observer.along in axis.values:
                values = axis.values[observer.along]
                if values.count(observer.standard) != 1:
                    raise InputError(
                        "standard",
                        f"must be one of the values of {observer.along}, once",
                        repr(observer.standard),
                    )
                if len(values) < 2:
                    raise InputError(f"{observer.along} must have two values or more to be discriminated.")
                return number, values.index(observer.standard)
        fields = [field for axis in self.axes if axis.presses for field in axis.values]
        raise InputError(
            "along",
            f"must be a field that varies and changes the skin, {', '.join(fields)}",
            repr(observer.along),
        )

    def settings_of(self, press: int) -> range:
        """Return the settings that have a press in common."""
        each = self.size // self.presses
        return range(press * each, (press + 1) * each)

    def values(self, setting: int) -> Content:
        """Value of each swept field in a setting."""
        place = np.unravel_index(setting, self.shape)
        return {
            field: values[int(number)]
            for axis, number in zip(self.axes, place, strict=True)
            for field, values in axis.values.items()
        }

    def content(self, setting: int) -> Content:
        """Touch of a setting, as plain values."""
        content: Content = dict(self.touch)
        with self.origin.located(), at("touch"):
            for field, value in self.values(setting).items():
                content = with_value(content, field.split("."), value)
        return content

    def described(self, setting: int) -> TouchRequest:
        """Return the touch of a setting."""
        name = f"{self.origin.name}, touch"
        return TouchRequest.read(self.content(setting), allow_python=self._allow_python, name=name)

    def check(self) -> None:
        """Check all keys and values, and press nothing."""
        strides = [int(np.prod(self.shape[number + 1 :])) for number in range(len(self.axes))]
        for axis, stride in zip(self.axes, strides, strict=True):
            for number in range(min(len(axis), MOST_CHECKED)):
                self.described(number * stride)
        self.observers  # noqa: B018 - builds and checks all
        if not any(self.allowed(setting) for setting in range(self.size)):
            with self.origin.located():
                raise InputError("where leaves no setting: give other constraints.")

    def allowed(self, setting: int) -> bool:
        """Whether a setting meets all constraints of the sweep."""
        if not self._constraints:
            return True
        content = self.content(setting)
        with self.origin.located(), at("where"):
            return all(met(content) for met in self._constraints)

    @cached_property
    def _constraints(self) -> list[Constraint]:
        with self.origin.located(), at("where"):
            return [Constraint(text) for text in self.where]

    @property
    def hashed(self) -> str:
        """All that determines the results, as text."""
        files = self.described(0).input_hashes()
        return json.dumps([self.written(without=("title",)), sorted(files.values())], sort_keys=True)

    def written(self, without: Sequence[str] = ()) -> Content:
        """Return the keys that are given as plain values; an object of Python as it is shown."""
        given = {name: value for name, value in self.set_in_order.items() if name not in without}
        return json.loads(json.dumps(given, default=_plain))


def _plain(value: Any) -> Any:
    return value.model_dump(mode="json") if isinstance(value, Part) else repr(value)


class Constraint:
    """A comparison of fields of a touch, written as in `a.b < 2 * c.d`."""

    def __init__(self, text: str):
        self.text = text
        try:
            tree = ast.parse(text.strip(), mode="eval")
        except SyntaxError as error:
            raise InputError(f"{_COMPARED}: got {text!r}.") from error
        if not isinstance(tree.body, ast.Compare | ast.BoolOp):
            raise InputError(f"{_COMPARED}: got {text!r}.")
        # What is evaluated can call nothing.
        if not all(isinstance(node, _ARITHMETIC) for node in ast.walk(tree)):
            raise InputError(
                f"a constraint must have fields, numbers, + - * / and comparisons: got {text!r}."
            )
        self._code = compile(ast.fix_missing_locations(_FieldNames().visit(tree)), "constraint", "eval")

    def __call__(self, content: Content) -> bool:
        values = {name: _at(content, name, self.text) for name in self._code.co_names}
        try:
            return bool(eval(self._code, {"__builtins__": {}}, values))
        except (ArithmeticError, TypeError) as error:
            raise InputError(f"{self.text!r} cannot be computed: {error}.") from error


class _FieldNames(ast.NodeTransformer):
    """Makes one name of a field such as `motion.depth_mm`."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.Name:
        return ast.Name(ast.unparse(node), ast.Load())


def _listed(values: Any) -> list[Any]:
    found = part_from(EvenValues, values).values if isinstance(values, Mapping) else values
    if not isinstance(found, list | tuple) or not found:
        raise InputError(
            f"a field that varies must have a list of values, or start, stop and count: got {values!r}."
        )
    return list(found)


def _at(content: Any, name: str, text: str) -> Any:
    for key in name.split("."):
        if not isinstance(content, Mapping) or key not in content:
            raise InputError(f"{name} of {text!r} must be given in touch or vary: it is not.")
        content = content[key]
    return content
