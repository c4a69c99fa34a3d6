#!/usr/bin/env bash
# Makes a virtual environment with a fitting Python, unless it is there. Usage: make-venv.sh FOLDER
set -euo pipefail

folder=$1
here=$(dirname "$0")
fits='import sys; sys.exit(sys.version_info < (3, 11))'

find_python() {
  for name in ${PYTHON:-python3 python3.13 python3.12 python3.11 python3.14 python}; do
    # a shim of a version switcher may exist and not run: ask it
    if command -v "$name" >/dev/null && "$name" -c "$fits" >/dev/null 2>&1; then
      command -v "$name"
      return
    fi
  done
  echo "Waydrop needs Python 3.11 or newer on the PATH (or: make PYTHON=/path/to/python3)" >&2
  return 1
}

python=$(find_python)
if [ -x "$folder/bin/python" ] && "$folder/bin/python" -c "$fits" >/dev/null 2>&1 && "$folder/bin/python" -m pip --version >/dev/null 2>&1; then
  exit 0
fi
echo "==> $folder with $("$python" --version)"
rm -rf "$folder"
if ! "$python" -c 'import ensurepip, venv' >/dev/null 2>&1; then
  version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  "$here/apt-install.sh" "a virtual environment needs Python's venv" "python$version-venv"
fi
"$python" -m venv "$folder"
