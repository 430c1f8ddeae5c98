"""Order and speed of the test files, the perturbation of presses, and the fixture that runs a command line.

The longest files come first, so that no process works alone at the end.
"""

import logging
import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

# An example may take long while other processes have the cores: that is no failure. Every run tries the same
# examples, so that a commit passes or fails for good; `--hypothesis-profile=search` tries new ones.
settings.register_profile("fingerpad", deadline=None, derandomize=True)
settings.register_profile("search", deadline=None)
settings.load_profile("fingerpad")

LONGEST = (
    "test_reproduction.py",
    "test_readme.py",
    "test_composes.py",
    "test_surfaces.py",
    "test_small_bodies.py",
    "test_recording_fit.py",
    "verification/test_verification.py",
    "test_lab.py",
    "verification/test_oracles.py",
    "test_store.py",
    "test_reduced_touch.py",
    "test_report.py",
    "test_view.py",
    "test_pose.py",
    "test_own_mesh.py",
    "test_validation.py",
    "test_discrimination_task.py",
    "test_estimation_afferent_posterior.py",
    "test_compilation.py",
    "test_psychometric.py",
    "test_recording_extras.py",
    "test_single_unit_uncertainty.py",
)
"""Files by their processor time, the longest first; all others follow in the order of their names."""

HERE = Path(__file__).parent

SLOW = re.compile(
    r"\.solve\(|\b(press|press_into|pressed|indent)\(|fp\.(touch|sweep|fit|discriminate|validate)\(|Notebook|subprocess"
)
"""What a file holds that presses bodies or starts programs: it is marked `slow`, and so are the longest."""

PERTURBED = int(os.environ.get("PERTURBED", "0"))
"""Seed of `make perturbed`; 0 for none."""


@pytest.fixture(autouse=PERTURBED > 0, scope="session")
def perturbed() -> None:
    """Change the moduli of every pressed body by 1e-12 to 1e-9 of themselves, and its nodes by 1e-14.

    Tests take integrals over the mesh that they made, some of them to 1e-12.
    """
    from fingerpad.mechanics import press  # only here: most runs need no mechanics

    body = press.Body

    def other_body(mesh, table, *others, **named):
        generator = np.random.default_rng(PERTURBED)
        size = 10.0 ** generator.uniform(-12.0, -9.0)
        law = table.law.copy()
        law[:, :7] *= 1.0 + size * generator.standard_normal((len(law), 1))
        nodes_mm = mesh.nodes_mm * (1.0 + 1e-14 * generator.standard_normal(mesh.nodes_mm.shape))
        return body(replace(mesh, nodes_mm=nodes_mm), replace(table, law=law), *others, **named)

    press.Body = other_body


@pytest.fixture(autouse=True)
def levels() -> Iterator[None]:
    """Put back what a command line in a test sets: the level of the logger, the handlers of the root."""
    handlers = logging.getLogger().handlers[:]
    yield
    logging.getLogger("fingerpad").setLevel(logging.NOTSET)
    logging.getLogger().handlers[:] = handlers


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory) -> Path:
    """Folder that all processes of one run of tests share: a touch stored there is not pressed again."""
    own = tmp_path_factory.getbasetemp()
    return (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "shared"


@pytest.fixture
def run_program(monkeypatch, capsys, tmp_path) -> Callable[..., tuple[int, str, str]]:
    """Run a main function with words of a command line in an empty folder: status, output and errors.

    A slow computer adds no line: those on compilation and on how far a stage is are left out.
    """
    from fingerpad.cli import commands
    from fingerpad.core.compilation import SHORT_NOTICE, SUBJECT

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(commands, "Lines", partial(commands.Lines, every_s=1e6))

    def run(main: Callable[[], None], *words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", [str(word) for word in words])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        lines = said.err.splitlines(keepends=True)
        errors = "".join(line for line in lines if not line.startswith((SUBJECT, SHORT_NOTICE)))
        return ended.value.code or 0, said.out, errors

    return run


@pytest.fixture
def is_refused(tmp_path) -> Callable[..., None]:
    """Check the outcome of a misused command: status 2, one sentence of errors, and no file written."""

    def check(outcome: tuple[int, str, str], program: str, named: str, came: str) -> None:
        status, said, errors = outcome
        assert (status, said) == (2, "")
        assert errors.startswith(f"{program}: ")
        assert errors.endswith(".\n")
        assert not errors.endswith("..\n")  # no sentence within a sentence
        assert errors.count("\n") == 1
        assert named in errors
        assert came in errors.removeprefix(f"{program}: ")
        assert list(tmp_path.iterdir()) == []

    return check


@cache
def is_slow(path: Path) -> bool:
    """Whether `make test-fast` leaves a file out."""
    if HERE not in path.parents:
        return False
    longest = path.relative_to(HERE).as_posix() in LONGEST
    return longest or SLOW.search(path.read_text(encoding="utf-8")) is not None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark slow tests, and sort the tests of whole files; within a file they keep their order."""
    if missing := [name for name in LONGEST if not (HERE / name).exists()]:
        raise pytest.UsageError(f"LONGEST of tests/conftest.py must name test files: {', '.join(missing)}.")
    for item in items:
        if is_slow(item.path):
            item.add_marker("slow")
    rank = {HERE / name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path, len(LONGEST)))
