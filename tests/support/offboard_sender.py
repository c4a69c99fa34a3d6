"""A ground station that streams offboard setpoints, and the messages it sends."""

from __future__ import annotations

import math

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import GroundStation

POSITION = 3576
"""Type mask."""
LOCAL = 1
Point = tuple[float, float, float]
ZERO: Point = (0.0, 0.0, 0.0)


class Sender:
    """Streams one setpoint while time passes."""

    def __init__(self, airframe: str, **params: float) -> None:
        self.gcs = GroundStation(airframe, params={"COM_OBL_RC_ACT": 5, "MIS_TAKEOFF_ALT": 25.0, **params})
        self.message = local()

    def stream(self, seconds: float, hz: float = 25.0) -> Sender:
        for _ in range(max(1, round(seconds * hz))):
            self.gcs.send(self.message)
            self.gcs.fly(1.0 / hz)
        return self

    def airborne(self, up_m: float = 10.0) -> Sender:
        """In OFFBOARD at this height, from the ground (a plane by its own takeoff)."""
        gcs = self.gcs
        if gcs.vehicle.spec.airframe.is_fixed_wing:
            gcs.command(Cmd.DO_SET_MODE, 1, 4, 2)
            gcs.arm()
            gcs.until(lambda: self.mode is Mode.LOITER and gcs.vehicle.state.body.up_m > 15.0, 60.0)
            self.stream(0.5)
            assert gcs.set_mode(Mode.OFFBOARD) == [Result.ACCEPTED]
            return self
        self.message = local((0.0, 0.0, -up_m))
        self.stream(0.5)
        assert gcs.set_mode(Mode.OFFBOARD) == [Result.ACCEPTED]
        gcs.arm()
        return self.stream(15.0)

    def to(self, message: mavlink.MAVLink_message, seconds: float) -> Sender:
        self.message = message
        return self.stream(seconds)

    @property
    def mode(self) -> Mode:
        return self.gcs.vehicle.state.status.mode

    @property
    def place(self) -> Point:
        body = self.gcs.vehicle.state.body
        return body.north_m, body.east_m, body.up_m


def local(
    position: Point = ZERO, velocity: Point = ZERO, mask: int = POSITION, frame: int = LOCAL
) -> mavlink.MAVLink_message:
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, frame, mask, *position, *velocity, 0, 0, 0, 0, 0
    )


def world(gcs: GroundStation, north_m: float, east_m: float, alt: float, frame: int) -> mavlink.MAVLink_message:
    latitude, longitude = gcs.vehicle.spec.frame.to_global(north_m, east_m)
    place = (round(latitude * 1e7), round(longitude * 1e7), alt)
    return mavlink.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, POSITION, *place, 0, 0, 0, 0, 0, 0, 0, 0
    )


def attitude(thrust: float, pitch_deg: float = 0.0, mask: int = 7, roll_deg: float = 0.0) -> mavlink.MAVLink_message:
    roll, pitch = math.radians(roll_deg) / 2.0, math.radians(pitch_deg) / 2.0
    q = [
        math.cos(roll) * math.cos(pitch),
        math.sin(roll) * math.cos(pitch),
        math.cos(roll) * math.sin(pitch),
        -math.sin(roll) * math.sin(pitch),
    ]
    return mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, q, 0, 0, 0, thrust)
