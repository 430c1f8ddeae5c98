"""`python -m fingerpad`."""

from fingerpad.cli import main

if __name__ == "__main__":
    main()
