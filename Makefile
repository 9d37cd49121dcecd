# Everything runs in a virtual environment of its own (.venv) with the versions pinned in constraints.txt.
#   make demo    design, fly and switch the paper's observer; results in dob-demo/
#   make test    the tests
#   make check   lint, types, import floors
#   make proof   long campaigns and the tables of the docs
#   make bench   measurements, as ratios taken in one run

SHELL := /bin/sh
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

.PHONY: demo test check proof bench docs clean

demo: $(VENV)/.demo
	$(BIN)/dob-companion demo $(DEMO_ARGS)

test: $(VENV)/.dev
	$(BIN)/python -m pytest -m "not proof" $(TEST_ARGS)

check: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

proof: $(VENV)/.dev
	$(BIN)/python -m pytest -m proof $(TEST_ARGS)

bench: $(VENV)/.dev
	$(BIN)/python -m bench

docs: $(VENV)/.dev
	$(BIN)/python -m docs

clean:
	rm -rf $(VENV) build *.egg-info

$(VENV)/.python:
	@command -v git >/dev/null || { echo "git is missing: apt install git" >&2; exit 1; }
	@command -v $(PYTHON) >/dev/null || { echo "python3 is missing: apt install python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "$$($(PYTHON) --version) is too old: apt install a python3 of 3.11 or newer" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "python3-venv is missing: apt install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.demo: $(VENV)/.python pyproject.toml constraints.txt
	$(PIP_INSTALL) --editable '.[demo]'
	@touch $@

$(VENV)/.dev: $(VENV)/.python pyproject.toml constraints.txt
	$(PIP_INSTALL) --editable '.[dev]'
	@touch $@ $(VENV)/.demo
