"""Pages of the studies that compare meshes: of their command, and as a section of the verification page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from matplotlib.figure import Figure

from fingerpad.report.formatting import fixed
from fingerpad.report.parts import Chapter, Drawing, Page, Part
from studies.mesh_errors import MeshErrors
from studies.pages.markdown import markdown_blocks, share

ERROR_COLUMNS = (
    "SED, ramp: max", "RMS", "SED, hold: max", "RMS",
    "dynamic rate: max [spikes/s]", "RMS", "static rate: max [spikes/s]", "RMS",
)  # fmt: skip
PHASES, RATES = ("ramp", "hold"), ("dynamic", "static")


@dataclass(frozen=True)
class MeshComparison:
    """How the result of a comparison of meshes is shown.

    Parameters
    ----------
    name : str
        Of its figure, and of its numbers where they are kept.
    result : type
        The `result_class` of the study; it has a `code_hash`.
    title, about, caption : str
        Heading, introduction with a place for `code_hash`, and what the figure shows.
    draw : callable
        Makes the figure of a result.
    parts : callable
        Makes the tables of a result and the sentences that introduce them.
    """

    name: str
    result: type
    title: str
    about: str
    caption: str
    draw: Callable[[Any], Figure]
    parts: Callable[[Any], list[Part]]

    def page(self, results: Any) -> Page:
        """Return the page of the study's command."""
        return Page(self.title, self._about(results), [], [Chapter("", self._content(results))])

    def section(self, results: Any) -> str:
        """Return a section of a page that is put together elsewhere, as Markdown."""
        heading = f"## {self.title}"
        blocks = [heading, self._about(results), *markdown_blocks(Chapter("", self._content(results)))]
        return "\n\n".join(block for block in blocks if block) + "\n"

    def _about(self, results: Any) -> str:
        return self.about.format(code_hash=results.code_hash)

    def _content(self, results: Any) -> list[Part]:
        figure = Drawing(self.name, self.caption, partial(self.draw, results), f"*{self.caption}.*")
        return [figure, *self.parts(results)]


def error_cells(errors: MeshErrors) -> Sequence[str]:
    """Return the cells of `ERROR_COLUMNS`."""
    sed, rate = errors.sed, errors.rate_hz
    return [
        *(share(value) for phase in PHASES for value in (sed[phase].max, sed[phase].rms)),
        *(fixed(value, 1) for name in RATES for value in (rate[name].max, rate[name].rms)),
    ]
