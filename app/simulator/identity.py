"""Who the vehicle is: AUTOPILOT_VERSION and PROTOCOL_VERSION, with a uid that is stable per seed and system id."""

from __future__ import annotations

import hashlib

from app.simulator.dialect import Message, mavlink
from app.simulator.firmware import FirmwareProfile

CAPABILITIES = 59647
"""As recorded: MISSION_INT, COMMAND_INT, PARAM_ENCODE_BYTEWISE, SET_POSITION_TARGET_*, MAVLINK2, fence and rally."""


class Identity:
    """Fixed for the life of the vehicle; a duplicate system id still has another uid (`salt`)."""

    def __init__(self, profile: FirmwareProfile, seed: int, system_id: int, salt: str = "") -> None:
        self.profile = profile
        digest = hashlib.sha256(f"waydrop-sim {seed} {system_id} {salt}".encode()).digest()
        self.uid = int.from_bytes(digest[:8], "little") >> 1
        self._uid2 = digest[:18]

    def autopilot_version(self) -> Message:
        profile = self.profile
        git_hash = list(reversed(profile.git_hash))
        return mavlink.MAVLink_autopilot_version_message(
            CAPABILITIES,
            profile.flight_sw_version,
            profile.flight_sw_version,
            101854463,
            1,
            git_hash,
            git_hash,
            [0] * 8,
            0,
            0,
            self.uid,
            list(self._uid2),
        )

    def protocol_version(self) -> Message:
        return mavlink.MAVLink_protocol_version_message(200, 100, 203, [0] * 8, [201, 83, 124, 58, 138, 7, 30, 222])
