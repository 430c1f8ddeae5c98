"""Other programs in environments of their own: none is a dependency; Brian2 needs an older NumPy."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parent / ".peers"
"""Folder of the environments; git ignores it, and it can be deleted at any time."""

REQUIREMENTS = {
    "felupe": ("felupe>=11.3,<12", "pypardiso>=0.4.6,<0.5", "psutil>=6,<8"),
    "brian2": ("brian2>=2.9,<2.11", "numpy>=2,<2.3", "cython>=3,<4", "setuptools>=75,<81"),
}


class MissingPeerError(RuntimeError):
    """A peer could not be installed."""


def environment_of(peer: str, folder: Path = FOLDER) -> Path:
    """Create the environment of a peer, unless it exists with the same requirements.

    Parameters
    ----------
    peer : str
        Key of `REQUIREMENTS`.
    folder : Path
        Where environments are kept.

    Returns
    -------
    Path
        Its interpreter.

    Raises
    ------
    MissingPeerError
        If pip cannot install it.
    """
    place, wanted = folder / peer, "\n".join(REQUIREMENTS[peer])
    python, done = place / "bin" / "python", place / "requirements.txt"
    if python.exists() and done.exists() and done.read_text(encoding="utf-8") == wanted:
        return python
    try:
        subprocess.run([sys.executable, "-m", "venv", "--clear", place], check=True, capture_output=True)
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, *REQUIREMENTS[peer]], check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        reason = getattr(error, "stderr", None) or str(error)
        raise MissingPeerError(
            f"{peer} could not be installed with pip: {str(reason).strip()[-300:]}"
        ) from error
    done.write_text(wanted, encoding="utf-8")
    return python


def calculix() -> str:
    """Find CalculiX, or install it with apt-get.

    Returns
    -------
    str
        The program `ccx`.

    Raises
    ------
    MissingPeerError
        If it is not installed and cannot be installed.
    """
    if found := shutil.which("ccx"):
        return found
    privileged = [] if getattr(os, "geteuid", lambda: 1)() == 0 else ["sudo", "--non-interactive"]
    quiet = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for arguments in (["update"], ["install", "--yes", "--no-install-recommends", "calculix-ccx"]):
        try:
            command = [*privileged, "apt-get", "--quiet", *arguments]
            subprocess.run(command, env=quiet, check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError) as error:
            raise MissingPeerError(
                "CalculiX is missing and apt-get could not install it (package calculix-ccx, as root or by "
                "sudo): install it, or put ccx on the PATH."
            ) from error
    if found := shutil.which("ccx"):
        return found
    raise MissingPeerError("apt-get installed calculix-ccx, but ccx is not on the PATH: add it to the PATH.")
