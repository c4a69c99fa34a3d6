"""Limits: what leaves is within them, what was within them is not touched, and every change is said."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.airspace.geofence import FenceArea, onboard_fence
from app.domain.autopilot import behaviour_of
from app.domain.autopilot.capability import FlightKind
from app.domain.errors import SetpointRefusedError
from app.domain.geo import LocalProjection
from app.domain.mission import MavCmd, MavFrame, MissionItem, MissionType
from app.domain.offboard.limits import OffboardLimits, VehiclePose, limit, tilt_deg
from app.domain.offboard.setpoints import Attitude, PositionNed, Setpoint, VelocityBody, VelocityNed
from app.domain.vehicle.state import FirmwareVersion, VehicleType
from tests.support.setpoint_examples import attitudes, body_velocities, example, places, velocities

PATIENT = settings(deadline=None)
"""Geometry on a busy machine."""
HOME = (47.397742, 8.545594, 488.0)
LIMITS = OffboardLimits()
HERE = VehiclePose(FlightKind.ROTARY, HOME, (0.0, 0.0, 0.0), (5.0, 5.0, 20.0))
heres = st.builds(
    lambda n, e, u: replace(HERE, here=(n, e, u)), st.floats(-990, 990), st.floats(-100, 100), st.floats(2, 120)
)


def refusal_of(setpoint: Setpoint, where: VehiclePose = HERE, **changes: object) -> str:
    with pytest.raises(SetpointRefusedError) as refused:
        limit(setpoint, LIMITS.model_copy(update=changes), where)
    return refused.value.refusal


@PATIENT
@given(setpoint=velocities | body_velocities, where=heres)
def test_a_clamped_velocity_is_within_every_limit_and_keeps_its_direction(
    setpoint: Setpoint, where: VehiclePose
) -> None:
    found = limit(setpoint, LIMITS, where).setpoint
    before, after = across(setpoint), across(found)
    assert math.hypot(*after) <= 10.0 + 1e-6
    assert -3.0 - 1e-9 <= found.down_m_s <= 2.0 + 1e-9  # type: ignore[union-attr]
    assert before[0] * after[1] == pytest.approx(before[1] * after[0], abs=1e-6)
    assert before[0] * after[0] + before[1] * after[1] >= 0.0


def across(setpoint: Setpoint) -> tuple[float, float]:
    if isinstance(setpoint, VelocityBody):
        return setpoint.forward_m_s, setpoint.right_m_s
    assert isinstance(setpoint, VelocityNed)
    return setpoint.north_m_s, setpoint.east_m_s


@PATIENT
@given(setpoint=places)
def test_a_clamped_place_is_within_the_distance_and_the_altitudes(setpoint: Setpoint) -> None:
    found = limit(setpoint, LIMITS, HERE).setpoint
    assert isinstance(found, PositionNed)
    assert math.hypot(found.north_m, found.east_m) <= 1000.0 + 1e-6
    assert found.down_m is not None
    assert 2.0 - 1e-9 <= -found.down_m <= 120.0 + 1e-9


@PATIENT
@given(setpoint=attitudes)
def test_a_clamped_attitude_tilts_no_more_than_allowed(setpoint: Setpoint) -> None:
    found = limit(setpoint, LIMITS, HERE).setpoint
    assert isinstance(found, Attitude)
    assert tilt_deg(found.roll_deg, found.pitch_deg) <= 35.0 + 1e-6


@PATIENT
@given(setpoint=velocities | places | attitudes, where=heres)
def test_limits_change_nothing_silently_and_nothing_twice(setpoint: Setpoint, where: VehiclePose) -> None:
    first = limit(setpoint, LIMITS, where)
    assert (first.setpoint == setpoint) == (not first.clamps)
    second = limit(first.setpoint, LIMITS, where)
    for name, value in first.setpoint.model_dump(exclude={"type", "altitude_type"}).items():
        assert value is None or getattr(second.setpoint, name) == pytest.approx(value, abs=1e-6)


@PATIENT
@given(setpoint=velocities | places | attitudes, where=heres)
def test_configured_to_refuse_exactly_what_would_be_clamped_is_refused(setpoint: Setpoint, where: VehiclePose) -> None:
    clamps = limit(setpoint, LIMITS, where).clamps
    if clamps:
        assert refusal_of(setpoint, where, when_exceeded="refuse") == clamps[0].code
    else:
        assert limit(setpoint, LIMITS.model_copy(update={"when_exceeded": "refuse"}), where).setpoint == setpoint


def test_no_limits_let_everything_through() -> None:
    nothing = OffboardLimits(
        **dict.fromkeys(name for name in OffboardLimits.model_fields if name != "when_exceeded")  # type: ignore[arg-type]
    )
    for form in ("velocity_ned", "position_ned", "attitude", "body_rates"):
        assert limit(example(form), nothing, HERE).setpoint == example(form)


def test_at_the_edge_the_way_out_is_stopped_and_the_way_back_is_open() -> None:
    edge = replace(HERE, here=(995.0, 0.0, 20.0))
    out, back = (
        example("velocity_ned", north_m_s=5.0, east_m_s=0.0),
        example("velocity_ned", north_m_s=-5.0, east_m_s=0.0),
    )
    stopped = limit(out, LIMITS, edge)
    assert [clamp.code for clamp in stopped.clamps] == ["limit.distance"]
    assert across(stopped.setpoint) == (0.0, 0.0)
    assert limit(back, LIMITS, edge).setpoint == back
    beyond = replace(HERE, here=(1500.0, 0.0, 20.0))
    assert limit(back, LIMITS, beyond).setpoint == back


def test_a_body_velocity_is_judged_by_where_the_nose_points() -> None:
    edge = replace(HERE, here=(995.0, 0.0, 20.0), heading_deg=180.0)
    setpoint = example("velocity_body", forward_m_s=5.0, right_m_s=0.0, down_m_s=0.0)
    assert limit(setpoint, LIMITS, edge).setpoint == setpoint
    assert limit(setpoint, LIMITS, replace(edge, heading_deg=0.0)).clamps


def test_a_climb_ends_below_the_ceiling_and_a_descent_above_the_floor() -> None:
    up, down = example("velocity_ned", down_m_s=-2.0), example("velocity_ned", down_m_s=2.0)
    for setpoint, height in ((up, 118.0), (down, 4.0)):
        found = limit(setpoint, LIMITS, replace(HERE, here=(0.0, 0.0, height)))
        assert found.setpoint.down_m_s == 0.0  # type: ignore[union-attr]
        assert across(found.setpoint) == across(setpoint)


def test_a_rover_has_no_altitude_and_a_wing_chooses_its_own_speed() -> None:
    ground = replace(HERE, kind=FlightKind.ROVER, here=(0.0, 0.0, 0.0))
    assert not limit(example("position_ned", down_m=None), LIMITS, ground).clamps
    wing = replace(HERE, kind=FlightKind.WING)
    assert not limit(example("position_velocity_ned", north_m_s=20.0), LIMITS, wing).clamps


def test_what_cannot_be_bounded_is_refused() -> None:
    assert refusal_of(example("body_rates")) == "limit.tilt"
    fast = replace(HERE, velocity=(12.0, 0.0, 0.0))
    assert refusal_of(example("acceleration_ned"), fast) == "limit.speed"
    leaving = replace(HERE, here=(990.0, 0.0, 20.0), velocity=(9.0, 0.0, 0.0))
    assert refusal_of(example("attitude"), leaving) == "limit.distance"


def test_a_wing_is_never_sent_along_another_path_than_was_asked() -> None:
    wing = replace(HERE, kind=FlightKind.WING, here=(900.0, 0.0, 50.0))
    assert refusal_of(example("position_velocity_ned", north_m=2000.0, down_m=-50.0), wing) == "limit.distance"
    near = example("position_velocity_ned", north_m=900.0, down_m=-50.0)
    assert limit(near, LIMITS, wing).setpoint == near
    beyond_the_point = replace(wing, here=(990.0, 0.0, 50.0), velocity=(12.0, 0.0, 0.0))
    assert refusal_of(near, beyond_the_point) == "limit.distance"
    coming_back = replace(beyond_the_point, here=(1200.0, 0.0, 50.0), velocity=(-12.0, 0.0, 0.0))
    assert limit(near, LIMITS, coming_back).setpoint == near


def test_without_home_or_a_place_nothing_can_be_measured_so_it_is_refused() -> None:
    lost = VehiclePose(FlightKind.ROTARY)
    assert refusal_of(example("position_ned"), lost) == "limit.home_unknown"
    assert refusal_of(example("position_global"), lost) == "limit.home_unknown"
    assert refusal_of(example("velocity_ned"), lost) == "limit.position_unknown"


def test_a_local_place_counts_from_the_ekf_origin_and_not_from_home() -> None:
    moved = replace(HERE, home_ned=(900.0, 0.0, 0.0))
    assert not limit(example("position_ned", north_m=1800.0, east_m=0.0), LIMITS, moved).clamps
    assert limit(example("position_ned", north_m=-150.0, east_m=0.0), LIMITS, moved).clamps


@PATIENT
@given(places)
def test_a_global_place_is_clamped_as_the_same_local_one(setpoint: Setpoint) -> None:
    assert isinstance(setpoint, PositionNed)
    assert setpoint.down_m is not None
    latitude, longitude = LocalProjection(HOME[0], HOME[1]).to_global(setpoint.east_m / 100, setpoint.north_m / 100)
    changes = {"latitude_deg": latitude, "longitude_deg": longitude, "altitude_m": 20.0, "altitude_type": "rel_home"}
    away = math.hypot(setpoint.east_m / 100, setpoint.north_m / 100)
    assert bool(limit(example("position_global", **changes), LIMITS, HERE).clamps) == (away > 1000.0)


NEW, OLD = FirmwareVersion(1, 17, 0), FirmwareVersion(1, 14, 3)


def fence(kind: str = "INCLUSION") -> tuple[MissionItem, ...]:
    command = MavCmd[f"NAV_FENCE_POLYGON_VERTEX_{kind}"]
    projection = LocalProjection(HOME[0], HOME[1])
    corners = [projection.to_global(east, north) for east, north in ((-50, -50), (-50, 50), (50, 50), (50, -50))]
    return tuple(
        MissionItem(
            seq, MavFrame.GLOBAL_RELATIVE_ALT_INT, command, 4.0, 0.0, 0.0, 0.0,
            x=round(latitude * 1e7), y=round(longitude * 1e7), mission_type=MissionType.FENCE,
        )
        for seq, (latitude, longitude) in enumerate(corners)
    )  # fmt: skip


def on_board(items: Sequence[MissionItem], firmware: FirmwareVersion | None = NEW) -> FenceArea | None:
    known = behaviour_of(VehicleType.MULTICOPTER, firmware)
    return onboard_fence(items, LocalProjection(HOME[0], HOME[1]), needs_all_inclusions=known.needs_all_inclusions)


def fenced(kind: str = "INCLUSION", here: tuple[float, float, float] = (5.0, 5.0, 20.0)) -> VehiclePose:
    return replace(HERE, here=here, fence=on_board(fence(kind)))


def test_a_place_beyond_the_fence_on_board_is_refused_and_never_moved() -> None:
    assert limit(example("position_ned", north_m=40.0), LIMITS, fenced())
    assert refusal_of(example("position_ned", north_m=60.0), fenced()) == "limit.fence"
    across_it = example("position_ned", north_m=0.0, east_m=80.0)
    assert refusal_of(across_it, fenced("EXCLUSION", here=(0.0, -80.0, 20.0))) == "limit.fence"


def test_a_velocity_towards_the_fence_is_stopped() -> None:
    found = limit(example("velocity_ned", north_m_s=5.0, east_m_s=0.0), LIMITS, fenced(here=(45.0, 0.0, 20.0)))
    assert [clamp.code for clamp in found.clamps] == ["limit.fence"]
    assert across(found.setpoint) == (0.0, 0.0)


def test_a_vehicle_without_a_fence_has_none() -> None:
    assert on_board(()) is None


@pytest.mark.parametrize(("firmware", "refused"), [(OLD, False), (NEW, True), (None, True)])
def test_newer_firmware_wants_a_place_in_all_inclusions_around_home(
    firmware: FirmwareVersion | None, refused: bool
) -> None:
    circle = replace(fence()[0], seq=4, command=MavCmd.NAV_FENCE_CIRCLE_INCLUSION, param1=30.0)
    home = replace(circle, x=round(HOME[0] * 1e7), y=round(HOME[1] * 1e7))
    around_home = on_board((*fence(), home), firmware)
    setpoint, there = example("position_ned", north_m=40.0), replace(fenced(), fence=around_home)
    if refused:
        assert refusal_of(setpoint, there) == "limit.fence"
    else:
        assert limit(setpoint, LIMITS, there).clamps == ()
