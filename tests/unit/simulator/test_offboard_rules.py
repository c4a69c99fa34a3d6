"""Offboard setpoints that are refused or held: each rule alone. What is followed is in test_offboard."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import Message, mavlink
from app.simulator.offboard.mode import OffboardMode
from app.simulator.offboard.receiver import OffboardReceiver, OffboardStream, OffboardTarget, Vector
from app.simulator.wire import Mode
from tests.support.simulated_vehicle import GroundStation

NAN = math.nan
POSITION, ACCELERATION = 3576, 3135


def lives(gcs: GroundStation, message: Message) -> bool:
    """Whether this setpoint is a sign of life."""
    gcs.send(message)
    return gcs.set_mode(Mode.LOITER) == [0] and gcs.set_mode(Mode.OFFBOARD) == [0]


@pytest.fixture
def flying() -> GroundStation:
    gcs = GroundStation(params={"MIS_TAKEOFF_ALT": 5.0})
    gcs.set_mode(Mode.TAKEOFF)
    gcs.arm()
    gcs.until(lambda: gcs.vehicle.state.status.mode is Mode.LOITER, 40.0)
    return gcs


def local(system: int = 1, component: int = 1, frame: int = 1, mask: int = POSITION) -> Message:
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, system, component, frame, mask, 0, 0, -5, 0, 0, 0, 0, 0, 0, 0, 0
    )


def world(frame: int) -> Message:
    return mavlink.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, POSITION, 473977420, 85455940, 5, 0, 0, 0, 0, 0, 0, 0, 0
    )


@pytest.mark.parametrize(
    ("message", "sign_of_life"),
    [
        (local(), True),
        (local(component=0), True),
        (local(system=0, component=0), True),
        (local(component=169), False),
        (local(system=2), False),
        (local(frame=8), False),  # a body frame has no positions
        (local(frame=9), False),
        (local(mask=ACCELERATION), True),
        (local(mask=4095), False),
        (world(0), True),
        (world(5), True),
        (world(6), True),
        (world(11), False),
        (world(3), False),
        (mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 128, [1, 0, 0, 0], 0, 0, 0.1, 0.5), True),  # rates
        (mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 7, [1, 0, 0, 0], 0, 0, 0, 0.5), True),
        (mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 7 | 64, [1, 0, 0, 0], 0, 0, 0, 0.5), False),
        (mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 7 | 128, [1, 0, 0, 0], 0, 0, 0, 0.5), False),
    ],
)
def test_what_is_taken_is_a_sign_of_life(flying: GroundStation, message: Message, sign_of_life: bool) -> None:
    assert lives(flying, message) is sign_of_life


def test_a_height_above_terrain_is_dropped_without_a_word(flying: GroundStation) -> None:
    before = flying.texts()
    flying.send(world(11))
    assert flying.texts() == before


def test_a_height_above_home_needs_a_home(flying: GroundStation) -> None:
    flying.vehicle.state.status.home = None
    assert not lives(flying, world(6))


def test_body_velocities_are_turned_by_the_heading(flying: GroundStation) -> None:
    body = flying.vehicle.state.body
    body.yaw_rad = math.pi / 2.0
    forward = local(frame=8, mask=3527)
    forward.vx = 2.0
    flying.send(forward)
    flying.fly(0.1)  # until the stream is seen
    flying.set_mode(Mode.OFFBOARD)
    for _ in range(30):
        flying.send(forward)
        flying.fly(0.1)
    assert body.east_m > 2.0
    assert body.north_m == pytest.approx(0.0, abs=0.5)


def test_acceleration_alone_leans_a_hovering_vehicle_until_the_drag_holds_it(flying: GroundStation) -> None:
    """SIH's drag is 1 m/s2 for each m/s, so 2 m/s2 end in 2 m/s."""
    alone = local(mask=ACCELERATION)
    alone.afx = 2.0
    flying.send(alone)
    flying.fly(0.1)  # until the stream is seen
    flying.set_mode(Mode.OFFBOARD)
    for _ in range(80):
        flying.send(alone)
        flying.fly(0.1)
    body = flying.vehicle.state.body
    assert flying.vehicle.state.status.mode is Mode.OFFBOARD
    assert (body.v_north_m_s, body.v_east_m_s) == pytest.approx((2.0, 0.0), abs=0.1)
    assert body.up_m == pytest.approx(5.0, abs=1.0)


@pytest.mark.parametrize(("velocity", "east"), [((0.0, 0.0, 0.0), True), ((10.0, 0.0, 0.0), False), (None, False)])
def test_a_plane_flies_the_line_of_a_velocity_keeps_its_course_without_any_and_north_without_the_part(
    velocity: Vector | None, east: bool
) -> None:
    """On its way to the east. Scenarios 20 and 20b: type masks 12288, 3520, 3576."""
    vehicle = GroundStation("plane", ready=False).vehicle
    vehicle.state.body.v_east_m_s, vehicle.state.body.up_m = 12.0, 40.0
    stream = OffboardStream(vehicle.params, vehicle.clock)
    mode = OffboardMode(vehicle.context, stream)
    mode.activate()
    stream.receive(OffboardTarget(position=(0.0, 0.0, 50.0), velocity=velocity))
    mode.step()
    towards = vehicle.context.setpoint
    assert (towards.east_m > 500.0, towards.north_m > 500.0, towards.up_m) == (east, not east, 50.0)


def test_a_rover_does_not_move_for_an_attitude() -> None:
    """Scenario 21."""
    vehicle = GroundStation("rover", ready=False).vehicle
    stream = OffboardStream(vehicle.params, vehicle.clock)
    mode = OffboardMode(vehicle.context, stream)
    mode.activate()
    stream.receive(OffboardTarget(thrust=0.7, tilt_rad=(0.2, -0.2)))
    mode.step()
    assert vehicle.context.setpoint.point == (0.0, 0.0)


def test_an_airship_flies_on_with_a_velocity_at_its_height() -> None:
    vehicle = GroundStation("airship", ready=False).vehicle
    vehicle.state.body.up_m = 30.0
    stream = OffboardStream(vehicle.params, vehicle.clock)
    mode = OffboardMode(vehicle.context, stream)
    mode.activate()
    stream.receive(OffboardTarget(velocity=(0.0, 2.0, 0.0)))
    mode.step()
    towards = vehicle.context.setpoint
    assert (towards.north_m, towards.up_m, towards.cruise_speed_m_s) == (0.0, 30.0, 2.0)
    assert towards.east_m > 100.0


@pytest.mark.parametrize(
    ("position", "held"),
    [((NAN, 5.0, 12.0), (20.0, 5.0, 12.0)), ((3.0, NAN, 12.0), (3.0, -7.0, 12.0)), ((3.0, 5.0, NAN), (3.0, 5.0, 9.0))],
)
def test_a_coordinate_that_is_not_a_number_stays_where_the_vehicle_was(position: Vector, held: Vector) -> None:
    vehicle = GroundStation(ready=False).vehicle
    body = vehicle.state.body
    body.north_m, body.east_m, body.up_m = 20.0, -7.0, 9.0
    stream = OffboardStream(vehicle.params, vehicle.clock)
    mode = OffboardMode(vehicle.context, stream)
    mode.activate()
    stream.receive(OffboardTarget(position=position))
    mode.step()
    towards = vehicle.context.setpoint
    assert (*towards.point, towards.up_m) == held


X, Y, Z, VX, VY, VZ = (1 << bit for bit in range(6))
REST = 0xFFF & ~(X | Y | Z | VX | VY | VZ)
"""Acceleration, force, yaw and yaw rate are ignored."""


def received(message: Message) -> OffboardTarget:
    """What a vehicle at the origin makes of a setpoint at 30, 40, 50 with 1, 2, 3 m/s."""
    gcs = GroundStation(ready=False)
    if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
        message.x, message.y, message.z = 30.0, 40.0, -50.0
    else:
        latitude, longitude = gcs.vehicle.spec.frame.to_global(30.0, 40.0)
        message.lat_int, message.lon_int = round(latitude * 1e7), round(longitude * 1e7)
        message.alt = 50.0 + gcs.vehicle.spec.frame.altitude_m
    message.vx, message.vy, message.vz = 1.0, 2.0, -3.0
    stream = OffboardStream(gcs.vehicle.params, gcs.vehicle.clock)
    OffboardReceiver(gcs.vehicle.context, stream).handlers()[message.get_type()](gcs.wire, message)
    assert stream.newest is not None
    return stream.newest


def parts(vector: Vector | None) -> list[float | None] | None:
    """Rounded to decimetres; None for NaN."""
    return None if vector is None else [None if math.isnan(part) else round(part, 1) for part in vector]


@pytest.mark.parametrize("name", ["local", "global"])
@pytest.mark.parametrize(
    ("ignored", "position", "velocity"),
    [
        (X | VX | VY | VZ, [None, 40, 50], None),
        (X | Y | VY | VZ, [None, None, 50], [1, None, None]),
        (Y | VX | VZ, [30, None, 50], [None, 2, None]),
        (X | Y | Z | VZ, None, [1, 2, None]),
        (Z | VX, [30, 40, None], [None, 2, 3]),
    ],
)
def test_an_ignored_axis_is_not_given(
    name: str, ignored: int, position: list[float | None] | None, velocity: list[float | None] | None
) -> None:
    message = local() if name == "local" else world(5)
    message.type_mask = REST | ignored
    target = received(message)
    assert (parts(target.position), parts(target.velocity)) == (position, velocity)


@pytest.mark.parametrize("ignored", [VX, VY, VZ])
def test_in_the_body_frame_one_ignored_axis_ignores_the_velocity(ignored: int, flying: GroundStation) -> None:
    assert not lives(flying, local(frame=8, mask=REST | X | Y | Z | ignored))


def test_a_height_with_a_velocity_keeps_the_height_and_flies_the_velocity(flying: GroundStation) -> None:
    """Not to the x and y of zero that are ignored."""
    body = flying.vehicle.state.body
    message = local(mask=REST | X | Y | VY | VZ)
    message.x = message.y = 0.0
    message.z, message.vx = -8.0, 2.0
    flying.send(message)
    flying.fly(0.1)  # until the stream is seen
    flying.set_mode(Mode.OFFBOARD)
    for _ in range(100):
        flying.send(message)
        flying.fly(0.1)
    assert body.v_north_m_s == pytest.approx(1.8, abs=0.1), "the integrator takes the drag over slowly"
    assert (body.east_m, body.up_m) == pytest.approx((0.0, 8.0), abs=0.5)
    assert body.north_m > 12.0


def test_one_axis_by_its_position_and_the_other_by_its_velocity(flying: GroundStation) -> None:
    body = flying.vehicle.state.body
    message = local(mask=REST | Y | Z | VX | VZ)
    message.x, message.vy = 5.0, 2.0
    before_m = body.up_m
    flying.send(message)
    flying.fly(0.1)  # until the stream is seen
    flying.set_mode(Mode.OFFBOARD)
    for _ in range(200):
        flying.send(message)
        flying.fly(0.1)
    assert body.north_m == pytest.approx(5.0, abs=1.0)
    assert body.v_east_m_s == pytest.approx(2.0, abs=0.3)
    assert body.up_m == pytest.approx(before_m, abs=0.5), "with neither it stays"
