"""One touch, from its description to strain energy density over time; stored responses."""
