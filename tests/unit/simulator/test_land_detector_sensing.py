"""What the land detectors' readings are made of."""

from __future__ import annotations

import pytest

from app.simulator.airframe import AIRFRAMES
from app.simulator.faults import VehicleFaults
from app.simulator.land_detector.sensing import LandSample, Sensing
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint
from app.simulator.state import Body, VehicleState


def reading(airframe: str, body: Body, params: dict[str, float] | None = None, **faults: object) -> LandSample:
    state, wrong = VehicleState(body=body), VehicleFaults()
    for name, value in faults.items():
        setattr(wrong, name, value)
    return Sensing(state, AIRFRAMES[airframe], Params(params or {}), wrong).sample(Setpoint())


@pytest.mark.parametrize(
    ("wind", "airspeed_m_s"), [((0.0, 0.0), 13.0), ((5.0, 0.0), 5.0), ((0.0, 12.0), 5.0), ((-7.0, -5.0), 20.8)]
)
def test_airspeed_is_told_from_the_wind(wind: tuple[float, float], airspeed_m_s: float) -> None:
    body = Body(v_north_m_s=5.0, v_east_m_s=12.0) if wind != (5.0, 0.0) else Body(v_north_m_s=10.0)
    sample = reading("plane", body, wind_north_m_s=wind[0], wind_east_m_s=wind[1])
    assert sample.airspeed_m_s == pytest.approx(airspeed_m_s, abs=0.1)


def test_without_a_sensor_there_is_no_airspeed() -> None:
    flying = Body(v_north_m_s=12.0)
    assert reading("plane", flying, {"SYS_HAS_NUM_ASPD": 0}).airspeed_m_s is None
    assert reading("quad", flying).airspeed_m_s is None
    assert reading("vtol", flying).airspeed_m_s == 12.0


def test_the_range_sensor_sees_a_hundred_metres_unless_it_is_broken() -> None:
    assert reading("quad", Body(up_m=99.0)).dist_bottom_m == 99.0
    assert reading("quad", Body(up_m=101.0)).dist_bottom_m is None
    assert reading("quad", Body(up_m=1.0), range_lost=True).dist_bottom_m is None
    assert reading("plane", Body(up_m=1.0)).dist_bottom_m is None
