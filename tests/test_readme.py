"""What the pages of the repository show is run, linked and named as it is."""

import re
from pathlib import Path

import pytest
import typer

from fingerpad.cli import app
from fingerpad.cli.reproduce import EXPECTED_TIME

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
BLOCKS = [
    pytest.param(block, id=f"{page.relative_to(ROOT)}-{number}")
    for page in PAGES
    for number, block in enumerate(
        re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    )
]


@pytest.mark.parametrize("block", BLOCKS)
def test_python_on_a_page_runs_and_prints(block: str, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(block, "page", "exec"), {})
    assert capsys.readouterr().out


def test_the_readme_shows_python() -> None:
    assert README.count("```python\n") == 2


def test_pictures_are_light() -> None:
    assert [image.name for image in (ROOT / "docs").rglob("*.png") if image.stat().st_size > 300_000] == []


def test_the_table_of_options_is_that_of_the_command() -> None:
    command = typer.main.get_command(app).commands["reproduce"]  # type: ignore[attr-defined]
    options = {name: parameter.default for parameter in command.params for name in parameter.opts}
    options.pop("--help", None)
    table = dict(re.findall(r"^\| `(--\w+)` \| ([^|]+?) \|", README, re.MULTILINE))
    assert set(table) == set(options)
    assert table["--jobs"] == "one per core"
    assert table["--extended"] == "not at `quick`"
    for name in set(table) - {"--jobs", "--extended"}:
        assert table[name] == f"`{options[name]}`"


def test_times_are_those_the_command_expects() -> None:
    for resolution, duration in EXPECTED_TIME.items():
        assert f"`{resolution}` ({duration})" in README
    assert README.count(EXPECTED_TIME["standard"]) == 2


def test_every_module_has_its_place_in_the_readme() -> None:
    package = ROOT / "src" / "fingerpad"
    present = {path.name for path in package.glob("*.py") if not path.name.startswith("__")}
    present |= {f"{path.parent.name}/" for path in package.glob("*/__init__.py")}
    listing = README.split("## Where things are")[1].split("## Licence")[0]
    named = set(re.findall(r"\b(\w+(?:\.py|/))(?=[\s`])", listing))
    assert named == present


@pytest.mark.parametrize(
    "source", sorted((ROOT / "src").rglob("*.py")), ids=lambda path: str(path.relative_to(ROOT / "src"))
)
def test_source_names_pages_that_exist(source: Path) -> None:
    named = re.findall(r"docs/[\w/-]+\.md", source.read_text(encoding="utf-8"))
    assert [page for page in named if not (ROOT / page).exists()] == []
