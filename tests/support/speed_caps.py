"""Control from the ground is simulated up to 4x, as its timers are wall clock. Above OFFBOARD is refused."""

from __future__ import annotations

from app.simulator.dialect import mavlink
from tests.support.simulated_vehicle import GroundStation

SETPOINT = mavlink.MAVLink_set_position_target_local_ned_message(
    0, 1, 1, 1, 3576, 20.0, 0.0, -10.0, 0, 0, 0, 0, 0, 0, 0, 0
)


def stream(gcs: GroundStation, seconds: float) -> None:
    for _ in range(round(seconds * 10)):
        gcs.send(SETPOINT)
        gcs.fly(0.1)
