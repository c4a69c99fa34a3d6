"""Loss of the ground station, rule by rule: NAV_DLL_ACT, its times, and what it leaves alone (scenario 24)."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import RETURN, GroundStation, takeoff, waypoint

GCS, ONBOARD = 6, 18
LOST_S = 12.4
"""COM_DL_LOSS_T (10 s), and 2.4 s until a link counts as silent."""


def heartbeat(gcs: GroundStation, mav_type: int) -> None:
    gcs.send(mavlink.MAVLink_heartbeat_message(mav_type, 8, 0, 0, 4, 3))


def mode(gcs: GroundStation) -> Mode:
    return gcs.vehicle.state.status.mode


def silent(**params: float) -> GroundStation:
    """Under way in a mission when the ground station falls silent."""
    gcs = GroundStation(params={"NAV_DLL_ACT": 2, **params})
    gcs.start([takeoff(5), waypoint(400, 0, 5), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 3)
    gcs.heartbeats = False
    heartbeat(gcs, GCS)
    return gcs


@pytest.mark.parametrize(("limit_s", "lost_s"), [(10, LOST_S), (25, LOST_S + 15.0)])
def test_it_holds_when_com_dl_loss_t_is_over(limit_s: int, lost_s: float) -> None:
    gcs = silent(COM_DL_LOSS_T=limit_s)
    assert gcs.until(lambda: mode(gcs) is not Mode.MISSION, 60.0) == pytest.approx(lost_s, abs=0.1)
    assert mode(gcs) is Mode.LOITER
    assert 27571288 in [event.id for event in gcs.messages("EVENT")], "GCS lost"


@pytest.mark.parametrize(("action", "then"), [(1, Mode.LOITER), (2, Mode.RTL), (3, Mode.LAND), (0, Mode.MISSION)])
def test_then_it_does_what_nav_dll_act_says(action: int, then: Mode) -> None:
    gcs = silent(NAV_DLL_ACT=action)
    gcs.fly(LOST_S + 6.0)
    assert mode(gcs) is then


def test_disarm_stops_the_motors_without_a_hold_before() -> None:
    gcs = silent(NAV_DLL_ACT=6)
    assert gcs.until(lambda: not gcs.armed, 20.0) == pytest.approx(LOST_S, abs=0.1)
    assert mode(gcs) is Mode.MISSION, "there was no hold"


def test_terminate_stops_the_motors_without_a_hold_before_and_stays_armed() -> None:
    gcs = silent(NAV_DLL_ACT=5)
    gcs.until(lambda: mode(gcs) is not Mode.MISSION, 20.0)
    gcs.fly(0.1)
    assert (mode(gcs), gcs.armed) == (Mode.TERMINATION, True)
    assert gcs.vehicle.state.body.throttle == 0.0


def test_a_hold_that_the_link_ended_lasts_until_somebody_changes_the_mode() -> None:
    """The failsafe is over with the mode change, not with the heartbeats (ClearCondition::OnModeChangeOrDisarm)."""
    gcs = silent(NAV_DLL_ACT=1)
    gcs.fly(LOST_S + 6.0)
    gcs.heartbeats = True
    gcs.fly(3.0)
    assert (mode(gcs), gcs.vehicle.state.status.failsafe) == (Mode.LOITER, True)
    assert gcs.set_mode(Mode.MISSION) == [Result.ACCEPTED]
    assert not gcs.vehicle.state.status.failsafe


@pytest.mark.parametrize("wait_s", [0.0, 2.0, 9.0])
def test_the_hold_before_lasts_com_fail_act_t(wait_s: float) -> None:
    gcs = silent(COM_FAIL_ACT_T=wait_s)
    gcs.until(lambda: mode(gcs) is not Mode.MISSION, 20.0)
    assert gcs.until(lambda: mode(gcs) is Mode.RTL, 20.0) == pytest.approx(wait_s, abs=0.1)


def test_heartbeats_that_return_during_the_hold_end_it_there() -> None:
    gcs = silent()
    gcs.fly(LOST_S + 2.0)
    heartbeat(gcs, GCS)
    gcs.fly(9.0)
    assert mode(gcs) is Mode.LOITER
    assert "GCS connection regained" in gcs.texts()


def test_only_a_ground_stations_heartbeats_count() -> None:
    gcs = silent()
    for _ in range(int(LOST_S) + 1):
        heartbeat(gcs, ONBOARD)
        gcs.fly(1.0)
    assert mode(gcs) is Mode.LOITER


@pytest.mark.parametrize("flown", [Mode.RTL, Mode.LAND])
def test_a_vehicle_that_comes_down_already_is_left_alone(flown: Mode) -> None:
    gcs = silent(RTL_RETURN_ALT=150.0, MPC_LAND_SPEED=0.1, MPC_Z_V_AUTO_DN=0.1)
    gcs.set_mode(flown)
    gcs.fly(LOST_S + 0.5)
    assert mode(gcs) is flown
    assert not gcs.vehicle.state.status.failsafe


def test_somebody_who_takes_over_during_the_hold_keeps_the_vehicle() -> None:
    gcs = silent()
    gcs.fly(LOST_S + 2.0)
    gcs.vehicle.commander.change_mode(Mode.POSCTL)
    gcs.fly(9.0)
    assert mode(gcs) is Mode.POSCTL


@pytest.mark.parametrize(("taken", "shown"), [(Mode.MISSION, 5), (Mode.LAND, 4)])
def test_who_took_over_is_warned_until_the_link_is_back_or_the_vehicle_lands(taken: Mode, shown: int) -> None:
    gcs = silent(MPC_LAND_SPEED=0.1, MPC_Z_V_AUTO_DN=0.1)
    gcs.fly(LOST_S + 2.0)
    gcs.vehicle.commander.change_mode(taken)
    gcs.fly(1.1)
    assert (gcs.last("HEARTBEAT").system_status, mode(gcs)) == (shown, taken)
    heartbeat(gcs, GCS)
    gcs.fly(1.1)
    assert (gcs.last("HEARTBEAT").system_status, mode(gcs)) == (4, taken)


def test_on_the_ground_nothing_happens() -> None:
    gcs = GroundStation(params={"NAV_DLL_ACT": 2, "COM_DISARM_PRFLT": 0.0})
    gcs.arm()
    gcs.heartbeats = False
    gcs.fly(LOST_S + 8.0)
    assert (gcs.armed, mode(gcs)) == (True, Mode.LOITER)
    assert not gcs.vehicle.state.status.failsafe


def test_arming_needs_a_ground_station_only_with_the_failsafe_on() -> None:
    for action, result in ((0, Result.ACCEPTED), (2, Result.TEMPORARILY_REJECTED)):
        gcs = GroundStation(params={"NAV_DLL_ACT": action}, heartbeats=False)
        assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [result]
