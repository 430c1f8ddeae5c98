"""Finite-strain mechanics of layered, nearly incompressible, viscoelastic tissue in contact.

Read in the order of the computation: `laws` and `materials`, `element` (one brick), `assembly` (all of them),
`contact` (the rigid indenter), `linear` (the solver behind a Newton step), `newton` (one equilibrium),
`steps` (how far to go at a time) and `press` (the whole ramp and hold). Beside them, `fields` tells what
elements feel on the way and `balance` where the work of the indenter went; `mixed` helps Newton's method
where volume hardly changes.
"""
