"""The pages name only files, headings, objects and commands that exist."""

import ast
import pkgutil
import re
from pathlib import Path

import pytest

from benchmarks.__main__ import BENCHMARKS
from fingerpad.cli import FINGERPAD, GENERAL, Program, parser_of
from studies.__main__ import PROGRAM

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "benchmarks" / "README.md"])
CURRENT = [page for page in PAGES if page.name != "CHANGELOG.md"]
"""Pages about the code as it is; the change log also names what is gone."""


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


def anchors(page: Path) -> set[str]:
    """The fragments of a page: its anchors, and those that GitHub gives to its headings."""
    text = page.read_text(encoding="utf-8")
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    named = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    return named | set(re.findall(r'<a id="([^"]+)">', text))


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_relative_links_lead_to_a_file_and_a_heading(page: Path) -> None:
    lost = []
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        file, _, fragment = link.partition("#")
        target = page.parent / file if file else page
        if "://" in link:
            continue
        if not target.exists() or (fragment and fragment not in anchors(target)):
            lost.append(link)
    assert lost == []


@pytest.mark.parametrize("page", CURRENT, ids=named)
def test_dotted_names_can_be_imported(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    lost = []
    for name in sorted(set(re.findall(r"`((?:fingerpad|studies|benchmarks)(?:\.\w+)+)[`(]", text))):
        try:
            pkgutil.resolve_name(name)
        except (ImportError, AttributeError):
            lost.append(name)
    assert lost == []


def commands(program: Program) -> dict[str, set[str]]:
    """The options of every command of a program."""
    return {
        name: {option for each in parser_of(program, name)._actions for option in each.option_strings}
        for name in program.commands
    }


PROGRAMS = {
    "fingerpad": commands(FINGERPAD),
    "python -m fingerpad": commands(FINGERPAD),
    "python -m studies": commands(PROGRAM),
    "python -m benchmarks": {name: set() for name in BENCHMARKS},
}


@pytest.mark.parametrize("page", CURRENT, ids=named)
def test_commands_and_their_options_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    shown = re.findall(r"`([^`\n]+)`", text)
    for block in re.findall(r"^```(?:text|sh|bash|console)?\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        shown += block.splitlines()
    lost = []
    for line in shown:
        for program, known in PROGRAMS.items():
            called = re.match(rf"(?:\$ )?{program} (\w[\w-]*)(.*)", line)
            if called is None:
                continue
            options = set(re.findall(r"(?<!\S)--[\w-]+", called[2].split("#")[0]))
            if called[1] not in known or not options <= known[called[1]] | {*GENERAL}:
                lost.append(line)
    assert lost == []


def test_options_and_keywords_that_an_error_names_exist() -> None:
    """Texts of errors name only options of the command line, and keywords that a function takes."""
    trees = {path: ast.parse(path.read_text("utf-8")) for path in (ROOT / "src").rglob("*.py")}
    nodes = [(path, node) for path, tree in trees.items() for node in ast.walk(tree)]
    keywords = {node.arg for _, node in nodes if isinstance(node, ast.arg)}
    keywords |= {
        node.target.id
        for _, node in nodes
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)
    }
    options = {*GENERAL, "--help"}.union(*commands(FINGERPAD).values())
    lost, seen = set(), 0

    def is_of_an_error(node: ast.AST) -> bool:
        """Whether it raises, or names a part of what is raised next."""
        names = [getattr(target, "id", "") for target in getattr(node, "targets", ())]
        return isinstance(node, ast.Raise) or bool({*names} & {"wanted", "got", "must", "said", "remedy"})

    for path, node in nodes:
        for part in ast.walk(node) if is_of_an_error(node) else ():
            if isinstance(part, ast.Constant) and isinstance(part.value, str):
                named_options = set(re.findall(r"(?<!\S)--[a-z][\w-]+", part.value))
                named_keywords = set(re.findall(r"(?<![\w.])([a-z_]+)=(?!=)", part.value))
                seen += len(named_options | named_keywords)
                lost |= {
                    (path.name, name) for name in (named_options - options) | (named_keywords - keywords)
                }
    assert lost == set()
    assert seen >= 37


def test_every_page_of_a_decision_has_its_row() -> None:
    text = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
    rows = set(re.findall(r'<a id="([^"]+)"></a>\[[^\]]+\]\(decisions/\1\.md\)', text))
    assert rows == {page.stem for page in (ROOT / "docs" / "decisions").glob("*.md")}


def test_the_sources_name_pages_and_anchors_that_exist() -> None:
    lost = []
    for source in sorted((ROOT / "src").rglob("*.py")):
        for page, fragment in re.findall(r"(docs/[\w/-]+\.md)(?:#([\w-]+))?", source.read_text("utf-8")):
            if not (ROOT / page).exists() or (fragment and fragment not in anchors(ROOT / page)):
                lost.append((source.name, page, fragment))
    assert lost == []
