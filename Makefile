# make demo      the example, all the way, into seatfem-demo/
# make test      lint, types, and the tests that take minutes (all but those marked slow)
# make test-all  everything: all tests, documentation, the wheel in bare environments
# All make .venv and install what they need first; a second run installs nothing.

PYTHON ?= python3
VENV   := .venv
PY     := $(VENV)/bin/python

# One thread per process where several processes run side by side.
SINGLE_THREAD := OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1
TEST_WORKERS  ?= auto

.DELETE_ON_ERROR:
.PHONY: help demo test test-all rest lint types cheap slow unit installed lowest verify doctor docs extremes frozen mutations fuzz history clean distclean

help:
	@sed -n 's/^# //p' Makefile
	@echo "Also: lint, types, slow, unit (all of pytest), verify, doctor, docs (into build/docs), extremes, frozen, mutations, fuzz, history, clean, distclean."

demo: $(VENV)/installed-pictures
	@$(VENV)/bin/seatfem demo

test: lint types cheap

test-all: test rest

# what make test leaves out
rest: docs installed lowest slow

lint: $(VENV)/installed-dev
	$(PY) -m ruff check .

types: $(VENV)/installed-dev
	$(PY) -m mypy

PYTEST := $(SINGLE_THREAD) $(PY) -m pytest -n $(TEST_WORKERS) --maxprocesses 4 --dist worksteal

cheap: $(VENV)/installed-dev
	@$(VENV)/bin/seatfem doctor --quiet
	$(PYTEST) -m "not slow"

slow: $(VENV)/installed-dev
	@$(VENV)/bin/seatfem doctor --quiet
	$(PYTEST) -m slow $(if $(WITHIN),--within $(WITHIN))

unit: cheap slow

# the wheel in bare environments outside the tree: PYTHONS="3.11 3.12 3.13"
installed: $(VENV)/installed-dev
	.ci/installed $(PY)

# the wheel with the lowest versions of its dependencies that pyproject.toml allows, and with the newest
lowest: $(VENV)/installed-dev
	.ci/lowest lowest $(PY)
	.ci/lowest newest $(PY)

verify doctor: $(VENV)/installed-pictures
	@$(VENV)/bin/seatfem $@

docs: $(VENV)/installed-dev
	$(PY) docs/scene_page.py
	$(PY) docs/scenes_page.py
	$(PY) docs/summary_page.py
	$(PY) docs/mistakes_page.py
	$(PY) docs/rooms.py docs/images/rooms.svg
	$(PY) docs/badges.py docs/images
	$(SINGLE_THREAD) $(PY) -m sphinx -q -W --keep-going -b html -c docs . build/docs

extremes: $(VENV)/installed-dev
	$(SINGLE_THREAD) $(PY) -m tests.extremes

# Values of all examples and of further scenes against those on file, tests/frozen; also among all tests.
frozen: $(VENV)/installed-dev
	$(PYTEST) tests/frozen

# 300 errors put into the product one by one: which tests find each. Hours; goes on where it stopped.
mutations: $(VENV)/installed-dev
	test -d build/mutations || $(PY) -m tests.mutations record
	$(PY) -m tests.mutations run
	$(PY) -m tests.mutations table

fuzz: $(VENV)/installed-dev
	$(SINGLE_THREAD) $(PY) -m tests.fuzz --write

# Speed of the main parts against earlier commits: a line of benchmarks/results/history.jsonl; it judges nothing.
history: $(VENV)/installed-dev
	$(SINGLE_THREAD) $(PY) benchmarks/history.py

# The virtual environment. Some systems' venv lacks ensurepip: the outer pip then installs into it.
$(PY):
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	    || { echo "Python 3.11 or newer is needed; name one: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	@if $(PYTHON) -c 'import ensurepip' 2>/dev/null; then $(PYTHON) -m venv $(VENV); \
	else $(PYTHON) -m venv --without-pip $(VENV); fi

# $(call install,EXTRA)
define install
	@if $(PY) -m pip --version >/dev/null 2>&1; then \
	    $(PY) -m pip install --quiet --disable-pip-version-check --editable '.[$(1)]'; \
	elif $(PYTHON) -m pip --version >/dev/null 2>&1; then \
	    $(PYTHON) -m pip --python $(PY) install --quiet --disable-pip-version-check --editable '.[$(1)]'; \
	else \
	    echo "No pip for $(PYTHON). On Debian or Ubuntu: apt-get install python3-pip" >&2; exit 1; \
	fi
endef

$(VENV)/installed-pictures: pyproject.toml | $(PY)
	@echo "installing seatfem with pictures into $(VENV)"
	$(call install,pictures)
	@touch $@

# the development tools include the pictures
$(VENV)/installed-dev: pyproject.toml | $(PY)
	@echo "installing seatfem with its development tools into $(VENV)"
	$(call install,dev)
	@touch $@ $(VENV)/installed-pictures

clean:
	rm -rf build dist docs/gallery docs/generated seatfem-demo .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -path ./$(VENV) -prune -o -name __pycache__ -type d -exec rm -rf {} +

distclean: clean
	rm -rf $(VENV)
