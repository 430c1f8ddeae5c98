"""One job in a process of its own: `python -m benchmarks.job MODULE FUNCTION ARGUMENTS`, answered by JSON."""

import importlib
import json
import sys


def answer(module: str, function: str, arguments: str) -> str:
    """Call a function of a module of `benchmarks` with arguments given as JSON.

    Parameters
    ----------
    module, function : str
        Names; the function returns a dict fit for JSON.
    arguments : str
        JSON object of its arguments.

    Returns
    -------
    str
        JSON of what it returned, on one line.

    Examples
    --------
    >>> answer("measuring", "doubled", '{"number": 21}')
    '{"doubled": 42}'
    """
    return json.dumps(
        getattr(importlib.import_module(f"benchmarks.{module}"), function)(**json.loads(arguments))
    )


if __name__ == "__main__":
    print(answer(*sys.argv[1:]))
