"""Plans near the limits, and vehicles on either side of them: what is said of each pair."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from app.domain.vehicle.state import VehicleProfile
from tests.support.plan_pieces import (
    HOME,
    RETURN,
    Json,
    at,
    facts,
    gripper,
    land,
    plan_json,
    square,
    takeoff,
    waypoint,
    wing_takeoff,
)

_TELLS_NOTHING = replace(facts(firmware=None), parameters={})
VEHICLES: Final[Mapping[str, VehicleProfile]] = {
    "new": facts(),
    "old": facts(firmware=(1, 15, 4)),
    "silent": _TELLS_NOTHING,
    "near": facts(GF_MAX_HOR_DIST=150),
    "plane": facts("fixed_wing"),
    "slow plane": facts("fixed_wing", FW_AIRSPD_TRIM=11.6),
    "bush plane": facts("fixed_wing", MIS_TKO_LAND_REQ=0, FW_LND_ANG=15),
}
MULTICOPTERS: Final = ("new", "old", "silent", "near")
PLANES: Final = ("plane", "slow plane", "bush plane")


@dataclass(frozen=True)
class NearTheLimits:
    """`depends` is the code of an error for the vehicles that are `refused`, and a warning without a vehicle.

    `warned`: whether there is that warning; what a default allows is not found. `never` is an error for all.
    """

    name: str
    document: Json
    depends: str = ""
    refused: tuple[str, ...] = ()
    never: str = ""
    warned: bool = True

    def __str__(self) -> str:
        return self.name

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Those of its type."""
        return MULTICOPTERS if self.document["vehicle_type"] == "multicopter" else PLANES

    def code_for(self, vehicle: str | None) -> str:
        """The error that is expected; empty if it is accepted."""
        return self.never or (self.depends if vehicle in self.refused else "")


def _quad(*items: Json, **more: object) -> Json:
    return plan_json("multicopter", *items, RETURN, **more)


def _plane(*items: Json, **more: object) -> Json:
    return plan_json("fixed_wing", wing_takeoff(), *items, waypoint(400, 400, 40), land(), **more)


def _plane_drop(max_offset_m: float) -> Json:
    return _plane(waypoint(800), gripper("moving", max_offset_m=max_offset_m))


_ABSOLUTE = {**waypoint(100, 100), "relative_altitude_m": None, "absolute_altitude_m": HOME.altitude_m + 30}
_APPROACH = {**at(-420, 0), "relative_altitude_m": 60, "radius_m": 60}
_BOX = {"polygons": [square("exclusion", 100, 0, 20)]}

PLANS: Final = (
    NearTheLimits("takeoff to 0.5 m", _quad(takeoff(0.5), waypoint()), "takeoff.too_low", ("old", "silent")),
    NearTheLimits("takeoff to 3 m", _quad(takeoff(3), waypoint()), "takeoff.too_low", ("old", "silent")),
    NearTheLimits("takeoff to 11 m", _quad(takeoff(11), waypoint())),
    NearTheLimits("takeoff to 0 m", _quad(takeoff(0), waypoint()), never="takeoff.too_low"),
    NearTheLimits(
        "no home, two kinds of altitude",
        _quad(takeoff(), waypoint(), _ABSOLUTE, home=None),
        "vehicle.altitudes_not_comparable",
    ),
    NearTheLimits("200 m away", _quad(takeoff(), waypoint(200)), "geofence.vehicle_distance", ("near",), warned=False),
    NearTheLimits("into a keep-out", _quad(takeoff(), waypoint(), geofence=_BOX), never="geofence.leg_outside"),
    NearTheLimits("13 m/s", _quad(takeoff(), waypoint(speed_m_s=13)), "speed.not_flyable", MULTICOPTERS),
    NearTheLimits(
        "in 20 s", _quad(takeoff(), waypoint(), limits={"max_duration_s": 20}), "limits.duration", MULTICOPTERS
    ),
    NearTheLimits("a drop within 30 m", _plane_drop(30), "drop.offset_not_reachable", ("plane", "bush plane")),
    NearTheLimits("a drop within 25 m", _plane_drop(25), "drop.offset_not_reachable", PLANES),
    NearTheLimits(
        "a glide of 8.2 degrees",
        plan_json("fixed_wing", wing_takeoff(), waypoint(400), land(approach=_APPROACH)),
        "fixed_wing.glide_too_steep",
        ("plane", "slow plane"),
    ),
    NearTheLimits("a plane that stops", _plane(waypoint(800), gripper()), never="braking.cannot_stop"),
)
