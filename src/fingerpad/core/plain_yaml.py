"""Reading YAML: plain values, numbers in any form, and an error for a duplicate key."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import yaml

from fingerpad.core.errors import InputError


def read_yaml(text: str, source: str) -> Any:
    """Plain values of a text in YAML.

    Parameters
    ----------
    text : str
        One document.
    source : str
        Name of the source, for errors.

    Returns
    -------
    mappings, lists, texts, numbers, booleans and None

    Raises
    ------
    InputError
        If the text is not YAML, or a mapping has a duplicate key.

    Examples
    --------
    Numbers such as 1e-6, without a point, are text in YAML 1.1. They are numbers here:

    >>> read_yaml("{gain: 1e-6, name: edge, off: [1, 2.5]}", "an example")
    {'gain': 1e-06, 'name': 'edge', 'off': [1, 2.5]}
    """
    try:
        return yaml.load(text, _Loader)  # a SafeLoader: plain values only
    except yaml.YAMLError as error:
        mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None) or str(error)
        said = " ".join(problem.split()).rstrip(".") + (f", line {mark.line + 1}" if mark else "")
        raise InputError(f"{source} cannot be read as YAML ({said}): correct it there.") from error
    except InputError as error:
        raise InputError(f"{source}, {error}") from error
    except RecursionError as error:
        raise InputError(f"{source} cannot be read as YAML (nested too deep): correct it there.") from error


def line_at(text: str, place: Sequence[int | str]) -> int | None:
    r"""Line at which a place of a text in YAML begins; that of the last part that is there.

    Parameters
    ----------
    text : str
        One document, which `read_yaml` can read.
    place : sequence of int or str
        Keys and indices that lead there.

    Examples
    --------
    >>> line_at("object:\n  kind: sphere\n  radius_mm: 3", ["object", "radius_mm"])
    3
    """
    node, line = yaml.compose(text, _Loader), None
    for part in place:
        if isinstance(node, yaml.MappingNode):
            found = [(key, value) for key, value in node.value if key.value == str(part)]
        elif isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
            found = [(node.value[part], node.value[part])]
        else:
            found = []
        if not found:
            break
        key, node = found[0]
        line = key.start_mark.line + 1
    return line


class _Loader(yaml.SafeLoader):
    """Raises an error for a duplicate key, of which YAML would keep the second."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [key.value for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise InputError(f"line {node.start_mark.line + 1}: {key} is repeated, keep one.")
        return super().construct_mapping(node, deep)


# A copy of the table of resolvers, because SafeLoader is shared by all code in this process.
_Loader.yaml_implicit_resolvers = {
    first: [
        (tag, form)
        for tag, form in resolvers
        # `on`, `off`, `yes` and `no` are words; only `true` and `false` are not.
        if tag != "tag:yaml.org,2002:bool" or first in "tTfF"
    ]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+$"),
    list("-+.0123456789"),
)
