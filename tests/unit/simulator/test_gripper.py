"""The payload deliverer: scenarios 08, 17 and 17b, and what a mission's gripper item shows on the wire (06)."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import RELEASE, GroundStation, takeoff, waypoint

OTHER = (246, 191)


def gripper(gcs: GroundStation, param2: float, param1: float = 1, wait_s: float = 4.0, **kwargs: object) -> list[int]:
    return gcs.command(Cmd.DO_GRIPPER, param1, param2, wait_s=wait_s, **kwargs)  # type: ignore[arg-type]


@pytest.fixture
def gcs() -> GroundStation:
    return GroundStation(params={"PD_GRIPPER_TO": 3.0})


def test_a_change_is_in_progress_at_once_and_accepted_after_the_timer(gcs: GroundStation) -> None:
    begin_s = gcs.now_s
    assert gripper(gcs, 0) == [Result.IN_PROGRESS, Result.ACCEPTED]
    times = [
        received.t_s - begin_s for received in gcs.received if received.name == "COMMAND_ACK" and received.t_s > begin_s
    ]
    assert times[0] < 0.05
    assert times[1] == pytest.approx(3.0, abs=0.1)
    acks = gcs.messages("COMMAND_ACK", begin_s)
    assert [ack.progress for ack in acks] == [255, 0]


def test_the_state_it_has_already_is_accepted_at_once(gcs: GroundStation) -> None:
    assert gripper(gcs, 1) == [Result.ACCEPTED], "it grabbed at boot"
    gripper(gcs, 0)
    assert gripper(gcs, 0) == [Result.ACCEPTED]


def test_the_same_again_while_it_runs_is_rejected_for_the_moment(gcs: GroundStation) -> None:
    assert gripper(gcs, 0, wait_s=1.0) == [Result.IN_PROGRESS]
    assert gripper(gcs, 0) == [Result.TEMPORARILY_REJECTED, Result.ACCEPTED]


def test_the_opposite_cancels_the_first_for_its_sender(gcs: GroundStation) -> None:
    gripper(gcs, 0, wait_s=0.5)
    assert gripper(gcs, 1, source=OTHER) == [Result.IN_PROGRESS, Result.ACCEPTED]
    to_first = [ack.result for ack in gcs.messages("COMMAND_ACK") if ack.target_system == 245]
    assert to_first == [Result.IN_PROGRESS, Result.CANCELLED]


def test_an_invalid_action_cancels_the_first_although_that_goes_on(gcs: GroundStation) -> None:
    """PX4's payload deliverer looks for the conflict first, and at the action only then."""
    gripper(gcs, 0, wait_s=0.5)
    assert gripper(gcs, 5, source=OTHER) == [Result.DENIED]
    to_first = [ack.result for ack in gcs.messages("COMMAND_ACK") if ack.target_system == 245]
    assert to_first == [Result.IN_PROGRESS, Result.CANCELLED, Result.ACCEPTED]


@pytest.mark.parametrize("param2", [5.0, -1.0, -0.5, 1.5, math.nan, math.inf])
def test_another_action_is_denied(gcs: GroundStation, param2: float) -> None:
    assert gripper(gcs, param2) == [Result.DENIED]


def test_one_half_counts_as_a_grab(gcs: GroundStation) -> None:
    gripper(gcs, 0)
    assert gripper(gcs, 0.5) == [Result.IN_PROGRESS, Result.ACCEPTED]
    assert not gcs.vehicle.state.gripper.released


@pytest.mark.parametrize("instance", [0, 2, -1])
def test_the_instance_is_ignored(gcs: GroundStation, instance: int) -> None:
    assert gripper(gcs, 0, instance) == [Result.IN_PROGRESS, Result.ACCEPTED]


def test_a_command_int_works_too(gcs: GroundStation) -> None:
    gcs.send(mavlink.MAVLink_command_int_message(1, 1, 2, Cmd.DO_GRIPPER, 0, 0, 1, 0, 0, 0, 0, 0, 0))
    gcs.fly(4.0)
    assert [ack.result for ack in gcs.messages("COMMAND_ACK") if ack.target_system == 245] == [5, 0]


def test_without_a_gripper_from_boot_it_fails_and_a_change_at_run_time_has_no_effect() -> None:
    gcs = GroundStation(params={"PD_GRIPPER_TYPE": -1})
    assert gripper(gcs, 0) == [Result.FAILED]
    gcs.vehicle.params.set("PD_GRIPPER_TYPE", 0)
    assert gripper(gcs, 0) == [Result.FAILED]
    with_gripper = GroundStation()
    with_gripper.vehicle.params.set("PD_GRIPPER_TYPE", -1)
    assert gripper(with_gripper, 0) == [Result.IN_PROGRESS, Result.ACCEPTED]


def test_px4_1_14_also_needs_its_enable_parameter() -> None:
    assert gripper(GroundStation(firmware="px4-1.14", params={"PD_GRIPPER_EN": 0}), 0) == [Result.FAILED]
    assert gripper(GroundStation(firmware="px4-1.14"), 0) == [Result.IN_PROGRESS, Result.ACCEPTED]


def test_the_output_is_900_disarmed_2000_grabbed_1000_released(gcs: GroundStation) -> None:
    assert gcs.last("SERVO_OUTPUT_RAW").servo5_raw == 900
    gripper(gcs, 0)
    assert gcs.last("SERVO_OUTPUT_RAW").servo5_raw == 900, "disarmed, whatever was commanded"
    gcs.arm()
    gcs.fly(0.2)
    assert gcs.last("SERVO_OUTPUT_RAW").servo5_raw == 1000
    begin_s = gcs.now_s
    gripper(gcs, 1, wait_s=0.3)
    outputs = [(h.t_s - begin_s, h.message.servo5_raw) for h in gcs.received if h.name == "SERVO_OUTPUT_RAW"]
    changed = next(t for t, output in outputs if t > 0 and output == 2000)
    assert changed == pytest.approx(0.12, abs=0.1)


def test_at_boot_it_grabs_in_public_and_acknowledges_to_nobody() -> None:
    gcs = GroundStation()
    announced = [m for m in gcs.messages("COMMAND_LONG") if m.command == Cmd.DO_GRIPPER]
    assert [(m.target_system, m.target_component, m.confirmation, m.param2) for m in announced] == [
        (0, 0, confirmation, 1.0) for confirmation in range(4)
    ]
    boot_ack = gcs.messages("COMMAND_ACK")[0]
    assert (boot_ack.command, boot_ack.result, boot_ack.target_system, boot_ack.target_component) == (211, 0, 0, 1)


def test_without_a_gripper_nothing_is_commanded_at_boot() -> None:
    """Scenario 17b."""
    gcs = GroundStation(params={"PD_GRIPPER_TYPE": -1})
    assert gcs.messages("COMMAND_LONG") == gcs.messages("COMMAND_ACK") == []


def test_a_mission_release_shows_as_a_command_to_itself_and_as_output_but_never_as_an_ack() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(10), waypoint(20, 0, 10), RELEASE, waypoint(20, 40, 10)])
    started_s = gcs.now_s
    gcs.until(lambda: gcs.vehicle.state.gripper.output_released)
    gcs.fly(4.0)
    own = [m for m in gcs.messages("COMMAND_LONG", started_s) if m.command == Cmd.DO_GRIPPER]
    assert [(m.target_system, m.target_component, m.param2, m.confirmation) for m in own] == [
        (1, 0, 0.0, confirmation) for confirmation in range(4)
    ]
    assert [ack for ack in gcs.messages("COMMAND_ACK", started_s) if ack.command == Cmd.DO_GRIPPER] == []
    assert gcs.last("SERVO_OUTPUT_RAW").servo5_raw == 1000


def test_with_an_invalid_gripper_the_mission_flies_on_exactly_alike() -> None:
    gcs = GroundStation(params={"PD_GRIPPER_TYPE": -1})
    gcs.start([takeoff(10), waypoint(20, 0, 10), RELEASE, waypoint(20, 40, 10)])
    gcs.until(lambda: 2 in [m.seq for m in gcs.messages("MISSION_ITEM_REACHED")])
    gcs.fly(2.0)
    outputs = {message.servo5_raw for message in gcs.messages("SERVO_OUTPUT_RAW")}
    assert outputs == {900, 1000}, "nothing ever told it to grab (17b_gripper_none)"


def test_without_an_assigned_output_all_is_answered_alike_and_nothing_moves() -> None:
    """Scenario 29: by command on the ground, and by an item of the mission."""
    gcs = GroundStation(params={"PWM_MAIN_FUNC5": 0})
    assert gripper(gcs, 0) == [Result.IN_PROGRESS, Result.ACCEPTED]
    assert gripper(gcs, 1) == [Result.IN_PROGRESS, Result.ACCEPTED]
    gcs.start([takeoff(10), waypoint(20, 0, 10), RELEASE, waypoint(20, 40, 10)])
    gcs.until(lambda: 2 in [m.seq for m in gcs.messages("MISSION_ITEM_REACHED")])
    gcs.fly(2.0)
    assert {message.servo5_raw for message in gcs.messages("SERVO_OUTPUT_RAW")} == {900}
    assert not gcs.vehicle.state.gripper.is_open


def test_an_output_that_is_assigned_while_armed_counts_after_the_next_disarming() -> None:
    gcs = GroundStation(params={"PWM_MAIN_FUNC5": 0})
    gcs.arm()
    gcs.vehicle.params.set("PWM_MAIN_FUNC7", 430)
    gcs.fly(0.2)
    assert gcs.last("SERVO_OUTPUT_RAW").servo7_raw == 900
    gcs.fly(12.0)
    assert not gcs.armed, "no take-off"
    gcs.arm()
    gcs.fly(0.2)
    assert gcs.last("SERVO_OUTPUT_RAW").servo7_raw == 2000


def test_it_stays_released_after_landing() -> None:
    gcs = GroundStation(params={"PD_GRIPPER_TO": 1.0})
    gripper(gcs, 0, wait_s=2.0)
    gcs.arm()
    gcs.fly(12.0)
    assert not gcs.armed, "no take-off"
    gcs.arm()
    gcs.fly(0.3)
    assert gcs.last("SERVO_OUTPUT_RAW").servo5_raw == 1000


def test_a_stuck_gripper_looks_on_the_link_like_one_that_opened(gcs: GroundStation) -> None:
    gcs.arm()
    gcs.vehicle.faults.stuck_gripper = True
    assert gripper(gcs, 0) == [Result.IN_PROGRESS, Result.ACCEPTED]
    assert gcs.last("SERVO_OUTPUT_RAW").servo5_raw == 1000
    assert not gcs.vehicle.state.gripper.is_open


def test_a_gripper_that_is_gone_in_flight_refuses_and_drops_nothing(gcs: GroundStation) -> None:
    gcs.arm()
    gcs.vehicle.faults.no_gripper = True
    assert gripper(gcs, 0) == [Result.FAILED]
    assert not gcs.vehicle.state.gripper.is_open


def test_a_slow_gripper_takes_longer(gcs: GroundStation) -> None:
    gcs.vehicle.faults.slow_gripper_s = 2.0
    assert gripper(gcs, 0, wait_s=1.5) == [Result.IN_PROGRESS]
    assert not gcs.vehicle.state.gripper.is_open
    gcs.fly(3.0)
    assert gcs.vehicle.state.gripper.is_open
    assert len([m for m in gcs.messages("COMMAND_ACK") if m.result == Result.ACCEPTED]) == 1
    gcs.fly(1.0)
    assert gcs.last("COMMAND_ACK").result == Result.ACCEPTED


def test_commands_to_somebody_else_get_no_answer_and_unknown_ones_are_unsupported(gcs: GroundStation) -> None:
    mark = len(gcs.messages("COMMAND_ACK"))
    gcs.send(mavlink.MAVLink_command_long_message(1, 100, 520, 0, 1, 0, 0, 0, 0, 0, 0))
    gcs.send(mavlink.MAVLink_command_long_message(200, 1, 520, 0, 1, 0, 0, 0, 0, 0, 0))
    gcs.fly(0.2)
    assert len(gcs.messages("COMMAND_ACK")) == mark
    for unsupported in (9999, Cmd.DO_PAUSE_CONTINUE, Cmd.REQUEST_AUTOPILOT_CAPABILITIES):
        assert gcs.command(unsupported) == [Result.UNSUPPORTED]
    assert gcs.set_mode(Mode.LOITER) == [Result.ACCEPTED]
