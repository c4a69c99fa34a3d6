"""The bill of materials lists what is installed into the image, fits CycloneDX, and names no address."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from tests.support.paths import ROOT
from tools.sbom import installed_on_linux, merged, page_part, problems_of, python_part

LOCK = """\
aiohttp==3.14.0 \\
    --hash=sha256:aa
colorama==0.4.6 ; sys_platform == 'win32' \\
    --hash=sha256:bb
uvloop==0.22.0 ; sys_platform != 'win32' \\
    --hash=sha256:cc
"""


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return merged(python_part(), page_part())


def test_packages_of_other_platforms_are_left_out() -> None:
    kept = installed_on_linux(LOCK)
    assert re.findall(r"^[a-z]+", kept, re.MULTILINE) == ["aiohttp", "uvloop"]
    assert "sha256:bb" not in kept


def test_it_fits_the_schema(document: dict[str, Any]) -> None:
    assert problems_of(document) == ""
    assert problems_of({**document, "components": [{"name": "no type"}]}) != ""


def test_it_lists_every_locked_package_with_version_and_hash(document: dict[str, Any]) -> None:
    lock = installed_on_linux((ROOT / "requirements.txt").read_text(encoding="utf-8"))
    locked = set(re.findall(r"^([A-Za-z0-9._-]+)==(\S+)", lock, re.MULTILINE))
    python = {(c["name"], c["version"]): c for c in document["components"] if c.get("purl", "").startswith("pkg:pypi/")}
    assert locked
    assert set(python) == locked
    assert all(component["hashes"] for component in python.values())
    assert {"preact", "aiohttp", "mavsdk"} <= {component["name"] for component in document["components"]}


def test_it_names_no_package_registry(document: dict[str, Any]) -> None:
    text = json.dumps(document["components"])
    assert "resolved" not in text
    assert not re.search(r"https?://[^\"]*(simple|registry|index|artifact)", text)


def test_the_image_is_built_with_it() -> None:
    assert "tools.sbom dist/waydrop.cdx.json" in (ROOT / "scripts" / "build-image.sh").read_text(encoding="utf-8")
