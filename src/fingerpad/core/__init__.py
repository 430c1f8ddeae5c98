"""Units, errors, checks, files, threads, keyed random numbers and shared types; independent of the finger."""
