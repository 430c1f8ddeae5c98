"""Tables and captions of the pages, made of a section of results as the rows of `pages.toml` say."""

from fingerpad.report import reproduction, results
from fingerpad.report.page import PAGES, ROWS
from fingerpad.report.tables import filled, filled_table

LOADED = reproduction, results  # They enter what draws the figures and makes the rows.


def table_of(page, title, section):
    (row,) = (row for row in PAGES[page]["parts"] if row.get("table", "").startswith(title))
    return filled_table(row, section, ROWS[row["made"]](section) if "made" in row else ())


def caption_of(page, name, section):
    (row,) = (row for row in PAGES[page]["parts"] if row.get("figure") == name)
    return filled(row["caption"], section)
