"""The longest test files come first, so that no process works alone at the end."""

from pathlib import Path

import pytest

LONGEST = (
    "test_reproduction.py",
    "test_recording_fit.py",
    "test_report.py",
    "verification/test_verification.py",
    "verification/test_oracles.py",
    "test_store.py",
    "test_discrimination_task.py",
    "test_psychometric.py",
    "test_studies.py",
    "test_estimation_afferent_posterior.py",
    "studies/test_spike_fit.py",
    "studies/test_material_sets.py",
    "test_recording_extras.py",
    "test_single_unit_uncertainty.py",
)
"""Files by their processor time, the longest first; all others follow in the order of their names."""

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the tests of whole files; within a file they keep their order."""
    if missing := [name for name in LONGEST if not (HERE / name).exists()]:
        raise pytest.UsageError(f"LONGEST of tests/conftest.py must name test files: {', '.join(missing)}.")
    rank = {HERE / name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path, len(LONGEST)))
