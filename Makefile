# make        set up .venv and regenerate the coarse book        make test   the whole test suite
# make lint   style, layers, workflow                            make book   the book at its own sizes
# make bench  speed, written into results/benchmarks.json        make soak   200 kills instead of 20
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
export NUMBA_NUM_THREADS ?= 1

CORES ?= $(shell nproc 2>/dev/null || sysctl -n hw.ncpu 2>/dev/null || echo 2)
JOBS  ?= 2
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	command -v $$p >/dev/null 2>&1 && $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN   := .venv/bin
READY := .venv/.ready
SNAKE  = $(BIN)/snakemake --cores $(CORES)

coarse: $(READY)
	$(SNAKE) --config size=coarse -- all
	$(SNAKE) --config size=coarse --report results/report.html -- all
	@echo; echo "scorecard  results/scorecard.html (also .md, .json)"; echo "report     results/report.html"

book: $(READY)
	$(SNAKE) --config size=book -- all
	$(SNAKE) --config size=book --report results/report.html -- all
	@echo; echo "scorecard  results/scorecard.html (also .md, .json)"; echo "report     results/report.html"

results/scorecard.json: $(READY) FORCE
	$(SNAKE) --config size=coarse -- $@

test: $(READY)
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile

soak: $(READY)
	FSIWORK_SOAK=200 $(BIN)/python -m pytest -n $(JOBS) tests/test_crash.py

# A peer that is not installed is left out, and its rows say so.
bench: $(READY)
	$(BIN)/python -m benchmarks -o results/benchmarks.json

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile rules
	$(BIN)/python -m pytest -q tests/test_workflow.py -k lint

rulegraph: $(READY)
	@$(BIN)/snakemake --quiet all --rulegraph mermaid-js -- all

verify: $(READY)
	$(BIN)/fsiwork verify

$(READY): requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "fsiwork needs Python 3.11 or newer; none was found on PATH (set PYTHON=...)"; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@$(BIN)/python -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "fsiwork needs Python 3.11 or newer; .venv has an older one: remove it and try again"; exit 1; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

# The lock serves Linux and macOS, x86 and ARM; it names no registry.
lock:
	uv pip compile pyproject.toml --extra test --extra build --universal --python-version 3.11 --generate-hashes \
		--no-header --no-annotate --no-emit-index-url --upgrade --quiet -o requirements.lock

FORCE:
.PHONY: coarse book test soak bench lint rulegraph verify lock FORCE

# The README's picture, from a scene that is shipped, and its table of what the book costs, from results.
pictures: $(READY)
	mkdir -p results/pictures
	$(BIN)/fsiwork run configs/scenes/elliptic_membrane.yaml --set bodies.0.coupling=stabilised --set clock.step=0.004 \
		-o results/pictures/membrane.nc
	$(BIN)/python -m fsiwork.figures.readme results/pictures/membrane.nc docs/membrane.png README.md
.PHONY: pictures
