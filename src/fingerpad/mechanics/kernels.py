"""Compiled functions that the press of a finger calls, for messages about their compilation."""

from __future__ import annotations

from fingerpad.mechanics import assembly, balance, columns, fields, multigrid, viscoelastic

KERNELS = (
    assembly._add_chunk, assembly._find_positions, balance._relaxed_work, columns.colours,
    columns.factor_columns, columns.find_blocks, columns.find_scales, columns.multiply,
    columns.residual_after_forward, columns.round_matrix, columns.sweep, columns.take_blocks,
    fields._isochoric_work, fields._mean_fields, multigrid._add_prolonged,
    multigrid._hold, multigrid._restrict, viscoelastic._carry, viscoelastic._relax, viscoelastic._states,
    viscoelastic._stored_energy,
)  # fmt: skip
"""All of them, the one that takes longest to compile first."""
