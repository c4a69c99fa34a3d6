"""A second ground station that meddles with one vehicle, over a link of its own."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.simulator.dialect import Message, mavlink
from app.simulator.geo import LocalFrame
from app.simulator.radio import Sender
from app.simulator.wire import VEHICLE_COMPONENT, Cmd, MissionType

IDENTITY = (246, 191)
DEEDS = ("upload", "clear", "open_transfer")


class SecondGround:
    """Answers the mission protocol for its own short mission."""

    def __init__(self, system_id: int, frame: LocalFrame, receive: Callable[[Sender, Message], None]) -> None:
        self.gcs_heard_s: float | None = None
        self._system_id = system_id
        self._frame = frame
        self._receive = receive
        self._answers = False

    def meddle(self, deed: str) -> None:
        """One of DEEDS: replace the mission, empty it, or begin an upload and fall silent."""
        target = (self._system_id, VEHICLE_COMPONENT)
        self._answers = deed == "upload"
        if deed == "clear":
            self._say(mavlink.MAVLink_mission_clear_all_message(*target, MissionType.MISSION))
        else:
            self._say(mavlink.MAVLink_mission_count_message(*target, 2, MissionType.MISSION, 0))

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        """The vehicle speaks to this station; only requests for items are answered."""
        mine = getattr(message, "target_system", None) == IDENTITY[0]
        if self._answers and mine and message.get_type() in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
            self._say(self._item(message.seq))

    def _item(self, seq: int) -> Message:
        latitude, longitude = self._frame.to_global(20.0 * seq, -20.0)
        command = Cmd.NAV_TAKEOFF if seq == 0 else Cmd.NAV_WAYPOINT
        return mavlink.MAVLink_mission_item_int_message(
            self._system_id, VEHICLE_COMPONENT, seq, 6, command, int(seq == 0), 1,
            0.0, 0.0, 0.0, math.nan, round(latitude * 1e7), round(longitude * 1e7), 25.0, MissionType.MISSION,
        )  # fmt: skip

    def _say(self, message: Message) -> None:
        packed = message.pack(mavlink.MAVLink(None, srcSystem=IDENTITY[0], srcComponent=IDENTITY[1]))
        self._receive(self, mavlink.MAVLink(None).decode(bytearray(packed)))
