# Everything a developer does here. Needs Python 3.11 or later and make; the rest is installed into .venv, as locked.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
UV ?= uv
PYTEST_FLAGS ?=

BIN := .venv/bin
DEMO := .venv/.demo-installed
INSTALLED := .venv/.installed

# One BLAS thread a process: the two test processes already fill two cores.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1

# Bytecode is kept, whatever the host's environment says: to compile our tests takes a test process 20 s.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help venv demo page prove test test-slow test-proof test-all bench lint docs format lock clean

help: ## say what there is
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/  make \1\t\2/' | expand -t 20

venv: $(INSTALLED) ## install the locked versions into .venv; does nothing where they are in place

PIP_INSTALL = $(BIN)/python -m pip install -qq --disable-pip-version-check

$(DEMO): constraints-demo.txt pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Tauscope needs Python 3.11 or later; name one: make PYTHON=...")'
	@test -x $(BIN)/pip || $(PYTHON) -m venv .venv
	$(PIP_INSTALL) --require-hashes -r constraints-demo.txt
	$(PIP_INSTALL) --no-deps --no-build-isolation -e .
	@touch $@

# The demo needs a third of it: what only develops and tests comes with the first target that does.
$(INSTALLED): $(DEMO) constraints-dev.txt
	$(PIP_INSTALL) --require-hashes -r constraints-dev.txt
	@touch $@

demo: $(DEMO) ## a whole campaign on the paper's arm, simulated, and in a terminal the page; look into demo-output/
	$(BIN)/tauscope demo --out demo-output

prove: $(DEMO) ## concealed effects: the quick set, and its page with pictures; look into proof-output/
	$(BIN)/tauscope prove --out proof-output

page: $(DEMO) ## the page at http://127.0.0.1:8000 with what `make demo` has made; Ctrl-C ends it
	@test -d demo-output/service || { echo "nothing to show yet: run make demo first" >&2; exit 1; }
	$(BIN)/tauscope serve --data demo-output/service

# A file is one process's: its tests share what they have built. Tests often wait: a third process fills two cores.
BY_FILE := --dist loadfile --no-loadscope-reorder
SELECTED = $(if $(CHANGED),--changed-only)
BY_THE_CLOCK = $(BIN)/pytest $(BY_FILE) --reruns 4 --only-rerun MachineStoodStill
SLOWLY = $(BIN)/pytest $(BY_FILE) -n 3 --timeout 1800
NONE_NEEDED = test $$? -eq 5 -a -n "$(CHANGED)"

test: $(INSTALLED) ## the quick tests
	$(BIN)/pytest $(BY_FILE) -n 3 $(PYTEST_FLAGS)

# The limit ends what hangs, and no test that a busy machine makes slow: one diagnosis of half a minute has taken five.
# Exit status 5: no test was selected, which is right where the change needs none.
test-slow: $(INSTALLED) ## tests of seconds, against the clock, or with a program of the host; CHANGED=1: those that the change needs
	$(BY_THE_CLOCK) -n 2 -m "realtime and not proof" $(SELECTED) $(PYTEST_FLAGS) || $(NONE_NEEDED)
	$(SLOWLY) -m "(slow or system) and not realtime and not proof" $(SELECTED) $(PYTEST_FLAGS) || $(NONE_NEEDED)

test-proof: $(INSTALLED) ## whole proofs, hours in all: real arms in full, series of sound arms, hundreds of kills, the image
	$(BY_THE_CLOCK) -m "realtime and proof" $(PYTEST_FLAGS)
	$(SLOWLY) -m "proof and not realtime" $(PYTEST_FLAGS)

test-all: test test-slow test-proof ## every test: quick, slow and proof

bench: $(INSTALLED) ## time and memory; leave the machine alone meanwhile
	@set -e; for script in tests/benchmarks/benchmark_*.py; do echo "== $$script"; $(BIN)/python $$script; done
	@$(BIN)/pytest -m benchmark -p no:xdist -s --timeout=0 $(PYTEST_FLAGS) || test $$? -eq 5 # 5: no test of that mark

# import-linter without its cache: that keeps imports resolved as they were before a package was added.
lint: $(INSTALLED) ## style, types and the direction of imports
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright
	$(BIN)/lint-imports --no-cache

docs: $(INSTALLED) ## the documentation site in build/docs/html; a warning or a link that leads nowhere is an error
	$(BIN)/python -m docs.site build/docs

format: $(INSTALLED) ## put the source into its one format
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

# Three lists of one resolution: all that develops, all that a user may install, and what the demo needs.
COMPILE = $(UV) pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes --no-annotate --no-header --quiet $(if $(UPGRADE),--upgrade)

DEMO_EXTRAS := service hardware sim

lock: ## resolve the versions anew from pyproject.toml; UPGRADE=1 takes the newest
	@command -v $(UV) >/dev/null || { echo "make lock needs uv: pip install uv" >&2; exit 1; }
	$(COMPILE) --all-extras --group dev --output-file constraints-dev.txt
	$(COMPILE) --all-extras --group build --constraints constraints-dev.txt --output-file constraints.txt
	$(COMPILE) $(DEMO_EXTRAS:%=--extra %) --group build --constraints constraints-dev.txt --output-file constraints-demo.txt

clean: ## remove what was made, but not .venv
	rm -rf build dist demo-output proof-output .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -not -path './.venv/*' -prune -exec rm -rf {} +
