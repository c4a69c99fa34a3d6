"""Stay at a position in the air: a fixed wing circles, a rotary wing hovers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.errors import PlanRejectedError
from app.domain.items.base import YAW, CommandForm, Draft, Forms, Leg, Param, Predictor, T, or_nan, position_draft
from app.domain.items.fields import SMALLEST_RADIUS_M, Seconds, SignedRadiusM
from app.domain.items.waypoint import AirStop
from app.domain.mission import MavCmd
from app.domain.vehicle.state import VehicleType

_COMMANDS: Final[Mapping[str, MavCmd]] = {
    "time": MavCmd.NAV_LOITER_TIME,
    "turns": MavCmd.NAV_LOITER_TURNS,
    "unlimited": MavCmd.NAV_LOITER_UNLIM,
    "to_altitude": MavCmd.NAV_LOITER_TO_ALT,
}
_RADIUS: Final = Param(3, zero_is_none=True)


def _form(kind: str, params: Mapping[str, Param]) -> CommandForm:
    return CommandForm("loiter", params, positioned=True, fixed={"kind": kind})


class Loiter(AirStop):
    """Circle (fixed wing) or hover (rotary wing) at a position. The sign of `radius_m` is the direction, + is
    clockwise.

    Kind `time` requires duration_s, `turns` requires turns. `to_altitude` ends at the item's altitude, `unlimited`
    never.
    """

    forms: ClassVar[Forms] = {
        MavCmd.NAV_LOITER_UNLIM: _form("unlimited", {"radius_m": _RADIUS, "yaw_deg": YAW}),
        MavCmd.NAV_LOITER_TURNS: _form("turns", {"turns": Param(1), "radius_m": _RADIUS}),
        MavCmd.NAV_LOITER_TIME: _form("time", {"duration_s": Param(1), "radius_m": _RADIUS}),
        MavCmd.NAV_LOITER_TO_ALT: _form("to_altitude", {"radius_m": Param(2, zero_is_none=True)}),
    }
    title: ClassVar[str] = "Loiter"
    fresh: ClassVar[Mapping[str, object]] = {"kind": "time", "duration_s": 30}

    type: Literal["loiter"]
    kind: Literal["time", "turns", "unlimited", "to_altitude"]
    radius_m: SignedRadiusM | None = None
    duration_s: Seconds | None = None
    turns: Annotated[float, Field(gt=0, le=1000)] | None = None

    @model_validator(mode="after")
    def _needs_of_kind(self) -> Self:
        given = {"duration_s": self.duration_s is not None, "turns": self.turns is not None}
        needed = {"duration_s": self.kind == "time", "turns": self.kind == "turns"}
        for name, is_given in given.items():
            if is_given != needed[name]:
                verb = "needs" if needed[name] else "takes no"
                raise PydanticCustomError(
                    "loiter_kind", "a loiter of this kind {verb} {name}", {"verb": verb, "name": name}
                )
        if self.radius_m is not None and abs(self.radius_m) < SMALLEST_RADIUS_M:
            raise PydanticCustomError("loiter_radius", "radius_m must not be 0; use null for the vehicle's own radius")
        return self

    def command(self, vehicle_type: VehicleType) -> MavCmd:
        return _COMMANDS[self.kind]

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        radius = or_nan(self.radius_m)
        match self.kind:
            case "time":
                params = (self.duration_s or 0.0, 0.0, radius, 0.0)
            case "unlimited":
                params = (0.0, 0.0, radius, or_nan(self.yaw_deg))
            case "to_altitude":
                params = (0.0, radius, 0.0, 0.0)
            case "turns":
                raise PlanRejectedError("PX4 does not support NAV_LOITER_TURNS", hint="use kind time with duration_s")
        return (position_draft(self.command(leg.vehicle_type), self, leg.end, params),)

    def effort(self, predictor: Predictor[T]) -> T:
        return predictor.circle(self.radius_m, self.duration_s or 0.0, self.turns)

    def never_ends(self) -> bool:
        return self.kind == "unlimited"

    def circles(self) -> bool:
        return True

    def circle_radius_m(self) -> float | None:
        return self.radius_m
