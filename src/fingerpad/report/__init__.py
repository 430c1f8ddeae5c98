"""Finished results drawn as figures and one page; a figure never computes."""

from fingerpad.report.page import write_report

__all__ = ["write_report"]
