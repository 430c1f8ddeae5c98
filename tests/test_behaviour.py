"""The hash of the mechanical sources changes with what they compute and with nothing else."""

import ast
import re
from pathlib import Path

import pytest

import fingerpad
from fingerpad.core.errors import StoreError
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Sphere
from fingerpad.skin import behaviour
from fingerpad.skin.behaviour import MECHANICAL_SOURCES, behaviour_of, code_hash
from fingerpad.skin.code_tags import class_tag
from fingerpad.skin.indentation import touch_of
from fingerpad.skin.store import touch_key

PACKAGE = Path(fingerpad.__file__).parent


def mechanical_files():
    return [
        path
        for name in MECHANICAL_SOURCES
        for path in (
            [PACKAGE / name] if (PACKAGE / name).is_file() else sorted((PACKAGE / name).glob("*.py"))
        )
    ]


SOURCES = {f"{path.parent.name}/{path.name}": path.read_text(encoding="utf-8") for path in mechanical_files()}
MODULES = frozenset(
    f"fingerpad.{path.parent.name}.{path.stem}" for path in PACKAGE.glob("*/*.py") if path.stem != "__init__"
)


def code(sources=SOURCES, modules=MODULES):
    return behaviour_of(list(sources.values()), modules).code


BEFORE = code()


def changed(name, old, new):
    assert len(re.findall(old, SOURCES[name], re.MULTILINE)) >= 1, (name, old)
    return {**SOURCES, name: re.sub(old, new, SOURCES[name], count=1, flags=re.MULTILINE)}


def everywhere(old, new):
    texts = {name: re.sub(old, new, text) for name, text in SOURCES.items()}
    assert texts != SOURCES
    return texts


def without_docstrings(text):
    """The source written anew by Python: no comment, no formatting and, here, no docstring."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            kept = [
                item
                for item in body
                if not (isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant))
            ]
            node.body = kept or [ast.Pass()]
    return ast.unparse(tree)


def test_the_installed_sources_are_hashed():
    assert len(SOURCES) > 30
    assert code_hash() == BEFORE


def test_comments_docstrings_and_formatting_do_not_count():
    commented = {name: f"# A comment.\n{text}\n\n# Another." for name, text in SOURCES.items()}
    assert code(commented) == BEFORE
    spoken = everywhere(r'"""(\w)', r'"""In other words, \1')
    assert code(spoken) == BEFORE
    bare = {name: without_docstrings(text) for name, text in SOURCES.items()}
    assert sum(map(len, bare.values())) < 0.7 * sum(map(len, SOURCES.values()))
    assert code(bare) == BEFORE


def test_names_and_order_of_files_do_not_count():
    """A renamed module is imported by its new name, whether it or what it defines is imported."""
    assert code(dict(reversed(SOURCES.items()))) == BEFORE
    renamed = {
        name.replace("assembly", "gathering"): re.sub(r"\bassembly\b", "gathering", text)
        for name, text in SOURCES.items()
    }
    modules = frozenset(module.replace("assembly", "gathering") for module in MODULES)
    assert "from fingerpad.mechanics.gathering import" in "".join(renamed.values())
    assert code(renamed, modules) == BEFORE
    use = "from fingerpad.mechanics import assembly as a, laws\na.assemble(laws.Polynomial)"
    other = use.replace("assembly as a", "gathering").replace("a.assemble", "gathering.assemble")
    assert code({"m": use}) == code({"m": other}, modules) != code({"m": use.replace("a.assemble", "a.add")})


@pytest.mark.parametrize("name", ["Sphere", "Fingertip", "PressSettings", "Deformation", "Touch", "Tissues"])
def test_names_of_classes_do_not_count(name):
    assert code(everywhere(rf"\b{name}\b", f"{name}Anew")) == BEFORE


def test_annotations_and_messages_of_errors_do_not_count():
    assert code(everywhere(r"-> FloatArray", "-> np.ndarray")) == BEFORE
    assert code(changed("geometry/mesh_checks.py", "must be joined face to face", "touches no")) == BEFORE


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("mechanics/press_settings.py", r"^PENETRATION_SHARE = 0\.1", "PENETRATION_SHARE = 0.10000001"),
        ("mechanics/press_settings.py", "ramp_steps: int = 8", "ramp_steps: int = 9"),
        ("mechanics/fields.py", r"\*\* \(1\.0 / 3\.0\)", "** (1.0 / 3.1)"),
        ("mechanics/fields.py", r"mean = 0\.5 \*", "mean = 0.6 *"),
        ("geometry/fingertip.py", r"^SMOOTHING = 5e-7", "SMOOTHING = 6e-7"),
        ("geometry/paths.py", r"^CLEARANCE_TO_BONE = 0\.8", "CLEARANCE_TO_BONE = 0.9"),
        ("skin/fields.py", r"Times\.LAST,", "Times.ALL,"),
        ("core/units.py", r"1000\.0|1e3", "1001.0"),
    ],
)
def test_a_change_of_a_number_or_a_formula_counts(name, old, new):
    texts = changed(name, old, new)
    if ast.dump(ast.parse(texts[name])) == ast.dump(ast.parse(SOURCES[name])):
        pytest.fail(f"{old} of {name} stands in text only")
    assert code(texts) != BEFORE


def test_which_class_is_used_counts():
    one = "class A:\n    x = 1\nclass B:\n    x = 2\n"
    assert code({"m": one + "C = A"}) != code({"m": one + "C = B"})
    assert code({"m": one + "C = A"}) == code({"m": one.replace("A", "D") + "C = D"})


def test_which_function_is_imported_counts():
    one, other = (f"from fingerpad.mechanics.tensors import {name} as f\nf(1)" for name in ("invert", "push"))
    assert code({"m": one}) != code({"m": other})
    assert code({"m": one}) == code({"m": one.replace("as f", "as g").replace("f(1)", "g(1)")})


def test_the_key_of_an_indentation_does_not_depend_on_the_names_of_its_classes(monkeypatch):
    def key(name):
        body = type(name, (Sphere,), {"__module__": Sphere.__module__})
        return touch_key(touch_of(Fingertip(), body(curvature_per_m=287.0)))

    before, tag = key("Sphere"), class_tag(Sphere)
    tags = behaviour_of(list(everywhere(r"\bSphere\b", "Ball").values()), MODULES)
    assert tags.classes["Ball"] == tag
    monkeypatch.setattr(behaviour, "_installed", lambda: tags)
    assert key("Ball") == before
    assert key("Cylinder") != before


def test_what_a_value_shows_of_itself_does_not_count():
    assert code(changed("geometry/fingertip.py", "mm long, ", "mm in length, ")) == BEFORE


def test_every_class_has_a_tag_of_its_own():
    tags = behaviour_of(list(SOURCES.values()), MODULES).classes
    assert len(tags) > 50
    assert len(set(tags.values())) == len(tags)


def test_every_source_that_mechanics_imports_counts():
    """Apart from what cannot alter a number: checks, errors, other names, notices, results, inputs.

    Published values and meshes of files reach an indentation as its own fields, which are in the key already.
    """
    imported = {
        module
        for text in SOURCES.values()
        for module in re.findall(r"^\s*from fingerpad\.([\w.]+) import", text, re.MULTILINE)
    }
    counted = tuple(name.removesuffix(".py").replace("/", ".") for name in MECHANICAL_SOURCES)
    others = {module for module in imported if not module.startswith(counted)}
    harmless = {
        f"core.{name}"
        for name in (
            "checks",
            "compilation",
            "displayed",
            "errors",
            "files",
            "keywords",
            "logger",
            "phases",
            "progress",
            "tables",
            "values",
        )
    }
    harmless |= {"skin.sampling"}
    assert {module for module in others if not module.startswith("data")} <= harmless


def test_a_package_without_sources_is_refused(monkeypatch, tmp_path):
    for name in MECHANICAL_SOURCES:
        (tmp_path / name).mkdir(exist_ok=True, parents=True)
    monkeypatch.setattr(behaviour, "files", lambda _: tmp_path)
    with pytest.raises(StoreError, match=r"installed without its \.py files"):
        behaviour._installed.__wrapped__()
