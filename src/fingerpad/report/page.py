"""A page written as HTML that holds its figures."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Mapping
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from fingerpad.core.files import write_atomically
from fingerpad.report.parts import COLUMNS, Drawing, Page, Table
from fingerpad.report.style import png

VERDICTS = {"✓": "met", "✗": "missed", "?": "open"}  # How a cell is marked by the sign that it begins with.


def write_html(page: Page, path: Path) -> Path:
    """Write a page as one HTML file that holds its figures; they are also written beside it in `figures/`."""
    images = images_of(page)
    environment = Environment(
        loader=PackageLoader("fingerpad.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode("ascii")
    environment.filters |= {"inline": _inline, "code": _code}
    environment.filters["verdict"] = lambda cell: VERDICTS.get(cell.partition(" ")[0], "")
    environment.tests |= {"table": lambda part: isinstance(part, Table)}
    environment.tests |= {"drawing": lambda part: isinstance(part, Drawing)}
    content = environment.get_template("template.html").render(page=page, images=images, columns=COLUMNS)
    return write_beside(path, content, images, "figures")


def images_of(page: Page) -> dict[str, bytes]:
    return {name: png(draw) for drawing in page.drawings for name, draw in drawing.images.items()}


def write_beside(path: Path, content: str, images: Mapping[str, bytes], folder: str) -> Path:
    """Write a page, and before it its images into a folder beside it; each file whole or not at all."""
    path = Path(path)
    for name, image in images.items():
        write_atomically(path.parent / folder / f"{name}.png", image)
    write_atomically(path, content.encode())
    return path


def _inline(text: str) -> str:
    """Return a paragraph as HTML: escaped, with its links and code."""
    return re.sub(r"\[([^\]]+)\]\(([^)\s]+)\)", r'<a href="\2">\1</a>', _code(text))


def _code(text: str) -> str:
    """Return a text as HTML: escaped, with its code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))
