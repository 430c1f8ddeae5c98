"""JSON schema of a description for editors: every key with its explanation."""

from __future__ import annotations

import ast
import inspect
import textwrap
from itertools import pairwise
from typing import Any

from docstring_parser import DocstringStyle, parse
from pydantic import BaseModel

from fingerpad.core.checked import other_names
from fingerpad.core.units import unit_of
from fingerpad.core.values import JsonSchema
from fingerpad.experiments.requests.parts import UNKNOWN_MODEL, Made, Part, parts_in
from fingerpad.experiments.requests.stimulus import MEASURED, RAMP_AND_HOLD


def explained_schema(kind: type[Part]) -> JsonSchema:
    """JSON schema of a description as it is written, with the explanations beside its fields."""
    made = {"$schema": "https://json-schema.org/draft/2020-12/schema"} | kind.model_json_schema()
    definitions = made.get("$defs", {})
    for name in [name for name in definitions if name.startswith(UNKNOWN_MODEL)]:
        del definitions[name]
    for part in _parts_of(kind):
        schema = made if part is kind else definitions.get(part.__name__)
        told: dict[str, str] = {}
        for home in reversed(part.__mro__):
            if issubclass(home, Part):
                own = _of_parameters(home) | _written_beside(home)
                # "As of" another class leaves the explanation to that class.
                told |= {
                    key: text for key, text in own.items() if not (text.startswith("As of") and key in told)
                }
        if issubclass(part, Made) and part is not Made:
            told |= _of_other_names(part.makes) | _of_parameters(part.makes)
            told["kind"] = (part.makes.__doc__ or "").strip().partition("\n")[0]
        properties = (schema or {}).get("properties", {})
        for name, value in properties.items():
            if name in told:
                value.setdefault("description", told[name])
        if properties.get("kind", {}).get("const", MEASURED) not in (MEASURED, RAMP_AND_HOLD):
            schema["required"] = [*schema.get("required", ()), "kind"]
    return _tidied(made)


def _of_parameters(kind: Any) -> dict[str, str]:
    """Explanation of each parameter in a docstring."""
    told = parse(kind.__doc__ or "", DocstringStyle.NUMPYDOC).params
    return {
        name.strip(): " ".join((each.description or "").split())
        for each in told
        for name in each.arg_name.split(",")
    }


def _of_other_names(kind: Any) -> dict[str, str]:
    others = other_names(kind) if isinstance(kind, type) else {}
    return {name: f"Another name of {other.meaning}. [{unit_of(name)}]" for name, other in others.items()}


def _written_beside(part: type[Part]) -> dict[str, str]:
    """Texts that stand below the fields of a part; none for a part that a function makes."""
    try:
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(part))).body
    except (OSError, TypeError):
        return {}
    told = {}
    for field, text in pairwise(getattr(body, "body", [])):
        if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
            told[ast.unparse(field.target)] = " ".join(ast.literal_eval(text.value).split())
    return told


def _parts_of(
    kind: type[BaseModel], found: dict[type[BaseModel], None] | None = None
) -> list[type[BaseModel]]:
    """List a part and all parts in it, each once."""
    found = {} if found is None else found
    if kind not in found:
        found[kind] = None
        for field in kind.model_fields.values():
            for part in parts_in(field.annotation):
                _parts_of(part, found)
    return list(found)


def _tidied(schema: Any) -> Any:
    """Return a schema without titles, null as a value to write, and the form that only serves errors."""
    if isinstance(schema, list):
        unknown = f"#/$defs/{UNKNOWN_MODEL}"
        said = [item for item in schema if not (isinstance(item, dict) and unknown in item.get("$ref", ""))]
        return [_tidied(item) for item in said]
    if not isinstance(schema, dict):
        return schema
    kept = {
        {"oneOf": "anyOf"}.get(key, key): {name: _tidied(item) for name, item in value.items()}
        if key in ("properties", "$defs")
        else _tidied(value)
        for key, value in schema.items()
        if key not in ("title", "discriminator") and (key, value) != ("default", None)
    }
    options = [option for option in kept.get("anyOf", ()) if option != {"type": "null"}]
    if len(options) == 1:
        kept.pop("anyOf")
        return options[0] | kept
    return kept | {"anyOf": options} if options else kept
