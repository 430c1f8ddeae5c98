"""Fingertip, indenters, motion, grading, mesh and its quality: shape and motion; nothing deforms."""
