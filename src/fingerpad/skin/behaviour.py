"""Hash of what the mechanical sources do: their syntax trees without what cannot change a number.

Left out are comments, docstrings, formatting, annotations of functions, the text of error messages, what a
value shows of itself, names of files and of classes, and imports from the package itself. A class is
represented by a tag, which is a hash of its own syntax tree; an imported name is represented by the name
under which it was defined. Everything else counts: constants, names of functions and fields, defaults, order
of statements.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

from fingerpad.core.errors import StoreError

PACKAGE = "fingerpad"
MECHANICAL_SOURCES = (
    "core/units.py",
    "core/threads.py",
    "core/numba_internals.py",
    "geometry",
    "mechanics",
    "skin/fields.py",
    "skin/indentation.py",
)
"""Source files and folders on which the numbers of a stored indentation depend."""

_IDENTIFIER = re.compile(r"<(\w+)>")
_NO_MEANING = ("ctx", "kind", "type_comment", "returns")
_SHOWING = ("__repr__", "_repr_html_", "plot")
"""Methods by which a value shows itself."""


@dataclass(frozen=True)
class Behaviour:
    """Hashes of some sources."""

    code: str
    """Hash of all of them, 16 hexadecimal digits."""
    classes: Mapping[str, str]
    """Tag of each class by its name, 16 hexadecimal digits."""


def code_hash() -> str:
    """Hash of the code on which stored indentations depend, 16 hexadecimal digits."""
    return _installed().code


def own_class_tag(name: str) -> str | None:
    """Tag of a class of the mechanical sources, None of another."""
    return _installed().classes.get(name)


def behaviour_of(sources: Sequence[str], modules: frozenset[str] = frozenset()) -> Behaviour:
    """Hash some sources; their order does not matter."""
    readers = [_Reader(modules) for _ in sources]
    texts = [reader.text(ast.parse(source)) for reader, source in zip(readers, sources, strict=True)]
    bodies = sorted(body for reader in readers for body in reader.classes)
    anonymous = {name: "class" for name, _ in bodies}
    tags = dict.fromkeys(anonymous, "")
    for name, body in bodies:
        tags[name] = _hash(tags[name] + _named(body, anonymous))
    return Behaviour(_hash("\n".join(sorted(_named(text, tags) for text in texts))), tags)


@lru_cache(maxsize=1)
def _installed() -> Behaviour:
    package = files(PACKAGE)
    entries = [package / name for name in MECHANICAL_SOURCES]
    sources = [
        source.read_text(encoding="utf-8")
        for entry in entries
        for source in ([entry] if entry.is_file() else _python_files(entry))
    ]
    if not sources:
        raise StoreError(
            f"Stored indentations are found by the sources of {PACKAGE}, but it was installed without its "
            ".py files: install it from a wheel or a source archive."
        )
    folders = (folder for folder in package.iterdir() if folder.is_dir())
    modules = (
        f"{PACKAGE}.{folder.name}.{file.name.removesuffix('.py')}"
        for folder in folders
        for file in _python_files(folder)
    )
    return behaviour_of(sources, frozenset(modules))


def _python_files(folder: Traversable) -> Iterator[Traversable]:
    return (file for file in folder.iterdir() if file.name.endswith(".py"))


class _Reader:
    """Writes the syntax tree of one file as text, the same for trees that do the same."""

    # Identifiers stand in angle brackets. Own code, not `ast.dump`, whose text differs between versions of
    # Python.

    def __init__(self, modules: frozenset[str]):
        self.modules = modules
        self.imported: dict[str, str] = {}
        self.classes: list[tuple[str, str]] = []
        """Name and text of each class that was read."""

    def text(self, node: Any, in_error: bool = False) -> str:
        """Text of a node, of a list of nodes or of an identifier."""
        if isinstance(node, str):
            return f"<{self.imported.get(node, node)}>"
        if isinstance(node, list):
            return ",".join([self.text(item, in_error) for item in node if self._counts(item)])
        if not isinstance(node, ast.AST):
            return repr(node)
        kind = type(node)
        if isinstance(node, ast.Constant) and not (in_error and isinstance(node.value, str)):
            return repr(node.value)
        if in_error and kind in (ast.Constant, ast.JoinedStr):
            return "message"
        in_error = in_error or kind is ast.Raise
        parts = [kind.__name__]
        for name in node._fields:
            part = getattr(node, name, None)
            if (
                part is None
                or part == []
                or name in _NO_MEANING
                or (kind is ast.arg and name == "annotation")
            ):
                continue
            parts.append(f"{name}={self.text(part, in_error)}")
        text = " ".join(parts) + ";"
        if isinstance(node, ast.ClassDef):
            self.classes.append((node.name, text))
        return text

    def _counts(self, node: Any) -> bool:
        """Whether a statement alters a number; `pass`, docstrings, imports from the package do not."""
        if isinstance(node, ast.Pass) or (isinstance(node, ast.FunctionDef) and node.name in _SHOWING):
            return False
        if isinstance(node, ast.Expr):
            return not isinstance(node.value, ast.Constant)
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith(
            (PACKAGE, "__future__")
        ):
            return True
        for alias in node.names:
            is_module = f"{node.module}.{alias.name}" in self.modules
            self.imported[alias.asname or alias.name] = "module" if is_module else alias.name
        return False


def _named(text: str, names: Mapping[str, str]) -> str:
    """Exchange some of the identifiers in a text."""
    return _IDENTIFIER.sub(lambda match: names.get(match[1], match[1]), text)


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
