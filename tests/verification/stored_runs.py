"""Last section of the page: SED, rates and hit rates under mesh refinement, from a stored run.

The run takes more than an hour and is not repeated for the page: `fingerpad refine` presses everything, and
its numbers and figure are kept beside the page with the hash of the code that made them.
"""

from __future__ import annotations

import json
from typing import Any

from fingerpad.report.mesh_refinement import FIGURE, NUMBERS, markdown

from .page import IMAGES, PAGE

STORED = PAGE.parent / "verification" / NUMBERS
PICTURE = IMAGES / FIGURE
TITLE = "## Mesh refinement"
ABOUT = """\
No closed form knows a fingertip, so the meshes of every resolution are compared with a finer one: strain
energy density (SED) at the receptor under the shifted bar and at the population's receptors under spheres,
and the firing rates, fit and hit rates that follow with the same afferent, noise and random numbers. Coarse,
standard and fine differ by one factor in every direction. `fingerpad refine` presses all of it and writes
these tables; these come from code {code_hash}. What follows for the choice of a mesh:
[three sizes of mesh](decisions/mesh-sizes.md).
"""
CAPTION = "SED at the receptor and its firing rates against the shift of the bar, on every mesh"


def stored_results() -> dict[str, Any]:
    """Numbers of the run that is kept."""
    return json.loads(STORED.read_text(encoding="utf-8"))


def section() -> str:
    """Markdown of the whole section."""
    results = stored_results()
    picture = f"![{CAPTION}](images/{FIGURE})\n\n*{CAPTION}.*"
    return "\n".join(
        [TITLE, "", ABOUT.format(code_hash=results["code_hash"]), picture, "", markdown(results)]
    )
