"""Simulated vehicles for the suite of the vehicle ports: one process for all tests that leave it as it was."""

from __future__ import annotations

import threading
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest

from app.domain.ports.vehicle_link import VehicleLink
from tests.support.driving import opened_link
from tests.support.simulated import SimulatedFleet

THREADS_END_S = 5.0


@pytest.fixture(scope="module")
def quad() -> Iterator[SimulatedFleet]:
    """One multicopter, five times as fast as the wall clock, shared by the tests of a file. Armed, it stays so."""
    with SimulatedFleet("quad", speed=5.0, params="COM_DISARM_PRFLT=60") as fleet:
        yield fleet


@pytest.fixture
async def link(quad: SimulatedFleet) -> AsyncIterator[VehicleLink]:
    """The link to it."""
    async with opened_link(quad.connections) as found:
        yield found


@pytest.fixture(autouse=True)
def no_leaked_threads() -> Iterator[None]:
    """mavsdk's and our own threads end with the source."""
    before = set(threading.enumerate())
    yield
    deadline_s = time.monotonic() + THREADS_END_S
    while left := [thread for thread in set(threading.enumerate()) - before if _runs(thread)]:
        assert time.monotonic() < deadline_s, f"threads left behind: {left}"
        time.sleep(0.01)


def _runs(thread: threading.Thread) -> bool:
    """Python keeps a native thread that once called it (a "Dummy") in its list for ever: ask the system."""
    native = Path(f"/proc/self/task/{thread.native_id}")
    return not thread.name.startswith("simulator") and (native.exists() or not native.parent.exists())
