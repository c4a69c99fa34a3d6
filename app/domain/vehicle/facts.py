"""The facts that a vehicle's link reports, from its messages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from app.domain.reasons import Reason
from app.domain.vehicle.link_security import LinkSecurity
from app.domain.vehicle.state import FlightMode


@dataclass(frozen=True, slots=True)
class LinkLost:
    """No HEARTBEAT for 3 s. The last known values remain readable, with their age."""

    heartbeat_age_s: float


@dataclass(frozen=True, slots=True)
class LinkRestored:
    """HEARTBEAT is back."""


@dataclass(frozen=True, slots=True)
class IdentityKnown:
    """AUTOPILOT_VERSION answered, or the type became known: read `identity` again."""


@dataclass(frozen=True, slots=True)
class StateChanged:
    """mode, armed, landed, failsafe or vtol_state differ from before: read `state()`."""


@dataclass(frozen=True, slots=True)
class MissionCurrent:
    """MISSION_CURRENT changed (seq, total, mission_state or mission_id): read `state()`.

    `mode` is the mode when it was received (None: unknown), `mission_id` the mission that it refers to.
    """

    seq: int
    mode: FlightMode | None = None
    mission_id: int | None = None


@dataclass(frozen=True, slots=True)
class ItemReached:
    """MISSION_ITEM_REACHED, once per visit (PX4 repeats it about ten times; it may never come). `mode` as above."""

    seq: int
    mode: FlightMode | None = None


@dataclass(frozen=True, slots=True)
class GripperOutput:
    """SERVO_OUTPUT_RAW of the gripper's output changed: 2000 grab, 1000 release, 900 disarmed [us]."""

    output_us: int


class MavSeverity(StrEnum):
    """MAV_SEVERITY, from the gravest to the least."""

    EMERGENCY = "emergency"
    ALERT = "alert"
    CRITICAL = "critical"
    ERROR = "error"
    WARNING = "warning"
    NOTICE = "notice"
    INFO = "info"
    DEBUG = "debug"


@dataclass(frozen=True, slots=True)
class StatusText:
    """STATUSTEXT, chunks joined.

    The same text again within ten seconds is counted, and emitted once more with the count in `repeated`.
    `last_age_s` of such a count: how long ago the last one came.
    """

    severity: MavSeverity
    text: str
    repeated: int = 0
    last_age_s: float | None = None


@dataclass(frozen=True, slots=True)
class LinkSecured:
    """What keeps others from speaking for the vehicle is now another."""

    security: LinkSecurity


@dataclass(frozen=True, slots=True)
class Rebooted:
    """The vehicle's time since boot jumped back: its mission index is 0 again."""


@dataclass(frozen=True, slots=True)
class DuplicateSystem:
    """Two vehicles answer to this system id. Nothing may be sent to it but Hold, Return and Land."""

    reason: Reason


@dataclass(frozen=True, slots=True)
class QuarantineEnded:
    """One vehicle is left; or `actor` has decided so."""

    actor: str | None = None


@dataclass(frozen=True, slots=True)
class SentInQuarantine:
    """A quarantined vehicle is commanded this mode now: the other one may obey too."""

    mode: FlightMode


@dataclass(frozen=True, slots=True)
class ClockRateSet:
    """A simulator's speed was changed: the vehicle's clock runs `rate` times as fast as ours from now on."""

    rate: float


@dataclass(frozen=True, slots=True)
class ParametersChanged:
    """Parameters that Waydrop uses have other values now: somebody set them."""

    parameters: Mapping[str, float | int]


QuarantineChange = DuplicateSystem | QuarantineEnded | SentInQuarantine
LinkChange = LinkLost | LinkRestored | IdentityKnown | QuarantineChange | ParametersChanged
MissionFact = MissionCurrent | ItemReached | GripperOutput
LinkFact = LinkChange | MissionFact | StateChanged | StatusText | Rebooted | ClockRateSet | LinkSecured
