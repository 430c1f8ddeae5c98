"""Reading YAML: plain values only, within limits, and an error for a duplicate key.

A value is a mapping, a list, a text, a decimal number, true, false or null. A date, a number with colons,
underscores or another base is text, as is a word such as `on`. Tags, anchors and aliases are refused: ten
lines of them can write a list of a billion entries.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import yaml

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError

LARGEST_TEXT = 300_000
"""Characters of a document, which are read in some seconds; longer tables belong in CSV."""

DEEPEST = 20  # Mappings and lists inside each other.


@checked
def read_yaml(text: str, source: str) -> Any:
    """Plain values of one document in YAML; errors name the source.

    Numbers such as 1e-6, without a point, are text in YAML 1.1. They are numbers here:

    >>> read_yaml("{gain: 1e-6, name: edge, off: [1, 2.5]}", "an example")
    {'gain': 1e-06, 'name': 'edge', 'off': [1, 2.5]}
    """
    if len(text) > LARGEST_TEXT:
        most = f"must have at most {LARGEST_TEXT:,} characters of YAML"
        raise InputError(source, most, f"{len(text):,}", "write long tables as CSV")
    try:
        return yaml.load(text, _Loader)  # a SafeLoader: plain values only
    except yaml.YAMLError as error:
        mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None) or str(error)
        said = " ".join(problem.split()).rstrip(".") + (f", line {mark.line + 1}" if mark else "")
        raise InputError(f"{source} cannot be read as YAML ({said}): correct it there.") from error
    except InputError as error:
        raise InputError(f"{source}, {error}") from error


def line_at(text: str, place: Sequence[int | str]) -> int | None:
    r"""Line at which a place of a text in YAML begins; that of the last part that is there."""
    try:
        node, line = yaml.compose(text, _Loader), None
    except (yaml.YAMLError, InputError):  # not what `read_yaml` read
        return None
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
    """Raises an error for what YAML would read silently: a duplicate key, an alias, a tag."""

    depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.peek_event()
        said = ""
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            said = "it has an anchor or an alias, & or *, in the place of a value"
        elif event.tag is not None:
            said = f"it has the tag {event.tag}, with !"
        elif self.depth == DEEPEST:
            said = f"it is nested deeper than {DEEPEST} levels"
        if said:
            raise yaml.composer.ComposerError(None, None, said, event.start_mark)
        self.depth += 1
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                problem = "a key must be a word, not a list or a mapping"
                raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
            if key.value in seen:
                raise InputError(f"line {key.start_mark.line + 1}: {key.value} is repeated, keep one.")
            seen.add(key.value)
        return super().construct_mapping(node, deep)

    def number(self, node: yaml.ScalarNode) -> int | float:
        """Value of a number in decimal digits."""
        text = self.construct_scalar(node)
        return float(text) if set(text) & set(".eE") or len(text) > _MOST_DIGITS else int(text)


_MOST_DIGITS = 30
"""Digits of a whole number, beyond which it is a float, which overflows to infinity and is refused."""

# A table of its own, because that of SafeLoader is shared by all code in this process.
_Loader.yaml_implicit_resolvers = {}
_Loader.add_constructor("tag:yaml.org,2002:float", _Loader.number)
for kind, form, first in (
    ("bool", "true|True|TRUE|false|False|FALSE", "tTfF"),
    ("null", "~|null|Null|NULL|", ("~", "n", "N", "")),
    ("float", r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?", "-+.0123456789"),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{kind}", re.compile(f"^({form})$"), list(first))
