# Three commands are all: `make demo`, `make study` and `make test`. Each creates .venv and installs what it needs.
PYTHON ?= python3
CORES ?= 2
TESTS ?= not slow and not exhaustive
OF ?= tests tools data
VENV := .venv
BIN := $(VENV)/bin
ANSWERS := $(VENV)/.answers
INSTALLED := $(VENV)/.installed
CHECKED := $(VENV)/.checked
PIP = $(BIN)/python -m pip install --quiet --disable-pip-version-check
COMPILE = uv pip compile --quiet --config-file tools/lock.toml
LOCKED = $(PIP) --no-deps --require-hashes
# workers side by side must not fight for threads; idle ones take over what others have not begun
PYTEST = OMP_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses $(CORES) --dist worksteal

# pip keeps a cache in the user's home, which a service's account may not have.
export XDG_CACHE_HOME ?= $(shell [ -w "$$HOME" ] && echo "$$HOME/.cache" || echo "$$PWD/.snakemake/cache")

# Programs of an environment name its folder, and run what lies there.
ifneq ($(filter-out help clean container,$(or $(MAKECMDGOALS),help)),)
ifneq ($(shell [ ! -e $(BIN)/swesbi ] || [ "$$(sed -n 's|.*[!"]\(/.*\)/bin/python.*|\1|p;2q' $(BIN)/swesbi)" -ef $(VENV) ] || echo yes),)
$(error $(VENV) was made for another folder: type `rm -r $(VENV) && make install`)
endif
endif

.DEFAULT_GOAL := help
.PHONY: help install demo mutants lock cluster study smoke report full verify container docs docs-site test test-slow test-exhaustive lint types check-workflow house reference format clean

help: # list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /\1\t/' | expand -t 20

# what answers a recording: neither torch nor Snakemake
$(ANSWERS): locks/infer.txt pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "swesbi needs Python >= 3.11; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(LOCKED) --requirement locks/infer.txt
	$(PIP) --no-deps --no-build-isolation --editable .
	@# a folder that is moved or copied with its environment imports its own code
	echo ../../../../src > "$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/0-swesbi.pth"
	touch $@

# torch has no hash: which wheel it is differs by index, and the one for CUDA brings libraries of its own
$(INSTALLED): $(ANSWERS) environment.txt
	$(PIP) --requirement environment.txt
	touch $@

$(CHECKED): $(INSTALLED) locks/checks.txt
	$(LOCKED) --requirement locks/checks.txt
	touch $@

install: $(INSTALLED) ## what the study needs, into .venv, and nothing else

lock: # renew the locks from pyproject.toml, with uv; pins that still fit stay, `uv pip compile --upgrade` changes them
	$(COMPILE) --generate-hashes --group build pyproject.toml --output-file locks/infer.txt
	echo '-e .[study]' | $(COMPILE) --constraint locks/infer.txt - --output-file environment.txt
	for group in checks cluster site; do \
		grep -v '^-e' environment.txt | $(COMPILE) --generate-hashes --group $$group --excludes locks/infer.txt --excludes /dev/stdin \
			--output-file locks/$$group.txt || exit; done

cluster: $(INSTALLED) # what a run on a cluster needs beside it
	$(LOCKED) --requirement locks/cluster.txt

demo: $(ANSWERS) ## a shipped recording inferred without a study, in ten seconds, into swesbi-demo/
	$(BIN)/swesbi demo

study: $(INSTALLED) ## the whole study: every figure and table, under results/
	$(BIN)/snakemake --cores $(CORES)

smoke: $(INSTALLED) ## a tiny study of the same shape, under results-smoke/
	$(BIN)/snakemake --cores $(CORES) --configfile tests/smoke.yaml

report: study # Snakemake's own report of the finished study: report.html in a zip, with all that it shows
	$(BIN)/snakemake --report results/report.zip

full: study ## the checks of calibration in large sizes, with the networks of the study, into results-full/ and docs/tables/
	$(BIN)/snakemake --cores $(CORES) --configfile config/overlays/full.yaml -- checks
	$(BIN)/python -m tools.model_version results-full/*/*.csv
	$(BIN)/python -m tools.docs --stored

verify: $(INSTALLED) ## numbers of README, tables of pages and versions of stored tables, beside settings, code and the study where it is finished
	$(BIN)/python -m tools.verify

container: # an image of the project, where podman or docker can build one
	$$(command -v podman || command -v docker || { echo "neither podman nor docker is here: install one of them" >&2; echo false; }) build --file Containerfile --tag swesbi .

docs: $(INSTALLED) ## tables and figures of README and docs/, from a finished study
	$(BIN)/python -m tools.docs
	$(BIN)/python -m tools.settings

docs-site: $(INSTALLED) locks/site.txt ## the pages with settings, commands and interface as a site to search, under build/docs-site/
	$(LOCKED) --requirement locks/site.txt
	$(BIN)/python -m tools.site

test: $(CHECKED) ## the fast tests
	$(PYTEST) -m "$(TESTS)" $(OF)

test-slow: smoke $(CHECKED) # the slow tests: what reads or reruns a smoke study, faults, statistics in larger sizes
	$(PYTEST) -m slow

test-exhaustive: smoke $(CHECKED) ## 20 kills, all of the fuzzing, whole studies on clusters and without network, mutations of the code
	$(PYTEST) -m exhaustive
	$(PYTEST) studies explorer

mutants: $(CHECKED) ## what the tests guard: one-line faults, each against its package's tests; fails where one lives that was killed
	$(BIN)/python tests/mutants.py

lint: $(CHECKED) ## ruff and snakefmt
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow/rules studies explorer

types: $(CHECKED) # mypy in strict mode
	$(BIN)/mypy

check-workflow: $(CHECKED) # Snakemake's lint and a dry run of the full study
	$(BIN)/python -m pytest tests/study/test_workflow_lint.py
	$(BIN)/snakemake --dry-run --quiet --cores $(CORES)

house: $(CHECKED) # what the layout of the code costs: its size, what an edit reruns, how long it takes to start
	$(BIN)/python benchmarks/house.py

reference: smoke # renew the stored tables: of the small study, and of the full one where it has finished
	$(BIN)/python tests/helpers/reference_tables.py results-smoke tests/reference/small_study
	if [ -e results/index.html ]; then \
		cp results/tables/ppc.csv tests/reference/study/ppc.csv; \
		for path in results/*/recovery.csv; do \
			cp $$path tests/reference/study/recovery-$$(basename $$(dirname $$path)).csv; done; fi

format: $(CHECKED) # format the code in place
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow/rules studies explorer

clean: ## remove the virtual environment, caches and the smoke study; results/ stays
	rm -rf $(VENV) results-smoke .snakemake .pytest_cache .mypy_cache .ruff_cache build src/*.egg-info
