"""Evidence for the mechanics: cases with known answers, run by pytest and shown on docs/verification.md.

A case is a function that returns rows: a quantity, what mathematics expects, what fingerpad got, and how far
apart they may be. `python -m tests.verification` runs all of them and writes the page.
"""
