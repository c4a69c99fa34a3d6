"""A landing amid a mission: it stays armed, and the next waypoint lifts off by itself [09_quad_land_deliver]."""

from __future__ import annotations

from app.simulator.wire import Cmd, LandedState
from tests.support.simulated_vehicle import RELEASE, RETURN, GroundStation, do, land, takeoff, waypoint

AMID = [takeoff(10.0), waypoint(30.0, 0.0, 10.0), land(30.0), RELEASE, do(Cmd.NAV_DELAY, 3.0, -1, -1)]


def test_it_goes_on_from_the_ground_without_a_takeoff() -> None:
    gcs = GroundStation()
    gcs.start([*AMID, waypoint(30.0, 0.0, 10.0), waypoint(10.0, 0.0, 10.0), RETURN])
    gcs.until(lambda: any(one.seq == 5 for one in gcs.messages("MISSION_ITEM_REACHED")[-1:]))
    assert gcs.armed
    assert [text for text in gcs.texts() if text.startswith("Climb to")] == ["Climb to 10.0 meters above home"]
    assert gcs.texts().count("Takeoff detected") == 2
    states = [LandedState(state) for (state,) in gcs.changes("EXTENDED_SYS_STATE", "landed_state")]
    ground, start, air, down = LandedState.ON_GROUND, LandedState.TAKEOFF, LandedState.IN_AIR, LandedState.LANDING
    assert states[:6] == [ground, start, air, down, ground, air]
    assert LandedState.TAKEOFF not in states[6:]
