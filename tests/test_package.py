"""The package for a user: exported names, docstrings, and time of import."""

import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import fingerpad

MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(fingerpad.__path__, prefix="fingerpad.")
    if not module.name.endswith("__main__")
)


def test_every_public_name_can_be_imported_by_star() -> None:
    namespace: dict[str, object] = {}
    exec("from fingerpad import *", namespace)
    assert fingerpad.__all__
    assert set(fingerpad.__all__) <= set(namespace)
    assert len(set(fingerpad.__all__)) == len(fingerpad.__all__)


def test_every_exported_name_is_explained() -> None:
    assert [name for name in fingerpad.__all__ if not explained(getattr(fingerpad, name))] == []


def explained(thing: object) -> bool:
    """Whether a function, class or module has words of its own; other values need none."""
    if not callable(thing) and not inspect.ismodule(thing):
        return True
    said = thing.__doc__ or ""
    written_by_dataclass = said.startswith(f"{getattr(thing, '__name__', '')}(")
    return len(said.split()) >= 3 and not written_by_dataclass


def test_every_module_has_a_docstring_and_its_exported_names() -> None:
    for name in MODULES:
        module = importlib.import_module(name)
        assert module.__doc__, name
        assert all(hasattr(module, promised) for promised in getattr(module, "__all__", ())), name


def test_version_is_the_installed_one() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+\S*", fingerpad.__version__)
    assert version("fingerpad") == fingerpad.__version__


def python(code: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True)


def test_import_chooses_no_plotting_backend_and_warns_of_nothing() -> None:
    done = python("import sys, fingerpad.report.reproduction; print('matplotlib.pyplot' in sys.modules)")
    assert (done.stdout.strip(), done.stderr) == ("False", "")


HEAVY = (
    "numpy", "scipy", "numba", "llvmlite", "matplotlib", "jinja2", "pydantic", "rich", "threadpoolctl",
    "vtkmodules",
)  # fmt: skip
"""Libraries that take from a tenth to several tenths of a second to load."""


@pytest.mark.parametrize(
    ("code", "needed"),
    [
        ("import fingerpad; fingerpad.InputError, fingerpad.__version__, dir(fingerpad)", set()),
        ("import fingerpad.cli", set()),
        ("from fingerpad import Fingertip, Traces", {"numpy", "scipy", "pydantic"}),
    ],
    ids=["package", "command line", "values"],
)
def test_an_import_loads_no_library_that_it_does_not_use(code, needed):
    done = python(f"{code}\nimport sys\nprint(*(name for name in {HEAVY} if name in sys.modules))")
    assert set(done.stdout.split()) == needed


def test_the_module_has_its_public_names_and_nothing_that_it_imports_itself():
    done = python("import fingerpad; print(*(name for name in vars(fingerpad) if not name.startswith('_')))")
    assert done.stdout.split() == []
    assert set(dir(fingerpad)) == {*fingerpad.__all__, "__version__"}
    daily = {"Store", "UnrolledSkin", "hexagonal", "touch", "write_responses_nwb"}
    daily = {"touch", "discriminate", "UnrolledSkin", "hexagonal", "write_responses_nwb"}
    assert daily <= set(fingerpad.__all__)
    assert len(fingerpad.__all__) <= 90
    packages = {path.name for path in Path(fingerpad.__file__).parent.iterdir()}
    shown = packages & set(fingerpad.__all__)
    assert all(inspect.ismodule(getattr(fingerpad, name)) for name in shown)  # no package hides a name
    with pytest.raises(AttributeError, match="module 'fingerpad' has no attribute 'Fingertap'"):
        fingerpad.Fingertap  # noqa: B018


DECISIONS = sorted((Path(__file__).parents[1] / "docs" / "decisions").glob("*.md"))


@pytest.mark.parametrize("page", DECISIONS, ids=lambda page: page.stem)
def test_a_decision_is_complete_and_names_arguments_that_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    parts = re.findall(r"^\*\*(Question|Choice|Reason|To change it)\.\*\*", text, flags=re.MULTILINE)
    assert parts == ["Question", "Choice", "Reason", "To change it"]
    for names, owner in re.findall(
        r"((?:`\w+`(?:, | and )?)+) of `(fingerpad(?:\.\w+)+)`", " ".join(text.split())
    ):
        thing = pkgutil.resolve_name(owner)
        known = set(dir(thing)) | set(inspect.signature(thing).parameters)
        assert set(re.findall(r"`(\w+)`", names)) <= known
