"""Moving delivery targets: reported over REST, followed by changes of the plan, and looked at before a release."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.service_in_process import Service, run_service

NOW_S = 1_790_000_000.0
CLINIC = (47.398641, 8.546656)
EAST_DEG_M = 1 / 75_268
"""A metre to the east there."""


class StillClock:
    """Time stands still until a test moves it: no report grows old while a busy machine takes its time."""

    passed_s = 0.0

    def now(self) -> float:
        return NOW_S + self.passed_s

    def monotonic(self) -> float:
        return 1000.0 + self.passed_s


@pytest.fixture
def clock() -> StillClock:
    return StillClock()


@pytest.fixture
async def service(tmp_path: Path, clock: StillClock) -> AsyncIterator[Service]:
    """A service whose targets are as old as `clock` says."""
    async with run_service(tmp_path, target_clock=clock) as running:
        yield running


def report(east_m: float = 0.0, *, age_s: float = 0.0, **more: float) -> dict[str, float]:
    place = {"latitude_deg": CLINIC[0], "longitude_deg": CLINIC[1] + east_m * EAST_DEG_M}
    return {**place, "north_m_s": 0.0, "east_m_s": 0.0, "time": NOW_S - age_s, **more}


async def report_target(service: Service, body: dict[str, float], **options: Any) -> tuple[int, Any]:
    status, _, answer = await service.call("POST", "/api/v1/targets/ship-1", json=body, **options)
    return status, answer
