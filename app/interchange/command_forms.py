"""Which MAV_CMD is which plan item, and which parameter is which field. Read both ways: in and out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from app.domain.mission import MavCmd


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter that is a field. `words` are the values of an enum; `zero_is_none`: 0 means "not given" as null does.

    `whole`: the field is an integer.
    """

    number: int
    words: Mapping[float, str] | None = None
    zero_is_none: bool = False
    whole: bool = False

    def written(self, value: Any) -> float | None:
        """The parameter for a field's value."""
        if value is None:
            return 0.0 if self.zero_is_none else None
        if self.words is not None:
            return next(number for number, word in self.words.items() if word == value)
        return float(value)


@dataclass(frozen=True, slots=True)
class CommandForm:
    """A command. `positioned`: param5 to param7 are a place. `fixed` are fields that the command itself says.

    `neutral` are values of other parameters that mean nothing, besides 0 and null; the first is what is written.
    """

    type: str
    params: Mapping[str, Param]
    positioned: bool = False
    fixed: Mapping[str, Any] = field(default_factory=dict)
    neutral: Mapping[int, tuple[float, ...]] = field(default_factory=dict)

    def used(self) -> frozenset[int]:
        """The numbers of the parameters that are fields."""
        place = {5, 6, 7} if self.positioned else set()
        return frozenset({param.number for param in self.params.values()} | place)


_WINCH_ACTIONS: Final = (
    *("relax", "length", "rate", "lock", "deliver", "hold"),
    *("retract", "load_line", "abandon_line", "load_payload"),
)
_YAW: Final = Param(4)
FORMS: Final[Mapping[int, CommandForm]] = {
    MavCmd.NAV_TAKEOFF: CommandForm("takeoff", {"pitch_deg": Param(1), "yaw_deg": _YAW}, positioned=True),
    MavCmd.NAV_VTOL_TAKEOFF: CommandForm("takeoff", {"yaw_deg": _YAW}, positioned=True),
    MavCmd.NAV_WAYPOINT: CommandForm(
        "waypoint",
        {"hold_s": Param(1, zero_is_none=True), "acceptance_radius_m": Param(2, zero_is_none=True), "yaw_deg": _YAW},
        positioned=True,
    ),
    MavCmd.NAV_LOITER_UNLIM: CommandForm(
        "loiter",
        {"radius_m": Param(3, zero_is_none=True), "yaw_deg": _YAW},
        positioned=True,
        fixed={"kind": "unlimited"},
    ),
    MavCmd.NAV_LOITER_TURNS: CommandForm(
        "loiter",
        {"turns": Param(1), "radius_m": Param(3, zero_is_none=True)},
        positioned=True,
        fixed={"kind": "turns"},
    ),
    MavCmd.NAV_LOITER_TIME: CommandForm(
        "loiter",
        {"duration_s": Param(1), "radius_m": Param(3, zero_is_none=True)},
        positioned=True,
        fixed={"kind": "time"},
    ),
    MavCmd.NAV_LOITER_TO_ALT: CommandForm(
        "loiter", {"radius_m": Param(2, zero_is_none=True)}, positioned=True, fixed={"kind": "to_altitude"}
    ),
    MavCmd.NAV_LAND: CommandForm("land", {"yaw_deg": _YAW}, positioned=True),
    MavCmd.NAV_VTOL_LAND: CommandForm("land", {"yaw_deg": _YAW}, positioned=True),
    MavCmd.NAV_RETURN_TO_LAUNCH: CommandForm("return_to_launch", {}),
    MavCmd.NAV_DELAY: CommandForm("delay", {"duration_s": Param(1)}, neutral={2: (-1.0,), 3: (-1.0,), 4: (-1.0,)}),
    MavCmd.DO_JUMP: CommandForm("jump", {"target": Param(1), "repeats": Param(2, whole=True)}),
    MavCmd.DO_CHANGE_SPEED: CommandForm(
        "change_speed",
        {"speed_type": Param(1, words={0.0: "airspeed", 1.0: "groundspeed"}), "speed_m_s": Param(2)},
        neutral={3: (-1.0,)},
    ),
    MavCmd.DO_VTOL_TRANSITION: CommandForm(
        "transition", {"to": Param(1, words={3.0: "multicopter", 4.0: "fixed_wing"})}
    ),
    MavCmd.DO_GRIPPER: CommandForm(
        "gripper",
        {
            "instance": Param(1, zero_is_none=True, whole=True),
            "action": Param(2, words={0.0: "release", 1.0: "grab"}),
        },
        fixed={"mode": "embedded"},
    ),
    MavCmd.DO_WINCH: CommandForm(
        "winch",
        {
            "instance": Param(1, zero_is_none=True, whole=True),
            "action": Param(2, words={float(number): word for number, word in enumerate(_WINCH_ACTIONS)}),
            "length_m": Param(3),
            "rate_m_s": Param(4),
        },
        fixed={"mode": "embedded"},
    ),
}
"""DO_LAND_START is not here: alone it is no item; see landing_reader."""
