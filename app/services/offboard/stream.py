"""What leaves for one vehicle: a slot that is overwritten and never queued, and the newest thing sent."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from app.domain.setpoint.encode import Follower, encode
from app.domain.setpoint.forms import ZERO_VELOCITY, Setpoint
from app.domain.setpoint.limiter import Clamp
from app.domain.setpoint.message import SetpointMessage
from app.services.offboard.cadence import Cadence
from app.services.offboard_view import SentView

Author = Literal["client", "dead_man", "task"]


@dataclass(frozen=True, slots=True)
class Slotted:
    """A setpoint that may be sent, and since when (monotonic)."""

    setpoint: Setpoint
    message: SetpointMessage
    clamps: tuple[Clamp, ...]
    at_s: float
    by: Author = "client"


class SetpointStream:
    """Sends at most one message a call. `send` may raise LinkError."""

    def __init__(self, send: Callable[[SetpointMessage], None], max_age_s: float, rate_hz: float) -> None:
        self._send = send
        self._max_age_s = max_age_s
        self._slot: Slotted | None = None
        self._newest: Slotted | None = None
        self._newest_s = 0.0
        self._left = asyncio.Event()
        self.cadence = Cadence(rate_hz)

    def put(self, slotted: Slotted) -> None:
        """The newest setpoint; the one before it is gone."""
        self._slot = slotted

    def clear(self) -> None:
        """Nothing is to be sent."""
        self._slot = None

    def age_s(self, now_s: float) -> float | None:
        """How old the slot's setpoint is."""
        return None if self._slot is None else now_s - self._slot.at_s

    def send_fresh(self, now_s: float) -> bool:
        """Send the slot's setpoint unless it is too old or missing. Raises LinkError."""
        if self._slot is None or now_s - self._slot.at_s > self._max_age_s:
            return False
        self._out(self._slot, now_s)
        return True

    def send_zero(self, follower: Follower, now_s: float) -> None:
        """Send a velocity of zero. Raises LinkError, SetpointRefusedError where the vehicle does not follow it."""
        self._out(Slotted(ZERO_VELOCITY, encode(ZERO_VELOCITY, follower), (), now_s, "dead_man"), now_s)

    async def until_sent(self, count: int) -> None:
        """Return when `count` more messages have left."""
        enough = self.cadence.sends + count
        while self.cadence.sends < enough:
            self._left.clear()
            await self._left.wait()

    def sent_view(self, now_s: float) -> SentView | None:
        """The newest message that left."""
        if self._newest is None:
            return None
        slotted = self._newest
        return SentView(
            by=slotted.by,
            setpoint=slotted.setpoint.model_dump(mode="json"),
            message=slotted.message.name,
            type_mask=int(slotted.message.type_mask),
            age_s=round(now_s - self._newest_s, 3),
            clamped=[clamp.code for clamp in slotted.clamps],
        )

    def _out(self, slotted: Slotted, now_s: float) -> None:
        self._send(slotted.message)
        self.cadence.sent(now_s)
        self._newest, self._newest_s = slotted, now_s
        self._left.set()
