"""Change between hover and fixed-wing flight."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from app.domain.items.base import CommandForm, Draft, Forms, Item, Leg, Param, Predictor, T, command_draft
from app.domain.mission import MavCmd
from app.domain.vehicle.state import FlightRegime, VehicleType

_STATE = {"multicopter": 3.0, "fixed_wing": 4.0}
"""MAV_VTOL_STATE."""


class Transition(Item):
    """Transition of a VTOL between hover and fixed-wing flight."""

    forms: ClassVar[Forms] = {
        MavCmd.DO_VTOL_TRANSITION: CommandForm(
            "transition", {"to": Param(1, words={number: word for word, number in _STATE.items()})}
        )
    }
    title: ClassVar[str] = "Transition"
    fresh: ClassVar[Mapping[str, object]] = {"to": "multicopter"}

    type: Literal["transition"]
    to: Literal["fixed_wing", "multicopter"]

    def carried_after(self, vehicle_type: VehicleType, before: FlightRegime) -> FlightRegime:
        if vehicle_type is not VehicleType.VTOL or before is FlightRegime.GROUND:
            return before
        return FlightRegime.FIXED_WING if self.to == "fixed_wing" else FlightRegime.ROTARY_WING

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        return (command_draft(MavCmd.DO_VTOL_TRANSITION, _STATE[self.to], 0.0),)

    def effort(self, predictor: Predictor[T]) -> T:
        return predictor.turn_to(self.to)

    def transition_to(self) -> Literal["multicopter", "fixed_wing"] | None:
        return self.to
