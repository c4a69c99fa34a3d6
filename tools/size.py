"""Lines of app/ by layer at two commits, and those of new features: `python -m tools.size --base REV`."""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping

from tools.architecture import ROOT

BEFORE_REDESIGN = "b15dbb79"
FEATURES: Mapping[str, tuple[str, ...]] = {
    "guards and keys of vehicle links": (
        *("vehicles/link_guard/", "services/vehicle_links.py", "domain/vehicle/link_security.py"),
        *("domain/ports/link_keys.py", "cli/link_key.py", "simulator/signing.py", "vehicles/steadiness.py"),
    ),
    "cluster": (
        *("cluster/", "domain/cluster/", "storage/postgres/", "storage/relay.py", "services/relay.py"),
        "services/projection.py",
    ),
    "audit log": ("services/audit.py", "domain/audit.py", "api/audit.py", "cli/audit.py", "storage/refusals.py"),
    "TLS, proxies, limits of connections": (
        *("api/tls.py", "api/proxies.py", "api/connections.py", "services/attempts.py", "file_limit.py"),
    ),
    "watches of the event loop": ("services/loop_watch.py", "services/hang_watch.py"),
    "private files and secrets": ("storage/private.py",),
    "photo": ("domain/items/photo.py", "simulator/external/others.py"),
    "stored inputs and replay": ("domain/flight/recording.py",),
}
"""Parts of app/ that came after the redesign and are none of it, by their paths. What they added elsewhere counts as no
feature.
"""


def sizes_at(revision: str) -> dict[str, int]:
    """The lines of each hand-written module of app/ at a commit, by its path below app/."""
    listed = _git("ls-tree", "-r", "--name-only", revision, "app").splitlines()
    paths = [path for path in listed if path.endswith(".py") and "generated" not in path.split("/")]
    return {path.removeprefix("app/"): _git("show", f"{revision}:{path}").count("\n") for path in paths}


def by_layer(sizes: Mapping[str, int]) -> Counter[str]:
    """The lines of each layer: a folder of app/, or a file right in it."""
    layers: Counter[str] = Counter()
    for path, lines in sizes.items():
        layers[path.split("/")[0].removesuffix(".py")] += lines
    return layers


def by_feature(sizes: Mapping[str, int]) -> Counter[str]:
    """The lines of each feature."""
    return Counter(
        {name: sum(n for path, n in sizes.items() if path.startswith(parts)) for name, parts in FEATURES.items()}
    )


def table(before: Mapping[str, int], after: Mapping[str, int]) -> str:
    """Both commits side by side as Markdown: layers, features, and what is left without these."""
    layers, features = (by_layer(before), by_layer(after)), (by_feature(before), by_feature(after))
    lines = ["| | before | after |", "|---|---|---|"]
    lines += [
        f"| `{layer}` | {layers[0][layer]:,} | {layers[1][layer]:,} |" for layer in sorted({*layers[0], *layers[1]})
    ]
    lines += [f"| feature: {name} | {features[0][name]:,} | {features[1][name]:,} |" for name in FEATURES]
    whole = layers[0].total(), layers[1].total()
    lines.append(f"| **all** | {whole[0]:,} | {whole[1]:,} |")
    lines.append(
        f"| **without these features** | {whole[0] - features[0].total():,} | {whole[1] - features[1].total():,} |"
    )
    return "\n".join(lines)


def _git(*arguments: str) -> str:
    return subprocess.run(("git", *arguments), cwd=ROOT, check=True, capture_output=True, text=True).stdout


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--base", default=BEFORE_REDESIGN, help="the commit before (default: before the redesign)")
    parser.add_argument("--at", default="HEAD", help="the commit after (default: HEAD)")
    given = parser.parse_args()
    sys.stdout.write(table(sizes_at(given.base), sizes_at(given.at)) + "\n")


if __name__ == "__main__":
    main()
