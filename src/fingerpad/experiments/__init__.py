"""Configurations to typed results: fit, discrimination tasks, and the protocol of Gerling et al. (2014)."""
