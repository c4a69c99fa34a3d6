"""Where a track goes on after an item, and where it stops instead: PX4's brake_for_hold, rule by rule."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.simulator.mission.item import Item
from app.simulator.navigator.mission_mode import JumpCounter, brakes, next_target
from app.simulator.wire import Cmd, VtolState
from tests.support.simulated_vehicle import RELEASE, RETURN, GroundStation, Plan, do, takeoff, waypoint

ON = waypoint(60, 30, 10)
DELAY, WINCH = do(Cmd.NAV_DELAY, 5), do(Cmd.DO_WINCH, 1, 4)


def items(gcs: GroundStation, *plans: Plan) -> list[Item]:
    messages = [gcs.item(seq, plan) for seq, plan in enumerate(plans)]
    return [
        Item(m.command, m.frame, m.autocontinue, m.param1, m.param2, m.param3, m.param4, m.x, m.y, m.z)
        for m in messages
    ]


def stops(airframe: str, *plans: Plan, firmware: str = "px4-main") -> bool:
    """At the first of these items."""
    gcs = GroundStation(airframe, firmware=firmware, ready=False)
    first, *following = items(gcs, *plans)
    return brakes(gcs.vehicle.context, first, following)


@pytest.mark.parametrize(("airframe", "stopped"), [("quad", True), ("vtol", True), ("plane", False), ("rover", False)])
def test_a_hold_brakes_in_rotary_wing_state(airframe: str, stopped: bool) -> None:
    assert stops(airframe, waypoint(30, 0, 10, hold_s=3.0), ON) is stopped
    assert stops(airframe, waypoint(30, 0, 10, hold_s=0.5), ON) is stopped
    assert not stops(airframe, waypoint(30, 0, 10), ON)


def test_the_pitch_of_a_takeoff_is_no_hold() -> None:
    assert not stops("quad", takeoff(10, pitch_deg=15.0), ON)


def test_a_vtol_on_its_wing_does_not_brake() -> None:
    gcs = GroundStation("vtol", ready=False)
    first, following = items(gcs, waypoint(30, 0, 10, hold_s=3.0), ON)
    gcs.vehicle.state.status.vtol_state = VtolState.FW
    assert not brakes(gcs.vehicle.context, first, [following])


@pytest.mark.parametrize("airframe", ["quad", "plane", "rover"])
def test_without_autocontinue_every_type_has_nothing_to_go_on_to(airframe: str) -> None:
    assert stops(airframe, replace(waypoint(30, 0, 10), autocontinue=0), ON)


@pytest.mark.parametrize("payload", [RELEASE, WINCH])
def test_a_payload_item_behind_brakes_on_older_firmware_only(payload: Plan) -> None:
    plans = (waypoint(30, 0, 10), payload, ON)
    assert not stops("quad", *plans)
    assert stops("quad", *plans, firmware="px4-1.14")
    assert not stops("plane", *plans, firmware="px4-1.14")
    assert not stops("quad", plans[0], ON, payload, firmware="px4-1.14"), "not the one behind the next waypoint"


@pytest.mark.parametrize(
    ("following", "on"),
    [([ON], True), ([RELEASE, DELAY, ON], True), ([RETURN], False), ([], False), ([takeoff(10), ON], False)],
)
def test_the_track_goes_on_to_the_next_position_over_commands(following: list[Plan], on: bool) -> None:
    gcs = GroundStation(ready=False)
    found = next_target(gcs.vehicle.context, items(gcs, waypoint(30, 0, 10), *following), 0, JumpCounter())
    assert (found.point if found else None) == (pytest.approx((60, 30), abs=0.1) if on else None)


def test_before_a_jump_the_track_goes_on_to_where_it_leads_as_long_as_it_is_taken() -> None:
    """FollowMissionControlFlow in PX4's findNextPositionIndex; to look does not count."""
    gcs, jumps = GroundStation(ready=False), JumpCounter()
    plan = items(gcs, takeoff(10), waypoint(30, 0, 10), waypoint(30, 40, 10), do(Cmd.DO_JUMP, 1, 1), ON)
    for point in ((30, 0), (30, 0)):
        found = next_target(gcs.vehicle.context, plan, 2, jumps)
        assert found is not None
        assert found.point == pytest.approx(point, abs=0.1)
    assert jumps.after(plan, 2) == 1
    found = next_target(gcs.vehicle.context, plan, 2, jumps)
    assert found is not None
    assert found.point == pytest.approx((60, 30), abs=0.1)


def test_jumps_over_commands_alone_lead_nowhere() -> None:
    gcs = GroundStation(ready=False)
    plan = items(gcs, waypoint(30, 0, 10), do(Cmd.DO_JUMP, 2, -1), RELEASE, do(Cmd.DO_JUMP, 2, -1))
    assert next_target(gcs.vehicle.context, plan, 0, JumpCounter()) is None


@pytest.mark.parametrize("airframe", ["quad", "rover"])
def test_a_vehicle_that_waits_in_a_delay_has_nothing_to_go_on_to(airframe: str) -> None:
    """PX4's setActiveMissionItems takes the next setpoint away at NAV_DELAY, so that the position is held."""
    gcs = GroundStation(airframe)
    up = [] if airframe == "rover" else [takeoff(10)]
    gcs.start([*up, waypoint(30, 0, 10), DELAY, ON])
    gcs.until(lambda: gcs.vehicle.mission.result.seq_reached == len(up))
    assert gcs.vehicle.context.setpoint.next is None
