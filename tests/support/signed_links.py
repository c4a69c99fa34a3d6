"""Signed links for whole suites: with WAYDROP_TESTS_SIGNED=1 simulated vehicles sign, and the service wants that.

WAYDROP_TESTS_SIGNED=1 .venv/bin/python -m pytest tests/e2e
"""

from __future__ import annotations

import functools
import json
import os
import tempfile
from pathlib import Path
from typing import Final

SYSTEMS: Final = range(1, 33)


def are_signed() -> bool:
    """Whether this run of the tests is about signed links."""
    return os.environ.get("WAYDROP_TESTS_SIGNED") == "1"


@functools.cache
def key_file() -> Path:
    """A link-keys.json with a key in use for each system id that tests give."""
    vehicles = {number: [{"secret": f"{number:02x}" * 32, "in_use": True}] for number in SYSTEMS}
    path = Path(tempfile.mkdtemp(prefix="waydrop-tests-")) / "link-keys.json"
    with open(os.open(path, os.O_WRONLY | os.O_CREAT, 0o600), "w") as file:
        json.dump({"version": 1, "vehicles": vehicles}, file)
    return path


def signing(fleet: str) -> str:
    """The --fleet of simulated vehicles, each with its key if this run is about that."""
    if not are_signed():
        return fleet
    return ",".join(entry if ":key=" in entry else f"{entry}:key={key_file()}" for entry in fleet.split(","))


def service_environment() -> dict[str, str]:
    """What the service needs to know of it."""
    return {"WAYDROP_LINK_KEYS": str(key_file())} if are_signed() else {}
