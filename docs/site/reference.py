"""Pages of the reference: one per package of `fingerpad`, with its public names."""

from itertools import groupby
from pathlib import Path

import fingerpad

TITLES = {
    "core": "Values, errors and results",
    "data": "Published numbers",
    "experiments": "Experiments and their files",
    "export": "Files for other programs",
    "geometry": "Fingers, objects and motions",
    "inference": "Fits",
    "mechanics": "Tissues and presses",
    "neuron": "Afferents and populations",
    "psychophysics": "Observers",
    "reduction": "Touches in real time",
    "report": "Figures",
    "skin": "Skin and receptors",
}


def write_reference(folder: Path) -> None:
    """Write the pages into a folder; files that have not changed are left alone."""
    folder.mkdir(exist_ok=True)
    packages = []
    for package, modules in groupby(
        sorted(fingerpad._HOMES.items()), key=lambda home: home[0].partition(".")[0]
    ):
        text = [*_heading(TITLES[package], "="), f"Public names of ``fingerpad.{package}``.", ""]
        for _, names in modules:
            for name in names:
                value = getattr(fingerpad, name)
                directive = "autoclass" if isinstance(value, type) else "autofunction"
                text += [*_heading(name, "-"), f".. {directive}:: fingerpad.{name}", ""]
        _write(folder / f"{package}.rst", text)
        packages.append(package)
    units = "Units are mm, ms, kPa, mN, mA, mF and mV; names carry them."
    tree = [".. toctree::", "", *(f"   {package}" for package in packages), ""]
    _write(folder / "index.rst", [*_heading("Reference", "="), units, "", *tree])


def _heading(words: str, line: str) -> list[str]:
    return [words, line * len(words), ""]


def _write(path: Path, lines: list[str]) -> None:
    text = "\n".join(lines)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
