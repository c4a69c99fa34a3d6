"""The stream of setpoints: one slot, never a queue; who fills it, what a tick sends of it, how steadily it leaves."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

from app.domain.errors import SetpointRefusedError
from app.domain.offboard.encode import Follower, encode, refuse_unfit
from app.domain.offboard.limits import Clamp, limit
from app.domain.offboard.messages import SetpointMessage
from app.domain.offboard.setpoints import ZERO_VELOCITY, Setpoint
from app.domain.offboard.state import OffboardState
from app.domain.offboard.step import Silence, can_stop
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.state import FlightMode, VehicleState
from app.services.offboard.preflight import ControlContext
from app.services.offboard.settings import OffboardSettings
from app.services.views import RateView, SentView, TaskReport

KEPT = 200


class RateStatistics:
    """The last send intervals of one stream, in seconds."""

    def __init__(self, target_hz: float) -> None:
        self.target_hz = target_hz
        self.sends = 0
        self._last_s: float | None = None
        self._intervals: deque[float] = deque(maxlen=KEPT)

    def sent(self, now_s: float) -> None:
        """A setpoint left now."""
        if self._last_s is not None:
            self._intervals.append(now_s - self._last_s)
        self._last_s = now_s
        self.sends += 1

    def view(self) -> RateView:
        """Rate and jitter over the last sends; null before the second one."""
        ordered = sorted(self._intervals)
        if not ordered:
            return RateView(target_hz=self.target_hz, achieved_hz=None, p50_ms=None, p99_ms=None, max_ms=None)
        return RateView(
            target_hz=self.target_hz,
            achieved_hz=round(len(ordered) / max(sum(ordered), 1e-9), 2),
            p50_ms=_ms(ordered[len(ordered) // 2]),
            p99_ms=_ms(ordered[min(len(ordered) - 1, int(len(ordered) * 0.99))]),
            max_ms=_ms(ordered[-1]),
        )


def _ms(seconds: float) -> float:
    return round(seconds * 1e3, 2)


class SetpointSource(Protocol):
    """Speaks for the client of a lease between its words: the guidance of its tasks. Called on the event loop."""

    def tick(self, now_s: float) -> SetpointRefusedError | None:
        """Before each send: give a setpoint, or none. Why it could not, if it should have."""

    def refuse_client_setpoint(self) -> None:
        """Before a setpoint of the client counts. Raises SetpointRefusedError: it would be sent and not be obeyed."""

    def client_sent_setpoint(self) -> None:
        """The client has put a setpoint itself."""

    def client_leaves(self) -> None:
        """The client wants to leave: it gives no setpoint any more, even if that fails, until the client says so."""

    def report(self) -> TaskReport | None:
        """What is shown with the state; None if no task was ever queued."""


Author = Literal["client", "dead_man", "task"]


@dataclass(frozen=True, slots=True)
class SlottedSetpoint:
    """A setpoint that may be sent, and since when (monotonic)."""

    setpoint: Setpoint
    message: SetpointMessage
    clamps: tuple[Clamp, ...]
    at_s: float
    source: Author


class SetpointFlow:
    """One vehicle's stream with its limits and its dead-man. `send` may raise LinkError."""

    def __init__(self, settings: OffboardSettings, send: Callable[[SetpointMessage], None]) -> None:
        self._settings = settings
        self._send = send
        self._spoke_s = 0.0
        self._rejected: SetpointRefusedError | None = None
        """The newest since `_spoke_s`."""
        self._left = asyncio.Event()
        self.start(settings.rate_hz)

    def start(self, rate_hz: float) -> None:
        """A new stream, of which nothing was sent yet."""
        self._rate = RateStatistics(rate_hz)
        self._slot: SlottedSetpoint | None = None
        self._newest: SlottedSetpoint | None = None
        self._newest_s = 0.0

    def clear(self) -> None:
        """Nothing of what was put is to be sent."""
        self._slot = None

    def count_from(self, now_s: float) -> None:
        """The silence of the client counts from here, unless it has spoken later."""
        if now_s >= self._spoke_s:
            self._spoke_s, self._rejected = now_s, None

    def note(self, rejected: SetpointRefusedError | None) -> None:
        """Why the source that speaks for the client has given none."""
        self._rejected = rejected or self._rejected

    async def streamed(self, seconds: float) -> None:
        """Return when so much of the stream has been sent."""
        rate = self._rate
        enough = rate.sends + round(seconds * rate.target_hz)
        while rate.sends < enough:
            self._left.clear()
            await self._left.wait()

    def put(
        self, setpoint: Setpoint, context: ControlContext, state: VehicleState, now_s: float, source: Author
    ) -> tuple[Clamp, ...]:
        """The newest setpoint, within the limits. Raises SetpointRefusedError: the one before stays to its age.

        What is to become of a setpoint that exceeds them is the client's choice for its own; a task flies more slowly.
        """
        follower = context.follower(state)
        limits = self._settings.limits
        if source == "task":
            limits = limits.model_copy(update={"when_exceeded": "clamp"})
        try:
            refuse_unfit(setpoint, follower)  # before any limit is looked at
            limited = limit(setpoint, limits, context.pose(state))
            message = encode(limited.setpoint, follower)
        except SetpointRefusedError as error:
            self._rejected = error
            raise
        self._slot = SlottedSetpoint(limited.setpoint, message, limited.clamps, now_s, source)
        self._spoke_s, self._rejected = now_s, None
        return limited.clamps

    def tick(self, phase: OffboardState, context: ControlContext, state: VehicleState, now_s: float) -> Reason | None:
        """Send at most one message. Why nothing more may be sent, in words; under control the silence counts.

        Raises:
            LinkError; SetpointRefusedError: the client is silent, and this vehicle follows no velocity of zero.
        """
        follower = context.follower(state)
        if phase is OffboardState.LEAVING:  # until the other mode is seen
            if state.mode is FlightMode.OFFBOARD and (self._is_fresh(now_s) or can_stop(follower.kind)):
                self._out(follower, now_s)
            return None
        silent_s = now_s - self._spoke_s if phase is OffboardState.ACTIVE else 0.0
        silence = self._settings.dead_man.judge(silent_s, follower.kind, has_estimate=follower.has_estimate)
        if silence is Silence.GONE:
            return self._why_gone(silent_s)
        self._out(follower, now_s)
        return None

    def views(self, now_s: float) -> tuple[SentView | None, RateView]:
        """The newest message that left, and how steadily they leave."""
        if self._newest is None:
            return None, self._rate.view()
        slotted = self._newest
        sent = SentView(
            source=slotted.source,
            setpoint=slotted.setpoint.model_dump(mode="json"),
            message=slotted.message.name,
            type_mask=int(slotted.message.type_mask),
            age_s=round(now_s - self._newest_s, 3),
            clamped=[clamp.code for clamp in slotted.clamps],
        )
        return sent, self._rate.view()

    def _why_gone(self, silent_s: float) -> Reason:
        """A client whose every setpoint was rejected was not silent."""
        if (rejected := self._rejected) is None:
            return Reason.of(ReasonCode.OFFBOARD_CLIENT_SILENT, silent_s=silent_s)
        return Reason.of(
            ReasonCode.OFFBOARD_ALL_REJECTED, silent_s=silent_s, refusal=rejected.refusal, detail=rejected.detail
        )

    def has_setpoint(self, now_s: float, source: SetpointSource | None) -> bool:
        """Whether the client gives one, or a task will: other than a velocity of zero."""
        tasks = None if source is None else source.report()
        return self._is_fresh(now_s) or (tasks is not None and tasks.current_id is not None)

    def _is_fresh(self, now_s: float) -> bool:
        return self._slot is not None and now_s - self._slot.at_s <= self._settings.dead_man.max_age_s

    def _out(self, follower: Follower, now_s: float) -> None:
        """The slot's setpoint, or a velocity of zero: a wing does not follow that, which ends the lease."""
        slotted = self._slot if self._is_fresh(now_s) else None
        slotted = slotted or SlottedSetpoint(ZERO_VELOCITY, encode(ZERO_VELOCITY, follower), (), now_s, "dead_man")
        self._send(slotted.message)
        self._rate.sent(now_s)
        self._newest, self._newest_s = slotted, now_s
        self._left.set()
