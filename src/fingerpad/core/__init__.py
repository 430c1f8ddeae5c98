"""Units, errors, checks, files, threads, keyed random numbers and hand-over types; knows no finger."""
