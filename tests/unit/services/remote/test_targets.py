"""Reports of targets between the parts of a cluster: told before they are kept, and not dropped in silence."""

from __future__ import annotations

import pytest
from structlog.testing import capture_logs

from app.domain.cluster.errors import BusDownError
from app.domain.errors import ConflictError, NotFoundError
from app.domain.targets import STALE_S, TargetReport
from app.services.remote.targets import LOG_EACH_S, TARGETS_SUBJECT, SharedReports, SharedTargets
from app.services.targets import MOST_FEEDS, Targets
from tests.support.memory_cluster import MemoryBus
from tests.support.targets_api import NOW_S, StillClock

REPORT = TargetReport(time=NOW_S, latitude_deg=47.0, longitude_deg=8.0, north_m_s=0.0, east_m_s=0.0)
EARLIER = REPORT.model_copy(update={"time": NOW_S - 1.0})


async def test_a_report_is_kept_only_once_it_was_told() -> None:
    bus, told = MemoryBus(), list[bytes]()
    targets = SharedTargets(StillClock(), bus)
    bus.down = True
    with pytest.raises(BusDownError):
        await targets.accept("boat", REPORT)
    with pytest.raises(NotFoundError):
        targets.fix("boat")
    bus.down = False
    async with bus.hearing(TARGETS_SUBJECT, told.append):
        assert (await targets.accept("boat", REPORT)).report == REPORT
    assert len(told) == 1


async def test_a_report_that_this_node_refuses_is_not_told() -> None:
    bus, told = MemoryBus(), list[bytes]()
    targets = SharedTargets(StillClock(), bus)
    for number in range(MOST_FEEDS):
        await targets.accept(f"boat-{number}", REPORT)
    async with bus.hearing(TARGETS_SUBJECT, told.append):
        with pytest.raises(ConflictError):
            await targets.accept("one-more", REPORT)
        with pytest.raises(ConflictError):
            await targets.accept("boat-0", EARLIER)
    assert told == []


async def test_after_all_clocks_were_set_back_reports_count_once_the_last_one_is_stale() -> None:
    """It is newer by the wall clock, for as long as they were ahead."""

    class SetBack(StillClock):
        def now(self) -> float:
            return super().now() - back_s

    back_s, clock, bus = 0.0, SetBack(), MemoryBus()
    targets = SharedTargets(clock, bus)
    await targets.accept("boat", REPORT)
    back_s = 3600.0
    report = REPORT.model_copy(update={"time": NOW_S - back_s})
    with pytest.raises(ConflictError):
        await targets.accept("boat", report)
    clock.passed_s += STALE_S + 1.0
    assert (await targets.accept("boat", report)).report == report


async def test_a_gateway_whose_clock_is_behind_logs_that_it_drops_reports_but_not_each_one() -> None:
    bus, behind = MemoryBus(), StillClock()
    behind.passed_s = -30.0
    gateway = Targets(behind)
    targets = SharedTargets(StillClock(), bus)
    async with bus.hearing(TARGETS_SUBJECT, SharedReports(gateway.report, behind).hear):
        with capture_logs() as logs:
            for _ in range(3):
                await targets.accept("boat", REPORT)
        assert [(line["log_level"], line["feed"]) for line in logs] == [("warning", "boat")]
        assert "30.0 s ahead" in logs[0]["error"]
    assert gateway.all() == ()


async def test_the_log_repeats_while_reports_are_dropped_and_an_older_report_is_no_news() -> None:
    bus, clock = MemoryBus(), StillClock()
    gateway = Targets(clock)
    reports = SharedReports(gateway.report, clock)
    with capture_logs() as logs:
        reports.hear(b"what is this?")
        reports.hear(b"what is this?")
        clock.passed_s = LOG_EACH_S
        reports.hear(b"what is this?")
        gateway.report("boat", REPORT)
        async with bus.hearing(TARGETS_SUBJECT, reports.hear):
            await SharedTargets(clock, bus).accept("boat", EARLIER)
    assert len(logs) == 2
