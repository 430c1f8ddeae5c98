"""A laboratory in the browser: objects pressed by hand, answered by reduced touches."""
