"""Mission items between the domain and the wire, and whether a vehicle holds what was sent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from app.domain.errors import LinkError
from app.domain.mission import MavCmd, MavFrame, MissionItem, MissionType

_RELATIVE = {MavFrame.GLOBAL_RELATIVE_ALT, MavFrame.GLOBAL_RELATIVE_ALT_INT}
_GLOBAL = {MavFrame.GLOBAL, MavFrame.GLOBAL_INT}


class WireItem(NamedTuple):
    """A MISSION_ITEM_INT as numbers, whatever they are."""

    seq: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float
    mission_type: int


def to_wire(items: Sequence[MissionItem]) -> list[WireItem]:
    """As sent: exactly item 0 is current, so that the vehicle starts there."""
    return [
        WireItem(
            seq=item.seq,
            frame=int(item.frame),
            command=int(item.command),
            current=int(item.seq == 0),
            autocontinue=int(item.autocontinue),
            param1=item.param1,
            param2=item.param2,
            param3=item.param3,
            param4=item.param4,
            x=item.x,
            y=item.y,
            z=item.z,
            mission_type=int(item.mission_type),
        )
        for item in items
    ]


def from_wire(items: Sequence[WireItem]) -> tuple[MissionItem, ...]:
    """As read back. Raises LinkError for an item that Waydrop has no word for (another ground station's mission)."""
    return tuple(_item_of(item) for item in items)


def _item_of(wire: WireItem) -> MissionItem:
    try:
        frame, command = MavFrame(wire.frame), MavCmd(wire.command)
    except ValueError as error:
        raise LinkError(
            f"item {wire.seq} on the vehicle has command {wire.command} in frame {wire.frame}, unknown to Waydrop",
            item_seq=wire.seq,
        ) from error
    return MissionItem(
        seq=wire.seq,
        frame=frame,
        command=command,
        param1=wire.param1,
        param2=wire.param2,
        param3=wire.param3,
        param4=wire.param4,
        x=wire.x,
        y=wire.y,
        z=wire.z,
        current=bool(wire.current),
        autocontinue=bool(wire.autocontinue),
        mission_type=MissionType(wire.mission_type),
    )


def first_difference(sent: Sequence[MissionItem], held: Sequence[MissionItem]) -> int | None:
    """The seq of the first item that differs (or is missing or too many); None if the lists are equal.

    PX4 gives fence points back in frame 5 without autocontinue: both mean nothing there, so they are not compared.
    """
    for one, other in zip(sent, held, strict=False):
        if not _plain(one).same_as(_plain(other)):
            return one.seq
    return None if len(sent) == len(held) else min(len(sent), len(held))


def _plain(item: MissionItem) -> MissionItem:
    if item.mission_type is not MissionType.MISSION:
        return replace(item, frame=MavFrame.GLOBAL_INT, autocontinue=True)
    if item.frame in _RELATIVE:
        return replace(item, frame=MavFrame.GLOBAL_RELATIVE_ALT_INT)
    if item.frame in _GLOBAL:
        return replace(item, frame=MavFrame.GLOBAL_INT)
    return item
