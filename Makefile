# Every target sets up its own environment in .venv first; only Python, pip and make are needed.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint requirements.lock

.PHONY: demo test check format docs bench lock clean

demo: $(VENV)/.demo
	$(BIN)/gainful estimate examples/rover/rover_without_bias.toml --out out/rover_without_bias
	$(BIN)/gainful estimate examples/rover/rover.toml --out out/rover
	@echo "Above: the same ranges taken at their word, then with one bias per beacon. Open out/rover/report.html."

test: $(VENV)/.dev
	$(BIN)/python -m pytest -n 2 --dist loadfile

check: $(VENV)/.dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports
	$(MAKE) test
	$(BIN)/python -m pytest -q --doctest-modules src/gainful
	$(BIN)/mkdocs build --strict --quiet

format: $(VENV)/.dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

docs: $(VENV)/.dev
	$(BIN)/mkdocs build --strict

bench: $(VENV)/.dev
	$(BIN)/python benchmarks/bench.py --out out/benchmarks.md

# Pins every package of every extra; run it after changing the dependencies in pyproject.toml.
lock: $(VENV)/.dev
	$(PIP) uv
	$(BIN)/uv pip compile pyproject.toml --all-extras --upgrade --universal --no-header --no-annotate --no-emit-index-url \
		--output-file requirements.lock

clean:
	rm -rf $(VENV) out site

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.demo: $(VENV)/bin/python pyproject.toml requirements.lock
	$(PIP) --editable ".[cli]"
	@touch $@

$(VENV)/.dev: $(VENV)/bin/python pyproject.toml requirements.lock
	$(PIP) --editable ".[dev]"
	@touch $@ $(VENV)/.demo
