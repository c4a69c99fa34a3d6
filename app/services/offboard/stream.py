"""The stream of setpoints: one slot, never a queue; the ticks that send it; how steadily it leaves."""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import structlog

from app.domain.offboard.encode import Follower, encode, refuse_unfit
from app.domain.offboard.limits import Clamp, limit
from app.domain.offboard.messages import SetpointMessage
from app.domain.offboard.setpoints import ZERO_VELOCITY, Setpoint
from app.domain.offboard.state import OffboardState
from app.domain.offboard.step import Silence, can_stop
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.state import FlightMode, VehicleState
from app.services.clock import Clock
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


# Ticks at a steady rate on the monotonic clock, and notices when the process or the machine stood still.


def uptime_s() -> float:
    """Seconds that go on while the machine is suspended, where the system has such a clock."""
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


class RateClock:
    """Calls `on_tick(monotonic seconds)`. Ticks that were missed are left out, never made up for in a burst."""

    def __init__(
        self,
        period_s: float,
        gap_s: float,
        on_tick: Callable[[float], None],
        on_gap: Callable[[float], None],
        *,
        monotonic: Callable[[], float] = time.monotonic,
        uptime: Callable[[], float] = uptime_s,
    ) -> None:
        self._period_s = period_s
        self._gap_s = gap_s
        self._on_tick = on_tick
        self._on_gap = on_gap
        self._monotonic = monotonic
        self._uptime = uptime
        self._seen_s = uptime()

    def check_gap(self) -> bool:
        """Whether the last tick is too long ago; calls `on_gap` then. For all that may run before the tick."""
        gap_s = self._uptime() - self._seen_s
        if gap_s <= self._gap_s:
            return False
        self._seen_s = self._uptime()
        self._on_gap(gap_s)
        return True

    async def run(self) -> None:
        """Tick until cancelled. After a gap nothing is ticked any more."""
        due_s = self._monotonic()
        self._seen_s = self._uptime()
        while True:
            if self.check_gap():
                return
            self._seen_s = self._uptime()
            self._on_tick(self._monotonic())
            due_s = next_due_s(due_s, self._monotonic(), self._period_s)
            await asyncio.sleep(max(0.0, due_s - self._monotonic()))


def next_due_s(due_s: float, now_s: float, period_s: float) -> float:
    """The first moment of the grid after both `due_s` and `now_s`."""
    missed = max(0, math.floor((now_s - due_s) / period_s))
    return due_s + (missed + 1) * period_s


# The ticks of one vehicle's control, from its lease to the end of it.


log = structlog.get_logger(__name__)


class RateLoop:
    """`on_defect` is called when a tick failed in a way that nobody foresaw: there are no more ticks then."""

    def __init__(
        self,
        vehicle_id: str,
        clock: Clock,
        gap_s: float,
        on_tick: Callable[[float], None],
        on_gap: Callable[[float], None],
        on_defect: Callable[[], None],
    ) -> None:
        self._vehicle_id = vehicle_id
        self._clock = clock
        self._gap_s = gap_s
        self._on_tick = on_tick
        self._on_gap = on_gap
        self._on_defect = on_defect
        self._rate_clock: RateClock | None = None
        self._task: asyncio.Task[None] | None = None

    def start(self, rate_hz: float) -> None:
        """Tick from now on."""
        monotonic = self._clock.monotonic
        self._rate_clock = RateClock(1.0 / rate_hz, self._gap_s, self._on_tick, self._on_gap, monotonic=monotonic)
        self._task = asyncio.create_task(self._rate_clock.run(), name=f"offboard {self._vehicle_id}")
        self._task.add_done_callback(self._ended)

    def stop(self) -> None:
        """No more ticks. Idempotent."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    def check_gap(self) -> None:
        """Call `on_gap` if the last tick is too long ago: for all that may run before the next one."""
        if self._rate_clock is not None:
            self._rate_clock.check_gap()

    def _ended(self, task: asyncio.Task[None]) -> None:
        if task.cancelled() or (error := task.exception()) is None:
            return
        log.error("offboard control stopped after an internal error", vehicle=self._vehicle_id, exc_info=error)
        if task is self._task:
            self._on_defect()


# Who may speak for the client of a lease between its words: the guidance of its tasks.


class SetpointSource(Protocol):
    """Called on the event loop by the vehicle's offboard control."""

    def tick(self, now_s: float) -> None:
        """Before each send: give a setpoint, or none."""

    def client_sent_setpoint(self) -> None:
        """The client has put a setpoint itself."""

    def client_leaves(self) -> None:
        """The client wants to leave: it gives no setpoint any more, even if that fails, until the client says so."""

    def report(self) -> TaskReport | None:
        """What is shown with the state; None if no task was ever queued."""


# Flying by setpoints: one slot, never a queue; what a tick sends of it, and when the client counts as gone.


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
        self._spoke_s = max(self._spoke_s, now_s)

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
        """The newest setpoint, within the limits. Raises SetpointRefusedError: the one before stays to its age."""
        follower = context.follower(state)
        refuse_unfit(setpoint, follower)  # before any limit is looked at
        limited = limit(setpoint, self._settings.limits, context.pose(state))
        message = encode(limited.setpoint, follower)
        self._slot = SlottedSetpoint(limited.setpoint, message, limited.clamps, now_s, source)
        self._spoke_s = now_s
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
            return Reason.of(ReasonCode.OFFBOARD_CLIENT_SILENT, silent_s=silent_s)
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
