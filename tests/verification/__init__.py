"""Verification of the mechanics: cases with known solutions, run by pytest, shown on docs/verification.md.

A case is a function that returns rows: a quantity, the expected value, the computed value and the
tolerance. `python -m tests.verification` runs all of them and writes the page.
"""
