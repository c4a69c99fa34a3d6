#!/usr/bin/env bash
# Fails when web/openapi.json or the types made from it are not what the API says now: run `make types`.
set -euo pipefail
cd "$(dirname "$0")/.."

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
.venv/bin/waydrop openapi >"$scratch/openapi.json"
diff -u web/openapi.json "$scratch/openapi.json" || {
  echo "web/openapi.json is old: run make types" >&2
  exit 1
}
(cd web && npx --no-install openapi-typescript openapi.json --output "$scratch/schema.d.ts" >/dev/null)
diff -u web/src/api/schema.d.ts "$scratch/schema.d.ts" || {
  echo "web/src/api/schema.d.ts is old: run make types" >&2
  exit 1
}
