# make demo   fly the de-tumble mission; pictures and table in out/detumble
# make test   style, types and the whole test suite
# make bench  speed, as ratios in one run
# Everything is installed into .venv here; needed beforehand: python3 (3.11 or newer, with venv), a
# C compiler and make.

PYTHON ?= python3
BIN := .venv/bin
OUT ?= out

.PHONY: demo test bench pictures lint docs clean

demo: .venv/installed
	$(BIN)/casadi-gnc fly problems/huang2020/detumble.toml --out $(OUT)/detumble

test: .venv/installed-dev lint
	$(BIN)/python -m pytest -q -n 2

lint: .venv/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python

# The pictures of the documentation, from flights made now.
pictures: .venv/installed
	$(BIN)/casadi-gnc fly problems/huang2020/slew.toml --out $(OUT)/slew
	$(BIN)/casadi-gnc attainable problems/huang2020/allocation.toml --plot docs/images/attainable.png
	cp $(OUT)/slew/funnel_robust.png docs/images/slew.png

bench: .venv/installed-dev
	$(BIN)/python tests/bench/flight_speed.py
	$(BIN)/python tests/bench/allocation_speed.py

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
