"""The vehicle clock tells the speed factor, and forgets it over a reboot."""

from __future__ import annotations

import pytest

from app.domain.vehicle_clock import VehicleClock


@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0, 20.0])
def test_the_rate_is_the_speed_factor(factor: float) -> None:
    clock = VehicleClock()
    for n in range(30):
        clock = clock.seen(100 + n * 0.1001, 5 + n * 0.1001 * factor)
    assert clock.rate == pytest.approx(factor, rel=0.02)


def test_it_is_one_until_known_and_after_a_reboot() -> None:
    clock = VehicleClock().seen(0, 10).seen(3, 40)
    assert clock.rate == pytest.approx(10)
    assert clock.seen(4, 0.2).rate == 1.0
