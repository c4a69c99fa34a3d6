#!/usr/bin/env bash
# Builds the container image with docker, podman or buildah, whichever works here. Usage: build-image.sh NAME
# BASE=local makes the base images out of this machine's Debian, for places where no image registry can be reached.
# The bill of materials of what is put into it is left at dist/waydrop.cdx.json (CycloneDX).
# REQUIREMENTS=requirements-cluster.txt makes the image for gateways and API nodes of a cluster.
# PYTHON_IMAGE and NODE_IMAGE name other bases; PIP_INDEX_URL and NPM_CONFIG_REGISTRY other package registries.
set -euo pipefail
cd "$(dirname "$0")/.."

name=${1:-waydrop}
.venv/bin/python -m tools.sbom dist/waydrop.cdx.json "${REQUIREMENTS:-requirements.txt}"
if [ "${BASE:-}" = local ]; then
  scripts/local-base-image.sh localhost/waydrop-base
  PYTHON_IMAGE=localhost/waydrop-base NODE_IMAGE=localhost/waydrop-base-node
fi

arguments=(--tag "$name" --file Dockerfile)
for variable in REQUIREMENTS PYTHON_IMAGE NODE_IMAGE PIP_INDEX_URL PIP_CERT NPM_CONFIG_REGISTRY NODE_EXTRA_CA_CERTS; do
  [ -z "${!variable:-}" ] || arguments+=(--build-arg "$variable=${!variable}")
done

if docker info >/dev/null 2>&1; then
  exec docker build "${arguments[@]}" .
fi
builder=buildah
command -v podman >/dev/null && builder=podman
command -v "$builder" >/dev/null || scripts/apt-install.sh "building an image needs a builder" buildah
# a proxy's certificate is the build's business, not the image's
certificates=${PIP_CERT:-${NODE_EXTRA_CA_CERTS:-}}
[ -z "$certificates" ] || arguments+=(--volume "$certificates:$certificates:ro")
# chroot: works in a sandbox that may not make namespaces; docker format: it alone knows HEALTHCHECK
exec "$builder" build --isolation chroot --network host --format docker "${arguments[@]}" .
