#!/usr/bin/env bash
# The browser tests drive Chromium: WAYDROP_CHROMIUM, else Debian's headless shell, which this installs when there is none.
# Where that fails, Debian's chromium does as well: it takes about twice the CPU time.
set -euo pipefail

[ -x "${WAYDROP_CHROMIUM:-/usr/bin/chromium-headless-shell}" ] ||
  "$(dirname "$0")/apt-install.sh" "the browser tests need a browser" chromium-headless-shell ||
  [ -x /usr/bin/chromium ]
