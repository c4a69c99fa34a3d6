#!/usr/bin/env bash
# Two base images without an image registry: NAME (Debian with Python 3.11) and NAME-node (the same with this
# machine's Node.js). Packages come from the Debian mirror that apt uses here. Usage: local-base-image.sh NAME
set -euo pipefail

name=$1
here=$(dirname "$0")
if buildah inspect "$name" >/dev/null 2>&1 && buildah inspect "$name-node" >/dev/null 2>&1; then
  exit 0
fi
command -v buildah >/dev/null || "$here/apt-install.sh" "building an image needs a builder" buildah
command -v debootstrap >/dev/null || "$here/apt-install.sh" "a base image needs Debian's root" debootstrap

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | head -n 1)
echo "==> Debian bookworm into $name (two minutes)"
debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates bookworm "$scratch/root" "$mirror" >"$scratch/log" ||
  { tail "$scratch/log" >&2; exit 1; }
rm -rf "$scratch"/root/var/cache/apt/* "$scratch"/root/var/lib/apt/lists/*

container=$(buildah from scratch)
buildah add --quiet "$container" "$scratch/root" / >/dev/null
buildah config --env PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin --env LANG=C.UTF-8 "$container"
buildah commit --quiet "$container" "$name" >/dev/null

echo "==> $(node --version) of this machine into $name-node"
modules=$(npm root --global)
buildah add --quiet "$container" "$(command -v node)" /usr/bin/node >/dev/null
buildah add --quiet "$container" "$modules/npm" /usr/lib/node_modules/npm >/dev/null
buildah run --isolation chroot "$container" -- ln -sf ../lib/node_modules/npm/bin/npm-cli.js /usr/bin/npm
buildah commit --quiet --rm "$container" "$name-node" >/dev/null
