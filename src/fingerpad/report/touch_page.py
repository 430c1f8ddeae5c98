"""The page of a described touch: what it did in a few numbers, and its picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from matplotlib.figure import Figure

from fingerpad.experiments.descriptions.pressed import TouchFile
from fingerpad.report.formatting import number
from fingerpad.report.manifest import edition, facts_table, manifest_chapter
from fingerpad.report.page import write_html
from fingerpad.report.parts import Chapter, Drawing, Page

PAGE = "touch.html"


def write_touch_page(result: TouchFile, draw: Callable[[], Figure], folder: Path) -> Path:
    caption = (
        "Left: the middle plane of the finger at the end of the touch. Right: depth "
        "over time, and the spikes of the afferents that fire."
    )
    numbers = asdict(result.summary).items()
    facts = {"number of times" if name == "times" else name: value for name, value in numbers}
    page = Page(
        result.touch.title,
        f"A finite-element fingertip and a population of afferents. {edition(result.manifest)}",
        touch_summary(result),
        [
            Chapter(
                "Results", [Drawing("touch", "The touch", draw, caption, 1), facts_table("In numbers", facts)]
            ),
            manifest_chapter(result.manifest),
        ],
    )
    return write_html(page, Path(folder) / PAGE)


def touch_summary(result: TouchFile) -> list[str]:
    found = result.summary
    return [
        f"The largest force is {number(found.largest_force_mn)} mN, the largest depth "
        f"{number(found.largest_depth_mm)} mm, the largest contact {number(found.largest_contact_mm2)} mm².",
        f"{found.firing} of {found.afferents} afferents fire, at up to {number(found.dynamic_rate_hz)} "
        f"spikes/s in the dynamic window and {number(found.static_rate_hz)} spikes/s in the static window.",
    ]
