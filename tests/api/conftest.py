"""Fixtures of the API tests."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.paths import PLANS
from tests.support.service_in_process import Service, run_service


@pytest.fixture
async def service(tmp_path: Path) -> AsyncIterator[Service]:
    """A service with two vehicles on a tokenless loopback."""
    async with run_service(tmp_path) as running:
        yield running


@pytest.fixture
def plan() -> dict[str, Any]:
    """A plan that can be flown."""
    document: dict[str, Any] = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
    return document
