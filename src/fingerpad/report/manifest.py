"""How the results of a page were made: the chapter that every page ends with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

from fingerpad.experiments.manifest import Manifest
from fingerpad.report.formatting import plain, spelled
from fingerpad.report.parts import Chapter, Row, Table


def manifest_chapter(manifest: Manifest) -> Chapter:
    """Return the chapter: facts about the run, its stages, and versions of packages."""
    facts = asdict(manifest)
    stages, packages = facts.pop("stages"), facts.pop("packages")
    tables = [facts_table("The run", facts)]
    if stages:
        names = [name for name in stages[0] if any(stage[name] for stage in stages)]
        rows = [Row([plain(stage[name]) for name in names]) for stage in stages]
        tables.append(Table("Stages", [spelled(name) for name in names], rows))
    return Chapter("Provenance", [*tables, facts_table("Packages", packages)])


def edition(manifest: Manifest) -> str:
    """Return the version, resolution and seed of a run, and its caveats: what was not verified."""
    made = f"fingerpad {manifest.version}, {manifest.resolution} resolution, seed {manifest.seed}"
    return made if not manifest.caveats else f"{made}. Not verified: {' '.join(manifest.caveats)}"


def facts_table(title: str, facts: Mapping[str, object]) -> Table:
    """Return names and values as a table; what is None or empty is left out."""
    given = {name: value for name, value in facts.items() if value is not None and value not in ({}, ())}
    return Table(title, ("", ""), [Row.of(spelled(name), plain(value)) for name, value in given.items()])
