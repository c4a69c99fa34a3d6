"""One vehicle as native mavsdk sees it, typed: messages, mission transfers, one blocking parameter read.

All callbacks run on mavsdk's threads: what is given to them must only hand over, never block or destroy.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from contextlib import suppress
from typing import Any, Final

from mavsdk.plugins.mavlink_direct import (  # type: ignore[import-untyped]
    MavlinkDirect,
    MavlinkDirectError,
    MavlinkMessage,
)
from mavsdk.plugins.mission_raw import MissionItem as RawItem  # type: ignore[import-untyped]
from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError
from mavsdk.plugins.param import Param, ParamError, ParamResult  # type: ignore[import-untyped]

from app.domain.errors import LinkError
from app.domain.mission import MissionType
from app.vehicles.encoders import Outgoing
from app.vehicles.mission_wire import WireItem

OUR_SYSTEM_ID: Final = 245
OUR_COMPONENT_ID: Final = 190
AUTOPILOT_COMPONENT_ID: Final = 1
_KEPT_CALLBACKS: Final = 8

RawSink = Callable[[str, str], None]
"""Gets a message's name and its fields as JSON, on mavsdk's thread."""


class NativeSystem:
    """One system id on one connection. Nothing here waits, but `read_int_parameter`."""

    def __init__(self, system: Any) -> None:
        self._system = system
        self._direct: Any = MavlinkDirect(system)
        self._mission: Any = MissionRaw(system)
        self._param: Any = Param(system)
        self.system_id = int(system.get_system_id())

    def listen(self, names: Sequence[str], of_any: Container[str], sink: RawSink) -> None:
        """Give each message with one of these names from the autopilot to `sink`; those `of_any` component too."""

        def hand_over(message: Any, _data: object) -> None:
            if message.component_id == AUTOPILOT_COMPONENT_ID or message.message_name in of_any:
                sink(message.message_name, message.fields_json)

        for name in names:
            self._direct.subscribe_message(name, hand_over)

    def send(self, message: Outgoing) -> None:
        """Send to the autopilot. Raises LinkError if mavsdk has no connection for it."""
        native = MavlinkMessage(
            message_name=message.name,
            system_id=OUR_SYSTEM_ID,
            component_id=OUR_COMPONENT_ID,
            target_system_id=self.system_id,
            target_component_id=AUTOPILOT_COMPONENT_ID,
            fields_json=message.fields_json(self.system_id, AUTOPILOT_COMPONENT_ID),
        )
        try:
            self._direct.send_message(native)
        except MavlinkDirectError as error:
            raise LinkError(f"cannot send {message.name}: {error.result.name}", result=error.result.name) from error

    def upload(self, mission_type: MissionType, items: Sequence[WireItem], done: Callable[[str], None]) -> None:
        """Start an upload. `done` gets the result's name. A transfer that destroy() cuts off never calls it."""
        self._forget_callbacks()
        start = {
            MissionType.MISSION: self._mission.upload_mission_async,
            MissionType.FENCE: self._mission.upload_geofence_async,
            MissionType.RALLY: self._mission.upload_rally_points_async,
        }[mission_type]
        start([RawItem(**item._asdict()) for item in items], lambda result, _data: done(result.name))

    def download(self, mission_type: MissionType, done: Callable[[str, list[WireItem]], None]) -> None:
        """Start a download. `done` gets the result's name and the items."""
        self._forget_callbacks()
        start = {
            MissionType.MISSION: self._mission.download_mission_async,
            MissionType.FENCE: self._mission.download_geofence_async,
            MissionType.RALLY: self._mission.download_rallypoints_async,
        }[mission_type]
        start(lambda result, items, _data: done(result.name, [_wire(item) for item in items]))

    def cancel_transfers(self) -> None:
        """Cancel what is under way; the vehicle is told (MISSION_ACK 15) and `done` gets TRANSFER_CANCELLED."""
        for cancel in (self._mission.cancel_mission_upload, self._mission.cancel_mission_download):
            with suppress(MissionRawError):  # ERROR: there is none
                cancel()

    def read_int_parameter(self, name: str) -> int | None:
        """Read an int parameter; None if it did not come. BLOCKS up to 3 s: only for a worker thread."""
        try:
            return int(self._param.get_param_int(name))
        except ParamError as error:
            if error.result in {ParamResult.TIMEOUT, ParamResult.DOES_NOT_EXIST, ParamResult.WRONG_TYPE}:
                return None
            raise LinkError(f"cannot read {name}: {error.result.name}", result=error.result.name) from error

    def _forget_callbacks(self) -> None:
        # mavsdk keeps each callback until its plugin ends; the last ones may still be returning
        del self._mission._callbacks[:-_KEPT_CALLBACKS]


def _wire(item: Any) -> WireItem:
    return WireItem(*(getattr(item, name) for name in WireItem._fields))
