"""A measurement is shown no longer than it is known."""

from __future__ import annotations

import pytest

from app.domain.vehicle import GnssFix
from app.vehicles.decoders import GpsRawInt
from app.vehicles.measurements import Measurements


@pytest.mark.parametrize(
    ("age_s", "shown"), [(0.0, (GnssFix.FIX_3D, 10, 0.7)), (4.9, (GnssFix.FIX_3D, 10, 0.7)), (5.1, (None, None, None))]
)
def test_gnss_is_unknown_again_once_its_message_stays_away(age_s: float, shown: tuple[object, ...]) -> None:
    measurements = Measurements()
    measurements.take_gnss(GpsRawInt(fix_type=3, eph=70, satellites_visible=10), 100.0)
    state = measurements.state(100.0 + age_s, connected=True)
    assert (state.gnss_fix, state.gnss_satellites, state.gnss_hdop) == shown
