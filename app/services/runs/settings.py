"""Deadlines and paces of a run. Seconds of our time."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.flight.flight import DEFAULT_MAX_OFFSET_M, LOST_AFTER_S
from app.services.journal import STORED_WITHIN_S


@dataclass(frozen=True, slots=True)
class RunSettings:
    """`armable_s`: PX4 denies arming for about 4 s after boot, and longer without GNSS. `recheck_s`: after this time a
    plan is checked again before its vehicle is armed.

    `lost_after_s`: the run of a vehicle that is silent for this long ends as lost. `poll_every_s`: the interval at
    which a vehicle in flight is observed, besides facts. `stored_within_s`: see STORED_WITHIN_S.
    """

    ready_s: float = 15.0
    armable_s: float = 60.0
    arm_again_s: float = 1.0
    recheck_s: float = 30.0
    lost_after_s: float = LOST_AFTER_S
    poll_every_s: float = 0.1
    stored_within_s: float = STORED_WITHIN_S
    ack_s: float = 1.5
    gripper_s: float = 15.0
    default_max_offset_m: float = DEFAULT_MAX_OFFSET_M
