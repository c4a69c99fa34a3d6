"""What every FlightLog promises."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager
from pathlib import Path

import pytest

from app.domain.ports.stores import MOST_RUNS
from app.storage import Storage, open_storage

Opener = Callable[[], AbstractAsyncContextManager[Storage]]


@pytest.fixture
def opener(tmp_path: Path) -> Opener:
    """A gateway's journal: API nodes fly nothing."""
    return lambda: open_storage(tmp_path / "journal.db")


@pytest.fixture
async def stores(opener: Opener) -> AsyncIterator[Storage]:
    async with opener() as opened:
        yield opened


async def test_parts_of_a_run_are_read_in_order_also_after_a_restart(opener: Opener) -> None:
    async with opener() as stores:
        await stores.flight_log.append("r1", "one\n")
        await stores.flight_log.append("r2", "of another\n")
        await stores.flight_log.append("r1", "größe ☂\n")
    async with opener() as stores:
        assert await stores.flight_log.read("r1") == "one\ngröße ☂\n"
        assert await stores.flight_log.read("r3") == ""


async def test_the_newest_runs_are_kept(stores: Storage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.storage.events.MOST_RUNS", 2)
    for run_id in ("r1", "r2", "r3"):
        await stores.flight_log.append(run_id, run_id)
    assert [await stores.flight_log.read(run_id) for run_id in ("r1", "r2", "r3")] == ["", "r2", "r3"]
    assert MOST_RUNS >= 50


async def test_a_run_takes_no_more_room_than_it_may(stores: Storage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.storage.events.MOST_BYTES", 30)
    for part in ("first", "second", "third", "fourth"):
        await stores.flight_log.append("r1", part)
    assert await stores.flight_log.read("r1") == "firstsecond"
