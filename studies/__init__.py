"""Research on the model itself: not installed; run with `python -m studies NAME`."""
