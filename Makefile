# make demo     fly the de-tumble mission; pictures and table in out/detumble (the first time about a minute more, to
#               install what it needs into .venv)
# make test     style, types and the fast tests: about ten minutes on two cores
# make test-all style, types and every test; needs clang, clang-tidy, cppcheck, g++ and `make targets`, fetches
#               600 MB of programs to compare with, and skips by name what a missing one prevents (with CI=true: fails)
# make test-rest  what `make test` left out of test-all
# make test-long  hundreds of kills and thousands of mutated files, of which test-all takes some: some hours
# make gates    the hand-written flight C: warnings, MISRA, analysers, coverage, fuzzing under sanitizers; needs
#               clang, clang-tidy, cppcheck and g++
# make targets  compilers and emulators of the flight targets (Debian packages; needs root)
# make test-oldest  the fast tests with the oldest packages that pyproject.toml allows, in .venv-oldest
# make lock     the newest packages that pyproject.toml allows, into requirements.lock, requirements-dev.lock and
#               requirements-oracles.lock
# make bench    every solver that is installed, on the shipped sets; report in out/bench/allocation
# make ratios   every time and ratio that the documentation quotes, into docs/ratios.md
# make docs     the documentation as a site, in docs/_build
# make browser  the browser files of the report from the npm registry, into codegen/report/vendor; needs node and npm
#
# Needed beforehand: python3 (3.11 or newer, with venv), gcc with the headers of the C library, and make. Packages come
# from the two lock files, each with its hash.

PYTHON ?= python3
BIN := .venv/bin
OUT ?= out

BROWSER := codegen/report/vendor

.PHONY: demo test test-all test-rest test-long test-oldest lock bench ratios gates targets pictures lint docs browser clean

# One BLAS thread a process: two processes share the cores.
PYTEST := -m pytest -q -n 2
test test-all test-rest test-long test-oldest: export OPENBLAS_NUM_THREADS = 1
# Tests that need more than the README asks for, and tests that take long, are in `make test-all` alone.
FAST := -m 'not tools and not packages and not slow and not long'

demo: .venv/installed
	$(BIN)/casadi-gnc fly problems/huang2020/detumble.toml --out $(OUT)/detumble --figures $(OUT)/detumble

test: .venv/installed-dev lint
	$(BIN)/python $(PYTEST) $(FAST)

test-all: .venv/installed-oracles lint
	$(BIN)/python $(PYTEST) -m 'not long'

test-rest: .venv/installed-oracles
	$(BIN)/python $(PYTEST) -m '(tools or packages or slow) and not long'

test-long: .venv/installed-dev
	$(BIN)/python $(PYTEST) -m long

# Old packages on new ones beneath them are told that they are old; that is no failure.
test-oldest: .venv-oldest/installed
	.venv-oldest/bin/python $(PYTEST) $(FAST) -W ignore::DeprecationWarning

lint: .venv/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python

# The pictures of the documentation, from flights made now.
FIGURES := $(OUT)/figures

pictures: .venv/installed
	$(BIN)/casadi-gnc fly huang2020/slew --out $(OUT)/slew --figures $(FIGURES)/slew
	cp $(FIGURES)/slew/funnel_robust.png docs/images/slew.png
	$(BIN)/python docs/moving_picture.py docs/images/slew.gif
	$(BIN)/python docs/theory_pictures.py docs/images
	$(BIN)/casadi-gnc margins huang2020/slew --scheme pd_pinv --scheme funnel_robust --figures docs/images
	$(BIN)/casadi-gnc attainable huang2020/allocation --figures docs/images
	$(BIN)/casadi-gnc fly shi2020/docking --scheme iobc --out $(OUT)/docking --figures $(FIGURES)/docking
	cp $(FIGURES)/docking/iobc.png docs/images/docking.png
	$(BIN)/casadi-gnc fly huang2019/vertices --out $(OUT)/vertices --figures $(FIGURES)/vertices
	cp $(FIGURES)/vertices/comparison.png docs/images/wheels_vertices.png
	$(BIN)/casadi-gnc fly tao2019/case2 --out $(OUT)/drag_free --figures $(FIGURES)/drag_free
	cp $(FIGURES)/drag_free/comparison.png docs/images/drag_free.png
	$(BIN)/casadi-gnc fly sun2018/circular_orbit --scheme tracking --out $(OUT)/proximity --figures $(FIGURES)/proximity
	cp $(FIGURES)/proximity/tracking.png docs/images/proximity.png

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

docs: .venv/installed-dev
	$(BIN)/sphinx-build -W -q docs docs/_build

# In a folder of its own, so that what npm installs stays out of the package.
browser:
	rm -rf .browser && mkdir .browser
	cp $(BROWSER)/package.json $(BROWSER)/package-lock.json $(BROWSER)/three_used.js $(BROWSER)/build.mjs .browser
	cd .browser && npm ci --silent --no-audit --no-fund && node build.mjs $(abspath $(BROWSER))
	rm -rf .browser

PIP := -m pip --quiet --disable-pip-version-check install

# The package itself is built by the back end from the lock, not by one that pip fetches for itself.
.venv/installed: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "casadi-gnc needs Python 3.11 or newer; make PYTHON=/path/to/python3.x")'
	@echo "Installing what flying needs into .venv: 170 MB to fetch, half a minute on a fast connection; pip says nothing meanwhile."
	$(PYTHON) -m venv .venv
	$(BIN)/python $(PIP) --require-hashes --requirement requirements.lock
	$(BIN)/python $(PIP) --no-deps --no-build-isolation --editable .
	touch $@

.venv/installed-dev: .venv/installed requirements-dev.lock
	@echo "Installing what tests and documentation need into .venv: 200 MB more to fetch, half a minute on a fast connection."
	$(BIN)/python $(PIP) --require-hashes --requirement requirements-dev.lock
	touch $@

# Basilisk alone is 267 MB, and `make test` does without.
.venv/installed-oracles: .venv/installed-dev requirements-oracles.lock
	@echo "Installing what tests compare with into .venv: 600 MB more to fetch, a minute or two on a fast connection."
	$(BIN)/python $(PIP) --require-hashes --requirement requirements-oracles.lock
	touch $@

# uv resolves for every system and Python at once; it reads settings of its own, not those of pip.
UV := .venv-uv/bin/uv

$(UV):
	$(PYTHON) -m venv .venv-uv
	.venv-uv/bin/python $(PIP) 'uv>=0.7'

COMPILE := $(UV) pip compile --quiet --universal --generate-hashes --python-version 3.11 --upgrade \
    --custom-compile-command 'make lock' --group build pyproject.toml

lock: $(UV)
	$(COMPILE) --extra dev --extra docs --extra oracles --output-file requirements-oracles.lock
	$(COMPILE) --extra dev --extra docs --constraints requirements-oracles.lock --output-file requirements-dev.lock
	$(COMPILE) --constraints requirements-oracles.lock --output-file requirements.lock

# Matplotlib before 3.10.8 calls functions that pyparsing 3.3 warns of.
.venv-oldest/installed: pyproject.toml | $(UV)
	@echo "Installing the oldest packages that pyproject.toml allows into .venv-oldest: about a minute."
	$(PYTHON) -m venv .venv-oldest
	$(UV) pip install --quiet --python .venv-oldest/bin/python --resolution lowest-direct --group build --editable '.[dev]' 'pyparsing>=3.2,<3.3'
	touch $@

clean:
	rm -rf .venv .venv-oldest .venv-uv out docs/_build
