"""`python -m tools.schemas`: rewrite the JSON schemas of files of results and of requests in the package.

The schema of a request has every key with its explanation, for editors and for the help of commands.
"""

from __future__ import annotations

import ast
import inspect
import io
import json
import textwrap
import tokenize
from pathlib import Path
from typing import Any, get_args

from docstring_parser import DocstringStyle, parse
from pydantic import BaseModel, TypeAdapter

from fingerpad.core.checked import other_names
from fingerpad.core.files import write_atomically
from fingerpad.core.units import unit_of
from fingerpad.core.values import JsonSchema
from fingerpad.experiments import schemas
from fingerpad.experiments.discrimination.analysis import DiscriminationFile
from fingerpad.experiments.fit.request import ChosenNumbersFile, FitFile
from fingerpad.experiments.gerling2014.reproduction import ReproductionResult
from fingerpad.experiments.requests.parts import Made, OneOfKinds, Part
from fingerpad.experiments.requests.stimulus import MEASURED, RAMP_AND_HOLD
from fingerpad.experiments.requests.touch import TouchFile
from fingerpad.experiments.run import REQUESTS
from fingerpad.experiments.scan import ScanFile
from fingerpad.experiments.validation.validation import ValidationFile

RESULT_FILES: tuple[type, ...] = (
    ReproductionResult,
    FitFile,
    ChosenNumbersFile,
    DiscriminationFile,
    ValidationFile,
    TouchFile,
    ScanFile,
)
"""Classes of results that are written to a file of their own."""


def write_schemas(folder: Path = Path(schemas.__file__).parent) -> None:
    """Write the schemas into a folder, that of the package by default."""
    for results in RESULT_FILES:
        content = json.dumps(structure(schema_of(results)), indent=1).encode()
        write_atomically(folder / schemas.file_name(file_format(results)[0]), content)
    for name, request in REQUESTS.items():
        content = json.dumps(explained_schema(request), indent=1).encode()
        write_atomically(folder / f"fingerpad-{name}-request.schema.json", content)


def schema_of(results: type) -> JsonSchema:
    """Return the JSON schema of a class of results, as a file holds it."""
    declared = TypeAdapter(results).json_schema(mode="serialization")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema"} | declared


def file_format(results: Any) -> tuple[str, int]:
    """Return format and version of a class of results that are a file: literals, each with a default."""
    declared = results.__dataclass_fields__
    return declared["format"].default, declared["format_version"].default


def structure(schema: Any) -> Any:
    """Return a schema without titles and descriptions: a docstring is no part of a format."""
    if isinstance(schema, list):
        return [structure(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    named = ("properties", "$defs")
    return {
        # A text may be a name, and how an object of Python is shown: two forms that are one here.
        {"oneOf": "anyOf"}.get(key, key): (
            {name: structure(item) for name, item in value.items()} if key in named else structure(value)
        )
        for key, value in schema.items()
        if key not in ("title", "description")
    }


def explained_schema(kind: type[Part]) -> JsonSchema:
    """JSON schema of a description as it is written, with the explanations beside its fields."""
    made = {"$schema": "https://json-schema.org/draft/2020-12/schema"} | kind.model_json_schema()
    definitions = made.get("$defs", {})
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
    """Texts below the fields of a part, and comments behind them; none for a part that a function makes.

    A comment holds for the fields on the lines above as well that have none.
    """
    try:
        source = textwrap.dedent(inspect.getsource(part))
    except (OSError, TypeError):
        return {}
    comments = {
        token.start[0]: token.string.lstrip("#: ")
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT and not token.string.startswith(("# type:", "# fmt:"))
    }
    told: dict[str, str] = {}
    said, above = "", None
    for node in reversed(ast.parse(source).body[0].body):  # type: ignore[attr-defined]
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            said, above = " ".join(str(node.value.value).split()), node.lineno - 1
        elif isinstance(node, ast.AnnAssign):
            own = comments.get(node.end_lineno or 0)
            said = own or (said if above == node.end_lineno else "")
            above = node.lineno - 1
            if said:
                told[ast.unparse(node.target)] = said
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


def parts_in(annotation: Any) -> list[type[BaseModel]]:
    """Parts that an annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if isinstance(annotation, OneOfKinds):
        return [annotation.part(kind) for kind in annotation.makers]
    return [found for inner in get_args(annotation) for found in parts_in(inner)]


def _tidied(schema: Any) -> Any:
    """Return a schema without titles and null as a value to write."""
    if isinstance(schema, list):
        return [_tidied(item) for item in schema]
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


if __name__ == "__main__":
    write_schemas()
