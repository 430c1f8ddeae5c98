"""`make wheel`: build the wheel, install it into an empty environment, run the README's ten lines there.

`python -m tests.installed_wheel` also states how large the environment is; it is what `make reproduce` needs.
"""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
MOST_MB = 700.0
"""Largest environment that is accepted. [MB]"""

LISTED = 8
"""Packages whose sizes are stated."""


class WheelError(RuntimeError):
    """The wheel cannot be installed or used as the README says."""


def ten_lines(readme: str) -> str:
    """Return the first Python example of the README."""
    found = re.search(r"^```python\n(.*?)^```", readme, re.MULTILINE | re.DOTALL)
    if found is None:
        raise WheelError("README.md must hold a block of Python: it does not.")
    return found[1]


def size_mb(folder: Path) -> float:
    """Return the size of all files in a folder, links not followed. [MB]"""
    return sum(file.lstat().st_size for file in folder.rglob("*") if not file.is_dir()) / 1e6


def largest(site_packages: Path) -> dict[str, float]:
    """Return the sizes of the largest packages, the largest first. [MB]"""
    sizes = {entry.name: size_mb(entry) for entry in site_packages.iterdir() if entry.is_dir()}
    return dict(sorted(sizes.items(), key=lambda item: -item[1])[:LISTED])


def run(*command: str | Path, folder: Path) -> str:
    """Run a program outside of the checkout and return what it prints.

    Raises
    ------
    WheelError
        If it fails, with what it printed.
    """
    done = subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise WheelError(f"{' '.join(map(str, command))} failed:\n{done.stdout}{done.stderr}")
    return done.stdout


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Print how long a part takes."""
    started = time.perf_counter()
    yield
    print(f"wheel: {what}, {time.perf_counter() - started:.1f} s", flush=True)


def main() -> None:
    """Build, install, check and use the wheel; any failure is an exception."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        environment, python = folder / "environment", folder / "environment" / "bin" / "python"
        # The pip of this environment serves the other one, which stays empty but for the wheel.
        pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
        with timed("built"):
            run(*pip, "wheel", "--no-deps", "--wheel-dir", folder, ROOT, folder=folder)
        (wheel,) = folder.glob("fingerpad-*.whl")
        with timed(f"{wheel.name} installed"):
            run(sys.executable, "-m", "venv", "--without-pip", environment, folder=folder)
            run(*pip, "--python", python, "install", "--no-compile", wheel, folder=folder)
            run(*pip, "--python", python, "check", folder=folder)
            run(environment / "bin" / "fingerpad", "--version", folder=folder)
        (site_packages,) = environment.glob("lib/python*/site-packages")
        total = size_mb(environment)
        listed = ", ".join(f"{package} {size:.0f}" for package, size in largest(site_packages).items())
        print(f"wheel: environment of {total:.0f} MB; {listed}", flush=True)
        if total > MOST_MB:
            raise WheelError(f"The environment must have at most {MOST_MB:.0f} MB: it has {total:.0f} MB.")
        with timed("ten lines run, the kernels compiled"):
            lines = ten_lines((ROOT / "README.md").read_text(encoding="utf-8"))
            run(python, "-I", "-c", lines, folder=folder)
        if not (folder / "touch.png").read_bytes().startswith(b"\x89PNG"):
            raise WheelError("The ten lines must save the picture touch.png: they did not.")


if __name__ == "__main__":
    main()
