"""How long to wait and how often to ask on a vehicle's link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

OWN_SYSTEM_ID: Final = 245
"""Waydrop's own MAVLink system id, unless a setting gives another."""


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """Times in seconds, rates in Hz. The defaults suit a radio of a few kB/s as well as loopback.

    `own_system_id`: Waydrop's own MAVLink system id, as a ground station.
    `link_lost_s`: silence of HEARTBEAT after which the link counts as lost.
    `transfer_silence_s`: a mission transfer without a word from the vehicle for so long is given up; mavsdk itself
    gives up after 2.5 s of silence, PX4 after 5 s.
    `mission_state_stale_s`: for so long after an upload MISSION_CURRENT may still show the old state (0.9 s seen).
    `executed_after_s`: so much later, on the vehicle's clock, a mission uploaded in flight that still shows as active
    is being flown; PX4 has shown an infeasible one by then.
    `other_mission_s`: a vehicle that goes on naming another complete mission for so long got it from another client.
    `quarantine_s`: a quarantine ends when the vehicle was heard for so long without a sign of a second one.
    """

    own_system_id: int = OWN_SYSTEM_ID
    position_rate_hz: float = 10.0
    slow_rate_hz: float = 5.0
    link_lost_s: float = 3.0
    command_timeout_s: float = 1.0
    command_attempts: int = 3
    mode_seen_timeout_s: float = 3.5
    mode_again_s: float = 1.5
    identity_retry_s: float = 1.0
    identity_recheck_s: float = 30.0
    parameter_timeout_s: float = 0.5
    parameter_attempts: int = 6
    upload_attempts: int = 6
    upload_backoff_s: float = 0.5
    transfer_silence_s: float = 6.0
    progress_period_s: float = 0.05
    mission_state_stale_s: float = 2.5
    executed_after_s: float = 1.0
    other_mission_s: float = 3.0
    mission_ready_after_ack_s: float = 0.05
    quarantine_s: float = 30.0
    refusal_text_window_s: float = 0.3
    close_timeout_s: float = 0.7
    mailbox_capacity: int = 512
