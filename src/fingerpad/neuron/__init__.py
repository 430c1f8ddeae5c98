"""Transduction, membrane, noise, spikes, afferents, populations and their response maps."""
