"""PX4's parameters that are choices: what each value means, and what to set instead."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from app.domain.autopilot.base import FenceBreach, LinkLoss, LowBattery, MissionNeeds, RallyReturn, Return, Setting
from app.domain.autopilot.px4.parameters import parameter, told
from app.domain.vehicle import VehicleFacts, VehicleType

_LINK_LOSS: Final[Mapping[int, Literal["continue", "hold", "return", "land"]]] = {
    0: "continue",
    1: "hold",
    2: "return",
    3: "land",
}
"""NAV_DLL_ACT. 5 (terminate) and 6 (disarm) are nothing a plan can count on."""
_ONLY_WATCHES: Final = {0: "flies on", 1: "only warns and flies on"}
"""GF_ACTION."""
_ALONG_ITEMS: Final = (2, 4)
_CHOICES: Final = {
    0: "the nearest of home and the rally points",
    1: "the nearest of the rally points and the mission's landing",
    3: "the nearest of home, the rally points and the mission's landing",
    5: "the nearest rally point",
}
"""RTL_TYPE: returns that fly to one place. The others go along the mission's items, the skipped ones too."""


def return_parameters(vehicle_type: VehicleType) -> tuple[str, ...]:
    """What `returns` and `rally_return` look at."""
    return ("RTL_TYPE", "RTL_LAND_DELAY", *(("RTL_APPR_FORCE",) if vehicle_type is VehicleType.VTOL else ()))


@dataclass(frozen=True, slots=True)
class Px4Settings:
    """The answers of a Behaviour that are choices of a vehicle's operator."""

    facts: VehicleFacts

    @property
    def returns(self) -> Return:
        """RTL_TYPE: 0 home and the rally points, 1 rally points and the mission's landing, 3 all, 5 rally points.

        2 and 4 follow the mission; 4 goes back if that is fewer items, 2 if there is no landing.
        """
        kind = int(parameter(self.facts, "RTL_TYPE"))
        return Return(
            to_home=kind not in (1, 5),
            to_landing=kind in (1, 3),
            along_items=kind in _ALONG_ITEMS,
            turns_back=kind == 4,
            may_follow_items=kind not in _CHOICES,
            choice=_CHOICES.get(kind, ""),
            rally_alone="with RTL_TYPE 5",
            setting=Setting("RTL_TYPE", kind, "set RTL_TYPE to 0 or 5"),
        )

    @property
    def rally_return(self) -> RallyReturn:
        """RTL_LAND_DELAY below 0 stays in the air; RTL_APPR_FORCE wants landing approaches: not all firmware has it."""
        delay_s, force = told(self.facts, "RTL_LAND_DELAY"), int(told(self.facts, "RTL_APPR_FORCE") or 0)
        return RallyReturn(
            lands=None if delay_s is None else delay_s >= 0.0,
            lands_by="RTL_LAND_DELAY",
            passes_over=Setting("RTL_APPR_FORCE", force, "set RTL_APPR_FORCE to 0") if force else None,
        )

    @property
    def mission_needs(self) -> MissionNeeds:
        """MIS_TKO_LAND_REQ: 1 takeoff, 2 landing, 3 both, 4 both or neither, 5 the same but a landing in flight."""
        required = int(parameter(self.facts, "MIS_TKO_LAND_REQ"))
        return MissionNeeds(
            takeoff=required in (1, 3),
            landing=required in (2, 3),
            both_or_neither=required in (4, 5),
            landing_in_flight=required in (2, 3, 5),
            setting=Setting("MIS_TKO_LAND_REQ", required, "set MIS_TKO_LAND_REQ to 0"),
            without_takeoff="set MIS_TKO_LAND_REQ to 0, 2 or 5",
        )

    @property
    def fence_breach(self) -> FenceBreach:
        """GF_ACTION."""
        action = int(parameter(self.facts, "GF_ACTION"))
        setting = Setting("GF_ACTION", action, "set GF_ACTION to 2 (hold) or 3 (return)")
        return FenceBreach(_ONLY_WATCHES.get(action, ""), setting)

    @property
    def link_loss(self) -> LinkLoss:
        """NAV_DLL_ACT."""
        action = int(parameter(self.facts, "NAV_DLL_ACT"))
        return LinkLoss(_LINK_LOSS.get(action), Setting("NAV_DLL_ACT", action, "set NAV_DLL_ACT to 2 (return)"))

    @property
    def low_battery(self) -> LowBattery:
        """COM_LOW_BAT_ACT; above 0 it acts at BAT_CRIT_THR."""
        action = int(parameter(self.facts, "COM_LOW_BAT_ACT"))
        mend = "set COM_LOW_BAT_ACT to 3: return when critical, land in an emergency"
        acts_below = Setting("BAT_CRIT_THR", 100.0 * parameter(self.facts, "BAT_CRIT_THR")) if action > 0 else None
        return LowBattery(action == 0, acts_below, Setting("COM_LOW_BAT_ACT", action, mend))
