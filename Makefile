# Two commands are all: `make study` and `make test`. Each creates .venv and installs what it needs.
PYTHON ?= python3
CORES ?= 2
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed

.DEFAULT_GOAL := help
.PHONY: help study smoke test test-slow lint types format check-workflow clean

help: ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /\1\t/' | expand -t 18

$(INSTALLED): environment.txt pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "swesbi needs Python >= 3.11; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --requirement environment.txt
	touch $@

study: $(INSTALLED) ## the whole study: every figure and table, under results/
	$(BIN)/snakemake --cores $(CORES)

smoke: $(INSTALLED) ## a tiny study of the same shape, under results-smoke/
	$(BIN)/snakemake --cores $(CORES) --configfile tests/smoke.yaml

test: $(INSTALLED) ## the fast tests and a smoke study
	$(BIN)/python -m pytest -m "not slow"

test-slow: $(INSTALLED) ## the slow tests
	$(BIN)/python -m pytest -m slow

lint: $(INSTALLED) ## ruff and snakefmt
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow/rules

types: $(INSTALLED) ## mypy in strict mode
	$(BIN)/mypy

check-workflow: $(INSTALLED) ## Snakemake's lint and a dry run of the full study
	$(BIN)/python tests/check_lint.py
	$(BIN)/snakemake --dry-run --quiet --cores $(CORES)

format: $(INSTALLED) ## format the code in place
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow/rules

clean: ## remove the virtual environment and caches; results stay
	rm -rf $(VENV) .snakemake .pytest_cache .mypy_cache .ruff_cache src/*.egg-info
