"""The faults of one vehicle: plain values, set by the control socket and read where they strike."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class LinkFaults:
    """What happens to datagrams, in both directions. Times are wall clock: a radio does not know of --speed."""

    loss: float = 0.0
    """Probability that a datagram is lost, 0..1."""
    delay_s: float = 0.0
    """One way."""
    jitter_s: float = 0.0
    """Up to this much more delay, each datagram by itself (so it also reorders)."""
    duplicate: float = 0.0
    """Probability that a datagram comes twice."""
    reorder: float = 0.0
    """Probability that a datagram is held back until after the next ones (by 50 ms)."""
    link_cut: bool = False
    """Nothing passes."""


@dataclass(slots=True)
class VehicleFaults:
    """Everything that can be wrong with one vehicle."""

    link: LinkFaults = field(default_factory=LinkFaults)
    refuse_upload: int = 0
    """Answer MISSION_COUNT with this MAV_MISSION_RESULT (0: do not)."""
    lost_acks: int = 0
    """This many final acks (MISSION_ACK, COMMAND_ACK other than in progress) are still to be dropped."""
    stuck_gripper: bool = False
    """The gripper acks by its timer, as always, but its output does not move."""
    no_gripper: bool = False
    """The gripper is not there any more: each command to it is answered FAILED, as without PD_GRIPPER_TYPE."""
    slow_gripper_s: float = 0.0
    """The output moves, and the ack comes, this much later."""
    gps_lost: bool = False
    """No position: fix type 0, no GLOBAL_POSITION_INT."""
    range_lost: bool = False
    """The range sensor that looks down gives no valid data: landing takes three times longer to detect."""
    wind_north_m_s: float = 0.0
    """Speed of the air towards north."""
    wind_east_m_s: float = 0.0
    """Speed of the air towards east."""

    def take_lost_ack(self) -> bool:
        """Whether the final ack about to be sent is lost; counts it."""
        if self.lost_acks <= 0:
            return False
        self.lost_acks -= 1
        return True
