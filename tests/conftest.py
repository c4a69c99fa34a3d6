"""What holds for every test."""

from __future__ import annotations

from itertools import chain, groupby, zip_longest
from pathlib import Path

import pytest
from hypothesis import settings

# a slow machine is no broken law: time is measured in bench/, never in a test
settings.register_profile("waydrop", deadline=None)
settings.load_profile("waydrop")

LONG = ("browser", "e2e", "contract")
"""Folders whose files take longest: first, so that none of them is begun last, and one of each kind at a time."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files first, a browser's between others: three browsers at once are too much for two cores."""
    files = [(path, list(tests)) for path, tests in groupby(items, key=lambda item: item.path)]
    long = ([tests for path, tests in files if _folder(path) == folder] for folder in LONG)
    rest = [tests for path, tests in files if _folder(path) not in LONG]
    in_turn = [tests for turn in zip_longest(*long, fillvalue=[]) for tests in turn]
    items[:] = chain.from_iterable([*in_turn, *rest])


def _folder(path: Path) -> str:
    return path.relative_to(Path(__file__).parent).parts[0]
