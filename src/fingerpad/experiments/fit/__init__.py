"""Fit an afferent to recordings."""
