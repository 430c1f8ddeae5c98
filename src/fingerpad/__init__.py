"""fingerpad: from a touch on the skin to spikes to a percept."""

__version__ = "0.1.0"
