"""What the Dockerfile copies is in the build context, for each list of requirements that an image is built with."""

from __future__ import annotations

import re
from fnmatch import fnmatch

import pytest
import yaml

from tests.support.paths import ROOT

DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
COMPOSE = yaml.safe_load((ROOT / "compose.yaml").read_text(encoding="utf-8"))
DEFAULT = re.findall(r"^ARG REQUIREMENTS=(\S+)$", DOCKERFILE, re.MULTILINE)
BUILDS = [service["build"] for service in COMPOSE["services"].values() if isinstance(service.get("build"), dict)]
LISTS = sorted({*DEFAULT, *(build["args"]["REQUIREMENTS"] for build in BUILDS)})


def copied(requirements: str) -> list[str]:
    """The sources of each COPY out of the context."""
    lines = re.findall(r"^COPY (?!--)(.+)$", DOCKERFILE, re.MULTILINE)
    return [part.replace("${REQUIREMENTS}", requirements) for line in lines for part in line.split()[:-1]]


def is_in_context(path: str) -> bool:
    """As builders read .dockerignore: the last pattern that fits the path or a folder of it decides."""
    parts = path.split("/")
    above = ["/".join(parts[: length + 1]) for length in range(len(parts))]
    kept = True
    for pattern in (ROOT / ".dockerignore").read_text(encoding="utf-8").split():
        if any(fnmatch(one, pattern.removeprefix("!")) for one in above):
            kept = pattern.startswith("!")
    return kept


@pytest.mark.parametrize("requirements", LISTS)
def test_what_is_copied_is_in_the_context(requirements: str) -> None:
    assert len(LISTS) == 2
    paths = copied(requirements)
    assert {requirements, "app", "web/package.json"} <= set(paths)
    assert [path for path in paths if not is_in_context(path) or not (ROOT / path).exists()] == []


def test_what_is_built_or_secret_is_not_in_the_context() -> None:
    assert not any(
        map(is_in_context, ("web/node_modules", "web/dist", "secrets/cluster-key", "var/waydrop.db", ".git"))
    )


def test_the_script_builds_the_image_of_a_cluster_too() -> None:
    assert " REQUIREMENTS " in (ROOT / "scripts" / "build-image.sh").read_text(encoding="utf-8")


def test_the_health_check_is_a_command_that_reads_the_settings_as_the_service_does() -> None:
    assert re.search(r'^HEALTHCHECK .*CMD \["waydrop", "health"\]$', DOCKERFILE, re.MULTILINE)
