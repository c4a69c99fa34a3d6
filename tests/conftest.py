"""What holds for every test."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

# a slow machine is no broken law: time is measured in bench/, never in a test
settings.register_profile("waydrop", deadline=None)
settings.load_profile("waydrop")

HEAVY = ("browser", "e2e")
"""Folders whose tests run a browser or whole services: one of each kind at a time is enough for two cores."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Who runs together with --dist loadgroup: a file's tests by one worker, all of a heavy folder's too, and first."""
    items.sort(key=lambda item: _folder(item.path) not in HEAVY)
    for item in items:
        folder = _folder(item.path)
        item.add_marker(pytest.mark.xdist_group(folder if folder in HEAVY else item.path.stem))


def _folder(path: Path) -> str:
    return path.relative_to(Path(__file__).parent).parts[0]
