"""Deadlines and paces of a run. Seconds of our time."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RunSettings:
    """`armable_s`: PX4 denies arming for about 4 s after boot, and longer without GNSS. `recheck_s`: after so long a
    plan is checked again before its vehicle is armed.

    `lost_after_s`: a vehicle not heard for this long ends its run as lost. `look_every_s`: how often a flight is
    looked at, besides when a fact comes in.
    """

    ready_s: float = 15.0
    armable_s: float = 60.0
    arm_again_s: float = 1.0
    recheck_s: float = 30.0
    lost_after_s: float = 900.0
    look_every_s: float = 0.1
    ack_s: float = 1.5
    gripper_s: float = 15.0
    default_max_offset_m: float = 3.0


RECORDED_VISITS = 500
"""Of a prediction: nested jumps can make more, and every one of them is stored."""

UNFINISHED_DROPS_S = 5.0
"""After a landing: how long a release that is still in flight may take to be answered."""

SLOWEST_HEARTBEAT_S = 3.0
"""After a start: how long a HEARTBEAT that says armed may take, with some of them lost."""

LAST_REPORTS_S = 2.5
"""After a landing: how long the report that the mission is done may take. MISSION_CURRENT comes at 1 Hz."""
