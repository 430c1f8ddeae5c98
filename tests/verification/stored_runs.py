"""Last section of the page: the standard meshes compared with finer ones, from a stored run.

The run takes more than an hour and is not repeated for the page. `python -m studies mesh-refinement` solves
every mesh. Its numbers are kept beside the page with the hash of the code that made them.
"""

from __future__ import annotations

from fingerpad.core.results import from_json
from studies.mesh_refinement import MeshRefinement, blocks

from .page import PAGE

NUMBERS = PAGE.parent / "verification" / "mesh_refinement.json"


def results() -> MeshRefinement:
    """Results of the stored run, as its study returned them."""
    return from_json(MeshRefinement, NUMBERS.read_bytes())


def closing() -> str:
    """Markdown of the section."""
    (name, content), *_ = blocks(results()).items()
    return f"## Mesh refinement\n\n<!-- begin {name} -->\n{content}\n<!-- end {name} -->\n"
