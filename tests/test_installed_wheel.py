"""The check of the wheel: code taken from the README, measurements and report."""

import os
import sys

import pytest

from tests.installed_wheel import WheelError, largest, run, size_mb, ten_lines


def test_the_first_block_of_python_is_taken_and_a_readme_without_one_is_refused():
    assert ten_lines("```shell\npip\n```\n```python\na = 1\nb\n```\n```python\nc\n```\n") == "a = 1\nb\n"
    with pytest.raises(WheelError, match="block of Python"):
        ten_lines("nothing")


def test_sizes_are_those_of_the_files_and_links_are_not_followed(tmp_path):
    for name, size in (("small", 1_000), ("large", 250_000)):
        (tmp_path / name / "deep").mkdir(parents=True)
        (tmp_path / name / "deep" / "file").write_bytes(b"x" * size)
    assert size_mb(tmp_path) == pytest.approx(0.251)
    assert largest(tmp_path) == {"large": pytest.approx(0.25), "small": pytest.approx(0.001)}
    os.symlink(tmp_path / "large" / "deep" / "file", tmp_path / "small" / "link")
    assert size_mb(tmp_path) < 0.2511


def test_a_program_that_fails_is_reported_with_what_it_printed(tmp_path):
    assert run(sys.executable, "-c", "print(1)", folder=tmp_path) == "1\n"
    with pytest.raises(WheelError, match="no picture"):
        run(sys.executable, "-c", "raise SystemExit('no picture')", folder=tmp_path)
