"""The pinned packages of the development keep to the ranges of pyproject.toml, and each has its hashes."""

import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PINS = re.findall(
    r"^(\S+)==(\S+)[^\n]*\\\n((?:    --hash=sha256:[0-9a-f]{64}[ \\]*\n)+)",
    (ROOT / "requirements-dev.txt").read_text(encoding="utf-8"),
    re.MULTILINE,
)
NEEDED = [
    Requirement(text)
    for text in (*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["test"])
    if not text.startswith("fingerpad[")
]


def test_every_package_is_pinned_with_hashes_within_the_ranges():
    lines = (ROOT / "requirements-dev.txt").read_text(encoding="utf-8").splitlines()
    assert len(PINS) == sum("==" in line and not line.lstrip().startswith("#") for line in lines) > 100
    for needed in NEEDED:
        name = canonicalize_name(needed.name)
        versions = [version for pinned, version, _ in PINS if canonicalize_name(pinned) == name]
        assert versions, needed
        assert all(needed.specifier.contains(version) for version in versions), "make lock"
