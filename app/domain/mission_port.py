"""The part of the vehicle's port that carries missions."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from dataclasses import dataclass
from typing import Protocol

from app.domain.mission import Mission, MissionItem, MissionType


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

    def rally_points_id_of(self, mission: Mission) -> int:
        """The same for its rally points (MISSION_CURRENT.rally_points_id)."""

    def upload(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        """Upload fence, rally, then mission, and verify. Closing the generator cancels the transfer.

        Raises:
            UploadError: it did not end verified; `extra["item_seq"]` names the refused item where known.
        """

    def replace_mission(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        """Upload and verify the mission alone, over the one that is flown; fence and rally points stay.

        A vehicle in Mission mode flies the new one, from its first item, as soon as its last item has come; until then
        the old one. Closing the generator cancels the transfer. UploadError: which of the two it flies is told by
        mission_id alone.
        """

    async def download(self, mission_type: MissionType) -> tuple[MissionItem, ...]:
        """Read a list back from the vehicle."""

    async def wait_mission_ready(self, *, mission_id: int | None, rerun: bool, timeout_s: float) -> None:
        """Return when the uploaded mission may be started (mission_state and mission_id fit, 50 ms passed).

        Raises:
            VehicleRefusedError: the vehicle found the mission infeasible; its texts are in `extra["texts"]`.
        """

    async def set_current(self, seq: int) -> None:
        """Make `seq` the current item (command 224, else MISSION_SET_CURRENT) and wait until that is accepted."""
