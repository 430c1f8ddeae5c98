"""Finished results drawn as figures and pages; a figure never computes."""
