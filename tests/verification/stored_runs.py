"""Last sections of the page: the standard meshes compared with finer ones, from stored runs.

The runs take more than an hour and are not repeated for the page. `python -m studies mesh-refinement` and
`python -m studies paper-size` solve every mesh. Their numbers and figures are kept beside the page with the
hash of the code that made them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fingerpad.core.results import from_json
from studies.pages.mesh_comparison import MeshComparison
from studies.pages.mesh_refinement import MESH_REFINEMENT
from studies.pages.paper_size import PAPER_SIZE

from .page import IMAGES, PAGE

STORED_RUNS = (MESH_REFINEMENT, PAPER_SIZE)


def numbers(run: MeshComparison) -> Path:
    """File of the numbers of a stored run."""
    return PAGE.parent / "verification" / f"{run.name}.json"


def picture(run: MeshComparison) -> Path:
    """File of the figure of a stored run."""
    return IMAGES / f"{run.name}.png"


def results(run: MeshComparison) -> Any:
    """Results of a stored run, as its study returned them."""
    return from_json(run.result, numbers(run).read_bytes())


def closing() -> str:
    """Markdown of the sections in their order."""
    return "\n\n".join(run.section(results(run)).rstrip() for run in STORED_RUNS) + "\n"
