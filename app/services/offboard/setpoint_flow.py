"""Flying by setpoints: what may go into the slot, what a tick sends of it, and when the client counts as gone."""

from __future__ import annotations

from collections.abc import Callable

from app.domain.offboard.state import SENDING, OffboardState
from app.domain.setpoint.dead_man import Silence, can_stand
from app.domain.setpoint.encode import encode
from app.domain.setpoint.forms import Setpoint
from app.domain.setpoint.limiter import Clamp, limit
from app.domain.setpoint.message import SetpointMessage
from app.domain.vehicle import FlightMode, VehicleState
from app.services.offboard.settings import OffboardSettings
from app.services.offboard.stream import Author, SetpointStream, Slotted
from app.services.offboard.surroundings import Surroundings
from app.services.offboard_view import CadenceView, SentView


class SetpointFlow:
    """One vehicle's stream with its limits and its dead-man. `send` may raise LinkError."""

    def __init__(self, settings: OffboardSettings, send: Callable[[SetpointMessage], None]) -> None:
        self._settings = settings
        self._send = send
        self._stream = SetpointStream(send, settings.dead_man.max_age_s, settings.rate_hz)
        self._spoke_s = 0.0

    def start(self, rate_hz: float) -> None:
        """A new stream, of which nothing was sent yet."""
        self._stream = SetpointStream(self._send, self._settings.dead_man.max_age_s, rate_hz)

    def clear(self) -> None:
        """Nothing of what was put is to be sent."""
        self._stream.clear()

    def count_from(self, now_s: float) -> None:
        """The silence of the client counts from here, unless it has spoken later."""
        self._spoke_s = max(self._spoke_s, now_s)

    async def streamed(self, seconds: float) -> None:
        """Return when so much of the stream has been sent."""
        await self._stream.until_sent(round(seconds * self._stream.cadence.wanted_hz))

    def put(
        self, setpoint: Setpoint, surroundings: Surroundings, state: VehicleState, now_s: float, by: Author
    ) -> tuple[Clamp, ...]:
        """The newest setpoint, within the limits. Raises SetpointRefusedError: the one before stays to its age."""
        follower = surroundings.follower(state)
        encode(setpoint, follower)  # refused by the table before any limit is looked at
        limited = limit(setpoint, self._settings.limits, surroundings.whereabouts(state))
        self._stream.put(Slotted(limited.setpoint, encode(limited.setpoint, follower), limited.clamps, now_s, by))
        self._spoke_s = now_s
        return limited.clamps

    def tick(self, phase: OffboardState, surroundings: Surroundings, state: VehicleState, now_s: float) -> str:
        """Send at most one message. Why nothing more may be sent, in words; under control the silence counts.

        Raises:
            LinkError; SetpointRefusedError: the client is silent, and this vehicle follows no velocity of zero.
        """
        if phase not in SENDING:
            return ""
        follower = surroundings.follower(state)
        if phase is OffboardState.LEAVING:  # until the other mode is seen
            if state.mode is FlightMode.OFFBOARD and not self._stream.send_fresh(now_s) and can_stand(follower.kind):
                self._stream.send_zero(follower, now_s)
            return ""
        silent_s = now_s - self._spoke_s if phase is OffboardState.ACTIVE else 0.0
        silence = self._settings.dead_man.judge(silent_s, follower.kind, has_estimate=follower.has_estimate)
        if silence is Silence.GONE:
            return f"the client was silent for {silent_s:.1f} s"
        if not self._stream.send_fresh(now_s):
            self._stream.send_zero(follower, now_s)  # a wing does not follow it: that is refused and ends the lease
        return ""

    def views(self, now_s: float) -> tuple[SentView | None, CadenceView]:
        """The newest message that left, and how steadily they leave."""
        return self._stream.sent_view(now_s), self._stream.cadence.view()
