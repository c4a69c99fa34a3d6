#!/usr/bin/env bash
# A test talks to Waydrop through nginx (WAYDROP_NGINX, else Debian's) as docs/nginx.conf sets it up. Installs Debian's when there is none.
set -euo pipefail

[ -x "${WAYDROP_NGINX:-/usr/sbin/nginx}" ] || "$(dirname "$0")/apt-install.sh" "the proxy sample is tested with nginx" nginx-light
