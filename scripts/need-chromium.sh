#!/usr/bin/env bash
# The browser tests drive Chromium (WAYDROP_CHROMIUM, else Debian's). Installs Debian's when there is none.
set -euo pipefail

[ -x "${WAYDROP_CHROMIUM:-/usr/bin/chromium}" ] || "$(dirname "$0")/apt-install.sh" "the browser tests need a browser" chromium
