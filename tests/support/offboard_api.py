"""Offboard control by REST: who may, what is refused with which code, and that it reaches the vehicle."""

from __future__ import annotations

import pytest

from app.domain.vehicle.state import LandedState
from tests.support.fake_links import HOME, FakeLink
from tests.support.service_in_process import Service

PATH = "/api/v1/vehicles/v1/offboard"
NORTH = {"type": "velocity_ned", "north_m_s": 2.0, "east_m_s": 0.0}


@pytest.fixture
def link(service: Service) -> FakeLink:
    """The first vehicle, in the air."""
    link = service.links[0]
    link.change(
        armed=True, landed=LandedState.IN_AIR, absolute_altitude_m=HOME.altitude_m + 20.0, relative_altitude_m=20.0
    )
    return link
