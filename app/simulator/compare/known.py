"""Where the simulator is known to differ from the recordings, each with its reason. Nothing else may differ."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fnmatch import fnmatch


@dataclass(frozen=True, slots=True)
class Known:
    """`scenario` and `aspect` are shell patterns, `what` a regular expression found in the difference's text."""

    scenario: str
    aspect: str
    what: str
    reason: str

    def covers(self, scenario: str, aspect: str, what: str) -> bool:
        """Whether this difference is the known one."""
        return (
            fnmatch(scenario, self.scenario) and fnmatch(aspect, self.aspect) and re.search(self.what, what) is not None
        )


KNOWN: tuple[Known, ...] = ()

_OFFBOARD = "offboard flight is not simulated: Waydrop never commands it"
NOT_REPLAYED: dict[str, str] = {
    "18_offboard_quad": _OFFBOARD,
    "18b_offboard_loss_x4": _OFFBOARD,
    "19_offboard_global_attitude": _OFFBOARD,
    "20_offboard_plane": _OFFBOARD,
    "20b_offboard_plane_path": _OFFBOARD,
    "21_offboard_rover": _OFFBOARD,
}
"""Scenarios that make no sense here, and why."""
