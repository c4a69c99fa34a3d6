"""Change the speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Final, Literal

from app.domain.items.base import CommandForm, Draft, Forms, Item, Leg, Param, command_draft
from app.domain.items.fields import SpeedMS
from app.domain.mission import MavCmd
from app.domain.vehicle.state import VehicleType

_AIRSPEED, _GROUND_SPEED = 0.0, 1.0
_THROTTLE_UNCHANGED: Final = -1.0


def speed_drafts(
    speed_m_s: float | None, vehicle_type: VehicleType, speed_type: str | None = None
) -> tuple[Draft, ...]:
    """DO_CHANGE_SPEED, or no item if no speed is requested."""
    if speed_m_s is None:
        return ()
    airspeed = speed_type == "airspeed" or (speed_type is None and vehicle_type is VehicleType.FIXED_WING)
    kind = _AIRSPEED if airspeed else _GROUND_SPEED
    return (command_draft(MavCmd.DO_CHANGE_SPEED, kind, speed_m_s, _THROTTLE_UNCHANGED),)


class ChangeSpeed(Item):
    """Fly at this speed from now on. A null `speed_type` means airspeed for fixed wings, else ground speed."""

    forms: ClassVar[Forms] = {
        MavCmd.DO_CHANGE_SPEED: CommandForm(
            "change_speed",
            {
                "speed_type": Param(1, words={_AIRSPEED: "airspeed", _GROUND_SPEED: "groundspeed"}),
                "speed_m_s": Param(2),
            },
            neutral={3: (_THROTTLE_UNCHANGED,)},
        )
    }
    stays: ClassVar[bool] = True
    is_preparation: ClassVar[bool] = True
    title: ClassVar[str] = "Change speed"
    stem: ClassVar[str] = "speed"
    fresh: ClassVar[Mapping[str, object]] = {"speed_m_s": 5}

    type: Literal["change_speed"]
    speed_m_s: SpeedMS
    speed_type: Literal["airspeed", "groundspeed"] | None = None

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        return speed_drafts(self.speed_m_s, leg.vehicle_type, self.speed_type)

    def asked_speed_m_s(self) -> float | None:
        return self.speed_m_s
