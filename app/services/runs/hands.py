"""Whether a run is paused because its vehicle was flown by hand, and not because somebody asked for the pause."""

from __future__ import annotations

from app.domain.flight_phase import is_of_hands
from app.domain.reason import Reason
from app.domain.vehicle import FlightMode


class HandsSign:
    """The way into offboard control asks for a pause; who leaves it to Hold asks again, and the dead-man does not.

    `reason`: the run's, by which a restart goes on with what an earlier process has recorded.
    """

    def __init__(self, reason: Reason | None) -> None:
        self._had_it = is_of_hands(reason)
        self._mode: FlightMode | None = None

    def asked(self) -> None:
        """A user asks for something now: what comes of it is as asked, also before the vehicle has obeyed."""
        self._had_it = False

    def look(self, mode: FlightMode | None) -> bool:
        """Whether the vehicle was flown by hand since anything was asked for. `mode`: at this look."""
        if mode is FlightMode.OFFBOARD and self._mode is not FlightMode.OFFBOARD:
            self._had_it = True
        elif mode not in (FlightMode.OFFBOARD, FlightMode.HOLD, None):
            self._had_it = False
        self._mode = mode
        return self._had_it
