"""One file per claim of the paper, what is pressed and what is read from it; `reproduction` runs all."""

from fingerpad.experiments.gerling2014.reproduction import Reproduction, reproduce

__all__ = ["Reproduction", "reproduce"]
