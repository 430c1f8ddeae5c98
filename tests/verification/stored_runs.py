"""Last sections of the page: the standard meshes compared with finer ones, from stored runs.

The runs take more than an hour and are not repeated for the page. `python -m studies mesh-refinement`
indents every mesh. Its numbers and figures are kept beside the page with the hash of the code that made them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from studies.pages import mesh_refinement, paper_size

from .page import IMAGES, PAGE


@dataclass(frozen=True)
class StoredRun:
    """A run whose numbers and figure are kept, and the section that shows it.

    Parameters
    ----------
    report : module
        Of `fingerpad.report`: how numbers become a page, and the names of the files.
    title, about, caption : str
        Heading, story with a place for the hash of the code, and the picture in words.
    """

    report: ModuleType
    title: str
    about: str
    caption: str

    @property
    def numbers(self) -> Path:
        """File of the numbers."""
        return PAGE.parent / "verification" / self.report.NUMBERS

    @property
    def picture(self) -> Path:
        """File of the figure."""
        return IMAGES / self.report.FIGURE

    def results(self) -> dict[str, Any]:
        """Numbers of the run that is kept."""
        return json.loads(self.numbers.read_text(encoding="utf-8"))

    def section(self) -> str:
        """Markdown of the whole section."""
        results = self.results()
        about = self.about.format(code_hash=results["code_hash"])
        picture = f"![{self.caption}](images/{self.report.FIGURE})\n\n*{self.caption}.*"
        return "\n".join([self.title, "", about, picture, "", self.report.markdown(results)])


REFINEMENT = StoredRun(
    mesh_refinement,
    "## Mesh refinement",
    """\
There is no closed-form solution for a fingertip. The meshes of every resolution are therefore compared
with a finer one. Compared are the strain energy density (SED) at the receptor under the shifted bar and at
the receptors of the population under spheres, and the firing rates, goodness of fit and hit rates computed
from it. Afferent, noise and random numbers are the same on every mesh. The coarse, standard and fine
meshes differ by one factor in every direction. `python -m studies mesh-refinement` computes these tables;
the ones below come from code {code_hash}. Conclusions about the choice of a mesh are on [mesh
resolutions](decisions/mesh-resolutions.md).
""",
    "SED at the receptor and its firing rates against the shift of the bar, on every mesh",
)

PAPER_SIZE = StoredRun(
    paper_size,
    "## Comparison with the paper's mesh size",
    """\
The same indentations on the quick mesh, the standard mesh and a mesh of the paper's size: line and
cylinder with the materials of three trials, the bar at its edges, at its centre and beside it, four
spheres at both positions. The meshes differ along the skin only. The standard mesh and the mesh of the
paper's size have the same elements through the depth; a mesh with twice as many elements through dermis
and subcutis shows the remaining error. `python -m studies paper-size` computes these tables;
the ones below come from code {code_hash}. The preset and the conclusions are on [the mesh of the paper's
size](decisions/paper-size.md).
""",
    "Deflection, SED under the bar and hit rates on every mesh, and by how much the deflections differ",
)


def closing() -> str:
    """Markdown of the sections in their order."""
    return "\n\n".join(run.section().rstrip() for run in (REFINEMENT, PAPER_SIZE)) + "\n"
