#!/usr/bin/env bash
# Runs the image with buildah, without an engine, until /readyz answers. Usage: check-image.sh [NAME] [PORT]
set -euo pipefail

name=${1:-waydrop}
port=${2:-18380}
token=$(head -c 24 /dev/urandom | base64)
container=$(buildah from "$name")
log=$(mktemp)
pid=
trap '[ -z "$pid" ] || kill "$pid" 2>/dev/null || true; wait "$pid" 2>/dev/null || true; buildah rm "$container" >/dev/null; rm -f "$log"' EXIT

echo "==> without a token it refuses to start"
refused() { buildah run --isolation chroot "$container" -- waydrop serve --port "$port" 2>&1; }
if said=$(refused); then
  echo "it started on 0.0.0.0 without a token" >&2
  exit 1
fi
grep WAYDROP_BOOTSTRAP_TOKEN <<<"$said"

echo "==> with one it answers"
buildah run --isolation chroot --env "WAYDROP_BOOTSTRAP_TOKEN=$token" --env "WAYDROP_CONNECTIONS=udpin://127.0.0.1:25990" \
  "$container" -- waydrop serve --port "$port" >"$log" 2>&1 &
pid=$!
for _ in $(seq 150); do
  if answer=$(curl --silent --fail "http://127.0.0.1:$port/readyz"); then
    echo "/readyz: $answer"
    curl --silent --fail -H "Authorization: Bearer $token" "http://127.0.0.1:$port/api/v1/vehicles"
    echo
    echo "without the token: $(curl --silent -o /dev/null -w '%{http_code}' "http://127.0.0.1:$port/api/v1/vehicles")"
    echo "the page: $(curl --silent --fail "http://127.0.0.1:$port/" | grep -o '<title>.*</title>')"
    echo "user: $(ps -o uid= -p "$(pgrep -f "waydrop serve --port $port" | tail -n 1)")"
    exit 0
  fi
  kill -0 "$pid" 2>/dev/null || break
  sleep 0.2
done
cat "$log" >&2
exit 1
