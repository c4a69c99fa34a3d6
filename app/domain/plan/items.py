"""The item types of a plan: what a dispatcher can ask a vehicle to do, one after the other."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.plan.alternate import DEFAULT_DROP_HOLD_S, Alternate, Consent, ConsentTimeoutS, HoldS
from app.domain.plan.fields import (
    Altitude,
    ItemId,
    LatitudeDeg,
    LongitudeDeg,
    PlanModel,
    Position,
    RadiusM,
    Seconds,
    SignedRadiusM,
    SpeedMS,
    YawDeg,
)
from app.domain.plan.moving_target import Target


class Takeoff(Altitude):
    """Climb to an altitude. Without a position: above home. A fixed wing climbs towards its position.

    `pitch_deg` is the least pitch of a fixed wing's climb-out (param1 of NAV_TAKEOFF).
    """

    id: ItemId = ""
    type: Literal["takeoff"]
    latitude_deg: LatitudeDeg | None = None
    longitude_deg: LongitudeDeg | None = None
    yaw_deg: YawDeg | None = None
    pitch_deg: Annotated[float, Field(ge=0, le=45)] | None = None

    @model_validator(mode="after")
    def _both_coordinates(self) -> Self:
        if (self.latitude_deg is None) != (self.longitude_deg is None):
            raise PydanticCustomError("half_position", "give both latitude_deg and longitude_deg, or neither")
        return self


class Waypoint(Position):
    """Fly through a place, or stop there for `hold_s` (rotary wings only).

    `speed_m_s` is the speed towards it and from then on.
    """

    id: ItemId = ""
    type: Literal["waypoint"]
    hold_s: Seconds = 0.0
    acceptance_radius_m: RadiusM | None = None
    yaw_deg: YawDeg | None = None
    speed_m_s: SpeedMS | None = None


class Loiter(Position):
    """Circle (fixed wing) or hover (rotary wing) at a place. The sign of `radius_m` is the direction, + clockwise.

    kind `time` needs duration_s, `turns` needs turns; `to_altitude` ends at the item's altitude; `unlimited` never.
    """

    id: ItemId = ""
    type: Literal["loiter"]
    kind: Literal["time", "turns", "unlimited", "to_altitude"]
    radius_m: SignedRadiusM | None = None
    duration_s: Seconds | None = None
    turns: Annotated[float, Field(gt=0, le=1000)] | None = None
    yaw_deg: YawDeg | None = None

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
        if self.radius_m == 0:
            raise PydanticCustomError("loiter_radius", "radius_m must not be 0; null is the vehicle's own radius")
        return self


class Delay(PlanModel):
    """Wait where the vehicle is (NAV_DELAY). The only way to stop a rover."""

    id: ItemId = ""
    type: Literal["delay"]
    duration_s: Annotated[float, Field(gt=0, le=86_400)]


class Drop(PlanModel):
    """What gripper and winch share.

    `release_motion`: whether the vehicle stands or flies on while releasing. `mode`: `embedded` is an item of the
    mission, `supervised` is commanded by Waydrop during a hold of at most `hold_s`; null is the default of the vehicle
    type. `max_offset_m`: no release farther than this from the point. `mass_kg` is that of the parcel. `consent`
    "operator": a person is asked while the vehicle holds, and has `consent_timeout_s` (null: as long as the hold
    allows) to answer; no answer is a refusal.
    """

    id: ItemId = ""
    release_motion: Literal["stopped", "moving"]
    mode: Literal["supervised", "embedded"] | None = None
    hold_s: HoldS = DEFAULT_DROP_HOLD_S
    max_offset_m: RadiusM | None = None
    mass_kg: Annotated[float, Field(gt=0, le=10_000)] | None = None
    consent: Consent = "none"
    consent_timeout_s: ConsentTimeoutS | None = None
    instance: Annotated[int, Field(ge=1, le=16)] = 1


class Gripper(Drop):
    """Release or grab a parcel at the position item before (DO_GRIPPER).

    `alternate` is where a supervised release is made if it fails here. With a `target` the place follows it.
    """

    type: Literal["gripper"]
    action: Literal["release", "grab"]
    alternate: Alternate | None = None
    target: Target | None = None


class Winch(Drop):
    """Let a parcel down at the position item before (DO_WINCH). `length_m`, `rate_m_s` as the action needs them."""

    type: Literal["winch"]
    action: Literal[
        "relax", "length", "rate", "lock", "deliver", "hold", "retract", "load_line", "abandon_line", "load_payload"
    ]
    length_m: Annotated[float, Field(ge=-1000, le=1000)] | None = None
    rate_m_s: Annotated[float, Field(ge=-20, le=20)] | None = None

    @model_validator(mode="after")
    def _needs_of_action(self) -> Self:
        if self.action == "length" and self.length_m is None:
            raise PydanticCustomError("winch_length", "a winch action length needs length_m")
        if self.action == "rate" and self.rate_m_s is None:
            raise PydanticCustomError("winch_rate", "a winch action rate needs rate_m_s")
        return self


class ChangeSpeed(PlanModel):
    """Fly at this speed from now on. A null `speed_type` is airspeed for fixed wings, else ground speed."""

    id: ItemId = ""
    type: Literal["change_speed"]
    speed_m_s: SpeedMS
    speed_type: Literal["airspeed", "groundspeed"] | None = None


class Transition(PlanModel):
    """A VTOL changes between hovering and wing-borne flight."""

    id: ItemId = ""
    type: Literal["transition"]
    to: Literal["fixed_wing", "multicopter"]


class Approach(Position):
    """Where a fixed wing descends on a circle before it lands along the tangent. The sign of the radius: direction."""

    radius_m: Annotated[float, Field(ge=-1000, le=1000)] = 60.0


class Land(Position):
    """Land at a place; the altitude is that of the ground there.

    In mid-plan a rotary wing stays armed and the next position item takes off again. `approach` is for fixed wings;
    null computes one in line with the item before.
    """

    id: ItemId = ""
    type: Literal["land"]
    yaw_deg: YawDeg | None = None
    approach: Approach | None = None


class ReturnToLaunch(PlanModel):
    """Fly home and land there, by the vehicle's own RTL settings. Ends the plan."""

    id: ItemId = ""
    type: Literal["return_to_launch"]


class Jump(PlanModel):
    """Go back to the item with this id, `repeats` times in all, then go on."""

    id: ItemId = ""
    type: Literal["jump"]
    target: Annotated[str, Field(min_length=1, max_length=64)]
    repeats: Annotated[int, Field(ge=1, le=1000)]


PlanItem = (
    Takeoff | Waypoint | Loiter | Delay | Gripper | Winch | ChangeSpeed | Transition | Land | ReturnToLaunch | Jump
)
DropItem = Gripper | Winch
PositionItem = Takeoff | Waypoint | Loiter | Land
"""Items with a position on the wire. A drop may follow all of them but the takeoff."""
