"""The multicopter's three stages, rule by rule: each test fails when its rule is taken out."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from app.simulator.land_detector.sensing import TakeoffState
from app.simulator.wire import Mode
from tests.support.landing_vehicle import FLYING, STANDING, LandDetectorHarness

THIRD_S = 1.0 / 3.0
CYCLE_S = 0.041
"""The first cycle, and the rounding up to whole ones."""
MANUAL = replace(STANDING, mode=Mode.STABILIZED)


def test_each_stage_takes_a_third_of_the_trigger_time_after_the_one_before() -> None:
    harness = LandDetectorHarness("quad").flown()
    assert harness.seconds_until("ground_contact", True, STANDING) == pytest.approx(THIRD_S, abs=CYCLE_S)
    assert not harness.land.maybe_landed
    assert harness.seconds_until("maybe_landed", True, STANDING) == pytest.approx(THIRD_S, abs=CYCLE_S)
    assert not harness.land.landed
    assert harness.seconds_until("landed", True, STANDING) == pytest.approx(THIRD_S, abs=CYCLE_S)


def test_the_trigger_time_is_a_parameter() -> None:
    harness = LandDetectorHarness("quad", LNDMC_TRIG_TIME=3.0).flown()
    assert harness.seconds_until("landed", True, STANDING) == pytest.approx(3.0, abs=3 * CYCLE_S)


def test_a_trigger_time_that_is_changed_counts_from_then_on() -> None:
    harness = LandDetectorHarness("quad").flown()
    harness.params.set("LNDMC_TRIG_TIME", 3.0)
    assert harness.seconds_until("landed", True, STANDING) == pytest.approx(3.0, abs=3 * CYCLE_S)


def test_without_valid_range_data_every_stage_takes_three_times_as_long() -> None:
    blind = replace(STANDING, dist_bottom_m=None)
    harness = LandDetectorHarness("quad").flown()
    assert harness.seconds_until("ground_contact", True, blind) == pytest.approx(1.0, abs=CYCLE_S)
    assert harness.seconds_until("maybe_landed", True, blind) == pytest.approx(1.0, abs=CYCLE_S)
    assert harness.seconds_until("landed", True, blind) == pytest.approx(1.0, abs=CYCLE_S)
    never_had_one = replace(blind, has_range_sensor=False)
    assert LandDetectorHarness("quad").flown().seconds_until("landed", True, never_had_one) == pytest.approx(
        1.0, abs=3 * CYCLE_S
    )


@pytest.mark.parametrize(
    "wrong",
    [
        {"throttle": 0.36},  # low thrust is 0.348 with a hover thrust estimate of 0.5
        {"throttle": 0.24, "hover_throttle": None},  # and 0.234 without
        {"v_z_m_s": 0.26},
        {"v_xy_m_s": 1.51},
        {"climb_command_m_s": 0.0},
        {"dist_bottom_m": 1.1},
    ],
    ids=lambda wrong: "-".join(wrong),
)
def test_no_ground_contact_with(wrong: dict[str, Any]) -> None:
    assert LandDetectorHarness("quad").flown().never("ground_contact", replace(STANDING, **wrong))


@pytest.mark.parametrize(
    "limit",
    [
        {"throttle": 0.34},
        {"throttle": 0.23, "hover_throttle": None},
        {"v_z_m_s": 0.24},
        {"v_xy_m_s": 1.49},
        {"v_xy_m_s": 9.0, "v_xy_valid": False},
        {"dist_bottom_m": 0.9},
    ],
    ids=lambda limit: "-".join(limit),
)
def test_ground_contact_just_within_the_limit_of(limit: dict[str, Any]) -> None:
    LandDetectorHarness("quad").flown().seconds_until("ground_contact", True, replace(STANDING, **limit))


def test_the_limits_of_movement_are_parameters() -> None:
    harness = LandDetectorHarness("quad", LNDMC_Z_VEL_MAX=0.6, LNDMC_XY_VEL_MAX=3.0).flown()
    harness.seconds_until("ground_contact", True, replace(STANDING, v_z_m_s=0.5, v_xy_m_s=2.5))


@pytest.mark.parametrize(
    "wrong",
    [
        {"throttle": 0.16},  # minimum thrust is 0.158
        {"rate_xy_rad_s": math.radians(21)},
        {"specific_force_m_s2": 1.9},
    ],
    ids=lambda wrong: "-".join(wrong),
)
def test_contact_but_not_maybe_landed_with(wrong: dict[str, Any]) -> None:
    harness = LandDetectorHarness("quad").flown()
    assert harness.never("maybe_landed", replace(STANDING, **wrong))
    assert harness.land.ground_contact


def test_turning_about_the_vertical_does_not_matter() -> None:
    LandDetectorHarness("quad").flown().seconds_until("landed", True, replace(STANDING, rate_rad_s=3.0))


def test_the_rotation_limit_is_a_parameter() -> None:
    harness = LandDetectorHarness("quad", LNDMC_ROT_MAX=40.0).flown()
    harness.seconds_until("maybe_landed", True, replace(STANDING, rate_xy_rad_s=math.radians(39)))


@pytest.mark.parametrize(("field", "size"), [("v_z_m_s", 0.6), ("rate_xy_rad_s", math.radians(49))])
def test_once_maybe_landed_the_limits_are_two_and_a_half_times_wider(field: str, size: float) -> None:
    harness = LandDetectorHarness("quad").flown()
    shaken = replace(STANDING, **{field: size})  # type: ignore[arg-type]
    assert harness.never("maybe_landed", shaken, 3.0)
    harness.feed(STANDING, 0.9)
    assert harness.land.maybe_landed
    assert harness.feed(shaken, 5.0).landed
    assert not harness.feed(replace(STANDING, **{field: size * 1.1}), 1.0).maybe_landed  # type: ignore[arg-type]


def test_once_landed_no_descent_is_asked_for() -> None:
    harness = LandDetectorHarness("quad").flown()
    harness.feed(STANDING, 2.0)
    assert harness.feed(replace(STANDING, climb_command_m_s=0.0), 5.0).landed


def test_more_than_minimum_thrust_ends_landed_at_once() -> None:
    harness = LandDetectorHarness("quad")
    harness.feed(replace(STANDING, climb_command_m_s=1.5), 2.0)
    assert harness.land.landed
    rising = replace(STANDING, climb_command_m_s=1.5, throttle=0.17)
    assert harness.seconds_until("landed", False, rising) <= CYCLE_S


def test_in_offboard_control_no_descent_is_asked_for_and_minimum_thrust_is_the_sticks() -> None:
    harness = LandDetectorHarness("quad").flown()
    harness.seconds_until("landed", True, replace(MANUAL, climb_command_m_s=0.0, throttle=0.089))
    assert LandDetectorHarness("quad").flown().never("maybe_landed", replace(MANUAL, throttle=0.091))
    free = LandDetectorHarness("quad", MPC_MANTHR_MIN=0.2).flown()
    free.seconds_until("maybe_landed", True, replace(MANUAL, throttle=0.2))


def test_minimum_thrust_is_a_tenth_of_the_range_to_hover_where_the_climb_is_controlled() -> None:
    """MPC_THR_MIN 0.12, hover at 0.5: up to 0.158; in manual flight MPC_MANTHR_MIN alone counts."""
    for throttle, lands in ((0.15, True), (0.165, False)):
        harness = LandDetectorHarness("quad").flown()
        assert harness.feed(replace(STANDING, throttle=throttle), 3.0).maybe_landed is lands
    assert not LandDetectorHarness("quad").flown().feed(replace(MANUAL, throttle=0.15), 3.0).maybe_landed


def test_a_descent_is_none_where_nothing_controls_the_climb() -> None:
    descending = replace(FLYING, v_xy_m_s=0.0, climb_command_m_s=-1.0, dist_bottom_m=None, has_range_sensor=False)
    assert LandDetectorHarness("quad").flown().feed(descending, 1.0).in_ground_effect
    assert not LandDetectorHarness("quad").flown().feed(replace(descending, mode=Mode.STABILIZED), 1.0).in_ground_effect


def test_after_a_reboot_the_hover_thrust_is_the_parameter_again() -> None:
    harness = LandDetectorHarness("quad")
    harness.feed(replace(FLYING, hover_throttle=0.9), 1.0)
    harness.reboot()
    assert not harness.feed(replace(STANDING, hover_throttle=None, throttle=0.3), 0.1).ground_contact


def test_the_hover_thrust_estimate_replaces_the_parameter_for_good() -> None:
    harness = LandDetectorHarness("quad")
    harness.feed(replace(FLYING, hover_throttle=0.3), 1.0)
    assert harness.never("ground_contact", replace(STANDING, throttle=0.18, hover_throttle=None), 3.0)  # 0.174
    harness.seconds_until("ground_contact", True, replace(STANDING, throttle=0.17, hover_throttle=None))


def test_disarmed_all_three_hold_in_the_air_too() -> None:
    harness = LandDetectorHarness("quad").flown()
    assert harness.seconds_until("landed", True, replace(FLYING, armed=False)) == pytest.approx(THIRD_S, abs=CYCLE_S)
    assert harness.land.ground_contact
    assert harness.land.maybe_landed


def test_free_fall_is_less_than_2_m_s2_for_three_tenths_of_a_second() -> None:
    harness = LandDetectorHarness("quad").flown()
    assert harness.never("freefall", replace(FLYING, specific_force_m_s2=2.1), 2.0)
    falling = replace(FLYING, specific_force_m_s2=1.9)
    assert harness.seconds_until("freefall", True, falling) == pytest.approx(0.3, abs=CYCLE_S)
    assert not harness.feed(FLYING, 0.02).freefall


@pytest.mark.parametrize(
    ("sample", "expected"),
    [
        (replace(FLYING, v_xy_m_s=1.0, climb_command_m_s=-0.5), True),  # descends
        (replace(FLYING, v_xy_m_s=2.0, climb_command_m_s=-0.5), False),  # but moves on
        (replace(FLYING, dist_bottom_m=1.9), True),  # flies low
        (replace(FLYING, dist_bottom_m=2.1), False),
        (replace(FLYING, dist_bottom_m=None), False),
        (replace(FLYING, dist_bottom_m=0.0, takeoff_state=TakeoffState.RAMPUP), True),
        (replace(FLYING, dist_bottom_m=0.0, takeoff_state=TakeoffState.GROUND), False),
    ],
)
def test_in_ground_effect_is_descending_flying_low_or_spinning_up(sample: Any, expected: bool) -> None:
    assert LandDetectorHarness("quad").feed(sample, 0.1).in_ground_effect is expected


def test_a_negative_ground_effect_height_turns_flying_low_off() -> None:
    assert (
        not LandDetectorHarness("quad", LNDMC_ALT_GND=-1.0)
        .feed(replace(FLYING, dist_bottom_m=0.5), 0.1)
        .in_ground_effect
    )
