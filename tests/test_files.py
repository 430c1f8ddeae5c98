"""A file is whole or absent, and what was there before survives every failure."""

import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from fingerpad.core.errors import StoreError
from fingerpad.core.files import write_atomically


def test_content_arrives_byte_by_byte_and_nothing_else_is_left(tmp_path):
    for content in (bytes(range(256)) * 100, b"second"):
        write_atomically(tmp_path / "a" / "b.bin", content)
        assert (tmp_path / "a" / "b.bin").read_bytes() == content
        assert os.listdir(tmp_path / "a") == ["b.bin"]
    with pytest.raises(StoreError, match="note cannot be written"):
        write_atomically(tmp_path / "a" / "b.bin" / "note", b"text")


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_a_failure_keeps_the_old_file_and_no_other(tmp_path, monkeypatch, failure, step):
    write_atomically(tmp_path / "note", b"old")

    def fail(*_):
        raise failure

    monkeypatch.setattr(os, step, fail)
    with pytest.raises(StoreError if isinstance(failure, OSError) else KeyboardInterrupt):
        write_atomically(tmp_path / "note", b"new")
    assert os.listdir(tmp_path) == ["note"]
    assert (tmp_path / "note").read_bytes() == b"old"


def test_bytes_are_on_the_disk_before_they_take_the_name(tmp_path, monkeypatch):
    steps = []
    fsync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda descriptor: (steps.append("fsync"), fsync(descriptor)))
    monkeypatch.setattr(os, "replace", lambda *paths: (steps.append("replace"), replace(*paths)))
    write_atomically(tmp_path / "note", b"text")
    assert steps[:2] == ["fsync", "replace"]


def test_many_writers_of_one_name_leave_one_whole_file(tmp_path):
    contents = [bytes([letter]) * 50_000 for letter in b"abcdefgh"]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda content: write_atomically(tmp_path / "note", content), contents))
    assert (tmp_path / "note").read_bytes() in contents
    assert os.listdir(tmp_path) == ["note"]
