# make reproduce     run the studies of the paper      (ARGS="..." goes to `fingerpad reproduce`)
# make test          check style, types, imports, behaviour and the wheel; starts nothing after the first failure
# make test-fast     only tests that press no body and start no program: at most two minutes, for daily work
# make checks        only style, types and imports
# make pages         only the examples and links of README and docs
# make kernels       only the example of the README, which compiles all kernels
# make site          build the site into build/site: all pages, the gallery, which is run, and the reference
# make wheel         build the wheel, install it into an empty environment and run the README's ten lines there
# make release       build wheel and sdist twice, compare and check them; publish nothing
# make results       reproduce at standard resolution, and write the numbers and the picture of README and docs
# make verification  run every verification case, slow ones too, and write docs/verification.md
# make benchmarks    run benchmarks, some by ARGS="sphere growth", and write benchmarks/README.md (no part of the tests)
# make perturbed     press with other roundings, twenty times; perturbed-7 is one of them (no part of the tests)
# make fuzz          random odd inputs for an hour; SEED=... repeats a run, FUZZ=... sets its length
# make lock          pin every package of the development, with hashes, in requirements-dev.txt
# make audit         ask for known vulnerabilities of what is pinned there
# make sbom          write what the package needs at run time, build/sbom.json (CycloneDX)
# make clean         remove what these have made, the environment included
#
# All make their own environment in .venv; PYTHON names the interpreter it is made with.

PYTHON ?= python3
ARGS ?=
# One file per process: the tests of a file may share one long run. The longest come first (tests/conftest.py).
PYTEST_ARGS ?= -n 2 --dist loadfile --no-loadscope-reorder
# Tests that press bodies.
PRESSES := $(addprefix tests/test_,$(addsuffix .py,mechanics_balance mechanics_contact mechanics_friction mechanics_linear \
	mechanics_middles mechanics_mixed mechanics_newton mechanics_press small_bodies skin_contact force_control))
# Tests of all that README and docs show.
PAGES := tests/test_readme.py

bin := .venv/bin
# Modules are compiled when they are first imported: most of an environment never is.
install := $(bin)/python -m pip install --quiet --disable-pip-version-check --no-compile --editable
# Nothing but the environment's own packages may answer an import.
export PYTHONNOUSERSITE := 1
unexport PYTHONPATH
# Compiled modules are kept: otherwise each of the hundred processes of a run compiles them again, in 3 s.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: reproduce test pytest test-fast checks pages kernels site wheel release results verification benchmarks perturbed fuzz lock audit sbom clean
.DEFAULT_GOAL := test

reproduce: .venv/installed
	$(bin)/fingerpad reproduce $(ARGS)

# What waits for packages or for one long example leaves a core to the others.
test: .venv/installed-for-tests
	$(MAKE) --jobs 3 checks pytest wheel site release

# Kernels are compiled before two processes need them at once.
pytest: checks kernels
	$(bin)/pytest $(PYTEST_ARGS)

test-fast: .venv/installed-for-tests
	$(bin)/pytest $(PYTEST_ARGS) -m "not slow" tests

checks: .venv/installed-for-tests
	$(bin)/ruff check
	$(bin)/ruff format --check
	$(bin)/mypy
	$(bin)/lint-imports

pages: .venv/installed-for-tests
	$(bin)/pytest $(PAGES)

kernels: .venv/installed-for-tests
	$(bin)/pytest --quiet $(PAGES) -k README.md

site: kernels
	$(bin)/python -m sphinx --quiet --fail-on-warning --keep-going -b html -c docs/site . build/site

wheel: .venv/installed-for-tests
	$(bin)/python -m tests.installed_wheel

release: .venv/installed-for-tests
	$(bin)/python -m tests.release

results: .venv/installed
	$(bin)/fingerpad reproduce $(ARGS)
	$(bin)/python -m studies results reproduction/results.json

verification: .venv/installed-for-tests
	$(bin)/python -m tests.verification $(ARGS)

benchmarks: .venv/installed-for-tests
	$(bin)/python -m benchmarks $(ARGS)

# No test may hang on the last bits: other moduli by 1e-9 or less, numbers of threads, and kernels of OpenBLAS.
perturbed:
	$(MAKE) --keep-going $(addprefix perturbed-,$(shell seq 20))

perturbed-%: .venv/installed-for-tests
	PERTURBED=$* NUMBA_NUM_THREADS=$$(($* % 2 + 1)) \
		OPENBLAS_CORETYPE=$$(set -- Prescott Nehalem Haswell; shift $$(($* % 3)); echo $$1) \
		$(bin)/pytest --quiet $(PYTEST_ARGS) $(PRESSES)

SEED ?= $(shell date +%s)
FUZZ ?= 100
fuzz: .venv/installed-for-tests
	@echo "seed $(SEED)"
	FUZZ=$(FUZZ) $(bin)/pytest tests/test_fuzz.py --hypothesis-profile=search --hypothesis-seed=$(SEED)

# These tools have their own environment, so that they are no part of what they look at.
pins := .venv/tools/bin/uv pip compile --quiet --universal --generate-hashes --custom-compile-command "make lock" pyproject.toml
lock: .venv/tools
	$(pins) --extra test --output-file requirements-dev.txt

audit: .venv/tools
	.venv/tools/bin/pip-audit --require-hashes --disable-pip --requirement requirements-dev.txt

sbom: .venv/tools
	mkdir -p build
	$(pins) --output-file build/requirements.txt
	.venv/tools/bin/cyclonedx-py requirements --pyproject pyproject.toml --mc-type library --output-reproducible \
		--output-file build/sbom.json build/requirements.txt

.venv/tools: | $(bin)/python
	$(bin)/python -m venv $@
	$@/bin/pip install --quiet "uv>=0.9,<1" "pip-audit>=2.9,<3" "cyclonedx-bom>=7,<8"

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
	rm -rf .venv build dist reproduction docs/examples docs/reference .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find src tests benchmarks studies -name __pycache__ -type d -prune -exec rm -rf {} +
