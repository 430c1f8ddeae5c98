"""`fingerpad store`: stored indentations of a folder, their checks and their removal."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fingerpad.cli.options import Command, Group, number_option, option
from fingerpad.core.errors import InputError, StoreError

if TYPE_CHECKING:
    from fingerpad.skin.store import Store

SECONDS_PER_DAY = 86_400.0

store_app = typer.Typer(
    help="List, verify or prune the stored indentations of a folder.", add_completion=False, cls=Group
)

Folder = Annotated[
    Path, typer.Argument(metavar="FOLDER", help="Folder of a run, or its folder `indentations`.")
]


def _store(folder: Path) -> Store:
    from fingerpad.experiments.runner import STORE_FOLDER
    from fingerpad.skin.store import Store

    inner = folder / STORE_FOLDER
    found = inner if inner.is_dir() else folder
    if not found.is_dir():
        raise InputError(f"FOLDER must be a folder of stored indentations: {folder} is none.")
    store = Store(found)
    if found.name != STORE_FOLDER and not store.files():
        raise InputError(f"FOLDER must hold stored indentations: {folder} has none; name that of a run.")
    return store


@store_app.command("list", cls=Command)
def list_command(folder: Folder) -> None:
    """List the stored indentations, the oldest first, with size and time."""
    files = _store(folder).files()
    for file in files:
        written = datetime.fromtimestamp(file.written_s, UTC).strftime("%Y-%m-%d %H:%M")
        typer.echo(f"{file.path.stem}  {file.size / 1e6:8.2f} MB  {written} UTC")
    typer.echo(f"{len(files)} indentations, {sum(file.size for file in files) / 1e6:.1f} MB")


@store_app.command("verify", cls=Command)
def verify_command(folder: Folder) -> None:
    """Read every file and compare its key and its checksum; exit status 1 if one is damaged."""
    files = _store(folder).files()
    faults = {file.path: fault for file in files if (fault := file.fault) is not None}
    for path, fault in faults.items():
        typer.echo(f"{path}: {fault}")
    typer.echo(f"{len(files)} indentations, {len(faults)} damaged")
    if faults:
        raise typer.Exit(1)


@store_app.command("prune", cls=Command)
def prune_command(
    folder: Folder,
    days: Annotated[float | None, number_option("Delete what is older. [days]")] = None,
    size: Annotated[
        float | None, number_option("Delete the oldest until the rest is at most so large. [MB]")
    ] = None,
    yes: Annotated[bool, option("Delete; without it, only say what would be.", "--yes")] = False,
) -> None:
    """Delete stored indentations by age and by size; they are computed again when they are needed."""
    from fingerpad.core.values import not_negative
    from fingerpad.skin.store import pruned

    if days is None and size is None:
        raise InputError("prune", "needs --days, --size or both", "neither")
    before_s = None if days is None else time.time() - SECONDS_PER_DAY * not_negative("--days", days, "days")
    most = None if size is None else int(1e6 * not_negative("--size", size, "MB"))
    files = _store(folder).files()
    chosen = pruned(files, before_s, most)
    try:
        for file in chosen if yes else ():
            file.path.unlink(missing_ok=True)
    except OSError as error:
        raise StoreError(f"{file.path} cannot be deleted: {error.strerror or error}.") from error
    verb = "deleted" if yes else "would be deleted; --yes deletes"
    freed = sum(file.size for file in chosen) / 1e6
    typer.echo(f"{len(chosen)} of {len(files)} indentations, {freed:.1f} MB, {verb}")
