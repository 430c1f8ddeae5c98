"""A laboratory in the browser: objects pressed by hand, answered by reduced touches."""

from fingerpad.lab.answer import LabState, compared
from fingerpad.lab.laboratory import Laboratory

__all__ = ["LabState", "Laboratory", "compared"]
