"""Returns: what a rover does first (scenario 21), and the warning of a destination near the fence (scenario 05)."""

from __future__ import annotations

import pytest

from app.simulator.mission.geofence import CIRCLE_EXCLUSION, POLYGON_EXCLUSION, POLYGON_INCLUSION
from app.simulator.wire import LandedState, Mode
from tests.support.simulated_vehicle import GroundStation, Plan, waypoint

FENCE = 1
BREACH = "RTL destination breaches geofence, will fly directly"


def breaches(gcs: GroundStation) -> int:
    return "".join(gcs.texts()).count(BREACH)


def square(half_m: float, command: int = POLYGON_INCLUSION, north_m: float = 0.0) -> list[Plan]:
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return [
        Plan(command, north_m + north * half_m, east * half_m, params=(4.0, 0.0, 0.0, 0.0)) for north, east in corners
    ]


def circle(radius_m: float, north_m: float) -> list[Plan]:
    return [Plan(CIRCLE_EXCLUSION, north_m, 0.0, params=(radius_m, 0.0, 0.0, 0.0))]


@pytest.mark.parametrize(
    ("fence", "said"),
    [
        (square(100.0), 0),
        (square(19.9), 1),  # nearer than twice NAV_ACC_RAD
        (square(20.5), 0),
        (square(50.0, POLYGON_EXCLUSION, north_m=65.0), 1),  # 15 m from an exclusion
        (square(50.0, POLYGON_EXCLUSION, north_m=75.0), 0),
        (circle(30.0, 40.0), 1),
        (circle(30.0, 10.0), 1),
        (circle(30.0, 51.0), 0),
        (circle(30.0, 0.0), 0),  # PX4's planner begins at the first point of the fence: it never looks at home there
        (square(15.0)[:3], 0),  # a vertex is missing: no fence
    ],
)
def test_a_home_near_the_fence_is_warned_of_once(fence: list[Plan], said: int) -> None:
    gcs = GroundStation()
    assert gcs.upload(fence, FENCE) == 0
    gcs.fly(8.0)
    assert breaches(gcs) == said


def test_the_warning_follows_the_fence_within_two_seconds_and_comes_again_with_the_next_one() -> None:
    gcs = GroundStation()
    gcs.upload(square(15.0), FENCE)
    assert gcs.until(lambda: breaches(gcs), 4.0) > 0.6
    gcs.upload(square(16.0), FENCE)
    gcs.until(lambda: breaches(gcs) == 2, 4.0)


def test_a_wing_keeps_its_loiter_radius_away() -> None:
    quad, plane = GroundStation("quad"), GroundStation("plane")
    for gcs in (quad, plane):
        gcs.upload(square(70.0), FENCE)
        gcs.fly(4.0)
    assert (breaches(quad), breaches(plane)) == (0, 1)


def test_a_rovers_return_is_a_landing_from_its_start_and_ends_within_its_radius_of_home() -> None:
    gcs = GroundStation("rover")
    gcs.start([waypoint(20, 10, 0), waypoint(60, 10, 0)])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 15.0, 60.0)
    mark = len(gcs.texts())
    assert gcs.set_mode(Mode.RTL) == [0]
    assert "".join(gcs.texts()[mark:]).startswith("RTL: land at destinationRTL: start return")
    gcs.fly(0.5)
    assert gcs.last("EXTENDED_SYS_STATE").landed_state == LandedState.LANDING
    gcs.until(lambda: gcs.vehicle.state.status.landed, 60.0)
    assert gcs.distance_to(0.0, 0.0) == pytest.approx(0.5, abs=0.1)
    assert gcs.until(lambda: not gcs.armed, 5.0) == pytest.approx(2.0, abs=0.1)
