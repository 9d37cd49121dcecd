# Everything runs in a virtual environment of its own (.venv) with the versions pinned in constraints.txt.
#   make demo    design, fly and switch the paper's observer; results in dob-demo/
#   make test    the tests, in three processes (many wait, for a second of real time to pass): JOBS=4 for four
#   make quick   those that take less than a quarter of a second each: what to run between two edits
#   make slow    measure again which tests those leave out (tests/slow.txt)
#   make check   lint, types, import floors
#   make proof   long campaigns, all examples of each property, and the tables of the docs
#   make paper   the paper's figures beside ours: docs/paper.md
#   make fuzz    coverage-guided fuzzing: FUZZ_ARGS="300 codec" for one target, 300 s
#   make bench   measurements, as ratios taken in one run
#   make docs    print the pages that come from the code
#   make pins    pin the newest versions that fit together
#   make deb     the daemon as a Debian package: ARCH=arm64 PYTHON_VERSION=3.13 for another computer
#   make wheels-aarch64    prove that all that flies has wheels for 64-bit ARM

SHELL := /bin/sh
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.NOTPARALLEL:
.PHONY: plants paper demo test quick slow check proof fuzz bench docs pins deb wheels-aarch64 clean

demo: $(VENV)/.demo
	$(BIN)/dob-companion demo $(DEMO_ARGS)

# A file's tests share a process, and with it what its fixtures build. What hangs ends with a traceback.
JOBS ?= 3
PYTEST = $(BIN)/python -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder --timeout 300

test: $(VENV)/.dev
	$(PYTEST) -m "not proof" $(TEST_ARGS)

quick: $(VENV)/.dev
	$(PYTEST) -m "not proof and not slow" $(TEST_ARGS)

# Measure again which tests are slow: tests/slow.txt.
slow: $(VENV)/.dev
	$(BIN)/python -m pytest -m "not proof" --write-slow $(TEST_ARGS)

check: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

proof: $(VENV)/.dev
	$(BIN)/python -m pytest -m "proof or hypothesis" --hypothesis-profile=proof $(TEST_ARGS)

fuzz: $(VENV)/.dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[fuzz]'
	$(BIN)/python -m tests.fuzz $(FUZZ_ARGS)

bench: $(VENV)/.dev
	$(BIN)/python -m bench

plants: $(VENV)/.dev
	$(BIN)/python -m bench.plants

paper: $(VENV)/.dev
	$(BIN)/python -m docs.paper

docs: $(VENV)/.dev
	$(BIN)/python -m docs

pins:
	$(PYTHON) -m venv --clear build/pins
	build/pins/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[dev,fuzz]'
	{ sed -n '/^#/p' constraints.txt && build/pins/bin/python -m pip freeze --exclude-editable; } > build/constraints.txt
	mv build/constraints.txt constraints.txt
	rm -rf build/pins

deb: $(VENV)/.python
	PYTHON=$(BIN)/python deploy/build-deb $(or $(ARCH),$(shell dpkg --print-architecture)) $(or $(PYTHON_VERSION),3.11)

wheels-aarch64: $(VENV)/.python
	rm -rf build/wheels-aarch64
	for version in 3.11 3.12 3.13; do \
	  PYTHON=$(BIN)/python deploy/fetch-wheels aarch64 $$version build/wheels-aarch64/$$version \
	    $$($(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["dependencies"])') \
	    || exit 1; \
	  ls build/wheels-aarch64/$$version; \
	done

clean:
	rm -rf $(VENV) build *.egg-info

# Set-up. A stamp is written when its step is complete, so that a step cut short is done again, and both steps put right
# what an interruption leaves: a pip without its end, and packages without the list of their files (RECORD), which pip
# would take for installed.
$(VENV)/.python:
	@command -v git >/dev/null || { echo "git is missing: apt install git" >&2; exit 1; }
	@command -v $(PYTHON) >/dev/null || { echo "$(PYTHON) is missing: apt install python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "$(PYTHON) is $$($(PYTHON) --version), expected 3.11 or newer: make PYTHON=python3.12 …" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "python3-venv is missing: apt install python3-venv" >&2; exit 1; }
	@rm -rf $(VENV)/lib/python3*/site-packages/pip $(VENV)/lib/python3*/site-packages/pip-*
	@$(PYTHON) -m venv $(VENV)
	@touch $@

define install
@echo "installing dob-companion[$(1)] into $(VENV), some minutes the first time" >&2
@find $(VENV)/lib -path '*/site-packages/*.dist-info' -prune ! -exec test -e '{}/RECORD' ';' -exec rm -r '{}' +
@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[$(1)]'
endef

$(VENV)/.demo: $(VENV)/.python pyproject.toml constraints.txt
	$(call install,demo)
	@touch $@

$(VENV)/.dev: $(VENV)/.python pyproject.toml constraints.txt
	$(call install,dev)
	@touch $(VENV)/.demo
	@touch $@
