"""How high a return flies, and how each vehicle type ends it."""

from __future__ import annotations

import pytest

from app.simulator.mission.geofence import POLYGON_EXCLUSION, Geofence
from app.simulator.mission.item import Item
from app.simulator.navigator.return_mode import DirectReturn
from app.simulator.params import Value
from app.simulator.setpoint import SetpointKind
from app.simulator.state import Home, LandDetected
from app.simulator.wire import Cmd, VtolState
from tests.support.simulated_vehicle import GroundStation, takeoff, waypoint


def returning(airframe: str, north_m: float, up_m: float, **params: float) -> tuple[GroundStation, DirectReturn]:
    gcs = GroundStation(airframe, params=params, ready=False)
    vehicle = gcs.vehicle
    vehicle.state.status.home = Home(0.0, 0.0, 0.0)
    vehicle.state.status.land = LandDetected(landed=False)
    vehicle.state.body.north_m, vehicle.state.body.up_m = north_m, up_m
    way = DirectReturn(vehicle.context, lambda: Geofence((), vehicle.context.frame))
    way.start((0.0, 0.0))
    return gcs, way


@pytest.mark.parametrize(
    ("north_m", "up_m", "params", "return_m"),
    [
        (100.0, 15.0, {}, 30.0),
        (100.0, 15.0, {"RTL_RETURN_ALT": 50.0}, 50.0),
        (100.0, 70.0, {}, 70.0),  # it never descends first
        (4.0, 3.0, {}, 8.0),  # inside NAV_ACC_RAD: twice the distance
        (4.0, 15.0, {}, 15.0),
        (25.0, 5.0, {"RTL_MIN_DIST": 40.0}, 25.0),  # inside RTL_MIN_DIST: the cone of 45 degrees
        (25.0, 5.0, {"RTL_MIN_DIST": 20.0}, 30.0),
        (15.0, 5.0, {"RTL_MIN_DIST": 40.0}, 20.0),  # at least twice NAV_ACC_RAD
    ],
)
def test_a_return_climbs_to_its_altitude_less_near_home(
    north_m: float, up_m: float, params: dict[str, float], return_m: float
) -> None:
    gcs, _ = returning("quad", north_m, up_m, **params)
    assert gcs.vehicle.context.setpoint.up_m == pytest.approx(return_m)


def test_a_wing_climbs_to_its_altitude_near_home_too() -> None:
    gcs, _ = returning("plane", 4.0, 3.0, RTL_RETURN_ALT=50.0)
    assert gcs.vehicle.context.setpoint.up_m == 50.0


# the end, by RTL_LAND_DELAY ---------------------------------------------------------------------------------


def flown_home(airframe: str, **params: Value) -> GroundStation:
    """Returns from 200 m away; in the air on its way."""
    high = {"RTL_RETURN_ALT": 45.0, "RTL_DESCEND_ALT": 25.0, "MIS_TKO_LAND_REQ": 0, **params}
    gcs = GroundStation(airframe, params=high)
    command = Cmd.NAV_VTOL_TAKEOFF if airframe == "vtol" else Cmd.NAV_TAKEOFF
    gcs.start([takeoff(40, north_m=60.0, command=command), waypoint(200, 0, 40), waypoint(600, 0, 40)])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 150.0)
    gcs.command(Cmd.NAV_RETURN_TO_LAUNCH)
    return gcs


def height_m(gcs: GroundStation) -> float:
    return gcs.vehicle.state.body.up_m


def kind(gcs: GroundStation) -> SetpointKind:
    return gcs.vehicle.context.setpoint.kind


def test_a_multicopter_lands_at_once() -> None:
    gcs = flown_home("quad")
    gcs.until(lambda: kind(gcs) is SetpointKind.LAND)
    assert height_m(gcs) == pytest.approx(45.0, abs=1.0)
    gcs.until(lambda: not gcs.armed)
    assert gcs.distance_to(0.0, 0.0) < 1.0


@pytest.mark.parametrize("airframe", ["quad", "plane"])
def test_with_a_delay_it_waits_at_rtl_descend_alt_and_then_lands(airframe: str) -> None:
    gcs = flown_home(airframe, RTL_LAND_DELAY=20.0, RTL_LOITER_RAD=50.0)
    gcs.until(lambda: gcs.vehicle.context.setpoint.up_m == 25.0)
    down_s = gcs.until(lambda: height_m(gcs) < 30.5, 60.0)
    assert down_s > 1.0
    assert gcs.until(lambda: kind(gcs) is SetpointKind.LAND, 60.0) >= 20.0
    assert "RTL: completed, loitering" not in gcs.texts()
    gcs.until(lambda: gcs.vehicle.state.status.landed, 200.0)
    assert gcs.distance_to(0.0, 0.0) < 60.0


@pytest.mark.parametrize("airframe", ["quad", "plane"])
def test_with_a_negative_delay_it_stays_there(airframe: str) -> None:
    gcs = flown_home(airframe, RTL_LAND_DELAY=-1.0, RTL_LOITER_RAD=50.0)
    gcs.until(lambda: "RTL: completed, loitering" in gcs.texts())
    gcs.fly(60.0)
    assert kind(gcs) is SetpointKind.LOITER
    assert height_m(gcs) == pytest.approx(25.0, abs=1.0)
    orbit_m = 50.0 if airframe == "plane" else 0.0
    assert gcs.distance_to(0.0, 0.0) == pytest.approx(orbit_m, abs=6.0)


def test_a_plane_is_told_not_to_land_by_its_airframe() -> None:
    assert GroundStation("plane", ready=False).vehicle.params["RTL_LAND_DELAY"] == -1.0


def test_a_vtol_on_its_wing_comes_down_in_circles_and_changes_back_before_it_lands() -> None:
    gcs = flown_home("vtol", RTL_LOITER_RAD=50.0)
    assert gcs.vehicle.state.status.vtol_state == VtolState.FW
    gcs.until(lambda: gcs.vehicle.state.status.vtol_state == VtolState.MC)
    assert height_m(gcs) == pytest.approx(25.0, abs=11.0), "within NAV_FW_ALT_RAD"
    assert gcs.distance_to(0.0, 0.0) < 30.0
    assert (3000, 3.0) in [(message.command, message.param1) for message in gcs.messages("COMMAND_LONG")]
    gcs.until(lambda: not gcs.armed)
    assert gcs.distance_to(0.0, 0.0) < 1.0


WALL = (30.0, -40.0, 70.0, 40.0)
"""South, west, north and east edge of an exclusion between the vehicle and home."""


def wall(gcs: GroundStation) -> tuple[Item, ...]:
    """The exclusion's corners."""
    south, west, north, east = WALL
    places = [(south, west), (north, west), (north, east), (south, east)]
    frame = gcs.vehicle.context.frame
    return tuple(fence_corner(frame.to_global(*place), len(places)) for place in places)


def fence_corner(place: tuple[float, float], count: int) -> Item:
    latitude_deg, longitude_deg = place
    x, y = round(latitude_deg * 1e7), round(longitude_deg * 1e7)
    return Item(POLYGON_EXCLUSION, 0, 1, float(count), 0.0, 0.0, 0.0, x, y, 0.0)


@pytest.mark.parametrize("firmware", ["px4-main", "px4-1.14"])
def test_newer_firmware_flies_round_an_exclusion_on_its_way_and_says_so(firmware: str) -> None:
    gcs = GroundStation("quad", firmware=firmware, ready=False)
    vehicle = gcs.vehicle
    vehicle.state.status.home = Home(0.0, 0.0, 0.0)
    vehicle.state.status.land = LandDetected(landed=False)
    body = vehicle.state.body
    body.north_m, body.up_m = 100.0, 40.0
    way = DirectReturn(vehicle.context, lambda: Geofence(wall(gcs), vehicle.context.frame))
    way.start((0.0, 0.0))
    visited = [vehicle.context.setpoint.point]
    for _ in range(200):
        body.north_m, body.east_m = vehicle.context.setpoint.point
        way.step()
        if vehicle.context.setpoint.point != visited[-1]:
            visited.append(vehicle.context.setpoint.point)
    corners = [(round(north), round(east)) for north, east in visited[1:-1]]
    margin_m = 2 * float(vehicle.context.params["NAV_ACC_RAD"])
    if firmware == "px4-main":
        aside_m = 40 + margin_m
        assert [(north, abs(east)) for north, east in corners] == [(70 + margin_m, aside_m), (30 - margin_m, aside_m)]
    else:
        assert corners == []
    assert visited[-1] == (0.0, 0.0)
    gcs.fly(0.5)
    assert ("RTL: avoiding geofence" in gcs.texts()) == (firmware == "px4-main")


def test_a_return_that_begins_above_its_destination_goes_no_way_round() -> None:
    gcs = GroundStation("quad", ready=False)
    vehicle = gcs.vehicle
    vehicle.state.status.home = Home(0.0, 0.0, 0.0)
    vehicle.state.status.land = LandDetected(landed=False)
    vehicle.state.body.up_m = 20.0
    way = DirectReturn(vehicle.context, lambda: Geofence(wall(gcs), vehicle.context.frame))
    way.start((0.0, 0.0))
    assert vehicle.context.setpoint.point == (0.0, 0.0)
    gcs.fly(0.5)
    assert "RTL: avoiding geofence" not in gcs.texts()
