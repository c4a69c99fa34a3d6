"""Offboard control as recorded in scenarios 18, 19, 20, 20b and 21: what is followed, sign of life, loss."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import mavlink
from app.simulator.events import EVENTS
from app.simulator.wire import Cmd, Mode, Result
from tests.support.offboard_sender import POSITION, ZERO, Sender, attitude, local, world
from tests.support.simulated_vehicle import GroundStation

VELOCITY, ACCELERATION, BOTH, NOTHING, LOITER = 3527, 3135, 3520, 4095, 12288
"""Type masks."""
BODY = 8
NAN = math.nan


# what is followed -------------------------------------------------------------------------------------------


def test_a_quad_takes_off_to_the_point_and_flies_positions_velocities_and_body_velocities() -> None:
    sender = Sender("quad").airborne()
    assert sender.place == pytest.approx((0, 0, 10), abs=0.5)
    assert sender.to(local((20, 0, -10)), 8.0).place == pytest.approx((20, 0, 10), abs=1.0)
    _, east, up = sender.to(local(velocity=(0, 2, 0), mask=VELOCITY), 6.0).place
    assert (east, up) == (pytest.approx(8.5, abs=3.0), pytest.approx(10.0, abs=0.5))
    north_m = sender.place[0]
    sender.gcs.vehicle.state.body.yaw_rad = 0.0
    sender.to(local(velocity=(1, 0, 0), mask=VELOCITY, frame=BODY), 4.0)
    assert sender.place[0] - north_m == pytest.approx(3.0, abs=1.5)


@pytest.mark.parametrize(("frame", "alt"), [(6, 12.0), (5, None), (0, None)])
def test_global_positions_are_above_home_or_above_the_sea_by_their_frame(frame: int, alt: float | None) -> None:
    sender = Sender("quad").airborne()
    amsl = sender.gcs.vehicle.spec.frame.altitude_m + 12.0
    place = sender.to(world(sender.gcs, 10, 5, amsl if alt is None else alt, frame), 10.0).place
    assert place == pytest.approx((10, 5, 12), abs=1.0)


def test_a_quad_follows_thrust_and_tilt() -> None:
    sender = Sender("quad").airborne()
    sender.gcs.vehicle.state.body.yaw_rad = 0.0
    north_m, _, up_m = sender.place
    sender.to(attitude(0.55, pitch_deg=-5.0), 3.0)
    assert sender.mode is Mode.OFFBOARD
    assert sender.place[0] > north_m + 0.5
    assert sender.place[2] > up_m + 0.5


def test_a_coordinate_that_is_not_a_number_is_taken_and_left_as_it_is() -> None:
    sender = Sender("quad").airborne()
    assert sender.to(local((NAN, 5, -10)), 5.0).place == pytest.approx((0, 5, 10), abs=1.0)


def test_a_plane_follows_position_with_velocity_as_a_line() -> None:
    sender = Sender("plane").airborne()
    north_m, east_m, up_m = sender.to(local((300, 0, -50), (12, 0, 0), BOTH), 60.0).place
    assert (east_m, up_m) == (pytest.approx(0.0, abs=2.0), pytest.approx(50.0, abs=2.0))
    assert north_m > 350.0  # beyond the point


def test_a_plane_given_a_position_alone_flies_due_north_at_its_height() -> None:
    sender = Sender("plane").airborne()
    sender.to(local((200, 0, -50)), 20.0)
    north_m, east_m, up_m = sender.place
    sender.stream(10.0)
    assert sender.place[0] - north_m == pytest.approx(120, abs=5)
    assert sender.place[1] == pytest.approx(east_m, abs=2)
    assert up_m == pytest.approx(50.0, abs=3.0)


@pytest.mark.parametrize(
    "message", [local(velocity=(0, 12, 0), mask=VELOCITY), local(mask=ACCELERATION), local((0, 0, -50), mask=LOITER)]
)
def test_a_plane_keeps_its_course_with_all_else(message: mavlink.MAVLink_message) -> None:
    sender = Sender("plane")
    sender.message = message
    sender.airborne()
    sender.stream(10.0)
    body = sender.gcs.vehicle.state.body
    course = math.atan2(body.v_east_m_s, body.v_north_m_s)
    sender.stream(10.0)
    assert math.atan2(body.v_east_m_s, body.v_north_m_s) == pytest.approx(course, abs=0.1)
    assert sender.mode is Mode.OFFBOARD


def test_a_plane_follows_bank_and_pitch() -> None:
    """Recorded: 20 and 3 degrees turn at a third of a rad/s and climb 4.5 m in 6 s."""
    sender = Sender("plane")
    sender.message = attitude(0.8, pitch_deg=3.0, roll_deg=20.0)
    body = sender.airborne().stream(6.0).gcs.vehicle.state.body
    yaw, up_m = body.yaw_rad, body.up_m
    sender.stream(6.0)
    turned = (body.yaw_rad - yaw) % (2.0 * math.pi)
    assert turned == pytest.approx(6.0 * 0.31, rel=0.2)
    assert body.up_m - up_m == pytest.approx(4.5, abs=1.5)


def test_a_rover_drives_to_a_position_follows_a_velocity_and_ignores_attitude() -> None:
    sender = Sender("rover")
    sender.message = local((20, 0, 0))
    sender.stream(0.5)
    sender.gcs.set_mode(Mode.OFFBOARD)
    sender.gcs.arm()
    assert sender.stream(15.0).place[:2] == pytest.approx((20, 0), abs=0.3)
    assert sender.to(local(velocity=(-1.5, 0, 0), mask=VELOCITY), 8.0).place[0] < 15.0
    sender.to(local(velocity=ZERO, mask=VELOCITY), 5.0)
    before = sender.place
    assert sender.to(attitude(0.2), 5.0).place == pytest.approx(before, abs=0.3)
    assert sender.mode is Mode.OFFBOARD


# what is refused --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "message",
    [
        local(mask=NOTHING),
        local((5, 5, -10), frame=BODY, mask=POSITION),  # no position in a body frame
        local((5, 5, -10), frame=7),
        mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, 3, POSITION, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, 11, POSITION, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_set_position_target_local_ned_message(0, 9, 1, 1, POSITION, *ZERO, *ZERO, 0, 0, 0, 0, 0),
        attitude(0.5, mask=7 | 0x40),  # no thrust
        attitude(0.5, mask=7 | 0x80),  # neither attitude nor rates
    ],
)
def test_what_is_refused_is_no_sign_of_life(message: mavlink.MAVLink_message) -> None:
    sender = Sender("quad").airborne()
    assert sender.to(message, 1.3).mode is Mode.LOITER


def test_the_refusal_is_said_for_each_setpoint() -> None:
    sender = Sender("quad")
    sender.to(local(mask=NOTHING), 0.4)
    assert sender.gcs.texts().count("SET_POSITION_TARGET_LOCAL_NED invalid") == 10
    sender.gcs.send(world(sender.gcs, 0, 0, 12, frame=3))
    assert "".join(sender.gcs.texts()[-2:]) == "SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame 3"


# entering ---------------------------------------------------------------------------------------------------


def test_disarmed_the_mode_is_taken_without_a_stream_and_then_arming_fails() -> None:
    gcs = GroundStation()
    assert gcs.set_mode(Mode.OFFBOARD) == [Result.ACCEPTED]
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    gcs.fly(1.0)
    heartbeat = gcs.last("HEARTBEAT")
    assert (heartbeat.custom_mode, heartbeat.system_status) == (Mode.OFFBOARD, 0)
    assert heartbeat.base_mode == 17, "no manual input"


def test_in_the_air_one_setpoint_is_enough_to_enter_and_none_is_not() -> None:
    sender = Sender("quad").airborne()
    sender.gcs.set_mode(Mode.LOITER)
    sender.gcs.fly(3.0)
    assert sender.gcs.set_mode(Mode.OFFBOARD) == [Result.TEMPORARILY_REJECTED]
    assert sender.gcs.texts()[-1] == "Switching to Offboard is currently not available"
    sender.gcs.send(sender.message)
    sender.gcs.fly(0.1)  # until the next check
    assert sender.gcs.set_mode(Mode.OFFBOARD) == [Result.ACCEPTED]


def test_a_stream_is_seen_by_the_next_of_ten_checks_a_second() -> None:
    """OFFBOARD was accepted 50 ms after the first setpoint [18_offboard_quad]."""
    sender = Sender("quad").airborne()
    at_once = []
    for _ in range(5):
        sender.gcs.set_mode(Mode.LOITER)
        sender.gcs.fly(3.02)  # each time a step later between two checks
        sender.gcs.send(sender.message)
        at_once += sender.gcs.set_mode(Mode.OFFBOARD)
        sender.gcs.fly(0.1)
        assert sender.gcs.set_mode(Mode.OFFBOARD) == [Result.ACCEPTED]
    assert at_once.count(Result.TEMPORARILY_REJECTED) >= 3


# loss -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("action", "mode"),
    [(0, Mode.POSCTL), (1, Mode.ALTCTL), (2, Mode.STABILIZED), (3, Mode.RTL), (4, Mode.LAND), (5, Mode.LOITER)],
)
def test_the_parameter_says_what_a_lost_stream_does(action: int, mode: Mode) -> None:
    sender = Sender("quad", COM_OBL_RC_ACT=action).airborne()
    lost_s = sender.gcs.until(lambda: sender.mode is not Mode.OFFBOARD, 5.0)
    assert sender.mode is mode
    assert lost_s == pytest.approx(1.0, abs=0.13)  # after the last pause of the stream
    sender.gcs.fly(1.1)
    assert sender.gcs.last("HEARTBEAT").system_status == 5
    assert "Failsafe activated" in sender.gcs.texts()
    said = [e for e in sender.gcs.messages("EVENT") if e.id == EVENTS["commander_failsafe_enter_generic"][0]]
    failsafe_action = {0: 2, 1: 3, 2: 4, 3: 6, 4: 7, 5: 5}[action]
    assert [event.arguments[4] for event in said] == [failsafe_action]


@pytest.mark.parametrize(("action", "armed"), [(6, True), (7, False)])
def test_terminate_and_disarm_stop_the_motors(action: int, armed: bool) -> None:
    sender = Sender("quad", COM_OBL_RC_ACT=action).airborne()
    sender.gcs.until(lambda: "Failsafe activated" in sender.gcs.texts(), 2.0)
    sender.gcs.fly(0.1)
    assert (sender.gcs.armed, sender.gcs.vehicle.state.body.throttle) == (armed, 0.0)
    sender.gcs.until(lambda: sender.gcs.vehicle.state.body.on_ground, 5.0)


def test_the_time_until_the_loss_is_a_parameter() -> None:
    sender = Sender("quad", COM_OF_LOSS_T=3.0).airborne()
    assert sender.gcs.until(lambda: sender.mode is not Mode.OFFBOARD, 5.0) == pytest.approx(3.0, abs=0.1)


@pytest.mark.parametrize("action", [3, 5])
def test_a_stream_that_comes_back_takes_the_vehicle_back_by_itself(action: int) -> None:
    sender = Sender("quad", COM_OBL_RC_ACT=action).airborne()
    sender.gcs.fly(8.0)
    assert sender.mode is not Mode.OFFBOARD
    assert sender.stream(0.3).mode is Mode.OFFBOARD, "0.05 to 0.3 s [18]"
    assert sender.stream(1.0).gcs.last("HEARTBEAT").system_status == 4


def test_after_somebody_asked_for_hold_a_stream_takes_nothing_back() -> None:
    sender = Sender("quad").airborne()
    sender.gcs.fly(2.0)
    sender.gcs.set_mode(Mode.LOITER)
    assert sender.stream(3.0).mode is Mode.LOITER


@pytest.mark.parametrize(("hz", "flips"), [(2.5, 0), (1.1, 0), (0.8, 8)])
def test_the_limit_is_the_loss_time_not_two_hertz(hz: float, flips: int) -> None:
    sender = Sender("quad").airborne()
    sender.stream(10.0, hz)
    assert sender.gcs.texts().count("Failsafe activated") == flips


def test_a_rover_returns_lands_disarms_and_is_in_offboard_again() -> None:
    sender = Sender("rover", COM_OBL_RC_ACT=3)
    sender.message = local((20, 0, 0))
    sender.stream(0.5)
    sender.gcs.set_mode(Mode.OFFBOARD)
    sender.gcs.arm()
    sender.stream(10.0)
    sender.gcs.until(lambda: not sender.gcs.armed, 60.0)
    assert sender.gcs.distance_to(0, 0) < 1.0
    assert sender.mode is Mode.OFFBOARD
