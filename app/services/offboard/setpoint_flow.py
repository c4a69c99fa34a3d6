"""Flying by setpoints: one slot, never a queue; what a tick sends of it, and when the client counts as gone."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from app.domain.offboard.state import OffboardState
from app.domain.reason import Reason, ReasonCode, because
from app.domain.setpoint.dead_man import Silence, can_stand
from app.domain.setpoint.encode import Follower, encode
from app.domain.setpoint.forms import ZERO_VELOCITY, Setpoint
from app.domain.setpoint.limiter import Clamp, limit
from app.domain.setpoint.message import SetpointMessage
from app.domain.vehicle import FlightMode, VehicleState
from app.services.offboard.cadence import Cadence
from app.services.offboard.settings import OffboardSettings
from app.services.offboard.surroundings import Surroundings
from app.services.offboard_view import CadenceView, SentView

Author = Literal["client", "dead_man", "task"]


@dataclass(frozen=True, slots=True)
class Slotted:
    """A setpoint that may be sent, and since when (monotonic)."""

    setpoint: Setpoint
    message: SetpointMessage
    clamps: tuple[Clamp, ...]
    at_s: float
    by: Author


class SetpointFlow:
    """One vehicle's stream with its limits and its dead-man. `send` may raise LinkError."""

    def __init__(self, settings: OffboardSettings, send: Callable[[SetpointMessage], None]) -> None:
        self._settings = settings
        self._send = send
        self._spoke_s = 0.0
        self._left = asyncio.Event()
        self.start(settings.rate_hz)

    def start(self, rate_hz: float) -> None:
        """A new stream, of which nothing was sent yet."""
        self._cadence = Cadence(rate_hz)
        self._slot: Slotted | None = None
        self._newest: Slotted | None = None
        self._newest_s = 0.0

    def clear(self) -> None:
        """Nothing of what was put is to be sent."""
        self._slot = None

    def count_from(self, now_s: float) -> None:
        """The silence of the client counts from here, unless it has spoken later."""
        self._spoke_s = max(self._spoke_s, now_s)

    async def streamed(self, seconds: float) -> None:
        """Return when so much of the stream has been sent."""
        cadence = self._cadence
        enough = cadence.sends + round(seconds * cadence.wanted_hz)
        while cadence.sends < enough:
            self._left.clear()
            await self._left.wait()

    def put(
        self, setpoint: Setpoint, surroundings: Surroundings, state: VehicleState, now_s: float, by: Author
    ) -> tuple[Clamp, ...]:
        """The newest setpoint, within the limits. Raises SetpointRefusedError: the one before stays to its age."""
        follower = surroundings.follower(state)
        message = encode(setpoint, follower)  # refused by the table before any limit is looked at
        limited = limit(setpoint, self._settings.limits, surroundings.whereabouts(state))
        if limited.setpoint != setpoint:
            message = encode(limited.setpoint, follower)
        self._slot = Slotted(limited.setpoint, message, limited.clamps, now_s, by)
        self._spoke_s = now_s
        return limited.clamps

    def tick(
        self, phase: OffboardState, surroundings: Surroundings, state: VehicleState, now_s: float
    ) -> Reason | None:
        """Send at most one message. Why nothing more may be sent, in words; under control the silence counts.

        Raises:
            LinkError; SetpointRefusedError: the client is silent, and this vehicle follows no velocity of zero.
        """
        follower = surroundings.follower(state)
        if phase is OffboardState.LEAVING:  # until the other mode is seen
            if state.mode is FlightMode.OFFBOARD and (self._is_fresh(now_s) or can_stand(follower.kind)):
                self._out(follower, now_s)
            return None
        silent_s = now_s - self._spoke_s if phase is OffboardState.ACTIVE else 0.0
        silence = self._settings.dead_man.judge(silent_s, follower.kind, has_estimate=follower.has_estimate)
        if silence is Silence.GONE:
            return because(ReasonCode.OFFBOARD_CLIENT_SILENT, silent_s=silent_s)
        self._out(follower, now_s)
        return None

    def views(self, now_s: float) -> tuple[SentView | None, CadenceView]:
        """The newest message that left, and how steadily they leave."""
        if self._newest is None:
            return None, self._cadence.view()
        slotted = self._newest
        sent = SentView(
            by=slotted.by,
            setpoint=slotted.setpoint.model_dump(mode="json"),
            message=slotted.message.name,
            type_mask=int(slotted.message.type_mask),
            age_s=round(now_s - self._newest_s, 3),
            clamped=[clamp.code for clamp in slotted.clamps],
        )
        return sent, self._cadence.view()

    def _is_fresh(self, now_s: float) -> bool:
        return self._slot is not None and now_s - self._slot.at_s <= self._settings.dead_man.max_age_s

    def _out(self, follower: Follower, now_s: float) -> None:
        """The slot's setpoint, or a velocity of zero: a wing does not follow that, which ends the lease."""
        slotted = self._slot if self._is_fresh(now_s) else None
        slotted = slotted or Slotted(ZERO_VELOCITY, encode(ZERO_VELOCITY, follower), (), now_s, "dead_man")
        self._send(slotted.message)
        self._cadence.sent(now_s)
        self._newest, self._newest_s = slotted, now_s
        self._left.set()
