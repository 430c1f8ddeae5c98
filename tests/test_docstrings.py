"""Sections of docstrings stand on what users call; private functions have one line or none."""

import ast
import inspect
import pydoc
import re
import runpy
from collections.abc import Iterator
from pathlib import Path

from fingerpad.core.displayed import Displayed

ROOT = Path(__file__).parents[1]
SECTION = re.compile(r"\n *(Parameters|Returns|Yields|Raises|Warns|Examples)\n *-+\n(.*?)(?=\n *\n|\Z)", re.S)


def called_by_users() -> set[str]:
    """Names of the reference and of the results that they return, each with its module."""
    public_names = runpy.run_path(str(ROOT / "docs/site/reference.py"))["public_names"]
    things = [thing for names in public_names().values() for thing in names.values()]
    return {f"{thing.__module__}.{thing.__qualname__}" for thing in (*things, *results_of(Displayed))}


def results_of(base: type) -> list[type]:
    return [base, *(each for kind in base.__subclasses__() for each in results_of(kind))]


def documented() -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef, str]]:
    """Dotted name, definition and docstring of everything in the package."""
    for path in (ROOT / "src").rglob("*.py"):
        module = ".".join(path.relative_to(ROOT / "src").with_suffix("").parts).removesuffix(".__init__")
        stack = [(module, ast.parse(path.read_text(encoding="utf-8")))]
        while stack:
            name, node = stack.pop()
            for child in node.body:
                if isinstance(child, ast.FunctionDef | ast.ClassDef):
                    yield f"{name}.{child.name}", child, ast.get_docstring(child) or ""
                    if isinstance(child, ast.ClassDef):
                        stack.append((f"{name}.{child.name}", child))


def inherited(name: str) -> str:
    """What a base class says of a method that overrides its own."""
    thing = pydoc.locate(name)
    return "" if thing is None else inspect.getdoc(thing) or ""


def faults(name: str, node: ast.FunctionDef | ast.ClassDef, said: str, users: set[str]) -> list[str]:
    """What a docstring says too much, or misses."""
    owner = name.rpartition(".")[0]
    private = node.name.startswith("_") and not node.name.startswith("__")
    called = not private and bool({name, owner} & users)
    sections = dict(SECTION.findall("\n" + said))
    found = []
    if called and not said and not node.name.startswith("__") and not inherited(name):
        found.append(f"{name} has no docstring")
    if sections and not called:
        found.append(f"{name} has sections, and no user calls it")
    if private and isinstance(node, ast.FunctionDef) and "\n" in said:
        found.append(f"{name} is private and has more than one line")
    if re.fullmatch(r"\s*\w+\s*", sections.get("Returns", "")):
        found.append(f"{name} returns what its annotation says")
    return found


def test_docstrings_are_as_long_as_their_reader_needs():
    users = called_by_users()
    assert [fault for each in documented() for fault in faults(*each, users)] == []
