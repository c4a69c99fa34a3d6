"""The interface of plan items, used by walk, compiler, prediction and other formats.

The defaults fit most items, so a new item overrides only what differs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, Literal, NamedTuple, Protocol, TypeVar

from app.domain.geo import LatLon
from app.domain.items.drop_places import Alternate, Target
from app.domain.items.fields import Altitude, ItemId, PlanModel, Point, Position
from app.domain.items.landing_pattern import Approach
from app.domain.mission import NAN, MavCmd, MavFrame
from app.domain.vehicle.state import FlightRegime, GlobalPosition, VehicleProfile, VehicleType


class Draft(NamedTuple):
    """A MISSION_ITEM_INT without seq. `jump_to` is the ID of a jump target, which becomes param1."""

    command: MavCmd
    frame: MavFrame
    params: tuple[float, float, float, float]
    x: int = 0
    y: int = 0
    z: float = 0.0
    jump_to: str | None = None


def command_draft(command: MavCmd, *params: float, jump_to: str | None = None) -> Draft:
    """Build an item without a position, in frame MISSION: PX4 rejects DO_ commands in a global frame.

    Unset parameters are NaN: 0 can have a meaning (RELEASE in DO_GRIPPER), and PX4 stores these parameters unchanged.
    """
    first, second, third, fourth = (*params, NAN, NAN, NAN, NAN)[:4]
    return Draft(command, MavFrame.MISSION, (first, second, third, fourth), jump_to=jump_to)


def position_draft(
    command: MavCmd, altitude: Altitude, place: LatLon | Position, params: tuple[float, float, float, float]
) -> Draft:
    """Build an item with a position, in an _INT frame, because PX4 reads integer items back in those.

    Unused parameters are 0: PX4 does not store them and reads back 0.
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
    """Convert degrees to the integer on the wire (1e7 per degree)."""
    return round(degrees * 1e7)


def or_nan(value: float | None) -> float:
    """NaN means "not set"."""
    return NAN if value is None else value


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter that is a field. `words` are enum values; `zero_is_none`: 0 means "not set", like null.

    `whole`: the field is an integer.
    """

    number: int
    words: Mapping[float, str] | None = None
    zero_is_none: bool = False
    whole: bool = False

    def written(self, value: Any) -> float | None:
        """Return the parameter for a field's value."""
        if value is None:
            return 0.0 if self.zero_is_none else None
        if self.words is not None:
            return next(number for number, word in self.words.items() if word == value)
        return float(value)


@dataclass(frozen=True, slots=True)
class CommandForm:
    """A command. `positioned`: param5 to param7 are a position. `fixed` are fields that the command implies.

    `neutral` lists values of other parameters that have no effect, besides 0 and null. The first one is written.
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


Forms = Mapping[int, CommandForm]
"""Return the parameters by MAV_CMD."""
YAW: Final = Param(4)


T_co = TypeVar("T_co", covariant=True)
T = TypeVar("T")


class Predictor(Protocol[T_co]):
    """How the prediction computes time and distance of an item."""

    def take_off(self) -> T_co:
        """To the end of the item."""

    def fly(self, hold_s: float, acceptance_radius_m: float | None) -> T_co:
        """To the end of the item, and wait there."""

    def circle(self, radius_m: float | None, seconds: float, turns: float | None) -> T_co:
        """To the end of the item, and circle there; a vehicle that can hover hovers."""

    def land(self, touchdown: Position, approach: Approach | None) -> T_co:
        """At the end of the item."""

    def return_home(self) -> T_co:
        """By the vehicle's RTL settings."""

    def turn_to(self, to: Literal["multicopter", "fixed_wing"]) -> T_co:
        """A transition of a VTOL."""

    def wait(self, duration_s: float) -> T_co:
        """At the current position."""

    def drop(self) -> T_co:
        """The duration of the gripper or winch action."""

    def at_once(self) -> T_co:
        """No time."""


class Leg(NamedTuple):
    """Start and end of an item, and the vehicle that it is compiled for."""

    start: LatLon
    end: LatLon
    home: GlobalPosition
    facts: VehicleProfile

    @property
    def vehicle_type(self) -> VehicleType:
        return self.facts.vehicle_type


class Item(PlanModel):
    """Base of plan items. `forms`: the commands that represent the item in other formats."""

    forms: ClassVar[Forms]
    is_stop: ClassVar[bool] = False
    """The item has a position where drops and photos can follow."""
    stays: ClassVar[bool] = False
    """The item belongs to the stop before it and does not move the vehicle."""
    needs_stop: ClassVar[bool] = False
    """The item requires a stop before it."""
    moves: ClassVar[bool] = False
    """The vehicle flies or drives."""
    lands: ClassVar[bool] = False
    """The item ends on the ground."""
    flies: ClassVar[bool] = False
    """The item ends in the air, if the vehicle can fly."""
    is_drop: ClassVar[bool] = False
    """Gripper and winch."""
    takes_off: ClassVar[bool] = False
    """The takeoff of the plan."""
    waits: ClassVar[bool] = False
    """Only a wait."""
    goes_home: ClassVar[bool] = False
    """By the vehicle's RTL settings."""
    is_preparation: ClassVar[bool] = False
    """The item may precede the takeoff."""

    title: ClassVar[str]
    """Display name in an editor."""
    stem: ClassVar[str] = ""
    """Prefix of a new item's ID; empty for its type."""
    fresh: ClassVar[Mapping[str, object]] = {}
    """Initial fields of a new item, besides its position."""

    id: ItemId = ""

    def altitude(self) -> Altitude | None:
        """Altitude of the item's own position."""
        return None

    def point(self) -> Point | None:
        """The item's own position, if the plan specifies it. A takeoff may omit it."""
        return None

    def end_of(self, home: GlobalPosition, here: LatLon) -> LatLon:
        """Return where the item ends if it begins `here`."""
        return here

    def carried_after(self, vehicle_type: VehicleType, before: FlightRegime) -> FlightRegime:
        """Return the flight regime at the end of the item."""
        return before

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        """Return the mission items, in order; none for drops, which depend on their stop (see plan/compiler.py).

        Raises PlanRejectedError if the autopilot has no such item.
        """
        return ()

    def command(self, vehicle_type: VehicleType) -> MavCmd:
        """Return the item's command form for this type of vehicle."""
        return MavCmd(next(iter(self.forms)))

    def written_fields(self, vehicle_type: VehicleType, home: GlobalPosition) -> Mapping[str, float]:
        """Return fields that another format must specify and the plan leaves to Waydrop."""
        return {}

    def effort(self, predictor: Predictor[T]) -> T:
        """Return how to predict the item."""
        return predictor.at_once()

    def never_ends(self) -> bool:
        """Whether an operator must take over the vehicle there."""
        return False

    def hovers_s(self) -> float:
        """Return how long a vehicle that can stop waits at the end of the item, besides for a drop."""
        return 0.0

    def asked_speed_m_s(self) -> float | None:
        """Return the speed requested from here on, or None."""
        return None

    def reach_m(self) -> float | None:
        """Return the acceptance radius, or None."""
        return None

    def transition_to(self) -> Literal["multicopter", "fixed_wing"] | None:
        """Return the target regime of a transition, or None."""
        return None

    def jumps_to(self) -> str | None:
        """Return the ID of the item that a jump leads to, or None."""
        return None

    def circles(self) -> bool:
        """Whether a vehicle that cannot hover circles around the position."""
        return False

    def circle_radius_m(self) -> float | None:
        """Return the radius, or None. The sign is the direction."""
        return None

    def holds(self) -> bool:
        """Whether a hovering vehicle can hold there as part of the item."""
        return False

    def other_place(self) -> Alternate | None:
        """Return the alternate of a drop, or None."""
        return None

    def followed(self) -> Target | None:
        """Return the target that a drop follows, or None."""
        return None
