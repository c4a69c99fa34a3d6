#!/usr/bin/env bash
# The browser tests drive Debian's Chromium. Installs it when it is missing.
set -euo pipefail

for name in "${CHROMIUM:-chromium}" chromium-browser google-chrome; do
  command -v "$name" >/dev/null && exit 0
done
"$(dirname "$0")/apt-install.sh" "the browser tests need a browser" chromium
