"""Files that describe what is pressed and who responds: their parts, and the errors of reading them."""
