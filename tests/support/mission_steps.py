"""Steps of the mission protocol, shared by the tests that take it apart."""

from __future__ import annotations

from app.simulator.dialect import mavlink
from tests.support.simulated_vehicle import GROUND, RELEASE, RETURN, GroundStation, takeoff, waypoint

TEN = [takeoff(15), *(waypoint(15 * i, 0, 15) for i in range(1, 6)), RELEASE, *(waypoint(9, 40, 15),) * 2, RETURN]
OTHER = (246, 191)
"""A second ground station."""


def count(gcs: GroundStation, number: int, mission_type: int = 0, source: tuple[int, int] = GROUND) -> None:
    gcs.send(mavlink.MAVLink_mission_count_message(1, 1, number, mission_type, 0), source)


def begin(gcs: GroundStation, upto: int) -> None:
    """Answer the requests before `upto`, so that `upto` is the open one."""
    count(gcs, len(TEN))
    for seq in range(upto):
        gcs.send(gcs.item(seq, TEN[seq]))


def go_on(gcs: GroundStation, first: int) -> None:
    for seq in range(first, len(TEN)):
        gcs.send(gcs.item(seq, TEN[seq]))


def acks(gcs: GroundStation) -> list[tuple[int, int]]:
    """Receiver and result of every MISSION_ACK."""
    return [(ack.target_system, ack.type) for ack in gcs.messages("MISSION_ACK")]


def requests(gcs: GroundStation) -> list[int]:
    return [message.seq for message in gcs.messages("MISSION_REQUEST_INT")]
