"""Fixtures of the API tests."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from tests.api.service import Service, run_service

PLANS = Path(__file__).resolve().parents[2] / "plans"


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
