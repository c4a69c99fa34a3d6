"""Where the vehicle is in its local frame, from its newest measurements."""

from __future__ import annotations

from typing import Final

from app.domain.tasks.guidance import Fix
from app.domain.tasks.origin import EkfOrigin
from app.domain.vehicle import VehicleState

OLDEST_S: Final = 1.0
"""A position older than this is not carried forward: the guidance falls silent, and the dead-man acts."""


def fix_of(state: VehicleState, origin: EkfOrigin) -> Fix | None:
    """The vehicle now: its newest position, carried forward by its velocity. None without a fresh one."""
    latitude, longitude, altitude = state.latitude_deg, state.longitude_deg, state.absolute_altitude_m
    age_s = state.position_age_s
    if latitude is None or longitude is None or altitude is None or age_s is None or age_s > OLDEST_S:
        return None
    velocity = (state.velocity_north_m_s or 0.0, state.velocity_east_m_s or 0.0)
    measured = Fix(origin.place(latitude, longitude), altitude - origin.altitude_m, velocity)
    return measured.ahead(age_s * state.clock.rate)
