"""Where Waydrop says that a return goes to a rally point, the simulated vehicle goes to that one; by RTL_TYPE."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from app.domain.airspace.rally import AT_HOME_M, ReturnConditions
from app.domain.autopilot import behaviour
from app.domain.errors import DivertRefusedError
from app.domain.vehicle.state import GlobalPosition, VehicleProfile, VehicleState, VehicleType, VtolState
from app.simulator.navigator.return_plan import ReturnDestination, ReturnPlan, Way
from tests.support.airborne_vehicle import FRAME, Airborne
from tests.support.simulated_vehicle import Plan, land, takeoff, waypoint

AWAY_M = st.integers(-400, 400).map(float)
PLACES = st.tuples(AWAY_M, AWAY_M).filter(lambda place: abs(math.hypot(*place) - AT_HOME_M) > 0.1)


def chosen_by_vehicle(
    rtl_type: int, airframe: str, here: tuple[float, float], rally: list[tuple[float, float]], garden: bool
) -> ReturnPlan:
    air = Airborne(airframe, (*here, 20.0), RTL_TYPE=rtl_type)
    air.upload([takeoff(10), waypoint(20, 0, 10), *([land(150.0, 40.0)] if garden else [])])
    air.upload([Plan(5100, *point, 15, (0, 0, 0, 0)) for point in rally], 2)
    return ReturnDestination(air.context, air.store, air.result).choose()


@given(
    st.integers(0, 5),
    st.sampled_from([("quad", VehicleType.MULTICOPTER, None), ("vtol", VehicleType.VTOL, VtolState.FIXED_WING)]),
    PLACES,
    st.lists(PLACES, max_size=4),
    st.booleans(),
)
def test_the_vehicle_goes_where_the_order_says_or_not_to_a_rally_point(
    rtl_type: int,
    kind: tuple[str, VehicleType, VtolState | None],
    here: tuple[float, float],
    rally: list[tuple[float, float]],
    garden: bool,
) -> None:
    flown = chosen_by_vehicle(rtl_type, kind[0], here, rally, garden)
    latitude_deg, longitude_deg = FRAME.to_global(*here)
    state = VehicleState(
        connected=True,
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        position_age_s=0.1,
        home=GlobalPosition(*FRAME.to_global(0.0, 0.0), 100.0),
        vtol_state=kind[2],
    )
    landings = [FRAME.to_global(150.0, 40.0)] if garden else []
    does = behaviour(VehicleProfile(kind[1], parameters={"RTL_TYPE": rtl_type, "RTL_LAND_DELAY": 0.0}))
    places = [FRAME.to_global(*point) for point in rally]
    sight = ReturnConditions(kind[1], state, places, landings, does.returns, does.rally_return)
    try:
        told = sight.destination()
    except DivertRefusedError as error:
        if error.extra["refusal"] != "divert.too_close":
            others = [point for point in rally if math.hypot(*point) > AT_HOME_M]
            assert flown.way is not Way.DIRECT or not any(math.dist(flown.point, point) < 0.5 for point in others)
        return
    meant = [rally[index] for index in (told.index, *told.or_index)]
    assert flown.way is Way.DIRECT
    assert any(math.dist(flown.point, point) < 0.5 for point in meant)
