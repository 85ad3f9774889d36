# make demo   fly the de-tumble mission; pictures and table in out/detumble
# make test   style, types and the whole test suite
# make bench  every solver that is installed, on the shipped sets; report in out/bench/allocation
# make ratios every time and ratio that the documentation quotes, into docs/ratios.md
# make gates  the hand-written flight C: warnings, MISRA, analysers, coverage, fuzzing under sanitizers
# make targets  compilers and emulators of the flight targets (Debian packages; needs root)
# Everything is installed into .venv here; needed beforehand: python3 (3.11 or newer, with venv), a
# C compiler and make.

PYTHON ?= python3
BIN := .venv/bin
OUT ?= out

.PHONY: demo test bench ratios gates targets pictures lint docs clean

demo: .venv/installed
	$(BIN)/casadi-gnc fly problems/huang2020/detumble.toml --out $(OUT)/detumble

# One BLAS thread a process: two processes share the cores.
test: .venv/installed-dev lint
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -q -n 2

lint: .venv/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python

# The pictures of the documentation, from flights made now.
pictures: .venv/installed
	$(BIN)/casadi-gnc fly problems/huang2020/slew.toml --out $(OUT)/slew
	$(BIN)/casadi-gnc attainable problems/huang2020/allocation.toml --plot docs/images/attainable.png
	cp $(OUT)/slew/funnel_robust.png docs/images/slew.png
	$(BIN)/casadi-gnc fly problems/shi2020/docking.toml --scheme iobc --out $(OUT)/docking
	cp $(OUT)/docking/iobc.png docs/images/docking.png
	$(BIN)/casadi-gnc fly problems/huang2019/vertices.toml --out $(OUT)/vertices
	cp $(OUT)/vertices/comparison.png docs/images/wheels_vertices.png
	$(BIN)/casadi-gnc fly problems/tao2019/case2.toml --out $(OUT)/drag_free
	cp $(OUT)/drag_free/comparison.png docs/images/drag_free.png

bench: .venv/installed-dev
	$(BIN)/casadi-gnc bench allocation --out $(OUT)/bench/allocation

ratios: .venv/installed-dev
	$(BIN)/python tests/bench/ratios.py

# What codegen/targets/*.toml name under `packages`.
TARGETS := $(shell sed -n 's/^packages = \[\(.*\)\]/\1/p' codegen/targets/*.toml | tr -d '",')

targets:
	apt-get update -qq
	apt-get install -y -qq --no-install-recommends $(sort $(TARGETS))

# Needs gcc, g++, clang, clang-tidy and cppcheck; nothing of Python but Python itself.
gates:
	$(PYTHON) tests/runtime/gates.py

docs: .venv/installed-docs
	$(BIN)/sphinx-build -W -q docs docs/_build

.venv/installed: pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "casadi-gnc needs Python 3.11 or newer; make PYTHON=/path/to/python3.x")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	touch $@

.venv/installed-dev: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $@

.venv/installed-docs: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	touch $@

clean:
	rm -rf .venv out docs/_build
