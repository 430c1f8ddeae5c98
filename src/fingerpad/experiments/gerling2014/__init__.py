"""The paper by level: what is pressed and read from it, its claims, and `reproduction`, which runs all."""

from fingerpad.experiments.gerling2014.reproduction import Reproduction, reproduce

__all__ = ["Reproduction", "reproduce"]
