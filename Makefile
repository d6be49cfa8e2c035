# Everything that needs an environment makes it: `make demo` and `make test` work on a fresh clone with Python >= 3.11.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

BENCH := benchmarks/.venv

# Byte code is kept, whatever the shell says: to compile every test for every worker, and the library for every process, takes a minute.
export PYTHONDONTWRITEBYTECODE :=

# What pictures of the examples depend on: they are drawn again when the library changes.
SOURCES := $(shell find src -name '*.py')
GALLERY := $(patsubst examples/%.py,build/gallery/%.png,$(wildcard examples/*.py))

.PHONY: demo test browser test-numpy test-slow coverage lint types docs gallery n-basis figures results variation detection bench-env bench bench-detection bench-realtime bench-studio clean

demo: $(VENV)/.demo
	$(BIN)/probdmp demo

test: $(VENV)/.test browser
	$(BIN)/python -m pytest -n auto --dist worksteal --ignore=tests/studio/browser
	$(BIN)/python -m pytest tests/studio/browser

# Tests of the studio's page run in Chromium, one after the other, for they draw in real time. It is installed where that can be done; elsewhere they are skipped.
browser:
	@test -n "$$PROBDMP_CHROMIUM" || command -v chromium >/dev/null || command -v chromium-browser >/dev/null || \
	command -v google-chrome >/dev/null || ls $${HOME}/.cache/ms-playwright/chromium* >/dev/null 2>&1 || \
	{ test "$$(id -u)" = 0 && command -v apt-get >/dev/null && apt-get update >/dev/null && apt-get install --yes --no-install-recommends chromium >/dev/null; } || \
	echo "No Chromium: tests in a browser are skipped. sudo apt-get install chromium, or $(BIN)/playwright install chromium"

# The same laws of filters and steps without the compiled kernels.
test-numpy: $(VENV)/.test
	PROBDMP_NO_EXTENSION=1 $(BIN)/python -m pytest -n auto --dist worksteal tests/gaussian tests/execution

# What takes minutes; then properties once more, on four times as many examples.
test-slow: $(VENV)/.test
	$(BIN)/python -m pytest -n auto --dist worksteal -m slow
	HYPOTHESIS_PROFILE=more $(BIN)/python -m pytest -n auto --dist worksteal -m 'hypothesis and not slow'

# The same tests as make test, and which lines of the library they run; fewer than 95 % are an error.
coverage: $(VENV)/.dev
	$(BIN)/python -m pytest -n auto --cov=probdmp --cov-report=term:skip-covered --cov-fail-under=95

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.dev
	$(BIN)/mypy

# The documentation as a site in build/site. Any warning ends it, but not with --quiet, which would hide them from --strict too.
docs: $(VENV)/.docs gallery
	$(BIN)/mkdocs build --strict

# A picture, and what was printed, of every example: the gallery of the site.
gallery: $(GALLERY)

build/gallery/%.png: examples/%.py $(SOURCES) | $(VENV)/.docs
	mkdir -p build/gallery
	MPLBACKEND=Agg $(BIN)/python $< $@ > $(@:.png=.txt)

# Every picture in docs/images, and the tables in docs/feedback.md; two minutes.
figures: $(VENV)/.demo
	$(BIN)/python docs/figures.py

# The table and the picture in docs/how-to/choose-n-basis.md, from the built-in letters; about a minute.
n-basis: $(VENV)/.demo
	$(BIN)/python docs/n_basis.py

# Every table in docs/paper.md, from the recordings that PROBDMP_RECORDINGS points at; about ten minutes.
results: $(VENV)/.demo
	$(BIN)/python docs/results.py

# The table in docs/variation.md, from the same recordings; about ten minutes.
variation: $(VENV)/.demo
	$(BIN)/python docs/variation.py

# The tables in docs/monitoring.md, from the same recordings; about a quarter of an hour.
detection: $(VENV)/.demo
	$(BIN)/python docs/detection.py

# Peers that the library is compared with live in an environment of their own.
bench-env: $(BENCH)/.ready

# docs/benchmarks.md and its picture: speed against peers, this machine and targets; ten minutes on a machine that is idle.
FLEET ?= 1000000
bench: $(BENCH)/.ready
	$(BENCH)/bin/python benchmarks/speed_tables.py --fleet $(FLEET)

# Control loops at 1 kHz, ten seconds each.
bench-realtime: $(BENCH)/.ready
	$(BENCH)/bin/python benchmarks/realtime.py

# The studio in Chromium: how long bands take, frames per second; then its picture in docs/images.
bench-studio: $(VENV)/.test browser
	$(BIN)/python benchmarks/studio.py
	$(BIN)/python benchmarks/studio.py --picture docs/images/studio.png

# benchmarks/detection.md: failure detectors against one another, on the recordings that PROBDMP_RECORDINGS points at.
bench-detection: $(BENCH)/.ready
	$(BENCH)/bin/python benchmarks/detection_tables.py

clean:
	rm -rf $(VENV) $(BENCH) build src/*.egg-info report.html

# A stamp per set of extras: installed again only when pyproject.toml changes.
$(VENV)/.demo: EXTRA := plot
$(VENV)/.docs: EXTRA := docs
$(VENV)/.test: EXTRA := test
$(VENV)/.dev: EXTRA := dev
$(VENV)/.%: pyproject.toml src/probdmp/gaussian/_kernels.c
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[$(EXTRA)]'
	touch $@

$(BENCH)/.ready: pyproject.toml benchmarks/requirements.txt src/probdmp/gaussian/_kernels.c
	test -x $(BENCH)/bin/python || $(PYTHON) -m venv $(BENCH)
	$(BENCH)/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[test]' -r benchmarks/requirements.txt
	touch $@
