"""Fixed wing, VTOL, rover and airship, rule by rule."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from app.simulator.wire import Mode
from tests.support.landing_vehicle import FLYING, STANDING, LandDetectorHarness

BLIND = {"airspeed_m_s": None}


def test_a_plane_has_landed_two_seconds_after_it_became_slow() -> None:
    harness = LandDetectorHarness("plane")
    harness.feed(FLYING, 3.0)
    assert not harness.land.landed
    harness.feed(replace(STANDING, v_z_m_s=0.0), 1.9)
    assert not harness.land.landed
    assert harness.seconds_until("landed", True, STANDING) < 0.8  # the filters lag


@pytest.mark.parametrize(
    ("fast", "lag_s"),
    [
        ({"airspeed_m_s": 12.0}, 0.14),  # down to a half with 0.95 kept in each of two runs a cycle
        ({"v_xy_m_s": 12.0}, 0.29),
        ({"v_z_m_s": 2.0}, 0.69),
        ({"acceleration_xy_m_s2": 60.0}, 0.09),
        ({"rate_rad_s": 0.1, "airspeed_m_s": None, "v_xy_valid": False}, 0.48),
    ],
)
def test_a_low_pass_lets_each_of_its_readings_lag(fast: dict[str, Any], lag_s: float) -> None:
    slow = {name: value for name, value in fast.items() if value is None or value is False}
    harness = LandDetectorHarness("plane")
    harness.feed(replace(STANDING, **fast), 5.0)
    assert not harness.land.landed
    assert harness.seconds_until("landed", True, replace(STANDING, **slow)) == pytest.approx(2.0 + lag_s, abs=0.045)


def test_after_a_reboot_its_filters_begin_at_rest() -> None:
    harness = LandDetectorHarness("plane")
    harness.feed(replace(FLYING, v_z_m_s=3.0), 3.0)
    harness.reboot()
    assert all(harness.feed(STANDING, 0.02).landed for _ in range(100))


def test_its_trigger_time_is_a_parameter() -> None:
    harness = LandDetectorHarness("plane", LNDFW_TRIG_TIME=6.0)
    harness.feed(FLYING, 3.0)
    assert 6.0 < harness.seconds_until("landed", True, STANDING) < 7.0


@pytest.mark.parametrize(
    ("params", "too_fast", "slow"),
    [
        ({}, {"airspeed_m_s": 6.1}, {"airspeed_m_s": 5.9}),
        ({}, {"v_xy_m_s": 5.1}, {"v_xy_m_s": 4.9}),
        ({}, {"v_z_m_s": 1.05}, {"v_z_m_s": 0.95}),
        ({}, {"acceleration_xy_m_s2": 9.0}, {"acceleration_xy_m_s2": 8.8}),  # the low pass leaks: 8 of 8.9
        ({}, {"v_xy_m_s": 3.6, **BLIND}, {"v_xy_m_s": 3.4, **BLIND}),
        (
            {},
            {"v_xy_valid": False, "rate_rad_s": math.radians(0.6), **BLIND},
            {"v_xy_valid": False, "rate_rad_s": math.radians(0.4), **BLIND},
        ),
        ({"LNDFW_AIRSPD_MAX": 9.0}, {"airspeed_m_s": 9.1}, {"airspeed_m_s": 8.9}),
        ({"LNDFW_VEL_XY_MAX": 9.0}, {"v_xy_m_s": 9.1}, {"v_xy_m_s": 8.9}),
        ({"LNDFW_VEL_Z_MAX": 0.5}, {"v_z_m_s": 0.55}, {"v_z_m_s": 0.45}),
        ({"LNDFW_XYACC_MAX": 4.0}, {"acceleration_xy_m_s2": 4.5}, {"acceleration_xy_m_s2": 4.4}),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else None,
)
def test_each_limit_of_a_plane(params: dict[str, Any], too_fast: dict[str, Any], slow: dict[str, Any]) -> None:
    harness = LandDetectorHarness("plane", **params)
    harness.feed(FLYING, 3.0)
    assert harness.never("landed", replace(STANDING, **too_fast), 15.0)
    harness.seconds_until("landed", True, replace(STANDING, **slow))


@pytest.mark.parametrize("sensed", [{}, {"v_xy_valid": False, "airspeed_m_s": 0.0}, {"v_xy_m_s": 1.0, **BLIND}])
def test_rotation_counts_only_when_no_speed_is_known(sensed: dict[str, Any]) -> None:
    harness = LandDetectorHarness("plane")
    harness.feed(FLYING, 3.0)
    harness.seconds_until("landed", True, replace(STANDING, rate_rad_s=1.0, **sensed))


def test_a_plane_is_in_the_air_half_a_second_after_it_became_fast() -> None:
    harness = LandDetectorHarness("plane", LNDFW_VEL_XY_MAX=100.0, LNDFW_VEL_Z_MAX=100.0)
    fast = replace(FLYING, airspeed_m_s=1000.0)  # over every limit in one cycle
    assert harness.seconds_until("landed", False, fast) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("airframe", ["plane", "vtol", "rover", "airship"])
def test_disarmed_everything_has_landed(airframe: str) -> None:
    harness = LandDetectorHarness(airframe)
    harness.feed(replace(FLYING, fixed_wing=airframe == "vtol"), 3.0)
    assert not harness.land.landed
    harness.seconds_until("landed", True, replace(FLYING, armed=False), 2.1)


def test_a_hovering_vtol_lands_as_a_multicopter_below_the_airspeed_limit() -> None:
    harness = LandDetectorHarness("vtol").flown()
    calm = replace(STANDING, airspeed_m_s=5.5)
    assert harness.seconds_until("landed", True, calm) == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize(("limit_m_s", "lands"), [(6.0, False), (10.0, True)])
def test_a_hovering_vtol_with_airspeed_above_lndfw_airspd_max_has_not_landed(limit_m_s: float, lands: bool) -> None:
    harness = LandDetectorHarness("vtol", LNDFW_AIRSPD_MAX=limit_m_s).flown()
    windy = replace(STANDING, airspeed_m_s=9.0)
    assert harness.never("landed", windy, 5.0) is not lands
    harness.seconds_until("landed", True, STANDING)


def test_a_vtol_that_has_not_flown_stands_in_any_wind() -> None:
    harness = LandDetectorHarness("vtol")
    assert harness.feed(replace(STANDING, airspeed_m_s=12.0), 3.0).landed


@pytest.mark.parametrize("state", ["landed", "maybe_landed", "freefall"])
def test_a_vtol_on_its_wing_has_none_of(state: str) -> None:
    harness = LandDetectorHarness("vtol").flown()
    fallen = replace(STANDING, specific_force_m_s2=1.0 if state == "freefall" else 9.81)
    assert harness.never(state, replace(fallen, fixed_wing=True), 5.0)
    harness.seconds_until(state, True, fallen)


def test_a_vtol_without_valid_range_data_waits_three_times_as_long() -> None:
    harness = LandDetectorHarness("vtol").flown()
    assert harness.seconds_until("landed", True, replace(STANDING, dist_bottom_m=None)) == pytest.approx(3.0, abs=0.06)


def test_an_armed_rover_leaves_the_ground_after_half_a_second_and_always_has_contact() -> None:
    harness = LandDetectorHarness("rover")
    assert harness.seconds_until("landed", False, STANDING) == pytest.approx(0.5, abs=0.03)
    assert harness.land.ground_contact


@pytest.mark.parametrize(
    ("mode", "last_point_m", "landed"),
    [
        (Mode.LAND, 20.0, True),
        (Mode.RTL, 9.9, True),
        (Mode.RTL, 10.1, False),
        (Mode.MISSION, 9.9, False),
        (Mode.LOITER, 9.9, False),
    ],
)
def test_an_armed_rover_lands_in_land_mode_and_back_home_in_a_return_only(
    mode: Mode, last_point_m: float, landed: bool
) -> None:
    """Scenario 21: within NAV_ACC_RAD, though its setpoint is a landing from the start."""
    harness = LandDetectorHarness("rover")
    harness.feed(FLYING, 1.0)
    sample = replace(STANDING, mode=mode, last_point_distance_m=last_point_m)
    assert harness.feed(sample, 3.0).landed is landed


def test_an_armed_airship_never_lands() -> None:
    harness = LandDetectorHarness("airship")
    assert not harness.feed(STANDING, 0.1).landed
    assert harness.never("landed", replace(STANDING, mode=Mode.LAND))
    assert not harness.land.ground_contact


def test_a_vtol_without_airspeed_any_more_lands_as_a_multicopter() -> None:
    harness = LandDetectorHarness("vtol").flown()
    assert harness.seconds_until("landed", True, replace(STANDING, **BLIND)) == pytest.approx(1.0, abs=0.1)


def test_after_a_reboot_a_vtol_has_not_flown_and_airspeed_is_wind() -> None:
    harness = LandDetectorHarness("vtol").flown()
    harness.reboot()
    assert all(harness.feed(replace(STANDING, airspeed_m_s=12.0), 0.02).landed for _ in range(50))
