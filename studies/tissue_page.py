"""docs/tissues.md: every named set of tissues, layer by layer."""

from __future__ import annotations

from fingerpad.experiments.tissue_sets import tissue_layers
from fingerpad.report.parts import Chapter, Page
from fingerpad.report.reproduction import tissue_table
from studies.pages.markdown import markdown

INTRODUCTION = (
    "Every set that `tissues` of `fingerpad.indent` and of the commands accepts by name. A report of "
    "`fingerpad reproduce` has the same table. `python -m studies results` writes this page. Reasons are on "
    "[substitutes for the lost hyperelastic coefficients](decisions/lost-hyperelastic-coefficients.md) and "
    "[two sets: paper and human](decisions/paper-and-human.md). Status: *paper*, printed there; *read*, in "
    "later public material; *recalled*, not checked against the publication; *assumed*, our stand-in."
)


def tissue_page() -> str:
    """Return the page."""
    return markdown(Page("Tissues", INTRODUCTION, [], [Chapter("", [tissue_table(tissue_layers())])]))
