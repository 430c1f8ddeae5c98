"""Sweeps: one touch, of which some fields vary, over thousands of settings."""
