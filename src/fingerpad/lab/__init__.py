"""A laboratory in the browser: objects pressed by hand, answered by reduced touches."""

from fingerpad.lab.answer import compared
from fingerpad.lab.laboratory import Laboratory
from fingerpad.lab.state import LabState

__all__ = ["LabState", "Laboratory", "compared"]
