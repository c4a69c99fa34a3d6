"""Which rally point a return goes to, in words, and why it goes to none."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.airspace.rally import RallyDestination, ReturnConditions
from app.domain.autopilot import Behaviour, behaviour
from app.domain.errors import ConflictError, DivertRefusedError
from app.domain.reasons import describe
from app.domain.vehicle.state import GlobalPosition, VehicleProfile, VehicleState, VehicleType, VtolState

HOME = GlobalPosition(47.0, 8.0, 400.0)
METRE_DEG = 1 / 111_194.926


def north(metres: float) -> tuple[float, float]:
    """A place so far north of home."""
    return 47.0 + metres * METRE_DEG, 8.0


def as_set(rtl_type: int, land_delay_s: float | None = 0.0, approach_force: int = 0) -> Behaviour:
    found = {"RTL_TYPE": rtl_type, "RTL_LAND_DELAY": land_delay_s, "RTL_APPR_FORCE": approach_force}
    parameters = {name: value for name, value in found.items() if value is not None}
    return behaviour(VehicleProfile(VehicleType.VTOL, parameters=parameters))


def sight(
    rtl_type: int, at_m: float, *rally_m: float, landing_m: float | None = None, **state: object
) -> ReturnConditions:
    """All places in metres north of home."""
    latitude_deg, longitude_deg = north(at_m)
    seen = VehicleState(latitude_deg=latitude_deg, longitude_deg=longitude_deg, position_age_s=0.1, home=HOME)
    does = as_set(rtl_type)
    return ReturnConditions(
        vehicle_type=VehicleType.MULTICOPTER,
        state=replace(seen, **state),  # type: ignore[arg-type]
        rally=[north(metres) for metres in rally_m],
        landings=[] if landing_m is None else [north(landing_m)],
        returns=does.returns,
        there=does.rally_return,
    )


def told(rtl_type: int, at_m: float, *rally_m: float) -> RallyDestination:
    return sight(rtl_type, at_m, *rally_m).destination()


def test_the_nearest_rally_point_is_named_with_its_distance_and_the_rule_that_chooses_it() -> None:
    found = told(0, 300.0, 60.0, 350.0)
    assert (found.index, found.or_index, found.lands) == (1, (), True)
    assert describe(found.reason) == "rally point 2, 50 m away: the nearest of home and the rally points (RTL_TYPE 0)"
    assert (found.latitude_deg, found.longitude_deg) == north(350.0)


def test_one_that_is_nearly_as_near_is_named_too() -> None:
    found = told(5, 300.0, 250.0, 360.0)
    assert (found.index, found.or_index) == (0, (1,))
    assert describe(found.reason).startswith(
        "rally point 1 or 2, 50 m away: the nearest rally point (RTL_TYPE 5), depending on where"
    )


def test_a_fast_vehicle_is_less_sure_of_what_is_nearest() -> None:
    fast = sight(5, 300.0, 250.0, 425.0, velocity_north_m_s=0.0, velocity_east_m_s=20.0)
    assert fast.destination().or_index == (1,)
    assert told(5, 300.0, 250.0, 425.0).or_index == ()


def test_what_it_flies_until_the_last_try_of_the_order_may_decide_so_home_must_be_farther_still() -> None:
    """Five seconds at 15 m/s: 75 m nearer to home, and as much farther from the rally point."""
    with pytest.raises(DivertRefusedError) as refused:
        sight(0, 300.0, 460.0, velocity_north_m_s=-15.0, velocity_east_m_s=0.0).destination()
    assert refused.value.extra["refusal"] == "divert.too_close"


def test_a_vehicle_that_does_not_land_there_is_told_of() -> None:
    found = replace(sight(5, 300.0, 250.0), there=as_set(5, -1.0).rally_return).destination()
    assert (found.lands, describe(found.reason).endswith("the vehicle does not land there (RTL_LAND_DELAY)")) == (
        False,
        True,
    )
    assert replace(sight(5, 300.0, 250.0), there=as_set(5, None).rally_return).destination().lands is None


@pytest.mark.parametrize(
    ("what", "because", "words"),
    [
        (sight(0, 300.0), "divert.no_rally_points", "the vehicle has no rally points"),
        (sight(5, 300.0), "divert.no_rally_points", "the vehicle has no rally points"),
        (sight(0, 300.0, 5.0, -8.0), "divert.no_rally_points", "at home"),
        (sight(2, 300.0, 320.0), "divert.return_type", "RTL_TYPE 2, a return follows the mission"),
        (sight(4, 300.0, 320.0), "divert.return_type", "RTL_TYPE 4"),
        (sight(0, 100.0, 400.0), "divert.other_is_nearer", "home is 100 m away, rally point 1 is 300 m"),
        (sight(3, 300.0, 500.0, landing_m=320.0), "divert.other_is_nearer", "the mission landing is 20 m away"),
        (
            sight(1, 300.0, 500.0, landing_m=320.0),
            "divert.other_is_nearer",
            "the nearest of the rally points and the mission",
        ),
        (sight(0, 100.0, 210.0), "divert.too_close", "too close to predict"),
    ],
)
def test_where_it_would_go_elsewhere_the_order_is_refused_with_the_reason(
    what: ReturnConditions, because: str, words: str
) -> None:
    with pytest.raises(DivertRefusedError, match=words) as refused:
        what.destination()
    assert refused.value.extra["refusal"] == because
    assert refused.value.hint


def test_home_is_no_choice_for_type_1_but_of_a_vtol_that_hovers() -> None:
    near_home = sight(1, 30.0, 400.0)
    assert near_home.destination().index == 0
    vtol = replace(near_home, vehicle_type=VehicleType.VTOL)
    with pytest.raises(DivertRefusedError, match="home is 30 m away"):
        vtol.destination()
    on_its_wing = replace(vtol, state=replace(vtol.state, vtol_state=VtolState("fixed_wing")))
    assert on_its_wing.destination().index == 0


@pytest.mark.parametrize("vtol_state", [VtolState.FIXED_WING, VtolState.MULTICOPTER])
def test_a_vtol_that_wants_landing_approaches_passes_over_rally_points_so_it_is_refused(vtol_state: VtolState) -> None:
    copter = replace(sight(5, 300.0, 320.0, vtol_state=vtol_state), there=as_set(5, approach_force=1).rally_return)
    assert copter.destination().index == 0
    vtol = replace(copter, vehicle_type=VehicleType.VTOL)
    with pytest.raises(DivertRefusedError, match="RTL_APPR_FORCE 1") as refused:
        vtol.destination()
    assert refused.value.extra["refusal"] == "divert.approach_forced"
    assert replace(vtol, there=as_set(5).rally_return).destination().index == 0


@pytest.mark.parametrize("missing", [{"position_age_s": 9.0}, {"latitude_deg": None}, {"home": None}])
def test_nothing_is_said_of_a_vehicle_whose_place_or_home_is_not_known(missing: dict[str, object]) -> None:
    with pytest.raises(ConflictError):
        sight(0, 300.0, 350.0, **missing).destination()
