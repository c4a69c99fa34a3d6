"""Whether MISSION_CURRENT's "complete" is about the mission.

PX4 has one such word for all modes. A Land mode that a failsafe entered says complete as it touches down, and Takeoff
mode at its altitude, with any mission stored (px4-traces 22, 25); and the word stays when the vehicle, disarmed, goes
to Hold. A mission that ends in a landing item stays in Mission mode, one that ends in a return item is in Return.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from app.domain.vehicle import FlightMode, MissionState, VehicleState

_OTHER_ENDS: Final = frozenset({FlightMode.LAND, FlightMode.TAKEOFF})


@dataclass(frozen=True, slots=True)
class CompleteSign:
    """`of_other_mode`: complete was first seen in Land or Takeoff mode, and has been said ever since."""

    said: bool = False
    of_other_mode: bool = False

    def seen(self, state: VehicleState) -> CompleteSign:
        """The sign after a look at a connected vehicle."""
        if state.mission_state is not MissionState.COMPLETE:
            return CompleteSign()
        if self.said:
            return self
        return replace(self, said=True, of_other_mode=state.mode in _OTHER_ENDS)

    def says_done(self, state: VehicleState, *, last_seq: int) -> bool:
        """Whether the mission is done by this sign."""
        return self.said and not self.of_other_mode and state.mission_seq == last_seq
