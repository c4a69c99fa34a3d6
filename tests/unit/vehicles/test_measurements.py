"""A measurement is shown no longer than it is known."""

from __future__ import annotations

import pytest

from app.domain.vehicle import GnssFix
from app.vehicles.decoders import GlobalPositionInt, GpsRawInt
from app.vehicles.measurements import Measurements


@pytest.mark.parametrize(
    ("age_s", "shown"), [(0.0, (GnssFix.FIX_3D, 10, 0.7)), (4.9, (GnssFix.FIX_3D, 10, 0.7)), (5.1, (None, None, None))]
)
def test_gnss_is_unknown_again_once_its_message_stays_away(age_s: float, shown: tuple[object, ...]) -> None:
    measurements = Measurements()
    measurements.take_gnss(GpsRawInt(fix_type=3, eph=70, satellites_visible=10), 100.0)
    state = measurements.state(100.0 + age_s, connected=True)
    assert (state.gnss_fix, state.gnss_satellites, state.gnss_hdop) == shown


def position(boot_ms: int, north_m: int = 0) -> GlobalPositionInt:
    return GlobalPositionInt(boot_ms, 473977420 + north_m * 90, 85455940, 0, 0, 0, 0, 0, 65535)


def test_a_position_that_newer_ones_have_overtaken_is_left_out() -> None:
    measurements = Measurements()
    measurements.take_position(position(60_000, 10), 100.0)
    measurements.take_position(position(59_900, 9), 100.1)
    state = measurements.state(100.2, connected=True)
    assert state.boot_time_s == 60.0, "the end of a hold is counted on this clock: it must not run backwards"
    assert state.position_age_s == pytest.approx(0.2)


def test_after_a_reboot_positions_count_again() -> None:
    measurements = Measurements()
    for n in range(30):
        measurements.take_position(position(n * 5_000), 100.0 + n * 0.1)  # 50 times as fast as ours
    measurements.forget_after_reboot()
    measurements.take_position(position(1_000), 110.0)
    assert measurements.state(110.0, connected=True).boot_time_s == 1.0
