#!/usr/bin/env bash
# Installs Debian packages that a step needs, saying so first. Usage: apt-install.sh WHY PACKAGE...
set -euo pipefail

why=$1
shift
announce() { printf '\n==> %s: installing %s with apt-get\n' "$why" "$*"; }

if ! command -v apt-get >/dev/null; then
  printf '%s: please install %s (this machine has no apt-get)\n' "$why" "$*" >&2
  exit 1
fi
if [ "$(id -u)" -eq 0 ]; then
  announce "$@"
  as_root=()
elif command -v sudo >/dev/null; then
  announce "$@"
  as_root=(sudo)
else
  printf '%s: please install as root: apt-get install %s\n' "$why" "$*" >&2
  exit 1
fi
"${as_root[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "$@" >/dev/null
