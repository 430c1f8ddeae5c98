"""Where the model meets data: recordings of an afferent, and how well parameters explain them."""
