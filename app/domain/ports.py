"""Ports: what services need of the world. vehicles/ and storage/ implement them; tests run one suite per port."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from app.domain.commands import CommandAck, CommandRequest
from app.domain.events import Event, NewEvent
from app.domain.jobs.port import JobRecord
from app.domain.mission_port import MissionLink
from app.domain.offboard.port import OffboardLink
from app.domain.reason import Reason
from app.domain.run import Run
from app.domain.run_filter import RunFilter
from app.domain.vehicle import AutopilotKind, FirmwareVersion, FlightMode, VehicleFacts, VehicleState, VehicleType

Unsubscribe = Callable[[], None]


@dataclass(frozen=True, slots=True)
class VehicleIdentity:
    """Who a vehicle is. `uid` is AUTOPILOT_VERSION's uid2 (or uid) as hex; None until it answered."""

    system_id: int
    connection: str
    vehicle_type: VehicleType | None = None
    firmware: FirmwareVersion | None = None
    uid: str | None = None
    autopilot: AutopilotKind = AutopilotKind.PX4


@dataclass(frozen=True, slots=True)
class LinkLost:
    """No HEARTBEAT for 3 s. What was last known stays readable, with its age."""

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

    `mode` is the vehicle's when this came (None: not known), `mission_id` the mission that it is about.
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


@dataclass(frozen=True, slots=True)
class StatusText:
    """STATUSTEXT, chunks joined. `severity` is the MAV_SEVERITY word in lower case."""

    severity: str
    text: str


@dataclass(frozen=True, slots=True)
class Rebooted:
    """The vehicle's time since boot jumped back: its mission index is 0 again."""


@dataclass(frozen=True, slots=True)
class DuplicateSystem:
    """Two vehicles answer to this system id. Nothing may be sent to it."""

    reason: Reason


@dataclass(frozen=True, slots=True)
class ClockRateTold:
    """A simulator's speed was changed: the vehicle's clock runs `rate` times as fast as ours from now on."""

    rate: float


@dataclass(frozen=True, slots=True)
class ParametersChanged:
    """Parameters that Waydrop uses have other values now: somebody set them."""

    parameters: Mapping[str, float | int]


LinkChange = LinkLost | LinkRestored | IdentityKnown | DuplicateSystem | ParametersChanged
MissionFact = MissionCurrent | ItemReached | GripperOutput
LinkFact = LinkChange | MissionFact | StateChanged | StatusText | Rebooted | ClockRateTold


class VehicleLink(MissionLink, OffboardLink, Protocol):
    """One vehicle on the wire. Every method may raise LinkTimeoutError or VehicleRefusedError.

    Listeners are called on the event loop, in order of arrival, and must not block.
    """

    @property
    def identity(self) -> VehicleIdentity:
        """Who it is, as far as known."""

    def state(self) -> VehicleState:
        """The newest measurements, ages computed now. Cheap."""

    def subscribe(self, listener: Callable[[LinkFact], None]) -> Unsubscribe:
        """Call `listener` for each fact from now on. The returned function ends it; calling it twice is fine."""

    def tell_clock_rate(self, rate: float) -> None:
        """A simulator's speed is changed: `state().clock` is measured anew, and listeners hear ClockRateTold."""

    async def read_facts(self, *, fresh: bool = False) -> VehicleFacts:
        """Version, home and the parameters that rules need; unknown ones are absent.

        Parameters are followed as the vehicle tells of changes. What it does not tell of is read again if `fresh`, or
        older than 30 s; if that takes more than a second (3 s if `fresh`), `parameters_age_s` says how old they are.
        """

    async def arm(self, leaves: Callable[[], None] = lambda: None) -> None:
        """Arm: sent once, right after a HEARTBEAT that says disarmed and Hold. `leaves` is called as it is sent.

        Raises:
            VehicleRefusedError: the vehicle's checks fail; `extra["texts"]` has its reasons.
            VehicleTakenError: it is armed, or in another mode; CommandExpiredError: no HEARTBEAT came in time. Nothing
                was sent.
            LinkTimeoutError: no ack: it may be armed now.
        """

    async def disarm(self) -> None:
        """Disarm; refused in flight."""

    async def start_mission(self) -> None:
        """Switch to Mission mode and see it in the HEARTBEAT. Also resumes."""

    async def hold(self) -> None:
        """Hold mode (AUTO.LOITER), seen in the HEARTBEAT."""

    async def hold_disarmed(self) -> None:
        """As `hold`, for a vehicle that stands disarmed: commanded only right after a HEARTBEAT that says so.

        Raises VehicleTakenError: it is armed; nothing was sent.
        """

    async def return_to_launch(self) -> None:
        """Return mode, seen in the HEARTBEAT. Out of OFFBOARD through Hold, or PX4 would go back to OFFBOARD when it
        disarms, and not arm again.
        """

    async def land(self) -> None:
        """Land mode, seen in the HEARTBEAT; out of OFFBOARD as `return_to_launch`."""

    def command(self, request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
        """Send a command and yield each ack to us; the last one is final.

        Raises:
            CommandExpiredError: `send_before_s` was over; nothing was sent.
            LinkTimeoutError: no final ack before the deadline. What the vehicle did is then not known.
        """


class LinkSource(Protocol):
    """Finds vehicles on its connections. Listeners are called on the event loop."""

    def links(self) -> Sequence[VehicleLink]:
        """All vehicles seen so far."""

    def subscribe(self, listener: Callable[[VehicleLink], None]) -> Unsubscribe:
        """Call `listener` for each vehicle found from now on."""

    async def start(self) -> None:
        """Open all connections. Raises LinkError naming the connection that cannot be opened."""

    async def close(self) -> None:
        """Cancel transfers, end callbacks, destroy the instances. Idempotent."""


class EventStore(Protocol):
    """The journal on disk. One writer."""

    async def append(
        self,
        events: Sequence[NewEvent],
        runs: Sequence[Run] = (),
        plans: Sequence[StoredPlan] = (),
        jobs: Sequence[JobRecord] = (),
    ) -> Sequence[Event]:
        """Number and store events, the runs and jobs they changed, the plans they announce. Raises StorageError."""

    async def read(self, *, after: int, limit: int, run_id: str | None = None) -> Sequence[Event]:
        """Events with seq > after, in order, at most `limit`."""

    async def last_seq(self) -> int:
        """The highest seq stored; 0 if none."""

    async def last_by_hand(self) -> Sequence[Event]:
        """The newest offboard.lease, offboard.changed and tasks.changed of each vehicle, in order."""


class RunStore(Protocol):
    """Runs as last stored."""

    async def get(self, run_id: str) -> Run | None:
        """One run."""

    async def list_runs(self, wanted: RunFilter, *, limit: int) -> Sequence[Run]:
        """Newest first."""


@dataclass(frozen=True, slots=True)
class StoredPlan:
    """A plan as accepted. `document` is the normalised JSON; `hash` its sha256."""

    id: str
    hash: str
    name: str
    vehicle_type: VehicleType
    created_at: float
    created_by: str
    document: dict[str, Any]


class PlanStore(Protocol):
    """Accepted plans; never changed after they are stored (with their event: EventStore.append)."""

    async def get(self, plan_id: str) -> StoredPlan | None:
        """One plan."""

    async def list_plans(self, *, limit: int) -> Sequence[StoredPlan]:
        """Newest first."""


@dataclass(frozen=True, slots=True)
class StoredToken:
    """A bearer token: only its sha256 is kept."""

    id: str
    name: str
    role: str
    token_hash: str
    created_at: float
    revoked_at: float | None = None


class TokenStore(Protocol):
    """Bearer tokens."""

    async def add(self, token: StoredToken) -> None:
        """Store a new token."""

    async def find_by_hash(self, token_hash: str) -> StoredToken | None:
        """The live token with this hash; None if unknown or revoked."""

    async def list_tokens(self) -> Sequence[StoredToken]:
        """All, revoked ones too."""

    async def revoke(self, token_id: str, *, now: float) -> bool:
        """Revoke; False if there is no such live token."""


@dataclass(frozen=True, slots=True)
class StoredAnswer:
    """The answer to a request with an Idempotency-Key, replayed for the same key and the same request."""

    key: str
    request_hash: str
    status: int
    headers: dict[str, str]
    body: bytes


class AnswerStore(Protocol):
    """Answers by Idempotency-Key; old ones are dropped after a day."""

    async def get(self, key: str) -> StoredAnswer | None:
        """The stored answer."""

    async def put(self, answer: StoredAnswer, *, now: float) -> None:
        """Store an answer."""
