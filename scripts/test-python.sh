#!/usr/bin/env bash
# All Python tests, four at a time: most wait for simulated flights. Takes pytest's options.
# A test that fails fails the run: one that is unsteady has a cause, in the test or in the product.
set -euo pipefail
cd "$(dirname "$0")/.."

unset PYTHONDONTWRITEBYTECODE # the tests start many processes: each would compile everything anew

exec .venv/bin/python -m pytest -n 4 --dist loadfile --no-loadscope-reorder --max-worker-restart=0 --durations=10 --durations-min=1 "$@"
