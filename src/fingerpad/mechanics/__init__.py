"""Finite-strain mechanics of layered, nearly incompressible, viscoelastic tissue in contact.

Read in the order of the computation: `laws` and `materials`, `element` (one brick), `assembly` (all of them),
`contact` (the rigid indenter), `linear` (the solver behind a Newton step), `newton` (one equilibrium),
`steps` (lengths of the time steps) and `press` (the whole ramp and hold). `fields` computes stress and strain
of chosen elements over time, `balance` the energy balance, and `mixed` treats pressure as an unknown of its
own for nearly incompressible tissue.
"""
