"""Whether a run is paused because its vehicle was flown by hand, and not because somebody asked for the pause."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.vehicle import FlightMode


@dataclass(frozen=True, slots=True)
class HandsSign:
    """The way into offboard control asks for a pause; who leaves it to Hold asks again, and the dead-man does not.

    `had_it`: the vehicle was flown by hand since anything was asked for. `mode` is that of the last look.
    """

    had_it: bool = False
    mode: FlightMode | None = None

    def asked(self) -> HandsSign:
        """A user asks for something now: what comes of it is as asked, also before the vehicle has obeyed."""
        return HandsSign(False, self.mode)

    def seen(self, mode: FlightMode | None) -> HandsSign:
        """After a look at a connected vehicle."""
        had_it = self.had_it
        if mode is FlightMode.OFFBOARD and self.mode is not FlightMode.OFFBOARD:
            had_it = True
        elif mode not in (FlightMode.OFFBOARD, FlightMode.HOLD, None):
            had_it = False
        return HandsSign(had_it, mode)
