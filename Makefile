# Waydrop: each target does its own set-up. Where packages come from is the environment's choice (pip.conf, .npmrc).
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := all

VENV := .venv
PY := $(VENV)/bin/python
PIP := $(PY) -m pip --disable-pip-version-check --no-input
RUNTIME := $(VENV)/.installed
DEV := $(VENV)/.installed-dev
DIALECT := app/simulator/dialect/generated/.built
NODE := web/node_modules/.installed
PAGE := web/dist/.built
PAGE_SOURCES := $(shell find web -path web/node_modules -prune -o -path web/dist -prune -o -type f -print 2>/dev/null)
LOCK_TOOL := uv==0.13.9

.PHONY: all run run-cluster test test-python test-signed test-web lint format types screenshots recording agreement bench bench-prediction docs architecture check lock image sbom clean help

all: $(RUNTIME) $(DIALECT) $(PAGE)  ## build .venv, the simulated vehicles' MAVLink dialect and the page

run: all  ## start Waydrop and four simulated vehicles; Ctrl-C ends both
	exec $(VENV)/bin/waydrop up

run-cluster: all $(DEV)  ## start a cluster on this machine: NATS, PostgreSQL, two gateways with simulated vehicles, two API nodes
	exec $(PY) -m tools.run_cluster

test: test-web test-python  ## all tests, the browser's too

test-python: $(DEV) $(DIALECT) $(PAGE)
	scripts/need-chromium.sh
	scripts/need-nginx.sh
	scripts/test-python.sh $(PYTEST_ARGS)

test-signed: $(DEV) $(DIALECT) $(PAGE)  ## the flights of tests/e2e again, on signed vehicle links
	WAYDROP_TESTS_SIGNED=1 scripts/test-python.sh tests/e2e $(PYTEST_ARGS)

test-web: $(NODE)
	cd web && npm run --silent check

lint: $(DEV) $(NODE)  ## ruff, mypy, and Biome over the page
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	cd web && npm run --silent lint

format: $(DEV) $(NODE)  ## put the code into shape
	$(VENV)/bin/ruff check --fix .
	$(VENV)/bin/ruff format .
	cd web && npm run --silent format

types: $(RUNTIME) $(NODE)  ## the page's types from the API's schema
	$(VENV)/bin/waydrop openapi > web/openapi.json
	cd web && npm run --silent types

screenshots: $(DEV) $(PAGE)  ## pictures of the page in all its looks into docs/screenshots, two of them into docs/images
	scripts/need-chromium.sh
	$(PY) -m tests.browser.screenshots docs/screenshots docs/images

recording: $(DEV) $(PAGE)  ## a delivery on the page, as an animated WebP: docs/images/delivery.webp
	scripts/need-chromium.sh
	$(PY) -m tests.browser.recording docs/images/delivery.webp

agreement: $(DEV)  ## 10,000 random plans: what the rules accept, the simulated autopilot takes, in process and over UDP
	$(PY) -m tests.contract.feasibility.many

bench: $(DEV) $(DIALECT)  ## Waydrop against the floor: LONG=1, ROWS=plan,help, PUBLISH=1; BASE=COMMIT: against a commit
	$(PY) -m bench $(if $(LONG),--long) $(if $(ROWS),--rows $(ROWS)) $(if $(PUBLISH),--publish) $(if $(BASE),--base $(BASE))

bench-prediction: $(DEV)  ## all example plans on all suited simulated vehicles, in calm air and wind: predicted against flown
	$(PY) -m bench.prediction

docs: $(DEV)  ## build the documentation site in build/docs, with checked links
	NO_MKDOCS_2_WARNING=1 $(VENV)/bin/mkdocs build --strict

architecture: $(RUNTIME)  ## the map of packages with their imports and cycles; draws the picture of docs/architecture.md
	$(PY) -m tools.architecture

check:  ## what CI runs
	.ci/run

lock:  ## choose versions anew; the files record hashes, not addresses
	scripts/make-venv.sh $(VENV)/lock
	$(VENV)/lock/bin/python -m pip install --quiet $(LOCK_TOOL)
	scripts/lock.sh $(VENV)/lock/bin/uv
	cd web && npm install --package-lock-only

image: $(DEV)  ## build the container image; its bill of materials goes to dist/waydrop.cdx.json; docs/how-to/deploy.md tells of IMAGE, BASE and registries
	scripts/build-image.sh $(or $(IMAGE),waydrop)

sbom: $(DEV)  ## the image's bill of materials (CycloneDX) alone: dist/waydrop.cdx.json
	$(PY) -m tools.sbom dist/waydrop.cdx.json

clean:  ## remove all that was built; what flew (var/) stays
	rm -rf $(VENV) web/node_modules web/dist $(dir $(DIALECT)) dist build docs/screenshots .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find app tests -name __pycache__ -type d -prune -exec rm -rf {} +

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*##/\1\t/p' $(MAKEFILE_LIST) | expand -t 10

$(PY):
	scripts/make-venv.sh $(VENV)

# --no-build-isolation: the build tools come by hash from the lock as well
$(RUNTIME): requirements.txt requirements-build.txt pyproject.toml | $(PY)
	@echo "==> Python packages, by hash"
	$(PIP) install --quiet --require-hashes -r requirements.txt -r requirements-build.txt
	$(PIP) install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

$(DEV): requirements-dev.txt $(RUNTIME)
	@echo "==> development tools, by hash"
	$(PIP) install --quiet --require-hashes -r requirements-dev.txt
	@touch $@

$(DIALECT): $(RUNTIME) app/simulator/dialect_build.py $(wildcard app/simulator/dialect/*.xml)
	@echo "==> the simulated vehicles' MAVLink dialect"
	$(PY) -m app.simulator.dialect_build
	@touch $@

$(NODE): web/package.json web/package-lock.json
	@echo "==> the page's packages, from the lock"
	scripts/need-node.sh
	cd web && npm ci --no-audit --no-fund --loglevel=error
	@touch $@

$(PAGE): $(NODE) $(PAGE_SOURCES)
	@echo "==> the page"
	cd web && npm run --silent build
	@touch $@
