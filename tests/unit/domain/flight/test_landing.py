"""The landing at a mission's end is the mission's own, or at its place; else somebody must fetch the vehicle."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.flight.landing import HeightTracker, Touchdown
from app.domain.mission import Mission
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction
from app.domain.vehicle.state import FlightMode, GlobalPosition, VehicleState, VehicleType
from tests.support.plan_pieces import HOME, RETURN, Json, at, facts, land, plan, takeoff, waypoint

RALLY: Json = {"rally_points": [at(500, 0, relative_altitude_m=20)]}
BECAUSE = Reason.of(ReasonCode.FAILSAFE)
WAYS_DOWN = (FlightMode.LAND, FlightMode.POSITION, FlightMode.MANUAL, FlightMode.DESCEND)


def mission(end: Json, **more: object) -> Mission:
    return compiled(plan("multicopter", takeoff(), waypoint(200), end, **more))


def compiled(made: Plan) -> Mission:
    return compile_plan(made, facts(made.vehicle_type.value))


def stands(north_m: float, mode: FlightMode | None) -> VehicleState:
    return VehicleState(mode=mode, home=HOME, position_age_s=0.1, **at(north_m, 0))


def broken_off(
    flown: Mission,
    mode: FlightMode | None,
    north_m: float,
    kind: VehicleType = VehicleType.MULTICOPTER,
    commanded: RunAction | None = None,
) -> bool:
    why = Touchdown.of(stands(north_m, mode), None, BECAUSE).why_elsewhere(flown, commanded, kind)
    assert why in (None, Reason.of(ReasonCode.LANDED_ELSEWHERE, BECAUSE))
    return why is not None


@pytest.mark.parametrize("mode", WAYS_DOWN)
@pytest.mark.parametrize("end", [RETURN, land(50)], ids=["return", "land"])
def test_another_mode_that_brought_it_down_elsewhere_broke_the_landing_off(end: Json, mode: FlightMode) -> None:
    assert broken_off(mission(end), mode, 120.0)


@pytest.mark.parametrize(("end", "place_m"), [(RETURN, 0.0), (land(50), 50.0)], ids=["return", "land"])
def test_a_vehicle_that_stands_at_the_place_has_landed_there_whoever_flew_it(end: Json, place_m: float) -> None:
    assert not broken_off(mission(end), FlightMode.LAND, place_m + 3.0)
    assert broken_off(mission(end), FlightMode.DESCEND, place_m), "PX4 descends where it does not know its position"


def test_a_landing_item_has_its_own_mode_wherever_it_ends() -> None:
    assert not broken_off(mission(land(50)), FlightMode.MISSION, 300.0)
    assert broken_off(mission(land(50)), FlightMode.RETURN, 300.0), "a return before the landing"


@pytest.mark.parametrize("mode", [FlightMode.RETURN, None, FlightMode.HOLD, FlightMode.MISSION])
def test_a_return_is_judged_by_its_place_whatever_the_mode(mode: FlightMode | None) -> None:
    """Whoever disarms a vehicle ends its return anywhere, and PX4 says nothing of it but the mode before."""
    assert broken_off(mission(RETURN), mode, 120.0)
    assert not broken_off(mission(RETURN), mode, 3.0)


@pytest.mark.parametrize("mode", [FlightMode.RETURN, None, FlightMode.HOLD, FlightMode.MISSION])
@pytest.mark.parametrize("unknown", ["home", "place"])
def test_a_mode_that_says_nothing_breaks_nothing_off_where_the_place_is_not_known(
    mode: FlightMode | None, unknown: str
) -> None:
    state = replace(stands(120.0, mode), **({"home": None} if unknown == "home" else {"position_age_s": 40.0}))
    judged = Touchdown.of(state, None, BECAUSE)
    assert judged.why_elsewhere(mission(RETURN), None, VehicleType.MULTICOPTER) is None


def test_home_of_the_takeoff_counts_where_it_has_moved_since() -> None:
    """PX4 moves it as it disarms, perhaps while Waydrop is stopped."""
    moved = replace(stands(120.0, FlightMode.HOLD), home=GlobalPosition(*at(120.0, 0).values(), 488.0))
    judged = Touchdown.of(moved, None, BECAUSE, took_off_from=HOME)
    assert judged.why_elsewhere(mission(RETURN), None, VehicleType.MULTICOPTER) is not None


def test_a_rally_point_is_a_place_to_return_to() -> None:
    assert not broken_off(mission(RETURN, **RALLY), FlightMode.LAND, 497.0)
    assert broken_off(mission(RETURN), FlightMode.LAND, 497.0)


def test_a_fixed_wing_may_be_landed_by_hand_on_the_strip_beside() -> None:
    made = plan("fixed_wing", takeoff(40, **at(160, 0)), waypoint(400), RETURN)
    assert not broken_off(compiled(made), FlightMode.MANUAL, 150.0, VehicleType.FIXED_WING)
    assert not broken_off(compiled(made), FlightMode.MANUAL, 150.0, VehicleType.AIRSHIP)
    assert broken_off(compiled(made), FlightMode.MANUAL, 250.0, VehicleType.FIXED_WING)


def test_a_mission_that_ends_in_the_air_is_landed_by_somebody() -> None:
    assert not broken_off(mission(waypoint(300)), FlightMode.LAND, 300.0)


def test_a_place_that_is_not_known_is_not_taken_for_the_right_one() -> None:
    unknown, old = VehicleState(mode=FlightMode.LAND), replace(stands(0.0, FlightMode.LAND), position_age_s=40.0)
    for state in (unknown, old):
        found = Touchdown.of(state, None, None).why_elsewhere(mission(RETURN), None, VehicleType.MULTICOPTER)
        assert found == Reason.of(ReasonCode.LANDED_ELSEWHERE, Reason.of(ReasonCode.VEHICLE_LANDS))


def test_a_vehicle_that_is_found_disarmed_is_judged_by_its_descent() -> None:
    """Silent at touchdown: PX4 goes back to Hold as it disarms, and moves home to the place."""
    descends = stands(120.0, FlightMode.LAND)
    found = replace(stands(120.0, FlightMode.HOLD), home=GlobalPosition(descends.latitude_deg or 0.0, 8.545594, 488.0))
    judged = Touchdown.of(found, descends, BECAUSE)
    assert judged.why_elsewhere(mission(RETURN), None, VehicleType.MULTICOPTER) is not None
    returned = Touchdown.of(replace(found, **at(3.0, 0)), replace(descends, mode=FlightMode.RETURN), None)
    assert returned.why_elsewhere(mission(RETURN), None, VehicleType.MULTICOPTER) is None


@pytest.mark.parametrize("commanded", [RunAction.RETURN, RunAction.CONTINGENCY])
def test_a_return_that_was_commanded_has_its_destination_too(commanded: RunAction) -> None:
    ends_in_the_air = mission(waypoint(300))
    assert broken_off(ends_in_the_air, FlightMode.LAND, 200.0, commanded=commanded)
    assert not broken_off(ends_in_the_air, FlightMode.LAND, 2.0, commanded=commanded)
    assert broken_off(ends_in_the_air, FlightMode.RETURN, 200.0, commanded=commanded), "disarmed on its way"
    assert not broken_off(ends_in_the_air, FlightMode.RETURN, 2.0, commanded=commanded)


@pytest.mark.parametrize(
    ("end", "place_m", "mode"),
    [(RETURN, 0.0, FlightMode.RETURN), (RETURN, 0.0, FlightMode.HOLD), (land(50), 50.0, FlightMode.MISSION)],
)
def test_a_landing_that_was_not_seen_is_judged_by_its_place(end: Json, place_m: float, mode: FlightMode) -> None:
    """What a failsafe flew while the link was lost, no mode tells that was heard before."""
    in_air = stands(150.0, mode)

    def why(north_m: float, **told: object) -> Reason | None:
        found = replace(stands(north_m, FlightMode.HOLD), **told)  # type: ignore[arg-type]
        judged = Touchdown.of(found, in_air, None, is_seen=False).located(found)
        return judged.why_elsewhere(mission(end), None, VehicleType.MULTICOPTER)

    assert why(place_m + 3.0) is None
    assert why(place_m + 200.0) == Reason.of(ReasonCode.LANDED_ELSEWHERE, Reason.of(ReasonCode.LANDING_UNSEEN))


def test_a_return_that_was_not_seen_is_not_judged_where_home_is_not_known() -> None:
    in_air, down = (replace(stands(150.0, mode), home=None) for mode in (FlightMode.RETURN, FlightMode.HOLD))
    judged = Touchdown.of(down, in_air, None, is_seen=False)
    assert judged.why_elsewhere(mission(RETURN, **RALLY), None, VehicleType.MULTICOPTER) is None


def test_a_landing_that_was_not_seen_waits_for_its_place() -> None:
    in_air, old = stands(150.0, FlightMode.MISSION), replace(stands(150.0, FlightMode.HOLD), position_age_s=40.0)
    found = Touchdown.of(old, in_air, None, is_seen=False)
    assert found.why_elsewhere(mission(RETURN), None, VehicleType.MULTICOPTER) is None, "nothing is known of its place"
    later = found.located(stands(200.0, FlightMode.HOLD))
    assert later.why_elsewhere(mission(RETURN), None, VehicleType.MULTICOPTER) is not None
    assert found.located(stands(1.0, FlightMode.HOLD)).located(stands(200.0, FlightMode.HOLD)).state == stands(
        1.0, FlightMode.HOLD
    ), "it is carried away after it landed"


def test_home_that_moves_after_the_return_began_is_not_where_it_goes() -> None:
    """PX4 moves home of a rover whose return begins at a waypoint: it says landed there, and then takes off (flown)."""
    moved = GlobalPosition(*at(25.0, 0).values(), 488.0)
    in_sight, found = (replace(stands(m, FlightMode.RETURN), home=moved) for m in (3.0, 0.5))
    judged = Touchdown.of(found, in_sight, BECAUSE, took_off_from=HOME)
    assert judged.why_elsewhere(mission(RETURN), None, VehicleType.MULTICOPTER) is None


@pytest.mark.parametrize(("north_m", "is_elsewhere"), [(0.5, False), (25.0, True)], ids=["took off", "moved to"])
def test_a_rover_returns_to_where_it_took_off_and_not_to_where_home_was_moved(
    north_m: float, is_elsewhere: bool
) -> None:
    """A return that is paused and repeated goes to the moved home (flown)."""
    moved = GlobalPosition(*at(25.0, 0).values(), 488.0)
    stood = replace(stands(north_m, FlightMode.RETURN), home=moved)
    judged = Touchdown.of(stood, stood, BECAUSE, took_off_from=HOME)
    assert (judged.why_elsewhere(mission(RETURN), None, VehicleType.ROVER) is not None) == is_elsewhere


@pytest.mark.parametrize(
    ("kind", "fallen_m", "is_fall"),
    [
        (VehicleType.MULTICOPTER, 3.0, False),
        (VehicleType.MULTICOPTER, 5.0, True),
        (VehicleType.FIXED_WING, 5.0, False),
        (VehicleType.FIXED_WING, 12.0, True),
    ],
)
def test_a_fall_is_measured_from_where_it_was_a_moment_before(
    kind: VehicleType, fallen_m: float, is_fall: bool
) -> None:
    """A plane that is landed by hand loses metres as it touches down, and its pilot stops the motor there."""
    high = replace(stands(1.0, FlightMode.RETURN), absolute_altitude_m=488.0 + fallen_m)
    lies = replace(high, absolute_altitude_m=488.0, boot_time_s=12.0)
    told = HeightTracker().in_air(replace(high, absolute_altitude_m=600.0, boot_time_s=1.0))
    told = told.in_air(replace(high, boot_time_s=11.0))
    judged = Touchdown.of(lies, high, None, from_m=told.highest_m(lies))
    assert (judged.why_fallen(lies, kind) is not None) == is_fall
    assert judged.why_fallen(replace(lies, position_age_s=9.0), kind) is None, "nobody knows where it lies"
