"""From a setpoint to its message: nothing invented, nothing turned into 0 that was not given."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from app.domain.autopilot.capability import FirmwareProfile, FlightKind
from app.domain.errors import SetpointRefusedError
from app.domain.offboard.control_method import capability
from app.domain.offboard.encode import encode
from app.domain.offboard.messages import AttitudeTarget, GlobalTarget, LocalTarget, SetpointFrame
from tests.support.setpoint_examples import EXAMPLES, example, follower, setpoint_of

POSITION_BITS, VELOCITY_BITS, ACCELERATION_BITS, YAW, YAW_RATE = 0x7, 0x38, 0x1C0, 0x400, 0x800


@pytest.mark.parametrize("form", EXAMPLES)
@pytest.mark.parametrize("kind", FlightKind)
@pytest.mark.parametrize("profile", FirmwareProfile)
def test_what_the_table_takes_is_encoded_and_what_it_refuses_is_refused_with_its_code(
    form: str, kind: FlightKind, profile: FirmwareProfile
) -> None:
    known = capability(form, kind, profile)
    if known.support.is_accepted:
        message = encode(example(form), follower(kind, profile))
        assert message.name == known.wire.message
        return
    with pytest.raises(SetpointRefusedError) as refused:
        encode(example(form), follower(kind, profile))
    assert refused.value.refusal == known.support.code
    assert known.support.reason in refused.value.detail


@settings(deadline=None)
@given(yaw=st.none() | st.floats(-360, 360), rate=st.none() | st.floats(-90, 90))
def test_a_heading_takes_its_bit_out_of_the_mask_and_not_given_is_nan(yaw: float | None, rate: float | None) -> None:
    message = encode(example("velocity_ned", yaw_deg=yaw, yawspeed_deg_s=rate), follower())
    assert isinstance(message, LocalTarget)
    assert bool(message.type_mask & YAW) == (yaw is None) == math.isnan(message.yaw_rad)
    assert bool(message.type_mask & YAW_RATE) == (rate is None) == math.isnan(message.yaw_rate_rad_s)
    if yaw is not None:
        assert -math.pi <= message.yaw_rad <= math.pi
        assert math.cos(message.yaw_rad) == pytest.approx(math.cos(math.radians(yaw)), abs=1e-9)


@pytest.mark.parametrize("form", [form for form in EXAMPLES if form.endswith("_ned")])
def test_each_vector_is_given_exactly_when_its_bits_are_not_set(form: str) -> None:
    if not capability(form, FlightKind.ROTARY, FirmwareProfile.FLOWN).support.is_accepted:
        return
    message = encode(example(form), follower())
    assert isinstance(message, LocalTarget)
    for vector, bits in (
        (message.position, POSITION_BITS),
        (message.velocity, VELOCITY_BITS),
        (message.acceleration, ACCELERATION_BITS),
    ):
        assert all(math.isnan(part) for part in vector) == (message.type_mask & bits == bits)


def test_a_body_velocity_goes_out_in_the_body_frame() -> None:
    message = encode(example("velocity_body"), follower())
    assert isinstance(message, LocalTarget)
    assert (message.frame, message.velocity) == (SetpointFrame.BODY_NED, (2.0, -1.0, 0.5))


def test_an_altitude_above_home_goes_out_above_the_sea() -> None:
    message = encode(example("position_global", altitude_m=12.0, altitude_type="rel_home"), follower())
    assert isinstance(message, GlobalTarget)
    assert (message.frame, message.altitude_m) == (SetpointFrame.GLOBAL_INT, 500.0)


@pytest.mark.parametrize(
    ("changes", "refusal"), [({"altitude_type": "agl"}, "setpoint.frame_unsupported"), ({}, "setpoint.home_unknown")]
)
def test_an_altitude_that_has_no_meaning_is_refused(changes: dict[str, str], refusal: str) -> None:
    setpoint = example("position_global", **{"altitude_type": "rel_home", **changes})
    with pytest.raises(SetpointRefusedError) as refused:
        encode(setpoint, replace(follower(), home_altitude_m=None))
    assert refused.value.refusal == refusal


def test_only_a_rover_may_leave_the_height_out() -> None:
    assert encode(example("position_ned", down_m=None), follower(FlightKind.ROVER))
    with pytest.raises(SetpointRefusedError, match="down_m"):
        encode(example("position_ned", down_m=None), follower())


@pytest.mark.parametrize("form", ["position_ned", "velocity_ned", "attitude", "body_rates"])
def test_without_an_estimate_only_what_needs_none_is_sent(form: str) -> None:
    blind = replace(follower(), has_estimate=False)
    if form in ("attitude", "body_rates"):
        assert encode(example(form), blind)
        return
    with pytest.raises(SetpointRefusedError) as refused:
        encode(example(form), blind)
    assert refused.value.refusal == "setpoint.no_estimate"


@settings(deadline=None)
@given(roll=st.floats(-80, 80), pitch=st.floats(-80, 80), yaw=st.floats(-180, 180))
def test_an_attitude_is_a_unit_quaternion_that_tilts_as_asked(roll: float, pitch: float, yaw: float) -> None:
    message = encode(example("attitude", roll_deg=roll, pitch_deg=pitch, yaw_deg=yaw), follower())
    assert isinstance(message, AttitudeTarget)
    w, x, y, z = message.q
    assert w * w + x * x + y * y + z * z == pytest.approx(1.0)
    assert math.degrees(math.asin(2 * (w * y - z * x))) == pytest.approx(pitch, abs=1e-4)
    assert math.degrees(math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))) == pytest.approx(roll, abs=1e-4)


@pytest.mark.parametrize(
    ("setpoint_type", "mask"), [("glide", 292), ("takeoff", 0x1DF8), ("land", 0x2DF8), ("loiter", 0x3DF8)]
)
def test_the_documented_types_are_in_the_mask(setpoint_type: str, mask: int) -> None:
    old = follower(FlightKind.WING, FirmwareProfile.DOCUMENTED)
    assert encode(example("typed_position_ned", setpoint_type=setpoint_type), old).type_mask == mask


@pytest.mark.parametrize(
    "document",
    [
        {"type": "position_ned", "north_m": 1.0},
        {"type": "velocity_ned", "north_m_s": 1.0, "east_m_s": 0.0, "speed": 3.0},
        {"type": "velocity_ned", "north_m_s": "1", "east_m_s": 0.0},
        {"type": "attitude", "yaw_deg": 0.0, "thrust": 1.5},
        {"type": "warp", "factor": 9},
        {"north_m": 1.0},
    ],
)
def test_what_is_no_setpoint_is_refused_whole(document: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        setpoint_of(document)


@pytest.mark.parametrize(
    ("form", "changes", "kind", "frame", "mask"),
    [
        ("position_ned", {}, FlightKind.ROTARY, 1, 3576),
        ("position_ned", {"yaw_deg": 90.0}, FlightKind.ROTARY, 1, 2552),
        ("velocity_ned", {}, FlightKind.ROTARY, 1, 3527),
        ("velocity_body", {}, FlightKind.ROTARY, 8, 3527),
        ("position_global", {}, FlightKind.ROTARY, 5, 3576),
        ("attitude", {}, FlightKind.ROTARY, None, 7),
        ("body_rates", {}, FlightKind.ROTARY, None, 128),
        ("position_velocity_ned", {}, FlightKind.WING, 1, 3520),
        ("attitude", {}, FlightKind.WING, None, 7),
        ("position_ned", {}, FlightKind.ROVER, 1, 3576),
        ("velocity_ned", {}, FlightKind.ROVER, 1, 3527),
        ("velocity_body", {}, FlightKind.ROVER, 8, 3527),
    ],
)
def test_it_is_what_a_real_px4_was_flown_with(
    form: str, changes: dict[str, float], kind: FlightKind, frame: int | None, mask: int
) -> None:
    """The frames and masks of all setpoints in recordings 18 to 21 that PX4 followed."""
    message = encode(example(form, **changes), follower(kind))
    assert (getattr(message, "frame", None), message.type_mask) == (frame, mask)
