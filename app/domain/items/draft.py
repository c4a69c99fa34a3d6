"""A mission item before it has a number."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.geo import Place
from app.domain.items.fields import Altitude
from app.domain.mission import NAN, MavCmd, MavFrame


@dataclass(frozen=True, slots=True)
class Draft:
    """One MISSION_ITEM_INT without seq. `jump_to` is the id of a jump's target; it becomes param1."""

    command: MavCmd
    frame: MavFrame
    params: tuple[float, float, float, float]
    x: int = 0
    y: int = 0
    z: float = 0.0
    jump_to: str | None = None


def command_draft(command: MavCmd, *params: float, jump_to: str | None = None) -> Draft:
    """An item without a position. Frame MISSION: PX4 refuses DO_ commands in a global frame. What is not given is NaN,

    because 0 can mean something (0 in DO_GRIPPER is RELEASE) and PX4 keeps these parameters as they are.
    """
    first, second, third, fourth = (*params, NAN, NAN, NAN, NAN)[:4]
    return Draft(command, MavFrame.MISSION, (first, second, third, fourth), jump_to=jump_to)


def position_draft(
    command: MavCmd, altitude: Altitude, place: Place, params: tuple[float, float, float, float]
) -> Draft:
    """An item with a position. The _INT frames, because those are what PX4 reads back for integer items.

    A parameter that the command does not use is 0 here: PX4 does not keep it and reads back 0.
    """
    absolute = altitude.absolute_altitude_m
    return Draft(
        command,
        MavFrame.GLOBAL_RELATIVE_ALT_INT if absolute is None else MavFrame.GLOBAL_INT,
        params,
        x=degrees_e7(place.latitude_deg),
        y=degrees_e7(place.longitude_deg),
        z=altitude.relative_altitude_m or 0.0 if absolute is None else absolute,
    )


def degrees_e7(degrees: float) -> int:
    """The integer of the wire: 1e7 to a degree."""
    return round(degrees * 1e7)


def or_nan(value: float | None) -> float:
    """NaN is "not given"."""
    return NAN if value is None else value
