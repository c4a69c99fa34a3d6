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
from app.domain.mission import MavCmd, MissionItem
from app.domain.offboard.limits import OffboardLimits, VehiclePose, limit, tilt_deg
from app.domain.offboard.setpoints import Attitude, PositionNed, Setpoint, VelocityBody, VelocityNed
from app.domain.vehicle.state import FirmwareVersion, VehicleType
from tests.support.fences import square
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


def test_a_velocity_beside_a_place_may_not_lead_below_the_floor_or_above_the_ceiling() -> None:
    for height, down_m_s in ((2.0, 2.0), (120.0, -3.0)):
        where = replace(HERE, here=(0.0, 0.0, 20.0))
        pressed = example("position_velocity_ned", north_m=0.0, east_m=0.0, down_m=-height, down_m_s=down_m_s)
        found = limit(pressed, LIMITS, where)
        assert [clamp.code for clamp in found.clamps] == ["limit.altitude"]
        assert found.setpoint.down_m_s == 0.0  # type: ignore[union-attr]
        assert across_beside(found.setpoint) == (2.0, -1.0)
        high = pressed.model_copy(update={"down_m": -60.0})
        assert limit(high, LIMITS, where).setpoint == high
        near = replace(where, here=(0.0, 0.0, height))
        assert limit(high, LIMITS, near).setpoint.down_m_s == 0.0, "nor from where the vehicle is"  # type: ignore[union-attr]


def across_beside(setpoint: Setpoint) -> tuple[float, float]:
    return setpoint.north_m_s, setpoint.east_m_s  # type: ignore[union-attr]


@pytest.mark.parametrize("form", ["position_velocity_ned", "position_velocity_acceleration_ned"])
def test_a_velocity_beside_a_place_may_not_lead_farther_than_allowed(form: str) -> None:
    at = replace(HERE, here=(900.0, 0.0, 20.0))
    found = limit(example(form, north_m=995.0, east_m=0.0, north_m_s=9.0, down_m_s=0.0), LIMITS, at)
    assert [clamp.code for clamp in found.clamps] == ["limit.distance"]
    assert across_beside(found.setpoint) == (0.0, 0.0)
    back = example(form, north_m=995.0, east_m=0.0, north_m_s=-9.0, east_m_s=0.0, down_m_s=0.0)
    back = back.model_copy(update={"north_m_s2": -1.0, "east_m_s2": 0.0} if "acceleration" in form else {})
    assert limit(back, LIMITS, at).setpoint == back


def test_a_velocity_beside_a_global_place_is_judged_alike() -> None:
    here = {"latitude_deg": HOME[0], "longitude_deg": HOME[1], "altitude_m": 490.0, "down_m_s": 2.0}
    found = limit(example("position_velocity_global", **here), LIMITS, HERE)
    assert [clamp.code for clamp in found.clamps] == ["limit.altitude"]


def test_what_is_beside_a_place_needs_to_know_where_the_vehicle_is() -> None:
    assert refusal_of(example("position_velocity_ned"), replace(HERE, here=None)) == "limit.position_unknown"


@pytest.mark.parametrize(
    ("changes", "codes"),
    [
        ({"north_m_s2": 100.0}, ["limit.tilt"]),
        ({"down_m_s2": 100.0}, ["limit.descend"]),
        ({"down_m_s2": -100.0}, ["limit.climb"]),
        ({"east_m_s2": 100.0, "down_m_s2": 100.0}, ["limit.tilt", "limit.descend"]),
    ],
)
def test_an_acceleration_is_bounded_by_the_tilt_and_by_the_climb(changes: dict[str, float], codes: list[str]) -> None:
    where = replace(HERE, here=(0.0, 0.0, 60.0))
    none = {"north_m_s2": 0.0, "east_m_s2": 0.0, "down_m_s2": 0.0}
    found = limit(example("acceleration_ned", **none | changes), LIMITS, where)
    assert [clamp.code for clamp in found.clamps] == codes
    assert bounded(found.setpoint)
    body = {
        name.replace("north", "forward").replace("east", "right"): value for name, value in (none | changes).items()
    }
    assert [clamp.code for clamp in limit(example("acceleration_body", **body), LIMITS, where).clamps] == codes


def bounded(setpoint: Setpoint) -> bool:
    """Within g * tan(35 degrees), and within what reaches 3 m/s of climb and 2 m/s of descent in 2 s."""
    size = math.hypot(setpoint.north_m_s2, setpoint.east_m_s2)  # type: ignore[union-attr]
    return size <= 6.87 and -1.5 <= setpoint.down_m_s2 <= 1.0  # type: ignore[union-attr]


def test_an_acceleration_is_refused_where_it_leads_beyond_the_limits() -> None:
    edge = replace(HERE, here=(990.0, 0.0, 20.0))
    none = {"north_m_s2": 0.0, "east_m_s2": 0.0, "down_m_s2": 0.0}
    assert refusal_of(example("acceleration_ned", **none | {"north_m_s2": 6.0}), edge) == "limit.distance"
    assert not limit(example("acceleration_ned", **none | {"north_m_s2": -6.0}), LIMITS, edge).clamps
    low = replace(HERE, here=(0.0, 0.0, 3.0))
    assert refusal_of(example("acceleration_ned", **none | {"down_m_s2": 1.0}), low) == "limit.altitude"
    assert refusal_of(example("acceleration_body", forward_m_s2=3.0), low) == "limit.altitude", "its tilt is not known"
    sinking = replace(HERE, velocity=(0.0, 0.0, -2.5))
    assert refusal_of(example("acceleration_ned", **none), sinking) == "limit.descend"


combined = st.builds(
    lambda n, e, d, vn, ve, vd, an, ae, ad: example(
        "position_velocity_acceleration_ned",
        **{"north_m": n, "east_m": e, "down_m": d, "north_m_s": vn, "east_m_s": ve, "down_m_s": vd},
        **{"north_m_s2": an, "east_m_s2": ae, "down_m_s2": ad},
    ),
    *(st.floats(-1200, 1200), st.floats(-1200, 1200), st.floats(-150, 20)),
    *(st.floats(-12, 12), st.floats(-12, 12), st.floats(-4, 4)),
    *(st.floats(-9, 9), st.floats(-9, 9), st.floats(-3, 3)),
)


@PATIENT
@given(setpoint=combined, where=heres)
def test_what_is_beside_a_place_leads_beyond_no_limit_from_there_nor_from_the_vehicle(
    setpoint: Setpoint, where: VehiclePose
) -> None:
    found = limit(setpoint, LIMITS, where).setpoint
    assert bounded(found)
    assert math.hypot(*across_beside(found)) <= 10.0 + 1e-6
    place = (found.north_m, found.east_m, -found.down_m)  # type: ignore[union-attr,operator]
    assert where.here is not None
    for start in (where.here, place):
        for north, east, up in leads_of(found):
            there = math.hypot(start[0] + north, start[1] + east)
            assert there <= max(1000.0, math.hypot(start[0], start[1])) + 1e-6
            assert min(2.0, start[2]) - 1e-6 <= start[2] + up <= max(120.0, start[2]) + 1e-6


def leads_of(setpoint: Setpoint) -> tuple[tuple[float, float, float], ...]:
    """How far the velocity and the acceleration lead in 2 s."""
    north, east = across_beside(setpoint)
    down, up = setpoint.down_m_s, -2.0 * setpoint.down_m_s2  # type: ignore[union-attr]
    return (2.0 * north, 2.0 * east, -2.0 * down), (2.0 * setpoint.north_m_s2, 2.0 * setpoint.east_m_s2, up)  # type: ignore[union-attr]


@PATIENT
@given(setpoint=combined, where=heres)
def test_limits_change_nothing_beside_a_place_silently_and_refuse_the_same(
    setpoint: Setpoint, where: VehiclePose
) -> None:
    first = limit(setpoint, LIMITS, where)
    assert (first.setpoint == setpoint) == (not first.clamps)
    again = limit(first.setpoint, LIMITS, where).setpoint
    for name, value in first.setpoint.model_dump(exclude={"type"}).items():
        assert value is None or getattr(again, name) == pytest.approx(value, abs=1e-6)
    if first.clamps:
        assert refusal_of(setpoint, where, when_exceeded="refuse") == first.clamps[0].code


NEW, OLD = FirmwareVersion(1, 17, 0), FirmwareVersion(1, 14, 3)


def on_board(items: Sequence[MissionItem], firmware: FirmwareVersion | None = NEW) -> FenceArea | None:
    known = behaviour_of(VehicleType.MULTICOPTER, firmware)
    return onboard_fence(items, LocalProjection(HOME[0], HOME[1]), needs_all_inclusions=known.needs_all_inclusions)


def fenced(kind: str = "INCLUSION", here: tuple[float, float, float] = (5.0, 5.0, 20.0)) -> VehiclePose:
    return replace(HERE, here=here, fence=on_board(square(kind=kind)))


def test_a_place_beyond_the_fence_on_board_is_refused_and_never_moved() -> None:
    assert limit(example("position_ned", north_m=40.0), LIMITS, fenced())
    assert refusal_of(example("position_ned", north_m=60.0), fenced()) == "limit.fence"
    across_it = example("position_ned", north_m=0.0, east_m=80.0)
    assert refusal_of(across_it, fenced("EXCLUSION", here=(0.0, -80.0, 20.0))) == "limit.fence"


def test_a_fence_stays_where_it_is_when_home_moves() -> None:
    """Home was set anew 100 m north of the fence's middle. The vehicle is 60 m south of home."""
    moved = replace(fenced(here=(-60.0, 0.0, 20.0)), home_ned=(100.0, 0.0, 0.0), fence_home=(100.0, 0.0))
    inside, outside = (example("position_ned", north_m=north, east_m=0.0) for north in (-40.0, 60.0))
    assert limit(inside, LIMITS, moved).setpoint == inside
    assert refusal_of(outside, moved) == "limit.fence"
    back, out = (example("velocity_ned", north_m_s=north, east_m_s=0.0) for north in (-6.0, 6.0))
    assert limit(back, LIMITS, moved).setpoint == back
    assert [clamp.code for clamp in limit(out, LIMITS, moved).clamps] == ["limit.fence"]
    beside = example("position_velocity_ned", north_m=40.0, east_m=0.0, north_m_s=6.0, east_m_s=0.0)
    assert [clamp.code for clamp in limit(beside, LIMITS, moved).clamps] == ["limit.fence"]


def test_a_velocity_towards_the_fence_is_stopped() -> None:
    found = limit(example("velocity_ned", north_m_s=5.0, east_m_s=0.0), LIMITS, fenced(here=(45.0, 0.0, 20.0)))
    assert [clamp.code for clamp in found.clamps] == ["limit.fence"]
    assert across(found.setpoint) == (0.0, 0.0)


@PATIENT
@given(
    place=st.tuples(st.floats(-49, 49), st.floats(-49, 49), st.floats(3, 119)),
    velocity=st.tuples(st.floats(-12, 12), st.floats(-12, 12), st.floats(-4, 4)),
    start=st.tuples(st.floats(-49, 49), st.floats(-49, 49), st.floats(3, 119)),
    gain_per_s=st.floats(0.2, 2.0),
)
def test_a_vehicle_that_adds_the_velocity_to_its_way_to_the_place_never_leaves(
    place: tuple[float, float, float],
    velocity: tuple[float, float, float],
    start: tuple[float, float, float],
    gain_per_s: float,
) -> None:
    """As PX4 does: MPC_XY_P and MPC_Z_P times the way that is left, plus the velocity."""
    place_ned = {"north_m": place[0], "east_m": place[1], "down_m": -place[2]}
    beside = dict(zip(("north_m_s", "east_m_s", "down_m_s"), velocity, strict=True))
    setpoint, area, here = example("position_velocity_ned", **place_ned, **beside), on_board(square()), start
    for _ in range(40):
        found = limit(setpoint, LIMITS, replace(HERE, here=here, fence=area)).setpoint
        added = (*across_beside(found), -found.down_m_s)  # type: ignore[union-attr]
        moved = [h + 0.2 * (gain_per_s * (p - h) + v) for h, p, v in zip(here, place, added, strict=True)]
        here = (moved[0], moved[1], moved[2])
        assert max(abs(here[0]), abs(here[1])) <= 50.0
        assert 2.0 <= here[2] <= 120.0


def test_a_velocity_beside_a_place_may_not_lead_out_of_the_fence() -> None:
    south = example("position_velocity_ned", north_m=-45.0, east_m=0.0, north_m_s=-10.0, east_m_s=0.0)
    found = limit(south, LIMITS, fenced(here=(0.0, 0.0, 20.0)))
    assert [clamp.code for clamp in found.clamps] == ["limit.fence"]
    assert across_beside(found.setpoint) == (0.0, 0.0)
    still = south.model_copy(update={"north_m_s": 0.0})
    assert limit(still, LIMITS, fenced(here=(0.0, 0.0, 20.0))).setpoint == still


def test_outside_the_fence_the_way_back_in_is_open_and_no_other() -> None:
    where = fenced(here=(51.0, 0.0, 20.0))
    back, out = (example("velocity_ned", north_m_s=north, east_m_s=0.0) for north in (-3.0, 3.0))
    assert limit(back, LIMITS, where).setpoint == back
    assert [clamp.code for clamp in limit(out, LIMITS, where).clamps] == ["limit.fence"]
    home = example("position_ned", north_m=0.0, east_m=0.0)
    assert limit(home, LIMITS, where).setpoint == home
    assert refusal_of(example("position_ned", north_m=50.5, east_m=0.0), where) == "limit.fence", "it ends outside"
    assert refusal_of(home, fenced("EXCLUSION", here=(-49.0, 0.0, 20.0))) == "limit.fence", "into the exclusion"


def test_outside_the_fence_only_the_place_of_a_combined_setpoint_counts() -> None:
    beside = example("position_velocity_ned", north_m=0.0, east_m=0.0, north_m_s=-3.0, east_m_s=0.0)
    found = limit(beside, LIMITS, fenced(here=(51.0, 0.0, 20.0)))
    assert [clamp.code for clamp in found.clamps] == ["limit.fence"]
    assert across_beside(found.setpoint) == (0.0, 0.0)


def test_outside_the_fence_an_attitude_is_taken_while_the_vehicle_comes_back() -> None:
    where = fenced(here=(55.0, 0.0, 20.0))
    assert not limit(example("attitude"), LIMITS, replace(where, velocity=(-1.0, 0.0, 0.0))).clamps
    assert refusal_of(example("attitude"), replace(where, velocity=(1.0, 0.0, 0.0))) == "limit.fence"


def test_what_lies_between_the_vehicle_and_where_it_is_led_counts_too() -> None:
    """Past a corner of the exclusion: neither way alone touches it, but the vehicle turns off on the way."""
    where = fenced("EXCLUSION", here=(-65.0, -45.0, 20.0))
    for speed, codes in ((2.0, []), (3.0, ["limit.fence"])):
        turning = example("position_velocity_ned", north_m=-45.0, east_m=-65.0, north_m_s=speed, east_m_s=speed)
        assert [clamp.code for clamp in limit(turning, LIMITS, where).clamps] == codes


def test_a_vehicle_without_a_fence_has_none() -> None:
    assert on_board(()) is None


@pytest.mark.parametrize(("firmware", "refused"), [(OLD, False), (NEW, True), (None, True)])
def test_newer_firmware_wants_a_place_in_all_inclusions_around_home(
    firmware: FirmwareVersion | None, refused: bool
) -> None:
    circle = replace(square()[0], seq=4, command=MavCmd.NAV_FENCE_CIRCLE_INCLUSION, param1=30.0)
    home = replace(circle, x=round(HOME[0] * 1e7), y=round(HOME[1] * 1e7))
    around_home = on_board((*square(), home), firmware)
    setpoint, there = example("position_ned", north_m=40.0), replace(fenced(), fence=around_home)
    if refused:
        assert refusal_of(setpoint, there) == "limit.fence"
    else:
        assert limit(setpoint, LIMITS, there).clamps == ()
