# make demo   the sample kitchen through every stage, its certified bundle, and the app opened on it
# make test   everything CI runs
# make slow   the tests that take long or need torch: before a release
# make screens  the pictures of the documentation, from a real run
# make env | check | docs | bench beside them
SHELL := /bin/bash
PYTHON ?= python3
DATA ?= .demo
PORT ?= 8000
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
LEARNED := $(VENV)/.learned

.PHONY: demo test slow env check types pages contracts format lint docs screens bench libs clean

demo: env
	"$(BIN)/python" -m r2c2r_core.cli demo --data "$(DATA)" --port $(PORT) $(DEMO)

test: env
	$(MAKE) --no-print-directory check && CHECKED_S=$$SECONDS "$(BIN)/python" scripts/run_tests.py

slow: env $(LEARNED)
	"$(BIN)/python" scripts/run_tests.py --slow

env: libs $(STAMP)

libs:
	@bash scripts/system-libraries.sh

$(STAMP): pyproject.toml constraints.txt
	bash scripts/make-venv.sh "$(PYTHON)" "$(VENV)"
	"$(BIN)/python" -m pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt -e . --group dev
	@# scene_synthesizer (of the dev group) brings it, nothing here calls it: its C code is free for non-commercial use only
	"$(BIN)/python" -m pip uninstall --quiet --yes triangle
	touch "$(STAMP)"

# torch is large: only the slow tests bring it
$(LEARNED): $(STAMP)
	"$(BIN)/python" -m pip install --quiet --disable-pip-version-check -c constraints.txt --group learned
	touch "$(LEARNED)"

CHECKS := types pages contracts format lint
check: env
	@$(MAKE) --no-print-directory -j 2 --output-sync=target $(CHECKS)
types:
	"$(BIN)/mypy"
pages:
	bash scripts/check-static.sh
contracts:
	"$(BIN)/lint-imports"
format:
	"$(BIN)/ruff" format --check .
lint:
	"$(BIN)/ruff" check .

# in build/site, without the network
docs: env
	NO_MKDOCS_2_WARNING=1 "$(BIN)/mkdocs" build --strict --quiet

screens: env
	"$(BIN)/python" -m scripts.screens

bench: env
	"$(BIN)/python" benchmarks/guard.py $(BENCH)

clean:
	rm -rf "$(VENV)" "$(DATA)" build dist
