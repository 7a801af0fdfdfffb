# Each command sets up what it needs; `make help` lists them.

BLEND ?= sample_blends/schwarzschild.blend
FRAMES ?= 1
OUT ?= out
PYTEST_ARGS ?=
QUICK ?=

# Any Python 3 that runs will do for the tools; they find 3.11 and 3.13 themselves.
PYTHON ?= $(shell for python in python3 python3.13 python3.11 /usr/bin/python3; do \
	$$python -c 'import sys; sys.exit(sys.version_info < (3, 8))' >/dev/null 2>&1 && echo $$python && break; done)
NEWEST = $(shell $(PYTHON) tools/environments.py)

# Names with spaces or quotes in them reach the tools whole.
quoted = '$(subst ','\'',$(1))'

.DEFAULT_GOAL := help
.PHONY: help python setup ready render test test-drivers bench report compare lint format package clean distclean

help: ## list the commands
	@grep -E '^[a-z-]+:.* ## ' $(firstword $(MAKEFILE_LIST)) | sed -E 's/^([a-z-]+):.* ## /\1|/' | \
		while IFS='|' read -r name text; do printf 'make %-12s %s\n' "$$name" "$$text"; done

python:
	@test -n '$(PYTHON)' || { echo 'No Python 3 here. Debian, Ubuntu: sudo apt-get install python3 python3-venv' >&2; exit 1; }

setup: python ## virtual environments, packages and EGL, all that the others need
	@$(PYTHON) tools/setup.py

ready: python
	@$(PYTHON) tools/setup.py --quiet

render: ready ## render BLEND=file.blend FRAMES=1-10 OUT=folder
	@$(NEWEST) tools/render.py --frames $(call quoted,$(FRAMES)) --output $(call quoted,$(OUT)) $(call quoted,$(BLEND))

test: ready ## run all tests; PYTEST_ARGS="-k name" chooses
	@$(PYTHON) tools/test.py $(PYTEST_ARGS)

test-drivers: ready ## run some of them on another OpenGL driver, and look at all programs' GLSL; a minute
	@$(PYTHON) tools/drivers.py

bench: ready ## measure how fast it is, into out/bench.json and out/bench; QUICK=1 takes three minutes
	@$(NEWEST) -m tools.bench $(if $(QUICK),--quick)

report: ready ## measure how right and how stable it is, into out/report; QUICK=1 takes three minutes
	@$(NEWEST) tools/report.py $(if $(QUICK),--quick)

compare: ready ## what is worse in out/report than in BASE=old/summary.json
	@$(NEWEST) tools/report.py --base $(call quoted,$(BASE))

lint: ready ## check the Python code's style
	@$(NEWEST) -m ruff check .
	@$(NEWEST) -m ruff format --check .

format: ready ## put the Python code into its style
	@$(NEWEST) -m ruff check --fix .
	@$(NEWEST) -m ruff format .

package: ready ## build the extension, one zip a platform, into dist
	@$(NEWEST) tools/package.py

clean: ## remove what was made: out, dist, caches
	rm -rf out dist .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -not -path './.venv/*' -prune -exec rm -rf {} +

distclean: clean ## clean, and remove the virtual environments and downloaded wheels
	rm -rf .venv wheels
