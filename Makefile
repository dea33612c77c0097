# One page of habits. `make demo` and `make test` are all a fresh machine needs.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready
SHOWN  := src tests tools benchmarks examples
FAST   := $(addprefix tests/,diagnostics golden propagation records scattering scenario sonar)
unexport PYTHONDONTWRITEBYTECODE  # pytest would rewrite the assertions of 500 files anew in each process: 15 s

.PHONY: help setup demo test check format-check lint types contract shape words fast bench validate format clean clean-venv

help:  ## list what can be made
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: $(READY)  ## create the virtual environment and install everything at its pinned version

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "insonify needs Python 3.11 or later; '$(PYTHON)' is $$($(PYTHON) --version 2>&1)." >&2; \
	  echo "Name another one: make PYTHON=python3.12 ..." >&2; exit 1; }
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV)
	@echo "installing into $(VENV) (once; about a minute)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@$(BIN)/python -m compileall -q src  # a command would compile 400 files at each start where Python may not write
	@touch $@

demo: $(READY)  ## simulate the nominal scene and draw it
	@mkdir -p demo
	@$(BIN)/insonify run examples/nominal.yaml -o demo/nominal.zarr --overwrite
	@$(BIN)/insonify show demo/nominal.zarr -o demo/nominal.png
	@echo "recording: $(CURDIR)/demo/nominal.zarr"
	@echo "picture:   $(CURDIR)/demo/nominal.png"
	@echo "next:      source $(VENV)/bin/activate; insonify new harbour"

test: $(READY)  ## run every test but slow statistics and further cases (12 minutes on two cores, with compilation)
	$(BIN)/python -m pytest -n 2 --dist worksteal

check: format-check lint types contract shape words fast  ## static checks, goldens and a third of the tests (at most 90 seconds)

format-check: $(READY)
	$(BIN)/ruff format --check $(wildcard $(SHOWN))

lint: $(READY)
	$(BIN)/ruff check $(wildcard $(SHOWN))

types: $(READY)
	$(BIN)/mypy

contract: $(READY)
	$(BIN)/lint-imports --no-logo

shape: $(READY)
	$(BIN)/python tools/shape.py

words: $(READY)  ## list where words of the code are not those of the glossary
	$(BIN)/python tools/words.py

fast: $(READY)
	$(BIN)/python -m pytest -q -n 2 --dist worksteal -m 'not validate and not slow' $(FAST)

bench: $(READY)  ## measure speed on this machine, append it to the ledger and compare
	$(BIN)/python benchmarks/run.py

validate: $(READY)  ## statistics over many draws, and further cases of claims (long)
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "validate or hypothesis" --hypothesis-profile many

format: $(READY)  ## put the code into its one format
	$(BIN)/ruff format $(wildcard $(SHOWN))
	$(BIN)/ruff check --fix $(wildcard $(SHOWN))

clean:  ## remove what was made, caches included, but not the environment
	rm -rf demo build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find $(wildcard $(SHOWN)) -name __pycache__ -type d -prune -exec rm -rf {} +

clean-venv:
	rm -rf $(VENV)
