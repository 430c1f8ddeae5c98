"""What a measurement ran on: enough to judge it elsewhere, and no name of a machine or a person."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import psutil

ROOT = Path(__file__).parents[1]

PACKAGES = ("numpy", "scipy", "numba", "pyamg")
"""Packages on whose versions times depend."""

WRITTEN_HERE = (":!benchmarks/results", ":!benchmarks/README.md")
"""What a benchmark itself changes says nothing about the code that ran."""


def describe() -> dict[str, Any]:
    """Describe processor, memory, system, versions, code and time.

    Returns
    -------
    dict
        Plain values, fit for JSON.

    Examples
    --------
    >>> sorted(describe())[:3]
    ['commit', 'cores', 'date']
    """
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "memory_gb": round(psutil.virtual_memory().total / 1e9, 1),
        "system": _system(),
        "python": platform.python_version(),
        "packages": {name: found for name in PACKAGES if (found := _version(name))},
        "commit": _git("rev-parse", "--short", "HEAD") or "unknown",
        "uncommitted": bool(_git("status", "--porcelain", "--", ".", *WRITTEN_HERE)),
        "load_before": round(os.getloadavg()[0], 1),
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    }


def hardware(machine: dict[str, Any]) -> str:
    """Say on one line on which machine and with which packages a measurement ran.

    Examples
    --------
    >>> abacus = {"processor": "Abacus", "cores": 2, "memory_gb": 4, "system": "Linux", "python": "3.11"}
    >>> print(hardware(abacus | {"packages": {"numpy": "2.4"}}))
    Abacus, 2 cores, 4 GB; Linux; Python 3.11, numpy 2.4
    """
    versions = ", ".join(f"{name} {found}" for name, found in machine["packages"].items())
    return (
        f"{machine['processor']}, {machine['cores']} cores, {machine['memory_gb']} GB; {machine['system']}; "
        f"Python {machine['python']}, {versions}"
    )


def occasion(machine: dict[str, Any]) -> str:
    """Say on one line which code ran, under which load, and when.

    Examples
    --------
    >>> print(occasion({"commit": "abc", "uncommitted": True, "load_before": 0.1, "date": "now"}))
    commit abc with changes; load before it 0.1; now.
    """
    changes = " with changes" if machine["uncommitted"] else ""
    return f"commit {machine['commit']}{changes}; load before it {machine['load_before']}; {machine['date']}."


def _processor() -> str:
    known = Path("/proc/cpuinfo")
    if known.exists():
        for line in known.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _system() -> str:
    try:
        named = platform.freedesktop_os_release().get("PRETTY_NAME", "")
    except OSError:
        named = ""
    return " ".join(part for part in (named or platform.system(), platform.machine()) if part)


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _git(*arguments: str) -> str:
    try:
        done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return done.stdout.strip()
