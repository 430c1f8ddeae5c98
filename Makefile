# make reproduce     run the studies of the paper      (ARGS="..." goes to `fingerpad reproduce`)
# make test          check style, types, imports, behaviour and the wheel; stops at the first failure
# make checks        only style, types and imports
# make pages         only the examples and links of README and docs
# make wheel         build the wheel, install it into an empty environment and run the README's ten lines there
# make results       reproduce at standard resolution, and write the numbers and the picture of README and docs
# make verification  run every verification case, slow ones too, and write docs/verification.md
# make benchmarks    run benchmarks, some by ARGS="sphere growth", and write benchmarks/README.md (no part of the tests)
# make clean         remove what these have made, the environment included
#
# All make their own environment in .venv; PYTHON names the interpreter it is made with.

PYTHON ?= python3
ARGS ?=
# One file per process: the tests of a file may share one long run. The longest come first (tests/conftest.py).
PYTEST_ARGS ?= -n 2 --dist loadfile --no-loadscope-reorder
# Tests of all that README and docs show.
PAGES := tests/test_readme.py

bin := .venv/bin
# Modules are compiled when they are first imported: most of an environment never is.
install := $(bin)/python -m pip install --quiet --disable-pip-version-check --no-compile --editable
# Nothing but the environment's own packages may answer an import.
export PYTHONNOUSERSITE := 1
unexport PYTHONPATH

.PHONY: reproduce test checks pages wheel results verification benchmarks clean
.DEFAULT_GOAL := test

reproduce: .venv/installed
	$(bin)/fingerpad reproduce $(ARGS)

# Each of the first three keeps about one core busy; the pages compile the kernels for the tests that follow.
test: .venv/installed-for-tests
	$(MAKE) --jobs 2 wheel checks pages
	$(bin)/pytest $(PYTEST_ARGS) --ignore $(PAGES)

checks: .venv/installed-for-tests
	$(bin)/ruff check
	$(bin)/ruff format --check
	$(bin)/mypy
	$(bin)/lint-imports

pages: .venv/installed-for-tests
	$(bin)/pytest $(PAGES)

wheel: .venv/installed-for-tests
	$(bin)/python -m tests.installed_wheel

results: .venv/installed
	$(bin)/fingerpad reproduce --extended $(ARGS)
	$(bin)/python -m studies methods --resolution standard --out reproduction
	$(bin)/python -m studies drives --resolution standard --out reproduction
	$(bin)/python -m studies results reproduction/results.json --methods reproduction/methods.json \
		--drives reproduction/drives.json

verification: .venv/installed-for-tests
	$(bin)/python -m tests.verification $(ARGS)

benchmarks: .venv/installed-for-tests
	$(bin)/python -m benchmarks $(ARGS)

.venv/installed: pyproject.toml | $(bin)/python
	$(install) .
	touch $@

.venv/installed-for-tests: pyproject.toml | $(bin)/python
	$(install) ".[test]"
	touch $@ .venv/installed

$(bin)/python:
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "fingerpad needs Python 3.11 or newer: PYTHON=$(PYTHON) is $$("$(PYTHON)" --version 2>&1 | head -n 1)." \
	         "Name another one, for example: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	"$(PYTHON)" -m venv .venv

clean:
	rm -rf .venv build dist reproduction .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find src tests benchmarks studies -name __pycache__ -type d -prune -exec rm -rf {} +
