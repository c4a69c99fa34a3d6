#!/usr/bin/env bash
# All Python tests, three at a time: most wait for simulated flights. Takes pytest's options.
#
# Real processes, sockets and a browser on a busy machine: a few tests that fail among the others are run once more,
# alone, and named at the end whatever comes of it. One that fails alone too fails the run; so do more than ALONE_AT_MOST.
set -euo pipefail
cd "$(dirname "$0")/.."

unset PYTHONDONTWRITEBYTECODE # the tests start many processes: each would compile everything anew

ALONE_AT_MOST=3
cache=.pytest_cache/all
pytest=(.venv/bin/python -m pytest -o cache_dir="$cache")

status=0
"${pytest[@]}" --cache-clear -n 3 --dist loadfile --no-loadscope-reorder "$@" || status=$?
[[ $status -eq 1 ]] || exit "$status" # 0: all passed; others: not a test's failure

failed=$(.venv/bin/python -c 'import json, sys; print("\n".join(json.load(open(sys.argv[1]))))' "$cache/v/cache/lastfailed")
(($(wc -l <<<"$failed") <= ALONE_AT_MOST)) || exit "$status"

printf '\n==> failed among the others, once more alone:\n%s\n' "$failed"
"${pytest[@]}" --last-failed --last-failed-no-failures none "$@" || {
  status=$?
  printf '==> failed alone too\n'
  exit "$status"
}
printf '==> UNSTEADY, passed only alone, to be mended:\n%s\n' "$failed"
