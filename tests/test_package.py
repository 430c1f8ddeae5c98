"""The package for a user: exported names, docstrings, and time of import."""

import dataclasses
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


def test_a_dataclass_without_words_does_not_count_as_explained() -> None:
    silent = dataclasses.make_dataclass("Silent", [("depth_mm", float), ("width_mm", float)])
    assert not explained(silent)
    assert explained(inspect.getdoc)


@pytest.mark.parametrize("name", MODULES)
def test_every_module_has_a_docstring_and_its_exported_names(name: str) -> None:
    module = importlib.import_module(name)
    assert module.__doc__
    assert all(hasattr(module, promised) for promised in getattr(module, "__all__", ()))


def test_version_is_the_installed_one() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+\S*", fingerpad.__version__)
    assert version("fingerpad") == fingerpad.__version__


def test_import_chooses_no_plotting_backend_and_warns_of_nothing() -> None:
    code = "import sys, fingerpad; print('matplotlib.pyplot' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "False", "")


HEAVY = (
    "numpy", "scipy", "numba", "llvmlite", "matplotlib", "jinja2", "typer", "rich",
    "threadpoolctl", "vtkmodules",
)  # fmt: skip
"""Libraries that take from a tenth to several tenths of a second to load."""


@pytest.mark.parametrize(
    ("code", "needed"),
    [
        ("import fingerpad", set()),
        ("import fingerpad; fingerpad.InputError, fingerpad.__version__, dir(fingerpad)", set()),
        ("import fingerpad.cli", {"typer"}),
        ("from fingerpad import Fingertip, SedTraces", {"numpy", "scipy"}),
    ],
    ids=["package", "errors", "command line", "values"],
)
def test_an_import_loads_no_library_that_it_does_not_use(code, needed):
    loaded = f"{code}\nimport sys\nprint(*(name for name in {HEAVY} if name in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", loaded], capture_output=True, text=True, check=True
    )
    assert set(done.stdout.split()) == needed


def test_the_module_has_its_public_names_and_nothing_that_it_imports_itself():
    code = "import fingerpad; print(*(name for name in vars(fingerpad) if not name.startswith('_')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
    assert set(dir(fingerpad)) == {*fingerpad.__all__, "__version__"}
    daily = {"Store", "UnrolledSkin", "hexagonal", "parse_task", "write_responses_nwb"}
    assert daily <= set(fingerpad.__all__)


def test_no_package_hides_a_public_name():
    packages = {path.name for path in Path(fingerpad.__file__).parent.iterdir()}
    assert not packages & set(fingerpad.__all__)


def test_names_are_listed_before_they_are_loaded_and_others_are_not_there():
    assert set(fingerpad.__all__) < set(dir(fingerpad))
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
