"""Quarantine: two vehicles seem to answer to one system id. Nothing is sent but what makes both stop or come down."""

from __future__ import annotations

from typing import Final

from app.domain.autopilot import autopilot
from app.domain.errors import ConflictError, VehicleQuarantinedError
from app.domain.mission import MavCmd
from app.domain.offboard.tasks.commanded import CIRCLE_HERE
from app.domain.reasons import Reason
from app.domain.vehicle.facts import DuplicateSystem, QuarantineEnded, SentInQuarantine
from app.domain.vehicle.state import FlightMode
from app.vehicles.decoders import Heartbeat
from app.vehicles.encoders import CommandLong, Outgoing
from app.vehicles.fact_stream import FactStream
from app.vehicles.modes import mode_numbers

_ALWAYS_SENT: Final = (FlightMode.HOLD, FlightMode.RETURN, FlightMode.LAND)
_QUESTIONS: Final = (int(MavCmd.REQUEST_MESSAGE),)


class Quarantine:
    """That of one link. It ends when the vehicle was heard for `ends_after_s` without a sign of a second one."""

    def __init__(self, facts: FactStream, system_id: int, ends_after_s: float) -> None:
        self._facts = facts
        self._system_id = system_id
        self._ends_after_s = ends_after_s
        self._sign_s = 0.0

    @property
    def is_on(self) -> bool:
        """Whether the vehicle is quarantined."""
        return self._facts.duplicate is not None

    def begin(self, reason: Reason, now_s: float) -> None:
        """Two vehicles answer to this system id, now."""
        self._sign_s = now_s
        self._facts.emit(DuplicateSystem(reason))

    def doubt(self, now_s: float) -> None:
        """A sign of a second vehicle, too weak to begin a quarantine: one that is on goes on."""
        self._sign_s = now_s

    def tick(self, now_s: float, *, connected: bool) -> None:
        """Look whether it is over."""
        if not connected:
            self._sign_s = now_s
        elif self.is_on and now_s - self._sign_s >= self._ends_after_s:
            self._facts.emit(QuarantineEnded())

    def end(self, actor: str) -> None:
        """By a user's decision. Raises ConflictError if the vehicle is not quarantined."""
        if not self.is_on:
            raise ConflictError(f"the vehicle with system id {self._system_id} is not quarantined")
        self._facts.emit(QuarantineEnded(actor))

    def warn(self, mode: FlightMode) -> None:
        """This mode is commanded now: in quarantine, two vehicles may obey."""
        if self.is_on:
            self._facts.emit(SentInQuarantine(mode))

    def check(self, message: Outgoing, beat: Heartbeat | None) -> None:
        """Raises VehicleQuarantinedError for what may not be sent now."""
        if self.is_on and not _is_always_sent(message, beat):
            self.refuse()

    def refuse(self) -> None:
        """Raises VehicleQuarantinedError if the vehicle is quarantined."""
        if self.is_on:
            raise VehicleQuarantinedError(
                f"two vehicles have the system id {self._system_id}",
                hint=f"give each vehicle its own {autopilot().system_id_name}. The quarantine ends when one of them is "
                f"silent for {self._ends_after_s:g} s, or an admin ends it; hold, return and land are always sent",
            )


def _is_always_sent(message: Outgoing, beat: Heartbeat | None) -> bool:
    if not isinstance(message, CommandLong):
        return False
    if message.command == MavCmd.DO_SET_MODE:
        return message.params[1:3] in {mode_numbers(mode, beat) for mode in _ALWAYS_SENT}
    if message.command == CIRCLE_HERE.command:  # the last word of Hold to a wing
        return repr(message.params) == repr(CIRCLE_HERE.params)
    return message.command in _QUESTIONS
