"""Fit any function of a few parameters; nothing here knows a model. A method fits a `Problem`."""
