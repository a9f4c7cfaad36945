# make demo    the cantilever of the paper: numbers, out/*.vtu, out/*.png; nothing else is installed
# make test    the tests, on two processes; ARGS="..." goes to pytest
# make test-settings   most of them as on an old processor, and without Numba, with least versions and noise
# make test-noise   all that solves, with noise in the last digits, in compiled code and in NumPy
# make test-least   the tests, with the least versions that pyproject.toml promises
# make paper   the paper's tables; bench: timings; stress: large and hard cases
# make fuzz    2000 random scenes; mutants: changes of the text that the tests should see
# make margins  the tests, with how far their comparisons are from round-off, out/margins.txt
# make coverage  the tests, with the lines and branches that they run
# make check-pages   that README.md and docs/benchmarks.md have the times of benchmarks/results
# make lint    ruff, mypy and codespell, of the versions that pyproject.toml names
# make docs    the pages of docs/, the gallery and the reference, out/docs/index.html
# make pictures  the pictures of docs/ that README.md and the pages show, anew
# make dist    sdist and wheel, in out/dist
# make clean   removes .venv, out and what the pages are made of
#
# The first target called builds a virtual environment in .venv with $(PYTHON), 3.10 or newer.

PYTHON ?= python3
VENV := .venv
PY := $(VENV)/bin/python
PIP := $(PY) -m pip install --quiet --disable-pip-version-check
# the systems are small and banded: more threads only cost time
export OPENBLAS_NUM_THREADS ?= 1
export OMP_NUM_THREADS ?= 1

.PHONY: demo test test-settings test-noise test-least lint paper bench check-pages stress fuzz mutants margins coverage docs pictures dist clean

demo: $(VENV)/demo.stamp
	$(PY) demos/cantilever.py
	@echo "open $(CURDIR)/out/cantilever.png"
	@echo "for long runs: $(PY) -m pip install '.[fast]' && $(PY) -m skfem_ancf compile"

# what the demo needs, and each step of it said: the first thing that somebody sees
$(VENV)/demo.stamp: pyproject.toml | $(PY)
	@echo "installing skfem-ancf with NumPy, SciPy, scikit-fem and matplotlib into $(VENV)"
	$(PY) -m pip install --disable-pip-version-check --editable '.[plot,progress]'
	@touch $@

test: $(VENV)/test.stamp
	$(PY) -m skfem_ancf compile
	$(PY) -m pytest -n 2 $(ARGS)

# what round-off could decide, in other kernels of OpenBLAS and without fused multiply-add;
# the code that Numba compiles for it is kept apart, and checks every index. Then, without Numba,
# with the least versions of all others and with noise in the last digits, all that solves.
LEAST := $(VENV)/least
GENERIC := compiled doors locking stability statics
ONCE := bad_arguments basis bench calls demos docstrings elements forms fuzz io items mapping mesh package \
  paper places points pulleys pyvista readme rooms stress units verification visuals

test-settings: $(VENV)/test.stamp $(LEAST)/stamp
	export OPENBLAS_CORETYPE=Nehalem NUMBA_CPU_NAME=generic NUMBA_BOUNDSCHECK=1 \
	  NUMBA_CACHE_DIR=$(CURDIR)/out/numba-generic; \
	  $(PY) -m skfem_ancf compile && $(PY) -m pytest -n 2 $(ARGS) $(GENERIC:%=tests/test_%.py)
	OPENBLAS_CORETYPE=Haswell SKFEM_ANCF_COMPILED=0 \
	  $(LEAST)/bin/python -m pytest -n 2 --noise 1 $(ARGS) tests $(ONCE:%=--ignore=tests/test_%.py)

# each number that processors round differently is changed by a few units in the last place
SEEDS := 1 2 3
QUIET := bad_arguments basis bench calls docstrings elements forms io items mapping mesh mutation near_misses \
  package paper prose pyvista readme reference rooms search typing verification visuals
# without Numba ten minutes
LONG := stepsize sweep

test-noise: $(VENV)/test.stamp
	set -e; for seed in $(SEEDS); do \
	  $(PY) tests/noise.py $$seed; \
	  $(PY) -m pytest -n 2 --noise $$seed $(ARGS) tests $(QUIET:%=--ignore=tests/test_%.py); \
	  SKFEM_ANCF_COMPILED=0 $(PY) -m pytest -n 2 --noise $$seed $(ARGS) tests \
	    $(QUIET:%=--ignore=tests/test_%.py) $(LONG:%=--ignore=tests/test_%.py); \
	done

margins: $(VENV)/test.stamp
	mkdir -p out
	$(PY) -m pytest $(ARGS) tests --margins out/margins.txt

test-least: $(LEAST)/stamp
	$(LEAST)/bin/python -m skfem_ancf compile
	$(LEAST)/bin/python -m pytest -n 2 $(ARGS)

$(LEAST)/stamp: pyproject.toml tests/least.py | $(PY)
	$(PY) -m venv $(LEAST)
	$(PY) tests/least.py > $(LEAST)/least.txt
	$(LEAST)/bin/python -m pip install --quiet --disable-pip-version-check \
	  --constraint $(LEAST)/least.txt --editable '.[test]'
	@touch $@

# in an environment of its own: nothing else depends on the versions
LINT := $(VENV)/lint

lint: $(LINT)/stamp
	$(LINT)/bin/ruff check
	$(LINT)/bin/mypy
	$(LINT)/bin/codespell README.md CONTRIBUTING.md CHANGELOG.md docs skfem_ancf tests demos benchmarks validation

$(LINT)/stamp: pyproject.toml | $(PY)
	$(PY) -m venv $(LINT)
	$(LINT)/bin/python -m pip install --quiet --disable-pip-version-check '.[lint]'
	@touch $@

paper: $(VENV)/test.stamp
	$(PY) benchmarks/paper.py

bench: $(VENV)/bench.stamp
	$(PY) benchmarks/bench.py

check-pages: $(VENV)/test.stamp
	$(PY) benchmarks/page.py --check

stress: $(VENV)/test.stamp
	$(PY) benchmarks/stress.py

fuzz: $(VENV)/test.stamp
	$(PY) benchmarks/fuzz.py $(ARGS)

mutants: $(VENV)/coverage.stamp
	$(PY) benchmarks/mutation/mutation.py --named
	$(PY) benchmarks/mutation/mutation.py $(ARGS)

coverage: $(VENV)/coverage.stamp
	$(PY) -m skfem_ancf compile
	$(PY) -m pytest -n 2 --cov --cov-report=term-missing:skip-covered --cov-fail-under=95 $(ARGS)

# the scripts of the pages and the examples of the docstrings, the pages with every warning an
# error, and their links; without a network
docs: $(VENV)/docs.stamp
	$(PY) -m pytest -n 2 tests/test_readme.py tests/test_reference.py skfem_ancf
	$(PY) -m sphinx -W --keep-going -d out/doctrees -b html docs out/docs
	$(PY) docs/check_links.py out/docs
	$(PY) -m pytest tests/test_search.py
	@echo "open $(CURDIR)/out/docs/index.html"

pictures: $(VENV)/test.stamp
	$(PY) docs/pictures.py

dist: $(VENV)/dist.stamp
	$(PY) -m build --outdir out/dist

clean:
	rm -rf $(VENV) out demos/out docs/gallery docs/generated

$(PY):
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  { echo "Python 3.10 or newer is needed: make PYTHON=/path/to/python3"; exit 1; }
	@echo "making a virtual environment in $(VENV)"
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

# one stamp per extra, so that nothing is installed twice
$(VENV)/%.stamp: pyproject.toml | $(PY)
	$(PIP) --editable '.[$*]'
	@touch $@
