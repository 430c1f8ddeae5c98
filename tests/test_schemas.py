"""Schemas of results and requests: those in the package are the ones that the types give."""

import json

import fastjsonschema
import pytest

from fingerpad.core.errors import StoreError
from fingerpad.experiments.schemas import all_formats, file_name, read, request_schema, schema
from tools.schemas import REQUESTS, RESULT_FILES, file_format, write_schemas


@pytest.mark.parametrize("results", RESULT_FILES)
def test_the_schema_in_the_package_is_the_one_that_the_types_give(results, tmp_path):
    write_schemas(tmp_path)
    name = file_format(results)[0]
    assert json.loads((tmp_path / file_name(name)).read_text(encoding="utf-8")) == schema(name)


def test_a_docstring_is_no_part_of_a_format(monkeypatch, tmp_path):
    monkeypatch.setattr(RESULT_FILES[0], "__doc__", "Rewritten in plain English.")
    test_the_schema_in_the_package_is_the_one_that_the_types_give(RESULT_FILES[0], tmp_path)
    assert "description" not in json.dumps(schema(file_format(RESULT_FILES[0])[0]))


def test_every_request_has_the_schema_in_the_package_that_its_fields_give(tmp_path):
    write_schemas(tmp_path)
    assert len(list(tmp_path.iterdir())) == len(RESULT_FILES) + len(REQUESTS)
    for name in REQUESTS:
        written = (tmp_path / f"fingerpad-{name}-request.schema.json").read_text(encoding="utf-8")
        assert json.loads(written) == request_schema(name)


@pytest.mark.parametrize("results", RESULT_FILES)
def test_a_schema_refuses_a_file_without_its_parts(results):
    name, version = file_format(results)
    check = fastjsonschema.compile(schema(name))
    with pytest.raises(fastjsonschema.JsonSchemaValueException, match="must contain"):
        check({"format": name, "format_version": version})


def test_a_file_of_results_of_any_format_is_read_if_none_is_named(tmp_path):
    assert sorted(all_formats()) == sorted(file_format(each)[0] for each in RESULT_FILES)
    path = tmp_path / "other.json"
    path.write_text('{"format": "shopping list", "format_version": 1}')
    with pytest.raises(StoreError, match=r"the format fingerpad discrimination, version \d or .*: got shop"):
        read(path)
