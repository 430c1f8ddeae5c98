"""Pages of the reference: one per package of `fingerpad`, with its public names.

Public are the names of `fingerpad` itself, those that a package exports in `__all__`, those that a page,
an example or a notebook imports from a module, and the entries of `FURTHER`.
"""

import re
from collections import defaultdict
from importlib import import_module
from inspect import isclass, isroutine
from pathlib import Path

import fingerpad

ROOT = Path(__file__).parents[2]

TITLES = {
    "core": "Values, errors and results",
    "data": "Published numbers",
    "experiments": "Experiments and their files",
    "export": "Files for other programs",
    "geometry": "Fingers, objects and motions",
    "inference": "Fits",
    "lab": "Laboratory",
    "mechanics": "Tissues and presses",
    "neuron": "Afferents and populations",
    "psychophysics": "Observers",
    "reduction": "Touches in real time",
    "report": "Figures",
    "skin": "Skin and receptors",
}

FURTHER = {
    "core.displayed": ("Displayed", "Result"),
    "core.errors": ("MaterialWarning", "StoreError", "TissuesWarning"),
    "core.phases": ("Phase",),
    "core.progress": ("Lines", "NoProgress", "Progress", "share_done"),
    "core.regions": ("Polygon", "Rectangle"),
    "core.signals": ("HitRates",),
    "experiments.conditions": ("Conditions",),
    "experiments.discrimination.analysis": ("TaskResult", "analyse"),
    "experiments.fit.fit": ("fit_recordings",),
    "experiments.fit.results": ("FitResult",),
    "experiments.recording_files": ("read_recordings",),
    "experiments.requests.parts": ("Request",),
    "experiments.requests.stimuli": ("read_stimuli",),
    "experiments.requests.stimulus": ("ramp_and_hold",),
    "experiments.scan": ("ScanRequest", "ScanResult", "TactileImage"),
    "experiments.validation.observations": ("read_observations",),
    "export.sweep_results": ("observe_sweep", "setting_response", "write_sweep_spikes"),
    "geometry.bodies": tuple(fingerpad.bodies.__all__),
    "geometry.embossed": ("Embossed",),
    "geometry.free_mesh": ("FingerMesh",),
    "geometry.motion": ("Cycles",),
    "geometry.surface": ("Surface",),
    "geometry.motions": ("recorded",),
    "inference.rate_model": ("AfferentModel",),
    "inference.recordings": ("SpikeRecordings",),
    "inference.spike_likelihood": ("SpikeFit", "SpikeLikelihood", "fit_spikes", "time_rescaling"),
    "mechanics.laws": ("Hencky", "Hyperfoam", "Ogden", "Polynomial"),
    "neuron.afferent_types": ("afferent_of",),
    "neuron.escape_rate": ("EscapeRate",),
    "neuron.transduction": ("Transduction",),
    "reduction.building": ("reduce_touch",),
    "reduction.model": ("ReducedModel", "write_reduced"),
    "reduction.streaming": ("ReducedSample",),
    "reduction.training": ("ReducedRange", "ReducedTraining"),
    "skin.indentation": ("Touch",),
    "skin.unrolled_skin": ("NailEdge",),
    "skin.sampling": ("SkinResponse", "SurfaceProfile"),
    "skin.store": ("Store", "solve_missing"),
}
"""Names by module that the interface returns or takes, or that left `fingerpad`; no page imports them."""

IMPORTED = re.compile(r"^[ \"]*from fingerpad\.([\w.]+) import (\([^)]*\)|[\w, ]+)", re.MULTILINE)


def public_names() -> dict[str, dict[str, object]]:
    """Names and values of each package, in the order of the alphabet."""
    modules: dict[str, set[str]] = defaultdict(set)
    for name, home in fingerpad._HOME.items():
        if home == "fingerpad":  # a package
            continue
        modules[home.removeprefix("fingerpad.")].add(name)
    for home, names in (*FURTHER.items(), *_imported_by_pages()):
        modules[home].update(names)
    found: dict[str, dict[str, object]] = defaultdict(dict)
    for home, names in modules.items():
        package, module = home.partition(".")[0], import_module(f"fingerpad.{home}")
        values = {name: getattr(module, name, None) for name in names}  # None for a module of the package
        found[package] |= _documented(values)
    for package in TITLES:
        exports = import_module(f"fingerpad.{package}")
        values = {name: getattr(exports, name) for name in getattr(exports, "__all__", ())}
        found[package] |= _documented(values)
    return {package: dict(sorted(found[package].items(), key=_order)) for package in TITLES}


def _documented(values: dict[str, object]) -> dict[str, object]:
    """Keep classes and functions: constants and names of types have no docstring of their own."""
    return {name: value for name, value in values.items() if isclass(value) or isroutine(value)}


def _order(item: tuple[str, object]) -> tuple[bool, str]:
    """Put classes first."""
    name, value = item
    return not isinstance(value, type), name.lower()


def _imported_by_pages() -> list[tuple[str, list[str]]]:
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    pages += [*(ROOT / "docs/gallery").glob("*.py"), *(ROOT / "docs/notebooks").glob("*.ipynb")]
    return [
        (module, re.findall(r"\w+", names))
        for page in sorted(pages)
        for module, names in IMPORTED.findall(page.read_text(encoding="utf-8"))
    ]


def write_reference(folder: Path) -> None:
    """Write the pages into a folder; files that have not changed are left alone."""
    folder.mkdir(exist_ok=True)
    packages = public_names()
    for package, names in packages.items():
        text = [*_heading(TITLES[package], "="), f"Public names of ``fingerpad.{package}``.", ""]
        for name, value in names.items():
            short = name in fingerpad.__all__
            directive = "autoclass" if isinstance(value, type) else "autofunction"
            home = "fingerpad" if short else value.__module__
            text += [*_heading(name, "-")]
            if not short:
                text += [f"``from {home} import {name}``", ""]
            text += [f".. {directive}:: {home}.{name}", ""]
        _write(folder / f"{package}.rst", text)
    units = "Units are mm, ms, kPa, mN, mA, mF and mV; names carry them."
    tree = [".. toctree::", "", *(f"   {package}" for package in packages), ""]
    _write(folder / "index.rst", [*_heading("Reference", "="), units, "", *tree])


def _heading(words: str, line: str) -> list[str]:
    return [words, line * len(words), ""]


def _write(path: Path, lines: list[str]) -> None:
    text = "\n".join(lines)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
