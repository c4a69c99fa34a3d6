"""What the values of PX4's choices mean."""

from __future__ import annotations

import pytest

from app.domain.autopilot import Behaviour, behaviour
from app.domain.vehicle.state import VehicleProfile, VehicleType


def as_set(name: str, value: float) -> Behaviour:
    return behaviour(VehicleProfile(VehicleType.MULTICOPTER, parameters={name: value}))


@pytest.mark.parametrize(
    ("rtl_type", "home", "landing", "along", "turns_back", "may_follow"),
    [
        (0, True, False, False, False, False),
        (1, False, True, False, False, False),
        (2, True, False, True, False, True),
        (3, True, True, False, False, False),
        (4, True, False, True, True, True),
        (5, False, False, False, False, False),
        (6, True, False, False, False, True),
    ],
)
def test_rtl_type_says_where_a_return_goes(
    rtl_type: int, home: bool, landing: bool, along: bool, turns_back: bool, may_follow: bool
) -> None:
    found = as_set("RTL_TYPE", rtl_type).returns
    assert (found.to_home, found.to_landing) == (home, landing)
    assert (found.along_items, found.turns_back, found.may_follow_items) == (along, turns_back, may_follow)
    assert bool(found.choice) is not may_follow, "it goes to a rally point, or along the items"
    assert str(found.setting) == f"RTL_TYPE {rtl_type}"


@pytest.mark.parametrize(
    ("required", "takeoff", "landing", "pair", "in_flight"),
    [
        (0, False, False, False, False),
        (1, True, False, False, False),
        (2, False, True, False, True),
        (3, True, True, False, True),
        (4, False, False, True, False),
        (5, False, False, True, True),
    ],
)
def test_mis_tko_land_req_says_what_a_mission_needs(
    required: int, takeoff: bool, landing: bool, pair: bool, in_flight: bool
) -> None:
    needs = as_set("MIS_TKO_LAND_REQ", required).mission_needs
    assert (needs.takeoff, needs.landing) == (takeoff, landing)
    assert (needs.both_or_neither, needs.landing_in_flight) == (pair, in_flight)


@pytest.mark.parametrize(("action", "word"), [(0, "continue"), (1, "hold"), (2, "return"), (3, "land"), (5, None)])
def test_nav_dll_act_is_an_action_of_a_plan_or_none(action: int, word: str | None) -> None:
    assert as_set("NAV_DLL_ACT", action).link_loss.action == word


@pytest.mark.parametrize(("action", "only_warns", "below"), [(0, True, None), (1, False, 7.0), (3, False, 7.0)])
def test_com_low_bat_act_says_whether_it_acts_by_itself(action: int, only_warns: bool, below: float | None) -> None:
    low = as_set("COM_LOW_BAT_ACT", action).low_battery
    assert low.only_warns is only_warns
    assert (None if low.acts_below is None else round(low.acts_below.value, 6)) == below


@pytest.mark.parametrize(("action", "stays"), [(0, False), (1, False), (2, True), (3, True), (4, False)])
def test_gf_action_says_whether_it_stays_inside(action: int, stays: bool) -> None:
    assert (as_set("GF_ACTION", action).fence_breach.ignored == "") is stays
