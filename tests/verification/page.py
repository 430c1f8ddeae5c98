"""docs/verification.md from the rows of all cases."""

from __future__ import annotations

import re
from pathlib import Path

from .case import ABSOLUTE, AT_LEAST, AT_MOST, RELATIVE, Case, Row

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "verification.md"
IMAGES = ROOT / "docs" / "images"

INTRODUCTION = """\
# Verification of the mechanics

Cases with known solutions: the expected value, the value computed by fingerpad, and the tolerance.
`make verification` runs all of them and writes this page; the fast ones run in every `make test`. The cases
are in `tests/verification`, one module per theme. Closed forms are written there in NumPy, independently of
the package. Problems that are not indentations of a finger are solved by a small Newton's method around the
element of the package. Units are mm, ms, kPa, mN, µJ.
"""


def number(value: float) -> str:
    """Six digits where they matter, two where a size says enough.

    >>> number(0.437929411), number(4.2e-14), number(1234.5678)
    ('0.437929', '4.2e-14', '1234.57')
    """
    return f"{value:.1e}" if 0.0 < abs(value) < 1e-6 else f"{value:.6g}"


def expectation(row: Row) -> str:
    """What is expected, a bound with its sign."""
    sign = {AT_MOST: "≤ ", AT_LEAST: "≥ "}.get(row.judged, "")
    return sign + number(row.expected)


def allowance(row: Row) -> str:
    """Allowed difference.

    >>> from .case import near
    >>> allowance(near("force", 1.0, 1.0, relative=0.03))
    '3 %'
    """
    if row.judged == RELATIVE:
        return f"{100 * row.tolerance:g} %" if row.tolerance >= 1e-4 else f"{row.tolerance:g} of it"
    return number(row.tolerance) if row.judged == ABSOLUTE else "bound"


def difference(row: Row) -> str:
    """How far the number lies from the expected one; nothing for a bound."""
    if row.judged != RELATIVE or row.expected == 0.0:
        return ""
    relative = row.got / row.expected - 1
    return f"{100 * relative:+.2f} %" if abs(relative) >= 5e-5 else f"{relative:.0e}"


def case_text(case: Case) -> str:
    """Heading, description and table of one case."""
    lines = [f"### {case.title}", "", f"{case.about}", "", f"*Source: {case.source}.* `{case.name}`", ""]
    if case.slow:
        lines[4] += f", {case.runs}"
    lines += [
        "| quantity | unit | expected | got | difference | tolerance | verdict |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in case.rows:
        verdict = "holds" if row.passes else "**fails**"
        cells = (
            row.quantity,
            row.unit,
            expectation(row),
            number(row.got),
            difference(row),
            allowance(row),
            verdict,
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def page_text(cases: list[Case], pictures: dict[str, str], stamp: str, closing: str = "") -> str:
    """The whole page.

    Parameters
    ----------
    cases : list of Case
        In order.
    pictures : dict
        Markdown of the pictures of a theme.
    stamp : str
        Date and versions.
    closing : str
        Markdown of a last section, without cases.
    """
    rows = [row for case in cases for row in case.rows]
    held = sum(row.passes for row in rows)
    parts = [INTRODUCTION, f"**{held} of {len(rows)} numbers hold, in {len(cases)} cases.** {stamp}\n"]
    parts.append("| theme | cases | numbers | held |\n|---|---|---|---|")
    themes = list(dict.fromkeys(case.theme for case in cases))
    for theme in themes:
        own = [case for case in cases if case.theme == theme]
        numbers = [row for case in own for row in case.rows]
        link = re.sub("[^a-z0-9 -]", "", theme.lower()).replace(" ", "-")
        parts[-1] += (
            f"\n| [{theme}](#{link}) | {len(own)} | {len(numbers)} | {sum(r.passes for r in numbers)} |"
        )
    for theme in themes:
        parts.append(f"\n## {theme}\n")
        if theme in pictures:
            parts.append(pictures[theme] + "\n")
        parts += [case_text(case) + "\n" for case in cases if case.theme == theme]
    parts.append("\n" + closing)
    return "\n".join(parts).rstrip() + "\n"


def rows_shown(text: str) -> dict[str, list[list[str]]]:
    """Cells of the tables on a page, by the name of their case."""
    shown: dict[str, list[list[str]]] = {}
    name = ""
    for line in text.splitlines():
        if found := re.match(r"\*Source: .*\* `(\w+)`", line):
            name = found[1]
            shown[name] = []
        elif line.startswith("## "):
            name = ""  # tables of a section without cases are its own
        elif name and line.startswith("| ") and not line.startswith("| quantity"):
            shown[name].append([cell.strip() for cell in line.strip("|").split("|")])
    return shown
