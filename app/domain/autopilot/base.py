"""What is asked of an autopilot. Each has one folder: its parameters and what they mean, its modes, what it accepts.

Outside of these folders, vehicles/ and simulator/ nobody names a parameter, a mode number or a firmware version. An
answer that an operator may want to change carries the name of its setting and how to change it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum, auto
from typing import Literal, NamedTuple, Protocol

from app.domain.autopilot.capability import AuditEntry, Cell, FirmwareProfile, FlightKind
from app.domain.vehicle.state import FirmwareVersion, FlightMode, FlightRegime, VehicleProfile, VehicleType


class Quantity(StrEnum):
    """A number that a vehicle is set to, in the unit that its name says."""

    ACCEPTANCE_RADIUS_M = auto()
    LOITER_RADIUS_M = auto()
    """Its sign is the direction."""
    HOVER_CRUISE_M_S = auto()
    HOVER_FASTEST_M_S = auto()
    HOVER_ACCELERATION_M_S2 = auto()
    HOVER_JERK_M_S3 = auto()
    CORNER_SHARE = auto()
    """Of the acceleration: what a corner may take."""
    CLIMB_M_S = auto()
    CLIMB_ACCELERATION_M_S2 = auto()
    SINK_M_S = auto()
    SINK_ACCELERATION_M_S2 = auto()
    SPOOL_UP_S = auto()
    TAKEOFF_RAMP_S = auto()
    TAKEOFF_M_S = auto()
    TAKEOFF_HEIGHT_M = auto()
    """Where no takeoff says how high."""
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
    """0 or less: as slow as it flies."""
    WING_ALTITUDE_RADIUS_M = auto()
    WING_LANDING_ALTITUDE_RADIUS_M = auto()
    GLIDE_DEG = auto()
    TRANSITION_M_S = auto()
    WHEELS_FASTEST_M_S = auto()
    GRIPPER_S = auto()
    """How long the gripper moves."""
    RETURN_HEIGHT_M = auto()
    RETURN_NEAR_M = auto()
    """Within it a return climbs less, by the cone."""
    RETURN_CONE_DEG = auto()
    COMMAND_WAIT_S = auto()
    """How long a mission waits at a drop that it does itself."""
    FIRST_WAYPOINT_M = auto()
    """From home at most; 0: no bound, as of the next two."""
    FARTHEST_M = auto()
    HIGHEST_M = auto()


@dataclass(frozen=True, slots=True)
class Setting:
    """What an operator looks up and changes. `mend` says how; empty where any other value may do."""

    name: str
    value: float
    mend: str = ""

    def __str__(self) -> str:
        return f"{self.name} {self.value:g}"


@dataclass(frozen=True, slots=True)
class LinkLoss:
    """What the vehicle does without a link; None is nothing that a plan can count on."""

    action: Literal["continue", "hold", "return", "land"] | None
    setting: Setting


@dataclass(frozen=True, slots=True)
class LowBattery:
    """`acts_below`: the charge in per cent at which the vehicle returns or lands by itself; None: it does not."""

    only_warns: bool
    acts_below: Setting | None
    setting: Setting


@dataclass(frozen=True, slots=True)
class FenceBreach:
    """`ignored`: what the vehicle does instead of staying inside its fence, in words; empty if it stays."""

    ignored: str
    setting: Setting


@dataclass(frozen=True, slots=True)
class Return:
    """Where a return goes: the nearest of the rally points and these places, or along the mission's items.

    `along_items`: on to the mission's landing if there is one, else back; with `turns_back` the way of fewer items.
    `may_follow_items`: the same or something that is not known; it may pass items that the mission left out. `choice`
    says what it chooses, empty: never a rally point. `rally_alone`: how it would choose among rally points only.
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
    """At a rally point. `lands` None: it does not tell. `passes_over`: by which a VTOL on its wing flies on from it."""

    lands: bool | None
    lands_by: str
    passes_over: Setting | None


@dataclass(frozen=True, slots=True)
class MissionNeeds:
    """Which items a mission must have to be flown. `without_takeoff` says how to lift the need for a takeoff alone."""

    takeoff: bool
    landing: bool
    both_or_neither: bool
    landing_in_flight: bool
    setting: Setting
    without_takeoff: str


@dataclass(frozen=True, slots=True)
class TooOld:
    """Firmware that cannot do something, and the oldest that can."""

    version: str
    needed: str


@dataclass(frozen=True, slots=True)
class GripperAssignment:
    """Whether an output moves the gripper; None: not known, for the `silent` settings did not answer.

    One of the outputs' settings, called like `settings`, has to be `function`.
    """

    assigned: bool | None
    silent: tuple[str, ...]
    settings: str
    function: int


class Behaviour(Protocol):
    """What one vehicle does, by its autopilot, its firmware and its settings.

    What it does not tell is assumed: the autopilot's own default, the strict one where they differ. Whoever asks notes
    that by VehicleFacts.assuming.
    """

    def quantity(self, which: Quantity) -> float:
        """0 if this vehicle type has no such thing."""

    def usable(self) -> VehicleProfile:
        """The same vehicle within bounds that can be predicted with: it may be set to what none can fly."""

    def switch_distance_m(self, ground_speed_m_s: float) -> float:
        """Fixed wing: how far before a waypoint the next one counts, and this one as reached."""

    def reach_m(
        self, carried: FlightRegime, ground_speed_m_s: float, acceptance_radius_m: float | None = None
    ) -> float:
        """Distance before the point at which an item counts as reached; an item's own radius where that counts."""

    def name_of(self, which: Quantity) -> str:
        """What an operator calls it."""

    @property
    def guidance_s(self) -> float:
        """Fixed wing, flown by commands: so long before a place its guidance turns onto the circle around it."""

    @property
    def steepest_glide(self) -> Setting:
        """In degrees: steeper landings of a fixed wing are refused."""

    @property
    def lowest_takeoff_m(self) -> float:
        """Above home: lower takeoffs are refused."""

    @property
    def mission_needs(self) -> MissionNeeds:
        """Without these items the vehicle takes a mission and does not fly it."""

    @property
    def refuses_far_first_waypoint(self) -> bool:
        """Beyond Quantity.FIRST_WAYPOINT_M; else it warns."""

    @property
    def too_old_for_drops(self) -> TooOld | None:
        """It refuses a mission with a gripper or winch item."""

    @property
    def no_gripper(self) -> Setting | None:
        """By which the vehicle has no gripper; None: it has one."""

    @property
    def gripper_output(self) -> GripperAssignment:
        """What moves the gripper."""

    @property
    def returns(self) -> Return:
        """Where it returns to."""

    @property
    def rally_return(self) -> RallyReturn:
        """What it does at a rally point."""

    @property
    def returns_round_fence(self) -> bool:
        """A direct return flies round the fence, instead of straight."""

    @property
    def return_margin_m(self) -> float:
        """How far that way keeps off the fence."""

    @property
    def needs_all_inclusions(self) -> bool:
        """A place must lie in all inclusions that contain home, and not in any one."""

    @property
    def fence_breach(self) -> FenceBreach:
        """At its fence."""

    @property
    def link_loss(self) -> LinkLoss:
        """Without its link."""

    @property
    def low_battery(self) -> LowBattery:
        """With its battery nearly empty."""


Capacity = Literal["max_mission_items", "max_fence_items", "max_rally_points"]


class GripperChannel(NamedTuple):
    """SERVO_OUTPUT_RAW's port and output, counted from 1."""

    port: int
    output: int


@dataclass(frozen=True, slots=True)
class Audit:
    """Which parameters are looked at before offboard control, and what they mean. `names` are asked for."""

    names: tuple[str, ...]
    entry: Callable[[str, float | int | None, bool], AuditEntry]
    """Of a name, its value (None: it did not answer), and whether somebody holds the sticks."""

    def entries(self, parameters: Mapping[str, float | int], *, sticks_held: bool) -> tuple[AuditEntry, ...]:
        """All of them. With somebody at the sticks a mode that needs them is right too."""
        return tuple(self.entry(name, parameters.get(name), sticks_held) for name in self.names)


@dataclass(frozen=True, slots=True)
class Autopilot:
    """What an autopilot brings; the same for all vehicles that it flies."""

    name: str
    mav_autopilot: int
    """MAV_AUTOPILOT of its HEARTBEAT."""
    behaviour: Callable[[VehicleProfile], Behaviour]
    """Of one vehicle."""
    defaults: Mapping[VehicleType, Mapping[str, float | int]]
    """What a vehicle that nobody set is set to: all parameters that plans are checked against."""
    also_read: tuple[str, ...]
    """Parameters that are read of a vehicle besides those."""
    return_parameters: Callable[[VehicleType], tuple[str, ...]]
    """What Behaviour.returns and .rally_return look at; without the first nothing can be said."""
    unattended: Mapping[str, float | int]
    """How to set a vehicle without sticks: without setpoints it holds, with a low battery it returns."""
    system_id_name: str
    """By which a vehicle has its MAVLink system id."""
    flight_mode: Callable[[int, VehicleType | None], FlightMode]
    """Of the number in its HEARTBEAT; the same number may mean another mode to another vehicle type."""
    mode_numbers: Callable[[FlightMode, VehicleType | None], tuple[int, int]]
    """By which a mode is commanded: DO_SET_MODE's param2 and param3."""
    arming_obstacle: Callable[[FlightMode], str]
    """What keeps a disarmed vehicle in this mode from arming, in words; empty if the mode does not."""
    setpoints: Mapping[FlightKind, Mapping[str, Cell]]
    """Which setpoint forms it takes, for each kind of vehicle."""
    setpoint_profile: Callable[[FirmwareVersion | None], FirmwareProfile]
    """Which word of that table counts."""
    audit: Audit
    """What it does by itself when setpoints stop."""
    audit_commanded: Audit
    """The same of a vehicle that is flown by commands: there is no stream to lose."""
    gripper_channel: Callable[[Mapping[str, float | int]], GripperChannel | None]
    """Where the gripper's pulses are seen; None if no output moves it, or its pulses have another meaning."""
    gripper_limits: Callable[[Mapping[str, float | int]], tuple[str, ...]]
    """What to read besides, to know what the pulses of the assigned output mean."""
    has_gripper_output: Callable[[Mapping[str, float | int], Collection[str]], bool | None]
    """Whether an output is assigned to it, by parameters and names without an answer; None: not known."""
    takes_turns: bool
    """A loiter by a number of turns."""
    takes_instance: bool
    """Looks at which gripper a mission item means."""
    executes_winch: bool
    """Moves a winch in a mission; else only an external payload does."""
    commands_winch: bool
    """The same by a command."""
    usually_stored: Mapping[Capacity, int]
    """What no message of a vehicle tells."""
    gripper_hint: str
    """What to look at when a gripper does not move."""
