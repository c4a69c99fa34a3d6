#!/usr/bin/env bash
# Says what to do when Node.js is missing or too old for the page's build.
set -euo pipefail

if ! command -v node >/dev/null || ! command -v npm >/dev/null; then
  echo "The page needs Node.js 20.19 or newer with npm: install it and run make again" >&2
  exit 1
fi
node -e 'const [a, b] = process.versions.node.split(".").map(Number); process.exit(a > 20 || (a === 20 && b >= 19) ? 0 : 1)' || {
  echo "The page needs Node.js 20.19 or newer; this is $(node --version)" >&2
  exit 1
}
