"""The speed may change in flight: time goes on from where it is, and what is wall time stays wall time."""

from __future__ import annotations

import pytest

from app.simulator.fault_control import FaultControl
from app.simulator.fleet import Fleet
from app.simulator.options import Options, VehicleOptions
from app.simulator.wire import Cmd, Mode, Result
from tests.support.paced import Machine
from tests.support.simulated_vehicle import RELEASE, GroundStation, takeoff, waypoint
from tests.support.speed_caps import SETPOINT, stream

ROUND = [takeoff(10), waypoint(60, 0, 10), RELEASE, waypoint(0, 30, 10)]


def flown(*changes: float) -> tuple[float, list[tuple[int, ...]], float, float]:
    """A mission, with the speed changed at every tenth second: when it ends, its items, where and when it released."""
    gcs = GroundStation()
    gcs.start(ROUND)
    began_s, boot_s, wanted = gcs.now_s, gcs.vehicle.clock.now_s, list(changes)
    released: list[float] = []
    while not gcs.vehicle.mission.result.finished:
        if wanted and gcs.now_s - began_s > 10.0 * (len(changes) - len(wanted) + 1):
            gcs.vehicle.clock.change_speed(wanted.pop(0))
        gcs.step()
        if gcs.vehicle.state.gripper.is_open and not released:
            released = [gcs.now_s - began_s, gcs.vehicle.state.body.north_m]
        assert gcs.now_s - began_s < 200.0
    assert gcs.vehicle.clock.now_s - boot_s == pytest.approx(gcs.now_s - began_s)
    return gcs.now_s - began_s, gcs.changes("MISSION_ITEM_REACHED", "seq"), released[0], released[1]


def test_a_flight_is_the_same_whatever_is_done_to_the_speed_meanwhile() -> None:
    assert flown(50.0, 1.0, 4.0) == flown()


def test_a_slower_clock_finds_no_ground_station_silent_that_was_heard_a_moment_ago_by_the_wall() -> None:
    gcs = GroundStation(speed=50.0, params={"NAV_DLL_ACT": 2})
    gcs.start([takeoff(10), waypoint(400, 0, 10)])
    gcs.heartbeats = False
    gcs.fly(50.0)  # a second on the wall
    gcs.vehicle.clock.change_speed(1.0)
    gcs.fly(11.0)
    assert gcs.vehicle.state.status.mode is Mode.MISSION
    gcs.until(lambda: gcs.vehicle.state.status.mode is not Mode.MISSION, 1.0)


def test_a_stream_of_setpoints_lives_on_at_the_slower_speed() -> None:
    gcs = GroundStation(speed=4.0)
    stream(gcs, 0.5)
    assert gcs.set_mode(Mode.OFFBOARD) == [Result.ACCEPTED]
    gcs.arm()
    stream(gcs, 10.0)
    gcs.fly(2.0)  # half a second on the wall
    gcs.vehicle.clock.change_speed(1.0)
    gcs.fly(0.4)
    assert gcs.vehicle.state.status.mode is Mode.OFFBOARD
    gcs.send(SETPOINT)
    gcs.fly(0.5)
    assert gcs.vehicle.state.status.mode is Mode.OFFBOARD


def test_a_vehicle_that_is_armed_at_high_speed_waits_for_its_start_at_the_lower() -> None:
    gcs = GroundStation(speed=50.0)
    assert gcs.upload(ROUND) == 0
    gcs.arm()
    gcs.fly(50.0)
    gcs.vehicle.clock.change_speed(1.0)
    gcs.fly(8.0)
    assert gcs.command(Cmd.MISSION_START) == [Result.ACCEPTED]
    gcs.until(lambda: gcs.distance_to(60, 0) < 5.0)


def test_what_was_thinned_at_high_speed_leaves_no_silence_at_the_low_one() -> None:
    gcs = GroundStation(speed=50.0)
    gcs.fly(20.0)
    gcs.vehicle.clock.change_speed(1.0)
    since_s = gcs.now_s
    gcs.fly(1.1)
    assert len(gcs.messages("GLOBAL_POSITION_INT", since_s)) >= 10
    assert len(gcs.messages("HEARTBEAT", since_s)) >= 1


@pytest.mark.parametrize(("speeds", "seconds"), [([50.0, 4.0, 1.0], 10.0), ([7.0, 3.0, 50.0], 500.0)])
def test_wall_times_are_exact_after_any_changes(speeds: list[float], seconds: float) -> None:
    gcs = GroundStation()
    for speed in speeds:
        gcs.vehicle.clock.change_speed(speed)
    assert gcs.vehicle.params["COM_DL_LOSS_T"] == seconds


def test_a_wall_time_that_a_ground_station_has_set_is_kept() -> None:
    gcs = GroundStation(speed=4.0)
    gcs.vehicle.params.set("COM_OF_LOSS_T", 2.0)  # half a second on the wall
    gcs.vehicle.clock.change_speed(2.0)
    assert gcs.vehicle.params["COM_OF_LOSS_T"] == 1.0


def test_the_pace_changes_at_once_and_late_steps_are_not_caught_up_at_the_new_one() -> None:
    machine = Machine(1.0).run(10.0)
    before = machine.steps
    machine.wall_s += 0.2  # late by ten steps
    machine.pace.change(50.0)
    machine.run(2.0)
    assert (machine.steps - before) * 0.02 == pytest.approx(100.0, rel=0.01)
    report = machine.pace.report()
    assert (report.wanted, report.behind, round(report.lost_s, 2)) == (50.0, False, 0.2)
    assert report.achieved == pytest.approx(50.0, rel=0.01), "it is measured from the change on"


async def test_the_control_socket_changes_it_for_all_and_for_a_duplicate_that_comes_later() -> None:
    fleet = Fleet(Options(fleet=(VehicleOptions("quad", 1), VehicleOptions("plane", 2)), port=15_490, local_port=0))
    await fleet.open()
    try:
        answer = await FaultControl(fleet).handle({"speed": 10})
        assert (answer["ok"], answer["speed"]["wanted"]) == (True, 10.0)
        await FaultControl(fleet).handle({"vehicle": 1, "fault": "duplicate_sysid", "value": True})
        assert [vehicle.clock.speed for vehicle in fleet.everybody()] == [10.0, 10.0, 10.0]
    finally:
        fleet.close()


@pytest.mark.parametrize("wanted", [0, 0.9, 50.1, True, None, "4", float("nan")])
async def test_a_speed_that_is_none_is_refused(wanted: object) -> None:
    fleet = Fleet(Options(fleet=(VehicleOptions("quad", 1),)))
    answer = await FaultControl(fleet).handle({"speed": wanted})
    assert answer["ok"] is False
    assert fleet.pace.speed == fleet.vehicles[0].clock.speed == 1.0


async def test_while_a_vehicle_is_in_offboard_no_speed_above_the_cap_is_taken() -> None:
    fleet = Fleet(Options(fleet=(VehicleOptions("quad", 1), VehicleOptions("quad", 2))))
    fleet.vehicles[1].commander.change_mode(Mode.OFFBOARD)
    answer = await FaultControl(fleet).handle({"speed": 4.1})
    assert answer == {"ok": False, "error": "vehicle 2 is in OFFBOARD, which is simulated up to 4x"}
    assert (await FaultControl(fleet).handle({"speed": 4}))["ok"] is True
