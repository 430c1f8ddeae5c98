"""Predictions compared with observations that a user brings: force, deflection, and rates of an afferent."""
