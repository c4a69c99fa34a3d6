"""The port to vehicles: one link for each vehicle. vehicles/ implements it; tests run one contract suite against it."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from app.domain.mission import Mission, MissionItem, MissionType
from app.domain.offboard.messages import SetpointMessage
from app.domain.vehicle.commands import CommandAck, CommandRequest
from app.domain.vehicle.facts import LinkFact
from app.domain.vehicle.link_security import Refused, Relayed
from app.domain.vehicle.state import (
    AutopilotKind,
    FirmwareVersion,
    VehicleProfile,
    VehicleState,
    VehicleType,
)


@dataclass(frozen=True, slots=True)
class UploadProgress:
    """One step of an upload. `sent` of `total` items of this list; `attempt` starts at 1.

    The last one of a good upload has `verified_by` set: "mission_id" (the ids agree) or "read_back" (every item
    compared), and `mission_id` where the firmware gives one.
    """

    mission_type: MissionType
    sent: int
    total: int
    attempt: int
    verified_by: str | None = None
    mission_id: int | None = None


class MissionLink(Protocol):
    """Every method may raise LinkError."""

    def mission_id_of(self, mission: Mission) -> int:
        """The id by which PX4 will name this mission (MISSION_CURRENT.mission_id), where its firmware names any."""

    def fence_id_of(self, mission: Mission) -> int:
        """The same for its geofence (MISSION_CURRENT.fence_id)."""

    def rally_points_id_of(self, mission: Mission) -> int:
        """The same for its rally points (MISSION_CURRENT.rally_points_id)."""

    def upload(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        """Upload fence, rally, then mission, and verify. Closing the generator cancels the transfer.

        Raises:
            UploadRefusedError: the vehicle keeps the previous list; `extra["item_seq"]` names the refused item where
                known.
            UploadError: it did not end verified.
        """

    def replace_mission(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        """Upload and verify only the mission, over the one that is flown; fence and rally points do not change.

        A vehicle in Mission mode flies the new mission, from its first item, once its last item has arrived; until then
        the old one. Closing the generator cancels the transfer. Nothing is sent before the first step. After an
        UploadError only mission_id shows which of the two it flies.
        """

    async def download(self, mission_type: MissionType) -> tuple[MissionItem, ...]:
        """Read a list back from the vehicle."""

    async def wait_mission_ready(self, *, mission_id: int | None, rerun: bool, timeout_s: float) -> None:
        """Return when the uploaded mission may be started (mission_state and mission_id fit, 50 ms passed).

        Raises:
            VehicleRefusedError: the vehicle found the mission infeasible; its texts are in `extra["texts"]`. Or it goes
                on naming another mission, which another client uploaded.
        """

    async def set_current(self, seq: int) -> None:
        """Make `seq` the current item (command 224, else MISSION_SET_CURRENT) and wait until that is accepted."""


class OffboardLink(Protocol):
    """Every method may raise LinkError."""

    async def enter_offboard(self) -> None:
        """Enter OFFBOARD mode, confirmed by the HEARTBEAT. Setpoints must be streamed before and after."""

    def send_setpoint(self, message: SetpointMessage) -> None:
        """Send one setpoint, once, now. Never blocks; nothing repeats it."""

    async def read_parameters(self, names: Sequence[str]) -> Mapping[str, float | int]:
        """These parameters as they are now, not from a cache; one that does not answer is left out."""


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


class VehicleLink(MissionLink, OffboardLink, Protocol):
    """One vehicle on the wire. Every method may raise LinkTimeoutError or VehicleRefusedError.

    Listeners are called on the event loop, in order of arrival, and must not block.
    """

    @property
    def identity(self) -> VehicleIdentity:
        """The identity, as far as known."""

    def state(self) -> VehicleState:
        """The newest measurements, ages computed now. Cheap."""

    def ground_station_age_s(self, system_id: int) -> float | None:
        """How long ago the HEARTBEAT of the ground station with this system id came over this link (a vehicle or
        router forwards it); None: never.
        """

    def subscribe(self, listener: Callable[[LinkFact], None]) -> Unsubscribe:
        """Call `listener` for each fact from now on. The returned function ends it; calling it twice is fine."""

    def end_quarantine(self, actor: str) -> None:
        """A user has decided that one vehicle is left. A new sign of a second one begins it again.

        Raises ConflictError: it is not quarantined.
        """

    def set_clock_rate(self, rate: float) -> None:
        """The speed of a simulator is changed: `state().clock` is measured again, and listeners receive
        ClockRateSet.
        """

    async def read_facts(self, *, fresh: bool = False) -> VehicleProfile:
        """Version, home and the parameters that rules need; unknown ones are absent.

        Parameters are updated when the vehicle announces changes. Others are read again if `fresh`, or if older than 30
        s; if that takes more than a second (3 s if `fresh`), `parameters_age_s` is their age.
        """

    async def arm(self, leaves: Callable[[], None] = lambda: None) -> None:
        """Arm: sent once, right after a HEARTBEAT that reports disarmed and Hold. `leaves` is called when it is sent.

        Raises:
            VehicleRefusedError: the vehicle's checks fail; `extra["texts"]` has its reasons.
            VehicleTakenError: it is armed, or in another mode. CommandExpiredError: no HEARTBEAT arrived in time, or
            the process stood still after it. In these cases nothing was sent.
            LinkTimeoutError: no acknowledgement: it may be armed now.
        """

    async def wait_armed(self) -> None:
        """Wait for a HEARTBEAT that arrives from now on and reports armed: after an older one, somebody may have
        disarmed the vehicle.

        Raises VehicleTakenError: it reports disarmed. LinkTimeoutError: no HEARTBEAT arrived in time.
        """

    async def disarm(self) -> None:
        """Disarm, confirmed by the HEARTBEAT; refused in flight."""

    async def start_mission(self) -> None:
        """Switch to Mission mode and see it in the HEARTBEAT. Also resumes."""

    async def hold(self) -> None:
        """Enter Hold mode (AUTO.LOITER), confirmed by the HEARTBEAT."""

    async def hold_disarmed(self) -> None:
        """As `hold`, for a disarmed vehicle: commanded only right after a HEARTBEAT that reports disarmed.

        Raises VehicleTakenError: it is armed; nothing was sent.
        """

    async def return_to_launch(self) -> None:
        """Enter Return mode, confirmed by the HEARTBEAT. From OFFBOARD through Hold; otherwise PX4 would go back to
        OFFBOARD when it disarms, and then not arm.
        """

    async def land(self) -> None:
        """Land mode, seen in the HEARTBEAT; out of OFFBOARD as `return_to_launch`."""

    def command(self, request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
        """Send a command and yield each acknowledgement; the last one is final.

        Raises:
            CommandExpiredError: `send_before_s` had passed; nothing was sent.
            LinkTimeoutError: no final acknowledgement before the deadline. It is unknown what the vehicle did.
        """


class LinkSource(Protocol):
    """Finds vehicles on its connections. Listeners are called on the event loop."""

    def links(self) -> Sequence[VehicleLink]:
        """All vehicles that have connected."""

    def subscribe(self, listener: Callable[[VehicleLink], None]) -> Unsubscribe:
        """Call `listener` for each vehicle found from now on."""

    async def start(self) -> None:
        """Open all connections. Raises LinkError naming the connection that cannot be opened."""

    async def close(self) -> None:
        """Cancel transfers, end callbacks, destroy the instances. Idempotent."""


class LinkGuards(Protocol):
    """What stands between the network and the links of all vehicles: see docs/explanation/security.md."""

    def refused(self) -> Sequence[Refused]:
        """What the guards of all connections refused since they were opened, by connection and reason."""

    def relayed(self) -> Sequence[Relayed]:
        """How many frames they let pass."""

    async def set_up_signing(self, system_id: int, connection: str) -> str:
        """Send a vehicle its newest signing key, unencrypted and on this connection alone, and wait until it signs with
        it. Returns the key's fingerprint.

        Raises:
            NotFoundError: the vehicle is silent there, or has no key. ConflictError: it already uses its newest key, or
            the connection is open. LinkTimeoutError: it continues as before.
        """
