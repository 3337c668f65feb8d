# Everything runs in .venv, made from requirements.lock; uv is used where it is present, else venv and pip.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
LOCK := requirements.lock
BIN := $(VENV)/bin
OUT ?= out/cost_vs_accuracy
JOBS ?= 0
STAMP := $(VENV)/.installed
# numba looks at the file of a kernel alone to see whether its machine code is old, and not at what it calls.
KERNELS := $(wildcard layoutopt/*_kernels.py layoutopt/*/*_kernels.py objectives/*_kernels.py solvers/*/*_kernels.py)
COMPILED := $(VENV)/.compiled
PEERS := .venv-peers
PEERS_STAMP := $(PEERS)/.installed
SOLVER_PEERS := .venv-solver-peers
SOLVER_PEERS_STAMP := $(SOLVER_PEERS)/.installed
SEARCH_PEERS := .venv-search-peers
SEARCH_PEERS_STAMP := $(SEARCH_PEERS)/.installed
DOCS := .venv-docs
DOCS_STAMP := $(DOCS)/.installed
ROUNDS ?= 15
export MPLBACKEND := Agg

.PHONY: study quick test test-all tests tests-oldest tests-latest lint types format dist environment benchmark \
    benchmark-peers benchmark-solver-peers benchmark-search-peers pictures docs clean

study: environment
	$(BIN)/layoutopt study cost_vs_accuracy --out $(OUT) --jobs $(JOBS) --resume

quick: environment
	$(BIN)/layoutopt study cost_vs_accuracy --quick --out $(OUT)_quick --jobs $(JOBS) --resume

test: lint types tests

# A file's tests stay in one process, so that what they share is made once.
tests: environment
	$(BIN)/python -m pytest -n 2 --dist loadfile -m "not long"

# The lower bounds of pyproject.toml, each taken at its word.
tests-oldest:
	$(MAKE) VENV=.venv-oldest LOCK=requirements-oldest.lock tests

# The newest of everything: what will break for users before we move our lock.
tests-latest:
	$(MAKE) VENV=.venv-latest LOCK=requirements-latest.txt tests

test-all: environment lint types
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: environment
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports

types: environment
	$(BIN)/mypy

format: environment
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

benchmark: environment
	$(BIN)/python benchmarks/mcl_peers.py --without-peers $(ROUNDS)
	$(BIN)/python benchmarks/scaling.py $(ROUNDS)
	$(BIN)/python benchmarks/geometry.py $(ROUNDS)
	$(BIN)/python benchmarks/sweeps.py $(ROUNDS)
	$(BIN)/python benchmarks/tracking.py $(ROUNDS)
	$(BIN)/python benchmarks/racing.py
	$(BIN)/python benchmarks/covering.py --without-peers

# The peers need an older numpy than we do, hence an environment of their own.
benchmark-peers: environment $(PEERS_STAMP)
	$(BIN)/python benchmarks/mcl_peers.py --python $(PEERS)/bin/python $(ROUNDS)

# Solvers of covering problems, with geopandas and its kin, which nothing else here needs.
benchmark-solver-peers: environment $(SOLVER_PEERS_STAMP)
	$(BIN)/python benchmarks/covering.py --python $(SOLVER_PEERS)/bin/python

# Searches by trials, with pymoo and optuna, which nothing else here needs.
benchmark-search-peers: environment $(SEARCH_PEERS_STAMP)
	$(BIN)/python benchmarks/search_peers.py --python $(SEARCH_PEERS)/bin/python

pictures: environment
	$(BIN)/python docs/make_pictures.py

# An old build/ would leave its files in the wheel.
dist: environment
	rm -rf build dist
	$(BIN)/python -c "from setuptools import build_meta as backend; backend.build_sdist('dist'); backend.build_wheel('dist')"

# The site, with the project installed into an environment of its own, beside Sphinx.
docs: environment $(DOCS_STAMP)
	$(DOCS)/bin/python -m sphinx -W --keep-going -q docs out/docs

environment: $(STAMP) $(COMPILED)

$(STAMP): $(LOCK) pyproject.toml
	@if command -v uv >/dev/null 2>&1; then \
	    test -x $(BIN)/python || uv venv --quiet --python 3.11 $(VENV); \
	    uv pip install --quiet --python $(BIN)/python -r $(LOCK) && \
	    uv pip install --quiet --python $(BIN)/python --no-deps --no-build-isolation -e .; \
	else \
	    test -x $(BIN)/python || $(PYTHON) -m venv $(VENV); \
	    $(BIN)/python -m pip install --quiet --disable-pip-version-check -r $(LOCK) && \
	    $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .; \
	fi
	@touch $(STAMP)

$(COMPILED): $(STAMP) $(KERNELS)
	rm -f $(foreach kernel,$(KERNELS),$(dir $(kernel))__pycache__/*.nbi $(dir $(kernel))__pycache__/*.nbc)
	$(BIN)/python -c "import matplotlib.font_manager; from studies.compiled import compile_all; compile_all()"
	@touch $(COMPILED)

$(PEERS_STAMP): benchmarks/requirements-peers.txt
$(SOLVER_PEERS_STAMP): benchmarks/requirements-solver-peers.txt
$(SEARCH_PEERS_STAMP): benchmarks/requirements-search-peers.txt
$(PEERS_STAMP) $(SOLVER_PEERS_STAMP) $(SEARCH_PEERS_STAMP):
	@if command -v uv >/dev/null 2>&1; then \
	    test -x $(@D)/bin/python || uv venv --quiet --python 3.11 $(@D); \
	    uv pip install --quiet --python $(@D)/bin/python -r $<; \
	else \
	    test -x $(@D)/bin/python || $(PYTHON) -m venv $(@D); \
	    $(@D)/bin/python -m pip install --quiet --disable-pip-version-check -r $<; \
	fi
	@touch $@

$(DOCS_STAMP): docs/requirements.txt requirements.lock pyproject.toml
	@if command -v uv >/dev/null 2>&1; then \
	    test -x $(@D)/bin/python || uv venv --quiet --python 3.11 $(@D); \
	    uv pip install --quiet --python $(@D)/bin/python -r $< && \
	    uv pip install --quiet --python $(@D)/bin/python --no-deps --no-build-isolation -e .; \
	else \
	    test -x $(@D)/bin/python || $(PYTHON) -m venv $(@D); \
	    $(@D)/bin/python -m pip install --quiet --disable-pip-version-check -r $< && \
	    $(@D)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .; \
	fi
	@touch $@

clean:
	rm -rf $(VENV) .venv-oldest .venv-latest $(PEERS) $(SOLVER_PEERS) $(SEARCH_PEERS) $(DOCS) docs/auto_examples docs/generated
	rm -rf out build dist .mypy_cache .ruff_cache .pytest_cache
