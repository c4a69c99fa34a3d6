"""What holds for every test."""

from __future__ import annotations

import gc
from typing import Any

import pytest
import structlog
from hypothesis import settings
from xdist.scheduler import LoadFileScheduling

# a slow machine is no broken law: time is measured in bench/, never in a test
settings.register_profile("waydrop", deadline=None)
settings.load_profile("waydrop")

HEAVY = ("browser", "e2e")
"""Folders whose tests run a browser or whole services: one of each kind at a time is enough for two cores."""


class OneHeavyOfAKind(LoadFileScheduling):
    """With several workers, one has all tests of a file, and all of a heavy folder."""

    def _split_scope(self, nodeid: str) -> str:
        folder = _folder(nodeid)
        return folder if folder in HEAVY else nodeid.partition("::")[0]


gc.disable()  # until all is collected: thousands of tests, and what they import, stay until the end


def pytest_collection_finish() -> None:
    """From here on garbage is looked for, and only in what the tests themselves make; and logs tell all."""
    gc.freeze()
    gc.enable()
    structlog.reset_defaults()  # a benchmark whose parts a test imports is silent, and would silence all tests


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> OneHeavyOfAKind:
    """Called by pytest-xdist when it runs with several workers."""
    return OneHeavyOfAKind(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The heavy folders first: what takes longest is not begun last."""
    items.sort(key=lambda item: _folder(item.nodeid) not in HEAVY)


def _folder(nodeid: str) -> str:
    return nodeid.split("/")[1]
