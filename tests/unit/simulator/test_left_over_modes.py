"""The mode of a disarmed vehicle: which one disarming leaves, and in which ones it arms (scenarios 18, 21, 26, 26b)."""

from __future__ import annotations

import pytest

from app.simulator.wire import Cmd, MissionState, Mode, Result
from tests.support.airborne_vehicle import Airborne
from tests.support.offboard_sender import Sender
from tests.support.simulated_vehicle import RETURN, GroundStation, takeoff

DENIED = "Arming denied: Resolve system health failures first"
NOT_AVAILABLE = "Switching to Mission is currently not available"


@pytest.mark.parametrize("left", [Mode.RTL, Mode.LAND, Mode.ORBIT, Mode.TAKEOFF])
@pytest.mark.parametrize("before", [Mode.OFFBOARD, Mode.POSCTL, Mode.LOITER, Mode.MISSION])
def test_disarming_goes_back_to_the_mode_that_was_asked_for_before(left: Mode, before: Mode) -> None:
    air = Airborne()
    air.commander.change_mode(before)
    air.commander.change_mode(left)
    air.commander.disarm(force=True)
    assert air.status.mode is before


@pytest.mark.parametrize("mode", [Mode.RTL, Mode.LAND, Mode.ORBIT])
def test_nobody_arms_in_a_mode_that_does_not_take_off(mode: Mode) -> None:
    gcs = GroundStation()
    assert gcs.set_mode(mode) == [Result.ACCEPTED], "disarmed every mode is taken"
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    assert gcs.set_mode(Mode.LOITER) == [Result.ACCEPTED]
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.ACCEPTED]


@pytest.mark.parametrize("airframe", ["quad", "plane", "vtol", "rover"])
@pytest.mark.parametrize("mode", [Mode.OFFBOARD, Mode.POSCTL, Mode.RTL])
def test_mission_start_arms_only_where_the_mode_before_it_allowed_that(airframe: str, mode: Mode) -> None:
    """Recording 26: refused, it has changed the mode all the same, and then it arms."""
    gcs = GroundStation(airframe, params={"MIS_TKO_LAND_REQ": 0})
    gcs.upload([takeoff(40.0, 200.0), RETURN])
    gcs.fly(1.0)
    gcs.set_mode(mode)
    gcs.fly(0.1)
    assert gcs.command(Cmd.MISSION_START) == [Result.TEMPORARILY_REJECTED]
    assert (gcs.armed, gcs.vehicle.state.status.mode) == (False, Mode.MISSION)
    assert "".join(gcs.texts()).endswith(DENIED + NOT_AVAILABLE)
    gcs.fly(1.0)
    assert gcs.last("MISSION_CURRENT").mission_state == MissionState.ACTIVE
    assert gcs.command(Cmd.MISSION_START) == [Result.ACCEPTED]
    assert gcs.armed


def test_while_a_failsafe_flies_current_mode_tells_what_the_user_asked_for() -> None:
    sender = Sender("quad").airborne()
    sender.gcs.until(lambda: sender.mode is Mode.LOITER, 5.0)
    sender.gcs.fly(2.1)
    told = sender.gcs.last("CURRENT_MODE")
    assert (told.custom_mode, told.intended_custom_mode) == (Mode.LOITER, Mode.OFFBOARD)
