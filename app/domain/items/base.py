"""What every plan item tells of itself: the walk, the compiler, the prediction and the other formats ask it.

An item answers with what most items do unless it says otherwise, so that a new one says only what it is.
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

# A mission item before it has a number.


class Draft(NamedTuple):
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
    command: MavCmd, altitude: Altitude, place: LatLon | Position, params: tuple[float, float, float, float]
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


# How a MAV_CMD is a plan item: which parameter is which field. Read both ways: in and out.


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


Forms = Mapping[int, CommandForm]
"""By MAV_CMD."""
YAW: Final = Param(4)


T_co = TypeVar("T_co", covariant=True)
T = TypeVar("T")


class Way(Protocol[T_co]):
    """How a vehicle covers an item, in time and distance: the item says what it asks of the vehicle."""

    def take_off(self) -> T_co:
        """To the end of the item."""

    def fly(self, hold_s: float, acceptance_radius_m: float | None) -> T_co:
        """To the end of the item, and wait there."""

    def circle(self, radius_m: float | None, seconds: float, turns: float | None) -> T_co:
        """To the end of the item, and around it; a vehicle that hovers stands there."""

    def land(self, touchdown: Position, approach: Approach | None) -> T_co:
        """At the end of the item."""

    def return_home(self) -> T_co:
        """By the vehicle's own settings."""

    def turn_to(self, to: Literal["multicopter", "fixed_wing"]) -> T_co:
        """A transition of a VTOL."""

    def wait(self, duration_s: float) -> T_co:
        """Where it is."""

    def drop(self) -> T_co:
        """What gripper or winch do there."""

    def at_once(self) -> T_co:
        """It takes no time."""


class Site(NamedTuple):
    """Where an item begins and ends, and the vehicle that it is compiled for."""

    start: LatLon
    end: LatLon
    home: GlobalPosition
    facts: VehicleProfile

    @property
    def vehicle_type(self) -> VehicleType:
        """The vehicle's type."""
        return self.facts.vehicle_type


class Item(PlanModel):
    """One item of a plan. `forms`: the commands that it is in other formats."""

    forms: ClassVar[Forms]
    is_stop: ClassVar[bool] = False
    """The vehicle is at its place afterwards: drops and photos after it are made there."""
    stays: ClassVar[bool] = False
    """It belongs to the stop before it, and does not move the vehicle."""
    needs_stop: ClassVar[bool] = False
    """Without that stop it means nothing."""
    moves: ClassVar[bool] = False
    """The vehicle flies or drives."""
    lands: ClassVar[bool] = False
    """It ends on the ground."""
    flies: ClassVar[bool] = False
    """It ends in the air, if the vehicle flies at all."""
    is_drop: ClassVar[bool] = False
    """Gripper and winch."""
    takes_off: ClassVar[bool] = False
    """The takeoff of the plan."""
    waits: ClassVar[bool] = False
    """A wait, and nothing else."""
    goes_home: ClassVar[bool] = False
    """By the vehicle's own settings."""
    is_preparation: ClassVar[bool] = False
    """It may stand before the takeoff."""

    title: ClassVar[str]
    """What it is called in an editor."""
    stem: ClassVar[str] = ""
    """What a new one's id begins with; its type, if empty."""
    fresh: ClassVar[Mapping[str, object]] = {}
    """What a new one says besides its place."""

    id: ItemId = ""

    def altitude(self) -> Altitude | None:
        """The altitude of a place of its own."""
        return None

    def point(self) -> Point | None:
        """That place, where the plan says it: a takeoff may leave it open."""
        return None

    def end_of(self, home: GlobalPosition, here: LatLon) -> LatLon:
        """Where it ends if it begins `here`."""
        return here

    def carried_after(self, vehicle_type: VehicleType, before: FlightRegime) -> FlightRegime:
        """What carries the vehicle at its end."""
        return before

    def drafts(self, site: Site) -> tuple[Draft, ...]:
        """Its mission items, in order; none for drops, which depend on their stop: see compiler/drop_items.

        Raises PlanRejectedError: the autopilot has none for it.
        """
        return ()

    def command(self, vehicle_type: VehicleType) -> MavCmd:
        """The one of its forms that it has for this type of vehicle."""
        return MavCmd(next(iter(self.forms)))

    def written_fields(self, vehicle_type: VehicleType, home: GlobalPosition) -> Mapping[str, float]:
        """What another format must say that the plan leaves to Waydrop."""
        return {}

    def effort(self, way: Way[T]) -> T:
        """What it takes."""
        return way.at_once()

    def never_ends(self) -> bool:
        """Somebody must take the vehicle over there."""
        return False

    def hovers_s(self) -> float:
        """How long a vehicle that can stop waits at the end of it, besides for a drop."""
        return 0.0

    def asked_speed_m_s(self) -> float | None:
        """The speed that is flown from here on, if it asks for one."""
        return None

    def reach_m(self) -> float | None:
        """How near its place counts as reached, if it says so."""
        return None

    def transition_to(self) -> Literal["multicopter", "fixed_wing"] | None:
        """What it turns a VTOL into."""
        return None

    def jumps_to(self) -> str | None:
        """The id of the item with which the plan goes on."""
        return None

    def circles(self) -> bool:
        """What cannot hover circles around its place."""
        return False

    def circle_radius_m(self) -> float | None:
        """How wide, if it says so; the sign is the direction."""
        return None

    def holds(self) -> bool:
        """A vehicle that hovers can be told to hold there, as part of the item."""
        return False

    def other_place(self) -> Alternate | None:
        """Where a drop is made if it fails here."""
        return None

    def followed(self) -> Target | None:
        """The target that a drop follows."""
        return None
