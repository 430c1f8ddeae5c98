"""How fast and how large fingerpad runs: scripts that measure, print a table and write JSON; none is a test.

`python -m benchmarks sphere peers` runs two of them and writes their sections of README.md anew.
"""
