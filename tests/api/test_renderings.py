"""Exports are written once and one at a time, and a client that has one causes none to be written."""

from __future__ import annotations

import asyncio
import threading
from collections import Counter
from typing import Any

import pytest

from app.api import conversions
from app.api.conversions import Renderings
from app.domain.plan import Plan
from app.domain.ports.stores import StoredPlan
from app.domain.vehicle.state import VehicleType
from app.interchange.formats import Exported, TargetFormat, export_plan
from tests.support.service_in_process import Service


class Writer:
    """Counts what is written, and how much of it at once."""

    def __init__(self) -> None:
        self.written: Counter[tuple[str, TargetFormat]] = Counter()
        self.most_at_once = 0
        self._now = 0
        self._lock = threading.Lock()

    def __call__(self, plan: Plan, target: TargetFormat) -> Exported:
        with self._lock:
            self.written[plan.name, target] += 1
            self._now += 1
            self.most_at_once = max(self.most_at_once, self._now)
        try:
            return export_plan(plan, target)
        finally:
            with self._lock:
                self._now -= 1


@pytest.fixture
def writer(monkeypatch: pytest.MonkeyPatch) -> Writer:
    counted = Writer()
    monkeypatch.setattr(conversions, "export_plan", counted)
    return counted


def stored(plan: dict[str, Any], number: int = 1) -> StoredPlan:
    document = {**plan, "name": f"plan {number}"}
    return StoredPlan(f"plan-{number}", "00", document["name"], VehicleType.MULTICOPTER, 0.0, "somebody", document)


async def test_many_viewers_have_each_format_written_once(
    service: Service, plan: dict[str, Any], writer: Writer
) -> None:
    _, headers, _ = await service.call("POST", "/api/v1/plans", json=plan)
    paths = [headers["Location"] + f"/exports{name}" for name in ("", "/qgc", "/geojson", "/kml")]
    answers = await asyncio.gather(*(service.call("GET", path) for path in paths * 4))
    assert {status for status, _, _ in answers} == {200}
    assert set(writer.written.values()) == {1}
    assert writer.most_at_once == 1


async def test_a_client_that_has_an_export_is_told_so_and_nothing_is_written(
    service: Service, plan: dict[str, Any], writer: Writer
) -> None:
    (_, first, _), (_, second, _) = [await service.call("POST", "/api/v1/plans", json=plan) for _ in range(2)]
    tags = {
        target: (await service.call("GET", f"{first['Location']}/exports/{target}"))[1]["ETag"]
        for target in TargetFormat
    }
    assert len(set(tags.values())) == len(TargetFormat)
    writer.written.clear()
    for target, tag in tags.items():
        path = f"{second['Location']}/exports/{target}"
        assert (await service.call("GET", path, headers={"If-None-Match": tag}))[0] == 304
    assert not writer.written


async def test_equal_plans_have_equal_tags_and_another_plan_another(service: Service, plan: dict[str, Any]) -> None:
    tags = []
    for name in ("one", "one", "two"):
        _, headers, _ = await service.call("POST", "/api/v1/plans", json={**plan, "name": name})
        tags.append((await service.call("GET", headers["Location"] + "/exports/kml"))[1]["ETag"])
    assert tags[0] == tags[1] != tags[2]


async def test_what_was_asked_for_longest_ago_is_let_go(plan: dict[str, Any], writer: Writer) -> None:
    kept = Renderings(kept=2)
    for number in (1, 2, 1, 3, 1, 2):  # 3 takes the place of 2, since 1 was asked for after it
        assert (await kept.of(stored(plan, number), TargetFormat.QGC)).text
    assert {name: count for (name, _), count in writer.written.items()} == {"plan 1": 1, "plan 2": 2, "plan 3": 1}
