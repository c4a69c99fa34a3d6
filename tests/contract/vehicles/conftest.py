"""Simulated vehicles for the suite of the vehicle ports: one process for all tests that leave it as it was."""

from __future__ import annotations

import threading
from collections.abc import AsyncIterator, Iterator

import pytest

from app.domain.ports import VehicleLink
from tests.contract.vehicles.driving import opened_link
from tests.simulated import SimulatedFleet


@pytest.fixture(scope="module")
def quad() -> Iterator[SimulatedFleet]:
    """One multicopter, five times as fast as the wall clock, shared by the tests of a file."""
    with SimulatedFleet("quad", speed=5.0) as fleet:
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
    left = [thread for thread in set(threading.enumerate()) - before if not thread.name.startswith("simulator")]
    assert not left, f"threads left behind: {left}"
