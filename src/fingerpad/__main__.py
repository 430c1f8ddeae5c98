"""Entry of the command line: ready for Ctrl-C before the rest of the package is loaded."""

from __future__ import annotations

import os
import signal


def _stopped(number: int, frame: object) -> None:
    """End at once: nothing has begun."""
    os.write(2, b"fingerpad: stopped. Run the same command again.\n")
    os._exit(128 + number)


def main() -> None:
    """Run the command line `fingerpad`."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _stopped)
    from fingerpad.cli import main as run

    run()


if __name__ == "__main__":
    main()
