"""Atomic writing of files: after an interruption a file is complete or absent."""

from __future__ import annotations

import os
import secrets
import stat
from pathlib import Path
from tempfile import TemporaryFile

from fingerpad.core.errors import InputError, StoreError, shown


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file atomically.

    The bytes are written to a temporary file in the same folder, flushed to the disk, and renamed.
    A concurrent reader gets the old file or the new one, never a part.
    """
    path = Path(path)
    # A rename is atomic within one file system only. The name is hidden and unique among processes.
    unfinished = path.with_name(f".{path.name}.{secrets.token_hex(8)}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with open(unfinished, "xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.replace(unfinished, path)
        except BaseException:
            unfinished.unlink(missing_ok=True)
            raise
        _sync_folder(path.parent)
    except OSError as error:
        raise StoreError(
            f"{path} cannot be written ({error.strerror or error}): free it or choose another."
        ) from error


def make_writable(folder: Path, name: str = "out") -> Path:
    """Create a folder if needed, and check that a file can be written into it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        refused = f"{folder} is not ({error.strerror})"
        raise InputError(name, "must be a writable folder", remedy=refused) from error


LARGEST_TEXT_MB = 200  # Largest file of text that is read, such as a mesh or a table. [MB]


def path_of(name: str, value: object) -> Path:
    """Return a path given as a text or as a path, else raise `InputError`."""
    if isinstance(value, str | os.PathLike) and isinstance(path := os.fspath(value), str):
        return Path(path)
    raise InputError(name, "must be a path, as a text or a Path", shown(value))


def check_file(path: Path, largest_mb: float) -> Path:
    """Return the path of a regular file of limited size, else raise `InputError`.

    A device or a pipe has no end, or none that ever comes.
    """
    path = Path(path)
    try:
        about = path.stat()
    except OSError as error:
        raise InputError(path, "must be a file that can be read", remedy=str(error.strerror)) from error
    except ValueError as error:
        raise InputError(f"The name of a file must not hold a null character: got {str(path)!r}.") from error
    if not stat.S_ISREG(about.st_mode):
        kind = "Is a directory" if stat.S_ISDIR(about.st_mode) else "it is a device or a pipe"
        raise InputError(path, "must be a file that can be read", remedy=str(kind))
    if about.st_size > largest_mb * 1e6:
        raise InputError(
            path, f"must have at most {largest_mb:g} MB", f"{about.st_size / 1e6:.0f} MB", "split it"
        )
    return path


def check_new(path: Path) -> None:
    """Raise `InputError` if a file exists that a user may have changed."""
    if path.exists():
        raise InputError(f"{path} exists and is not overwritten: choose another name.")


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8, else raise `InputError`."""
    try:
        return check_file(path, LARGEST_TEXT_MB).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(path, "must be a file that can be read", remedy=str(error.strerror)) from error
    except UnicodeDecodeError as error:
        raise InputError(
            path, "must be text in UTF-8", remedy=f"byte {error.start + 1} is not; save it as UTF-8"
        ) from error


def _sync_folder(folder: Path) -> None:
    """Flush the directory entry to the disk, where the system can open folders."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
