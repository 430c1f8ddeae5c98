"""Code, links and names on the pages of the repository are run and checked."""

import re
from pathlib import Path

import pytest

import fingerpad

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
GALLERY = sorted((ROOT / "docs" / "gallery").glob("*.py"))
BLOCKS = [
    pytest.param(block, id=f"{page.relative_to(ROOT)}-{number}")
    for page in PAGES
    for number, block in enumerate(
        re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    )
]


@pytest.mark.parametrize("block", BLOCKS)
def test_python_on_a_page_runs_and_prints(
    block: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "page", "exec"), {})
    assert capsys.readouterr().out
    for saved in re.findall(r'save_figure\("([^"]+)"', block):
        assert (tmp_path / saved).read_bytes().startswith(b"\x89PNG")


def test_the_readme_is_short_and_starts_with_a_picture_and_ten_lines() -> None:
    assert README.count("\n") <= 120
    picture, block = README.index("(docs/images/chain.png)"), README.index("```python\n")
    lines = README[block:].split("```")[1].splitlines()[1:]
    assert picture < block < README.index("## Two commands")
    assert len([line for line in lines if line]) <= 10
    assert "save_figure" in lines[-1]


def test_pictures_are_light() -> None:
    assert [image.name for image in (ROOT / "docs").rglob("*.png") if image.stat().st_size > 300_000] == []


def test_pages_import_nothing_below_the_package() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.ipynb")]
    below = re.compile(r"(?:from|import) fingerpad\.[\w.]+")
    found = {page.name: below.findall(page.read_text("utf-8")) for page in [*pages, *GALLERY]}
    assert {name: lines for name, lines in found.items() if lines} == {}
    assert len(fingerpad.__all__) <= 90
