"""Deformations and jobs in the formats of other programs: pictures in ParaView, decks of other solvers."""
