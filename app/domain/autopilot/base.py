"""The interface of autopilots. Each has a folder with its parameters, modes and rules.

Only these folders, vehicles/ and simulator/ may name parameters, mode numbers or firmware versions. A result that
depends on a setting names the setting and how to change it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum, auto
from typing import Literal, NamedTuple, Protocol

from app.domain.autopilot.capability import AuditedParameter, Cell, FirmwareProfile, FlightKind
from app.domain.vehicle.state import FirmwareVersion, FlightMode, FlightRegime, VehicleProfile, VehicleType


class Quantity(StrEnum):
    """A numeric setting of a vehicle, in the unit of its name."""

    ACCEPTANCE_RADIUS_M = auto()
    LOITER_RADIUS_M = auto()
    """The sign is the direction."""
    HOVER_CRUISE_M_S = auto()
    HOVER_FASTEST_M_S = auto()
    HOVER_ACCELERATION_M_S2 = auto()
    HOVER_JERK_M_S3 = auto()
    CORNER_SHARE = auto()
    """Of the acceleration: limits the speed in corners."""
    CLIMB_M_S = auto()
    CLIMB_ACCELERATION_M_S2 = auto()
    SINK_M_S = auto()
    SINK_ACCELERATION_M_S2 = auto()
    SPOOL_UP_S = auto()
    TAKEOFF_RAMP_S = auto()
    TAKEOFF_M_S = auto()
    TAKEOFF_HEIGHT_M = auto()
    """Altitude of a takeoff that does not specify one."""
    LANDING_M_S = auto()
    LANDING_SLOWS_BELOW_M = auto()
    LANDING_SLOW_BELOW_M = auto()
    WING_CRUISE_M_S = auto()
    WING_SLOWEST_M_S = auto()
    WING_FASTEST_M_S = auto()
    WING_CLIMB_M_S = auto()
    WING_SINK_M_S = auto()
    WING_TAKEOFF_CLIMB_M_S = auto()
    WING_LANDING_M_S = auto()
    """0 or less: minimum airspeed."""
    WING_ALTITUDE_RADIUS_M = auto()
    WING_LANDING_ALTITUDE_RADIUS_M = auto()
    GLIDE_DEG = auto()
    TRANSITION_M_S = auto()
    WHEELS_FASTEST_M_S = auto()
    GRIPPER_S = auto()
    """Duration of a gripper action."""
    RETURN_HEIGHT_M = auto()
    RETURN_NEAR_M = auto()
    """Within this distance a return climbs less, by the cone."""
    RETURN_CONE_DEG = auto()
    COMMAND_WAIT_S = auto()
    """How long a mission waits at an embedded drop."""
    FIRST_WAYPOINT_M = auto()
    """Maximum distance from home; 0: no limit, also for the next two."""
    FARTHEST_M = auto()
    HIGHEST_M = auto()


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting that an operator can look up and change. `remedy` says how; empty if any other value is acceptable."""

    name: str
    value: float
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.name} {self.value:g}"


@dataclass(frozen=True, slots=True)
class LinkLoss:
    """What the vehicle does when its link is lost; None if a plan cannot rely on it."""

    action: Literal["continue", "hold", "return", "land"] | None
    setting: Setting


@dataclass(frozen=True, slots=True)
class LowBattery:
    """`acts_below`: charge in percent below which the vehicle returns or lands by itself; None: never."""

    only_warns: bool
    acts_below: Setting | None
    setting: Setting


@dataclass(frozen=True, slots=True)
class FenceBreach:
    """`ignored`: what the vehicle does instead of staying inside its geofence; empty if it stays inside."""

    ignored: str
    setting: Setting


@dataclass(frozen=True, slots=True)
class Return:
    """Destination of a return: the nearest of the rally points and these places, or along the mission items.

    `along_items`: to the mission landing if there is one, else back along the items; with `turns_back`, the direction
    with fewer items. `may_follow_items`: the same, or unknown; the return may execute items that the mission skipped.
    `choice` describes the choice; empty: never a rally point. `rally_alone`: the choice among rally points only.
    """

    to_home: bool
    to_landing: bool
    along_items: bool
    turns_back: bool
    may_follow_items: bool
    choice: str
    rally_alone: str
    setting: Setting


@dataclass(frozen=True, slots=True)
class RallyReturn:
    """At a rally point. `lands` None: unknown. `passes_over`: the setting with which a VTOL in fixed-wing flight skips
    it.
    """

    lands: bool | None
    lands_by: str
    passes_over: Setting | None


@dataclass(frozen=True, slots=True)
class MissionNeeds:
    """The items that a mission requires. `without_takeoff` says how to drop the requirement of a takeoff."""

    takeoff: bool
    landing: bool
    both_or_neither: bool
    landing_in_flight: bool
    setting: Setting
    without_takeoff: str


@dataclass(frozen=True, slots=True)
class TooOld:
    """Firmware that lacks a feature, and the oldest version that has it."""

    version: str
    needed: str


@dataclass(frozen=True, slots=True)
class GripperAssignment:
    """Whether an output moves the gripper. None: unknown, because the `silent` settings did not answer.

    One of the output settings, named like `settings`, must be `function`.
    """

    assigned: bool | None
    silent: tuple[str, ...]
    settings: str
    function: int


class Behaviour(Protocol):
    """The behaviour of one vehicle: its autopilot, firmware and settings.

    Unknown settings are assumed: the default of the autopilot, or the strict value where versions differ. Assumptions
    are recorded by VehicleProfile.assuming.
    """

    def quantity(self, which: Quantity) -> float:
        """0 if the vehicle type has no such setting."""

    def usable(self) -> VehicleProfile:
        """The same behaviour within bounds that the prediction can handle, whatever the vehicle's settings are."""

    def switch_distance_m(self, ground_speed_m_s: float) -> float:
        """Fixed wing: distance before a waypoint at which it counts as reached."""

    def reach_m(
        self, carried: FlightRegime, ground_speed_m_s: float, acceptance_radius_m: float | None = None
    ) -> float:
        """Distance from the point at which an item counts as reached. An item's own radius applies where supported."""

    def name_of(self, which: Quantity) -> str:
        """The name of the setting."""

    @property
    def guidance_s(self) -> float:
        """Fixed wing controlled by commands: time before a position at which it turns onto the circle around it."""

    @property
    def steepest_glide(self) -> Setting:
        """In degrees. Steeper fixed-wing landings are rejected."""

    @property
    def lowest_takeoff_m(self) -> float:
        """Above home. Lower takeoffs are rejected."""

    @property
    def mission_needs(self) -> MissionNeeds:
        """Items without which the vehicle accepts a mission but does not fly it."""

    @property
    def refuses_far_first_waypoint(self) -> bool:
        """Beyond Quantity.FIRST_WAYPOINT_M. Otherwise it only warns."""

    @property
    def too_old_for_drops(self) -> TooOld | None:
        """Firmware that rejects missions with a gripper or winch item."""

    @property
    def no_gripper(self) -> Setting | None:
        """The setting by which the vehicle has no gripper; None: it has one."""

    @property
    def gripper_output(self) -> GripperAssignment:
        """The output that moves the gripper."""

    @property
    def returns(self) -> Return:
        """The destination of a return."""

    @property
    def rally_return(self) -> RallyReturn:
        """What the vehicle does at a rally point."""

    @property
    def returns_round_fence(self) -> bool:
        """Whether a direct return avoids the geofence instead of flying straight."""

    @property
    def return_margin_m(self) -> float:
        """Margin to the geofence on that path."""

    @property
    def needs_all_inclusions(self) -> bool:
        """Whether a position must be in all inclusions that contain home, instead of any."""

    @property
    def fence_breach(self) -> FenceBreach:
        """At its geofence."""

    @property
    def link_loss(self) -> LinkLoss:
        """When its link is lost."""

    @property
    def low_battery(self) -> LowBattery:
        """When its battery is nearly empty."""


Capacity = Literal["max_mission_items", "max_fence_items", "max_rally_points"]


class GripperChannel(NamedTuple):
    """Port and output (counted from 1) in SERVO_OUTPUT_RAW."""

    port: int
    output: int


@dataclass(frozen=True, slots=True)
class Audit:
    """The parameters audited before offboard control. `names` are read from the vehicle."""

    names: tuple[str, ...]
    entry: Callable[[str, float | int | None, bool], AuditedParameter]
    """Audit a parameter by name, value (None: no answer) and whether a pilot holds the sticks."""
    merged: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """A parameter of newer firmware, and those of `names` that it replaces."""

    def to_read_too(self, parameters: Mapping[str, float | int]) -> tuple[str, ...]:
        """Parameters of newer firmware to read, if none of those that they replace has answered: asked for a parameter
        that does not exist, older firmware says nothing, and is waited for.
        """
        return tuple(new for new, old in self.merged.items() if parameters.keys().isdisjoint(old))

    def entries(self, parameters: Mapping[str, float | int], *, sticks_held: bool) -> tuple[AuditedParameter, ...]:
        """Audit all of them. With a pilot at the sticks, a mode that requires sticks is acceptable too."""
        return tuple(self.entry(name, parameters.get(name), sticks_held) for name in self._shown(parameters))

    def _shown(self, parameters: Mapping[str, float | int]) -> Sequence[str]:
        """Each replaced parameter under its newer name, once, if that one has answered."""
        newer = {name: new for new, old in self.merged.items() if new in parameters for name in old}
        return tuple(dict.fromkeys(newer.get(name, name) for name in self.names))


@dataclass(frozen=True, slots=True)
class Autopilot:
    """An autopilot: the properties that its vehicles have in common."""

    name: str
    mav_autopilot: int
    """MAV_AUTOPILOT of its HEARTBEAT."""
    behaviour: Callable[[VehicleProfile], Behaviour]
    """The behaviour of one vehicle."""
    defaults: Mapping[VehicleType, Mapping[str, float | int]]
    """Parameters that plans are checked against, with their defaults."""
    also_read: tuple[str, ...]
    """Additional parameters to read from a vehicle."""
    return_parameters: Callable[[VehicleType], tuple[str, ...]]
    """Parameters of Behaviour.returns and .rally_return. Without the first, no destination can be predicted."""
    unattended: Mapping[str, float | int]
    """Settings for a vehicle without a pilot: hold without setpoints, return with a low battery."""
    system_id_name: str
    """The parameter of the MAVLink system ID."""
    flight_mode: Callable[[int, VehicleType | None], FlightMode]
    """The mode of the number in HEARTBEAT. It may depend on the vehicle type."""
    mode_numbers: Callable[[FlightMode, VehicleType | None], tuple[int, int]]
    """param2 and param3 of DO_SET_MODE for a mode."""
    arming_obstacle: Callable[[FlightMode], str]
    """Why a disarmed vehicle cannot be armed in this mode; empty if it can."""
    setpoints: Mapping[FlightKind, Mapping[str, Cell]]
    """The setpoint forms that each kind of vehicle follows."""
    setpoint_profile: Callable[[FirmwareVersion | None], FirmwareProfile]
    """The column of that table that applies."""
    audit: Audit
    """The reaction to a loss of setpoints."""
    audit_commanded: Audit
    """The same under control by commands, where no stream can be lost."""
    gripper_channel: Callable[[Mapping[str, float | int]], GripperChannel | None]
    """The output that shows the gripper's pulses; None if there is none, or its pulses cannot be interpreted."""
    gripper_limits: Callable[[Mapping[str, float | int]], tuple[str, ...]]
    """Additional parameters to interpret the pulses of the assigned output."""
    has_gripper_output: Callable[[Mapping[str, float | int], Collection[str]], bool | None]
    """Whether an output is assigned, by parameters and names without an answer; None: unknown."""
    takes_turns: bool
    """Supports a loiter by number of turns."""
    takes_instance: bool
    """Respects the gripper instance of a mission item."""
    executes_winch: bool
    """Executes winch items of a mission. Otherwise an external payload must do so."""
    commands_winch: bool
    """Executes winch commands."""
    usually_stored: Mapping[Capacity, int]
    """What no message of a vehicle reports."""
    gripper_hint: str
    """What to check if a gripper does not move."""
