"""Tags of classes in the key of a stored indentation: equal only if the classes do the same.

A class of the package is identified by its syntax tree (`fingerpad.skin.behaviour`). A class of a user's own
is identified by its compiled code: methods, properties, class attributes and base classes, and the functions,
classes and constants outside of installed packages that they refer to. Names of classes, comments and
docstrings do not count. What belongs to an installed package counts by its name and version. Compiled code
differs between versions of Python, so that another one presses such a body again.
"""

from __future__ import annotations

import dis
import hashlib
import inspect
import pickle
import sys
from collections.abc import Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.skin.behaviour import PACKAGE, own_class_tag

_HAS_DOCSTRING: int = getattr(inspect, "CO_HAS_DOCSTRING", 0)
"""Flag of code with a docstring, from Python 3.14 on."""

_GENERATED = frozenset(
    (
        "__module__", "__qualname__", "__doc__", "__dict__", "__weakref__", "__firstlineno__",
        "__static_attributes__", "__dataclass_fields__", "__dataclass_params__", "__match_args__",
        "__annotations__", "__annotate_func__", "__annotations_cache__", "__abstractmethods__", "_abc_impl",
    )
)  # fmt: skip
"""Attributes of a class that its definition makes, beside what is written in it."""

_WRITTEN = frozenset(
    ("__init__", "__repr__", "__eq__", "__hash__", "__setattr__", "__delattr__", "__replace__")
)
"""Methods that `dataclass` writes."""


def class_tag(kind: type) -> str:
    """Identify a class in the key of a stored indentation, whatever its name."""
    return own_class_tag(kind.__name__) or kind.__name__ if _is_own(kind.__module__) else _Tagger().tag(kind)


def array_digest(values: np.ndarray) -> list[Any]:
    """Type, shape and hash of the content of an array."""
    content = np.ascontiguousarray(values + 0.0 if values.dtype.kind == "f" else values)  # -0.0 equals 0.0
    return [values.dtype.str, list(values.shape), hashlib.sha256(content.tobytes()).hexdigest()]


def _is_own(module: str) -> bool:
    return module.partition(".")[0] == PACKAGE


def _installed(module: str) -> str | None:
    """Name and version of the installed package that a module belongs to; None for a user's own module."""
    top = module.partition(".")[0]
    found = sys.modules.get(top)
    if top == "__main__":
        return None
    if _is_own(module) or top in sys.stdlib_module_names:
        return top
    where = getattr(found, "__file__", None) or ""
    if "site-packages" in where or "dist-packages" in where:
        return f"{top} {getattr(found, '__version__', '')}"
    return None


class _Tagger:
    """Writes what code refers to, each object once."""

    def __init__(self) -> None:
        self.seen: dict[int, int] = {}

    def tag(self, value: Any) -> str:
        text = "\n".join(self.lines(value))
        return hashlib.sha256(text.encode()).hexdigest()[:16] if "\n" in text else text

    def lines(self, value: Any) -> Iterator[str]:
        """Lines that are equal for values that do the same."""
        if value is None or isinstance(value, bool | int | float | complex | str | bytes):
            yield repr(value)
            return
        if isinstance(value, ModuleType | type | FunctionType):  # these may refer to each other
            if id(value) in self.seen:
                yield f"again {self.seen[id(value)]}"
                return
            self.seen[id(value)] = len(self.seen)
        if isinstance(value, ModuleType):
            yield f"module {_installed(value.__name__) or value.__name__} {value.__name__}"
        elif isinstance(value, type):
            yield from self.class_lines(value)
        elif isinstance(value, FunctionType):
            yield from self.function_lines(value)
        elif isinstance(value, staticmethod | classmethod):
            yield type(value).__name__
            yield from self.lines(value.__func__)
        elif isinstance(value, property):
            yield from self.lines(value.fget)
        elif isinstance(value, tuple | list | set | frozenset):
            yield type(value).__name__
            for item in value if isinstance(value, tuple | list) else sorted(value, key=repr):
                yield from self.lines(item)
        elif isinstance(value, dict):
            for key in sorted(value, key=repr):
                yield repr(key)
                yield from self.lines(value[key])
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            yield repr(array_digest(value))
        elif isinstance(function := getattr(value, "py_func", getattr(value, "func", None)), FunctionType):
            yield type(value).__name__  # compiled by Numba, or a cached property
            yield from self.lines(function)
        elif _named(value):
            yield f"{_installed(value.__module__)} {value.__module__} {value.__name__}"
        else:
            yield _pickled(value)

    def class_lines(self, kind: type) -> Iterator[str]:
        installed = _installed(kind.__module__)
        if installed:
            own = own_class_tag(kind.__name__) if _is_own(kind.__module__) else None
            yield own or f"{installed} {kind.__module__}.{kind.__qualname__}"
            return
        yield "class"
        for base in kind.__bases__:
            yield from self.lines(base)
        for name in sorted(vars(kind).keys() - _GENERATED):
            part = vars(kind)[name]
            # The code that `dataclass` writes follows from the fields, which are in the key already.
            if (
                name in _WRITTEN
                and isinstance(part, FunctionType)
                and part.__code__.co_filename == "<string>"
            ):
                continue
            yield name
            yield from self.lines(part)

    def function_lines(self, function: FunctionType) -> Iterator[str]:
        installed = _installed(function.__module__ or "")
        if installed:
            yield f"{installed} {function.__module__} {function.__qualname__}"
            return
        yield from self.lines(function.__defaults__)
        yield from self.lines(function.__kwdefaults__)
        for cell in function.__closure__ or ():
            yield from self.lines(cell.cell_contents)
        names: list[str] = []
        yield from self.code_lines(function.__code__, names)
        for name in dict.fromkeys(names):
            if name in function.__globals__:
                yield name
                yield from self.lines(function.__globals__[name])

    def code_lines(self, code: CodeType, names: list[str]) -> Iterator[str]:
        """Instructions of some code, and into `names` those of globals that it may use."""
        names += code.co_names
        yield repr((code.co_argcount, code.co_kwonlyargcount, code.co_flags & ~_HAS_DOCSTRING))
        for step in dis.get_instructions(code):
            yield step.opname
            if isinstance(step.argval, CodeType):
                yield from self.code_lines(step.argval, names)
            else:
                yield from self.lines(step.argval)


def _named(value: Any) -> bool:
    """Whether a value is a function or class that an installed package defines."""
    module, name = getattr(value, "__module__", None), getattr(value, "__name__", None)
    return isinstance(module, str) and isinstance(name, str) and _installed(module) is not None


def _pickled(value: Any) -> str:
    try:
        return hashlib.sha256(pickle.dumps(value, protocol=4)).hexdigest()
    except Exception as error:  # a value of an unknown type may fail in any way
        raise InputError(
            f"A press of a body of your own can only be stored if its class refers to functions, classes and "
            f"fixed values: got {type(value).__name__}."
        ) from error
