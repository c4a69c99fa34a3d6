#!/usr/bin/env bash
# Writes the four lock files: exact versions with hashes for every platform. Usage: lock.sh UV
set -euo pipefail

uv=$1
compile() { "$uv" pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes --no-header "$@"; }

compile pyproject.toml --output-file requirements.txt
compile --group build --constraint requirements.txt --output-file requirements-build.txt
compile pyproject.toml --extra cluster --constraint requirements.txt --output-file requirements-cluster.txt
compile pyproject.toml --extra cluster --group build --group dev \
  --constraint requirements.txt --constraint requirements-build.txt --output-file requirements-dev.txt
