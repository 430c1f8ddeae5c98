"""Last sections of the page: meshes held against finer ones, from stored runs.

The runs take an hour and more and are not repeated for the page: `fingerpad refine` presses everything, and
its numbers and figures are kept beside the page with the hash of the code that made them.
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
No closed form knows a fingertip, so the meshes of every resolution are compared with a finer one: strain
energy density (SED) at the receptor under the shifted bar and at the population's receptors under spheres,
and the firing rates, fit and hit rates that follow with the same afferent, noise and random numbers. Coarse,
standard and fine differ by one factor in every direction. `fingerpad refine` presses all of it and writes
these tables; these come from code {code_hash}. What follows for the choice of a mesh:
[three sizes of mesh](decisions/mesh-sizes.md).
""",
    "SED at the receptor and its firing rates against the shift of the bar, on every mesh",
)

PAPER_SIZE = StoredRun(
    paper_size,
    "## Against the paper's size of mesh",
    """\
The same touches on quick, standard and a mesh of the paper's size: the skin under line and cylinder in three
trials, the bar at its edges, centre and beside it, four spheres at both positions. Meshes differ along the
skin only; standard and the paper's size have the same elements through it, so what those leave open is shown
by a mesh with twice as many through the deep layers. `fingerpad refine --against paper` presses all of it and
writes these tables; these come from code {code_hash}. What the preset is, and what follows:
[the paper's size of mesh](decisions/paper-size.md).
""",
    "Deflection, SED under the bar and hit rates on every mesh, and by how much the deflections differ",
)


def closing() -> str:
    """Markdown of the sections in their order."""
    return "\n\n".join(run.section().rstrip() for run in (REFINEMENT, PAPER_SIZE)) + "\n"
