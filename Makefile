# A clone needs Python >= 3.11 (with venv), make and a C compiler; everything else is installed, pinned, into .venv.

PYTHON  ?= python3
VENV    ?= .venv
OUT     ?= runs/first
WORKERS ?= 2
MINUTES ?= 10
SEED    ?= 0

BIN   := $(VENV)/bin
PIP   := $(BIN)/python -m pip --disable-pip-version-check --no-input
# --no-compile: byte code is made when a module is first used, which keeps the core environment below 400 MB.
ADD   := $(PIP) install --quiet --no-deps --no-compile
CODE  := src tests benchmarks examples

# Compiled kernels stay in the clone (one folder for each state of the sources, see src/swarmscope/_jit.py).
export SWARMSCOPE_CACHE = $(CURDIR)/.numba_cache

# Without byte code every process that imports PyTorch or scikit-learn compiles them from source: half a minute.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help run test check fuzz storm golden bench setup setup-dev clean

help: ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-10s %s\n", $$1, $$2}' $(firstword $(MAKEFILE_LIST))

run: setup ## set up and let 15 robots cross the forest (results in runs/first)
	$(BIN)/swarmscope run --task T1 --planner nav-scope --robots 15 --seed 0 --out $(OUT)

test: $(VENV)/.package ## set up, check and run all tests
	@echo "compiling what is not compiled yet: minutes after a change, seconds after that"
	@$(BIN)/python tests/warm.py planners & planners=$$!; \
	{ $(MAKE) --no-print-directory setup-dev && $(BIN)/python tests/warm.py world && \
	  $(MAKE) --no-print-directory check; } || { kill $$planners; exit 1; }; \
	wait $$planners
	$(BIN)/python -m pytest -rs -n $(WORKERS) $(PYTEST_ARGS)

check: setup-dev ## linter, strict types, import contract
	$(BIN)/ruff check $(wildcard $(CODE))
	$(BIN)/mypy
	$(BIN)/lint-imports

fuzz: setup-dev ## run the property tests with new examples for MINUTES=10, until one fails
	$(BIN)/python tests/fuzz.py --minutes $(MINUTES)

storm: setup-dev ## look for contacts in random hostile runs for MINUTES=10; STORM_ARGS=--covered leaves known gaps out
	$(BIN)/swarmscope storm --minutes $(MINUTES) --seed $(SEED) --workers $(WORKERS) $(STORM_ARGS)

golden: setup-dev ## write the golden file of all planners' runs anew
	$(BIN)/python tests/golden_runs.py --renew

bench: setup-dev ## measure speed against floors and peers
	$(BIN)/python benchmarks/run_all.py

setup: $(VENV)/.package ## install the package and its pinned core set only

setup-dev: $(VENV)/.dev ## install what tests and checks need, too

clean: ## remove the environment, caches and results
	rm -rf $(VENV) runs build dist .numba_cache .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -not -path './.git/*' -prune -exec rm -rf {} +
	rm -rf src/*.egg-info

# Each stamp is touched only after its step succeeded, so an interrupted step is done again.
$(VENV)/.python:
	@command -v $(PYTHON) >/dev/null || { echo "'$(PYTHON)' was not found: install Python 3.11 or newer, or say make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.version_info >= (3, 11) or sys.exit("swarmscope needs Python 3.11 or newer; $(PYTHON) is " + sys.version.split()[0] + ". Say which to use: make PYTHON=python3.12")'
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "$(PYTHON) has no venv module: install it (Debian, Ubuntu: apt-get install python3-venv)" >&2; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	@touch $@

$(VENV)/.core: requirements/core.lock $(VENV)/.python
	$(ADD) -r requirements/core.lock
	@touch $@

$(VENV)/.package: pyproject.toml $(VENV)/.core
	$(ADD) --no-build-isolation -e .
	$(PIP) check
	@touch $@

$(VENV)/.dev: requirements/dev.lock $(VENV)/.package
	$(ADD) -r requirements/dev.lock
	$(PIP) check
	@touch $@
