"""What the return mode chooses as it is entered, and the warning of a home near the fence; without a flight."""

from __future__ import annotations

import pytest

from app.simulator.mission.geofence import CIRCLE_INCLUSION, POLYGON_INCLUSION, Geofence
from app.simulator.mission.item import Item
from app.simulator.navigator.mission_mode import JumpCounter
from app.simulator.navigator.return_mode import ReturnMode
from app.simulator.navigator.return_plan import ReturnCheck
from app.simulator.setpoint import SetpointKind
from app.simulator.state import Home
from app.simulator.wire import Cmd, Mode
from tests.support.airborne_vehicle import FRAME, Airborne, Place
from tests.support.simulated_vehicle import RELEASE, do, land, takeoff, waypoint

PLANS = [takeoff(15), waypoint(100, 0, 15), RELEASE, waypoint(0, 100, 15), do(Cmd.DO_LAND_START), land(0, 200)]
BREACH = ["RTL destination breaches geofence, will fly directly"]


def entered(
    rtl_type: int, airframe: str = "quad", landed: bool = False, from_mission: bool = True, then: Place | None = None
) -> Airborne:
    """The first cycle; and one at another place."""
    air = Airborne(airframe, (0.0, 90.0, 20.0), RTL_TYPE=rtl_type)
    air.upload(PLANS)
    air.store.current_seq = 1
    air.land(landed)
    mode = ReturnMode(air.context, air.store, air.result, JumpCounter(), lambda: Geofence((), air.context.frame))
    mode.from_mission = from_mission
    mode.activate()
    air.run(mode.step)
    if then is not None:
        air.place(*then)
        air.run(mode.step)
    return air


def test_a_direct_return_flies_home() -> None:
    air = entered(0)
    assert air.said[0].startswith("RTL: start return at")
    assert air.context.setpoint.kind is SetpointKind.LOITER
    assert len(air.said) == 1
    assert entered(0, then=(0.0, 90.0, 30.0)).context.setpoint.kind is SetpointKind.POSITION


@pytest.mark.parametrize(("from_mission", "seq"), [(True, 1), (False, 3)])
def test_a_return_along_the_mission_goes_on_or_begins_at_the_nearest(from_mission: bool, seq: int) -> None:
    air = entered(2, from_mission=from_mission)
    assert air.said == ["Executing Mission"]
    assert air.store.current_seq == seq
    there = (100.0, 0.0, 15.0) if from_mission else (0.0, 100.0, 15.0)
    assert entered(2, from_mission=from_mission, then=there).store.current_seq == seq + 2


def test_a_return_to_the_landing_knows_where_it_begins() -> None:
    air = entered(1)
    assert air.store.current_seq == 4
    assert air.said[1].startswith("RTL Mission land: climb to")


@pytest.mark.parametrize("rtl_type", [0, 1, 2])
def test_who_has_landed_idles_where_it_stands_whatever_the_type(rtl_type: int) -> None:
    air = entered(rtl_type, landed=True)
    assert (air.context.setpoint.kind, air.context.setpoint.point) == (SetpointKind.IDLE, (0.0, 90.0))
    assert air.context.setpoint.up_m == 20.0
    assert (air.said, [command for command, _ in air.issued]) == ([], [Cmd.IDLE])


def test_a_rover_that_stands_drives_home() -> None:
    air = entered(0, "rover", landed=True)
    assert air.context.setpoint.kind is SetpointKind.LAND
    assert len(air.said) == 2


def test_the_gimbal_turns_to_neutral_soon_after() -> None:
    air = entered(0)
    assert air.context.gimbal.due(air.clock.now_s + 0.2) == ()
    assert len(air.context.gimbal.due(air.clock.now_s + 0.3)) == 3


# the warning ------------------------------------------------------------------------------------------------


def polygon(half_m: float) -> Geofence:
    corners = [FRAME.to_global(north * half_m, east * half_m) for north, east in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    items = [
        Item(POLYGON_INCLUSION, 0, 1, 4.0, 0.0, 0.0, 0.0, round(latitude * 1e7), round(longitude * 1e7), 0.0)
        for latitude, longitude in corners
    ]
    return Geofence(tuple(items), FRAME)


def checking(fence: Geofence | None, airframe: str = "quad", **params: float) -> tuple[Airborne, ReturnCheck]:
    air = Airborne(airframe, **params)
    check = ReturnCheck(air.context)
    if fence is not None:
        check.take(fence)
    return air, check


@pytest.mark.parametrize(
    ("airframe", "params", "margin_m"),
    [
        ("quad", {"NAV_ACC_RAD": 8.0}, 16.0),
        ("rover", {"NAV_ACC_RAD": 8.0}, 16.0),
        ("plane", {"NAV_LOITER_RAD": 30.0}, 30.0),
        ("vtol", {"NAV_LOITER_RAD": -30.0}, 30.0),
    ],
)
def test_home_keeps_off_the_fence_by_what_the_type_needs(
    airframe: str, params: dict[str, float], margin_m: float
) -> None:
    for half_m, said in ((margin_m + 0.2, []), (margin_m - 0.2, BREACH)):
        air, check = checking(polygon(half_m), airframe, **params)
        air.run(check.step, 3.0)
        assert air.said == said
        assert air.events == [("rtl_destination_breaches",)] * len(said)


def test_it_is_said_once_for_each_fence_and_each_home() -> None:
    air, check = checking(polygon(10.0))
    air.run(check.step, 10.0)
    assert air.said == BREACH
    check.take(polygon(10.0))
    air.run(check.step, 10.0)
    assert air.said == BREACH * 2
    for moved_m, times in ((0.08, 2), (0.15, 3)):
        air.status.home = Home(0.0, moved_m, 0.0)
        air.run(check.step, 10.0)
        assert air.said == BREACH * times


def test_it_looks_every_two_seconds_and_at_once_after_power_up() -> None:
    air, check = checking(polygon(10.0))
    air.run(check.step)
    check.take(polygon(10.0))
    assert air.until(check.step, lambda: len(air.said) == 2) == pytest.approx(2.0, abs=0.03)
    check.boot()
    check.take(polygon(10.0))
    air.run(check.step)
    assert len(air.said) == 3


@pytest.mark.parametrize("reboots", [True, False])
def test_the_first_look_is_in_the_first_cycle(reboots: bool) -> None:
    air, check = checking(polygon(10.0))
    if reboots:
        air.run(check.step, 3.0)
        air.said.clear()
        check.take(polygon(10.0))
        check.boot()
    air.clock.now_s = 0.02
    check.step()
    assert air.said == BREACH


def test_a_polygon_with_missing_vertices_is_none_to_keep_off() -> None:
    x, y = (round(degrees * 1e7) for degrees in FRAME.to_global(-9.0, 0.0))
    air, check = checking(Geofence((Item(POLYGON_INCLUSION, 0, 1, 4.0, 0.0, 0.0, 0.0, x, y, 0.0),), FRAME))
    air.run(check.step, 3.0)
    assert air.said == []


def test_it_does_not_look_without_a_fence_without_home_or_on_a_return() -> None:
    air, check = checking(None)
    air.run(check.step, 3.0)
    check.take(polygon(10.0))
    air.status.home = None
    air.run(check.step, 3.0)
    air.status.home = Home(0.0, 0.0, 0.0)
    air.status.mode = Mode.RTL
    air.run(check.step, 3.0)
    assert air.said == []
    air.status.mode = Mode.LAND
    air.run(check.step, 3.0)
    assert air.said == BREACH


def test_a_home_on_the_fences_first_point_is_never_looked_at() -> None:
    x, y = (round(degrees * 1e7) for degrees in FRAME.to_global(0.0, 0.0))
    air, check = checking(Geofence((Item(CIRCLE_INCLUSION, 0, 1, 5.0, 0.0, 0.0, 0.0, x, y, 0.0),), FRAME))
    air.run(check.step, 3.0)
    assert air.said == []
