"""PX4's mode numbers, and which modes nobody can arm in."""

from __future__ import annotations

import pytest

from app.domain.autopilot import autopilot
from app.domain.vehicle.state import FlightMode

AUTO, POSCTL = 4, 3


def number(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


@pytest.mark.parametrize(
    ("main", "sub", "mode"),
    [
        (AUTO, 4, FlightMode.MISSION),
        (AUTO, 6, FlightMode.LAND),
        (AUTO, 9, FlightMode.LAND),
        (AUTO, 20, FlightMode.DESCEND),
        (AUTO, 99, FlightMode.OTHER),
        (POSCTL, 1, FlightMode.ORBIT),
    ],
)
def test_a_custom_mode_is_named(main: int, sub: int, mode: FlightMode) -> None:
    assert autopilot().flight_mode(number(main, sub), None) is mode


def test_nobody_arms_in_a_failsafes_descent() -> None:
    assert "never" in autopilot().arming_obstacle(FlightMode.DESCEND)
