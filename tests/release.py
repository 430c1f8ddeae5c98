"""`make release`: build wheel and sdist twice, compare them bit by bit, and check what is in them.

Nothing is published: the workflow `.github/workflows/release.yml` does that, from a tag.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tarfile
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.installed_wheel import ROOT, run, timed

IN_WHEEL = ("fingerpad/py.typed", "fingerpad/__main__.py", "fingerpad/report/template.html")
IN_SDIST = ("README.md", "LICENSE", "CITATION.cff", "tests/release.py", "docs/index.md")


class ReleaseError(RuntimeError):
    """The release is not what it must be."""


def build(folder: Path) -> dict[str, str]:
    """Build wheel and sdist into a folder; return the SHA-256 of each by its name."""
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT, folder=folder)
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())}


def missing(folder: Path) -> list[str]:
    """Files that a user would miss in the wheel or in the sdist."""
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    in_wheel = set(zipfile.ZipFile(wheel).namelist())
    with tarfile.open(sdist) as opened:
        in_sdist = {name.partition("/")[2] for name in opened.getnames()}
    lost = [name for name in IN_WHEEL if name not in in_wheel]
    lost += [name for name in IN_SDIST if name not in in_sdist]
    return lost + [name for name in in_wheel if name.startswith(("tests", "docs", "benchmarks", "studies"))]


def main() -> None:
    """Build twice, compare, check; any failure is an exception."""
    # A build takes the times of files from here, not from the checkout.
    os.environ["SOURCE_DATE_EPOCH"] = "1767225600"
    with TemporaryDirectory() as first, TemporaryDirectory() as second:
        with timed("built twice"):
            built = build(Path(first))
            if build(Path(second)) != built:
                raise ReleaseError("Two builds must have the same bits: they do not.")
        if lost := missing(Path(first)):
            raise ReleaseError(f"Wheel and sdist must hold what users need and no more: {', '.join(lost)}.")
        files = [Path(first) / name for name in built]
        run(sys.executable, "-m", "twine", "check", "--strict", *files, folder=Path(first))
        for name, digest in built.items():
            print(f"release: {name} {digest}", flush=True)


if __name__ == "__main__":
    main()
