"""Last section of the page: `quick` and `standard` compared with finer meshes, from stored runs.

The runs took more than an hour and are not repeated for the page. Their numbers lie beside it, with the hash
of the code that made them.
"""

from __future__ import annotations

import json
from typing import Any

from .page import PAGE

INTRODUCTION = """\
## Mesh refinement

There is no closed form for a fingertip, so meshes are compared with finer ones: `fine` divides all elements
of `standard` by 1.5, `paper` has the paper's size. Largest differences of strain energy density (SED) at the
receptors, over its largest value, and of rates [spikes/s]
([numbers](verification/mesh_refinement.json), [of the paper's size](verification/paper_size.json)).

| mesh | against | touch | touches | SED, ramp | SED, hold | dynamic rate | static rate |
|---|---|---|---|---|---|---|---|
"""


def stored(name: str) -> dict[str, Any]:
    """Numbers of a stored run."""
    return json.loads((PAGE.parent / "verification" / f"{name}.json").read_text(encoding="utf-8"))


def errors_shown() -> list[tuple[str, str, str, dict[str, Any]]]:
    """Mesh, finer mesh, kind of touch and errors of every row."""
    rows = []
    refined, sized = stored("mesh_refinement"), stored("paper_size")
    for touch in ("bars", "spheres"):
        for each in refined[touch]["against_finer"]:
            rows.append((each["mesh"], each["against"], touch, each["errors"]))
    for mesh in ("quick", "standard"):
        rows.append((mesh, "paper", "bars", sized["bars"]["errors"][mesh]))
        for position, errors in sized["spheres"]["errors"][mesh].items():
            rows.append((mesh, "paper", f"spheres at {position} mm", errors))
    return rows


def closing() -> str:
    """Markdown of the section."""
    lines = []
    for mesh, against, touch, errors in errors_shown():
        sed = [f"{100 * errors['sed'][phase]['max']:.1f} %" for phase in ("ramp", "hold")]
        rates = [f"{errors['rate_hz'][phase]['max']:.1f}" for phase in ("dynamic", "static")]
        cells = [mesh, against, touch, str(errors["touches"]), *sed, *rates]
        lines.append("| " + " | ".join(cells) + " |")
    sized = stored("paper_size")
    fss = ", ".join(f"{value:.3f} at {mesh}" for mesh, value in sized["bars"]["fss"].items())
    steps = stored("mesh_refinement")["steps"]["bar"]["sed"]["ramp"]["max"]
    end = (
        f"\n\nWeighted FSS of the bar's shifts with unchanged parameters: {fss}. Eight steps against 32 in\n"
        f"the ramp and in the hold change SED under the bar by {100 * steps:.1f} %. Conclusions are on\n"
        "[mesh resolutions](decisions/mesh-resolutions.md).\n"
    )
    return INTRODUCTION + "\n".join(lines) + end
