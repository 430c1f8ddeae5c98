"""docs/architecture.md and the contract of imports say what the packages are and may do."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "fingerpad"
FOLDERS = sorted(path.parent.name for path in PACKAGE.glob("*/__init__.py"))
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
ROWS = {
    cells[0].strip("` "): cells
    for cells in (line.strip("|").split("|") for line in PAGE.splitlines() if line.startswith("| `"))
}
CONTRACT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"][0]
LAYERS = CONTRACT["layers"]
UPWARDS = {line.split(" -> ")[1] for line in CONTRACT["ignore_imports"]}
"""Modules that results load when they draw themselves or turn into tables."""


def modules_imported(folder: Path) -> set[str]:
    """Dotted names of all modules that the modules of a folder import."""
    found = set()
    for module in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            found |= {alias.name for alias in node.names} if isinstance(node, ast.Import) else set()
            found |= {node.module or ""} if isinstance(node, ast.ImportFrom) else set()
    return found


def imported(package: str) -> set[str]:
    """Other packages that the modules of one name in an import."""
    names = modules_imported(PACKAGE / package) - (UPWARDS if package == "core" else set())
    return {match[1] for name in names if (match := re.match(r"fingerpad\.(\w+)", name))} - {package}


def test_the_page_and_the_contract_list_every_package_in_the_same_order():
    assert [f"fingerpad.{name}" for name in ROWS] == LAYERS
    assert sorted(ROWS) == FOLDERS


def test_no_module_lies_beside_the_packages():
    assert sorted(path.name for path in PACKAGE.glob("*.py")) == ["__init__.py", "__main__.py"]


@pytest.mark.parametrize("package", FOLDERS)
def test_a_package_imports_only_what_its_row_names(package):
    stated = ROWS[package][2]
    named = set(FOLDERS) if "all others" in stated else set(re.findall(r"`(\w+)`", stated))
    assert imported(package) <= named | ({"core", "data"} if package not in ("core", "data") else {"core"})


def test_a_command_loads_what_its_options_need_when_they_are_given():
    """The likelihood of spikes, the uncertainty of a fit and regions of the skin are loaded on demand."""
    late = ("inference.spike_likelihood", "inference.fitting.posterior", "skin.unrolled_skin")
    loading = "import sys, fingerpad.experiments.fit.request, fingerpad.experiments.discrimination.request; "
    stated = f"{loading}print(*[name for name in {late!r} if 'fingerpad.' + name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", stated], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_the_installed_package_imports_nothing_that_stands_beside_it():
    beside = {"studies", "benchmarks", "tests"}
    assert not {name for name in modules_imported(PACKAGE) if name.split(".")[0] in beside}
    assert beside & {name.split(".")[0] for name in modules_imported(ROOT / "studies")} == {"studies"}
