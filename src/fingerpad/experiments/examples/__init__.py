"""Examples of the files that users write, as `fingerpad init` gives them."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable

from fingerpad.core.plain_yaml import read_yaml


@dataclass(frozen=True)
class Example:
    """An example of a file."""

    what: str  #: What it is, in words.
    file: str  #: Its name.
    text: str


def examples() -> dict[str, Example]:
    """Examples of all kinds by their names."""
    packaged, rates = files(__name__), files("fingerpad.data") / "tables/bar_firing_rates.csv"
    found = {
        "touch": Example("A touch", "touch.yaml", _text(packaged / "touch.yaml")),
        "recordings": Example("Rates under the paper's bar, for a fit", "bar.csv", _text(rates)),
    }
    for name, text in _texts("observations").items():
        found[name] = Example("Observations to be predicted", f"{name}.csv", text)
    for name, text in tasks().items():
        found[name] = Example(str(read_yaml(text, "task")["question"]), f"{name}.yaml", text)
    return found


def tasks() -> dict[str, str]:
    """Texts of the example tasks by name."""
    return _texts("tasks")


def _texts(folder: str) -> dict[str, str]:
    entries = sorted((files(__name__) / folder).iterdir(), key=lambda entry: entry.name)
    return {entry.name.partition(".")[0]: _text(entry) for entry in entries}


def _text(entry: Traversable) -> str:
    return entry.read_text(encoding="utf-8")
