"""A gripper outside the autopilot: the mission's command goes out, a component executes and acknowledges it."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import mavlink
from app.simulator.external.gripper import GRIPPER_COMPONENT, MOVING_S
from app.simulator.wire import Cmd, Result
from tests.support.simulated_vehicle import GROUND, RELEASE, GroundStation, takeoff, waypoint

GRAB_IT, RELEASE_IT = 1.0, 0.0


@pytest.fixture
def gcs() -> GroundStation:
    return GroundStation(external_gripper=True)


def ask(gcs: GroundStation, action: float, *, component: int = GRIPPER_COMPONENT, wait_s: float = 4.0) -> list[int]:
    mark = len(gcs.received)
    gcs.send(mavlink.MAVLink_command_long_message(1, component, Cmd.DO_GRIPPER, 0, 1, action, 0, 0, 0, 0, 0))
    gcs.fly(wait_s)
    acks = [h for h in gcs.received[mark:] if h.name == "COMMAND_ACK"]
    assert all(h.component == GRIPPER_COMPONENT for h in acks), "the autopilot has no part in it"
    assert all((h.message.target_system, h.message.target_component) == GROUND for h in acks)
    return [h.message.result for h in acks]


def opened(gcs: GroundStation) -> bool:
    return gcs.vehicle.state.gripper.output_released


def test_it_has_a_heartbeat_of_its_own_and_the_autopilot_commands_nothing_at_boot(gcs: GroundStation) -> None:
    beats = [h.message for h in gcs.received if h.name == "HEARTBEAT" and h.component == GRIPPER_COMPONENT]
    assert {(beat.type, beat.autopilot) for beat in beats} == {(48, 8)}
    assert gcs.messages("COMMAND_LONG") == gcs.messages("COMMAND_ACK") == []


@pytest.mark.parametrize("component", [GRIPPER_COMPONENT, 0])
def test_a_release_is_in_progress_and_accepted_when_it_has_happened(gcs: GroundStation, component: int) -> None:
    assert ask(gcs, RELEASE_IT, component=component, wait_s=MOVING_S / 2) == [Result.IN_PROGRESS]
    assert not opened(gcs)
    gcs.fly(MOVING_S)
    assert (gcs.last("COMMAND_ACK").result, opened(gcs)) == (Result.ACCEPTED, True)


def test_its_final_acks_are_lost_like_the_autopilots(gcs: GroundStation) -> None:
    gcs.vehicle.faults.lost_acks = 1
    assert ask(gcs, RELEASE_IT) == [Result.IN_PROGRESS], "the release happened, and nobody hears of it"
    assert opened(gcs)
    assert ask(gcs, GRAB_IT) == [Result.IN_PROGRESS, Result.ACCEPTED], "one was to be lost"


def test_a_winchs_acks_are_lost_too() -> None:
    gcs = GroundStation(winch=True)
    gcs.vehicle.faults.lost_acks = 1
    before = len(gcs.messages("COMMAND_ACK"))  # of the grab at boot
    for wanted in (0, 1):
        gcs.send(mavlink.MAVLink_command_long_message(1, 169, Cmd.DO_WINCH, 0, 1, 5, 0, 0, 0, 0, 0))
        gcs.fly(0.1)
        assert len(gcs.messages("COMMAND_ACK")) == before + wanted


def test_what_is_sent_to_the_autopilot_is_answered_by_nobody(gcs: GroundStation) -> None:
    assert ask(gcs, RELEASE_IT, component=1) == []
    assert not opened(gcs)


def test_conflicts_are_resolved_as_by_the_deliverer_on_board(gcs: GroundStation) -> None:
    assert ask(gcs, GRAB_IT) == [Result.ACCEPTED], "it is closed already"
    assert ask(gcs, RELEASE_IT, wait_s=0.3) == [Result.IN_PROGRESS]
    assert ask(gcs, RELEASE_IT, wait_s=0.1) == [Result.TEMPORARILY_REJECTED]
    assert ask(gcs, GRAB_IT) == [Result.CANCELLED, Result.IN_PROGRESS, Result.ACCEPTED]
    assert not opened(gcs)


@pytest.mark.parametrize("action", [2.0, 0.5, math.nan])
def test_another_action_is_denied(gcs: GroundStation, action: float) -> None:
    assert ask(gcs, action) == [Result.DENIED]


def test_a_stuck_one_knows_it_and_fails(gcs: GroundStation) -> None:
    gcs.vehicle.faults.stuck_gripper = True
    assert ask(gcs, RELEASE_IT) == [Result.IN_PROGRESS, Result.FAILED]
    assert not opened(gcs)


def test_a_slow_one_takes_longer(gcs: GroundStation) -> None:
    gcs.vehicle.faults.slow_gripper_s = 2.0
    assert ask(gcs, RELEASE_IT, wait_s=MOVING_S + 1.5) == [Result.IN_PROGRESS]


def test_a_mission_releases_by_it_and_no_output_nor_ack_shows_that(gcs: GroundStation) -> None:
    gcs.start([takeoff(10), waypoint(20, 0, 10), RELEASE, waypoint(20, 40, 10)])
    started_s = gcs.now_s
    gcs.until(lambda: opened(gcs))
    gcs.fly(4.0)
    own = [m for m in gcs.messages("COMMAND_LONG", started_s) if m.command == Cmd.DO_GRIPPER]
    assert [(m.target_system, m.target_component, m.confirmation) for m in own] == [(1, 0, n) for n in range(4)]
    assert [ack for ack in gcs.messages("COMMAND_ACK", started_s) if ack.command == Cmd.DO_GRIPPER] == []
    assert {message.servo5_raw for message in gcs.messages("SERVO_OUTPUT_RAW")} == {900}
    assert gcs.vehicle.params.integer("PWM_MAIN_FUNC5") == 0, "PX4 has the parameter, and nothing is assigned"


def test_px4_1_14_goes_on_by_its_ack() -> None:
    gcs = GroundStation(firmware="px4-1.14", external_gripper=True, params={"MIS_PD_TO": 30.0, "NAV_ACC_RAD": 2.0})
    gcs.start([takeoff(10), waypoint(20, 0, 10), RELEASE, waypoint(20, 40, 10)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert gcs.until(lambda: gcs.vehicle.store.current_seq == 3) == pytest.approx(MOVING_S, abs=0.1)


def test_px4_1_14_waits_its_full_time_after_a_failure() -> None:
    gcs = GroundStation(firmware="px4-1.14", external_gripper=True, params={"MIS_PD_TO": 6.0, "NAV_ACC_RAD": 2.0})
    gcs.vehicle.faults.stuck_gripper = True
    gcs.start([takeoff(10), waypoint(20, 0, 10), RELEASE, waypoint(20, 40, 10)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert gcs.until(lambda: gcs.vehicle.store.current_seq == 3) == pytest.approx(6.0, abs=0.1)
