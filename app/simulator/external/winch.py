"""A winch: DO_WINCH's ten actions as MAVLink describes them, and WINCH_STATUS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.external.component import Answer, Params4
from app.simulator.wire import Cmd, Result

FULL_LENGTH_M = 30.0
DEFAULT_RATE_M_S = 1.0
FASTEST_M_S = 3.0
SLOW_M_S = 0.5
SLOW_BELOW_M = 1.0
"""The last of the way down is slow, feeling for the ground."""
RETRACT_M_S = 2.0
HOOK_M = 0.5
RELEASE_S = 0.5
"""At the ground, until the payload is off the hook."""


class Flag(IntFlag):
    """MAV_WINCH_STATUS_FLAG."""

    HEALTHY = 1
    FULLY_RETRACTED = 2
    MOVING = 4
    CLUTCH_ENGAGED = 8
    LOCKED = 16
    DROPPING = 32
    ARRESTING = 64
    GROUND_SENSE = 128
    RETRACTING = 256
    ABANDON_LINE = 1024
    LOAD_LINE = 4096
    LOAD_PAYLOAD = 8192


MOVING_ONLY = Flag(0)


@dataclass(frozen=True, slots=True)
class WinchLeg:
    """To `target_m` of line let out."""

    target_m: float
    rate_m_s: float
    flags: Flag = MOVING_ONLY
    releases: bool = False
    """At its end the payload stands on the ground."""


def let_out(target_m: float, rate_m_s: float) -> list[WinchLeg]:
    """To a length within the line's; a rate that is not given (0 or NaN) is the winch's own."""
    rate = abs(rate_m_s) if math.isfinite(rate_m_s) and rate_m_s != 0.0 else DEFAULT_RATE_M_S
    return [WinchLeg(max(0.0, min(FULL_LENGTH_M, target_m)), min(rate, FASTEST_M_S))]


def deliver(height_m: float) -> list[WinchLeg]:
    """Drop, slow down, touch down, reel up (and lock); nothing when the line does not reach the ground."""
    if height_m > FULL_LENGTH_M:
        return []
    return [
        WinchLeg(max(0.0, height_m - SLOW_BELOW_M), FASTEST_M_S, Flag.DROPPING),
        WinchLeg(max(0.0, height_m), SLOW_M_S, Flag.ARRESTING | Flag.GROUND_SENSE, releases=True),
        WinchLeg(0.0, RETRACT_M_S, Flag.RETRACTING),
    ]


def retract() -> list[WinchLeg]:
    return [WinchLeg(0.0, RETRACT_M_S, Flag.RETRACTING)]


def load_line() -> list[WinchLeg]:
    """Wind a new line on, until the tension says that it is all there."""
    return [WinchLeg(0.0, DEFAULT_RATE_M_S, Flag.LOAD_LINE)]


def abandon() -> list[WinchLeg]:
    """Let out the entire line; it is lost then."""
    return [WinchLeg(FULL_LENGTH_M, FASTEST_M_S, Flag.ABANDON_LINE)]


def present_hook() -> list[WinchLeg]:
    """Just enough line that somebody can hang the payload on."""
    return [WinchLeg(HOOK_M, DEFAULT_RATE_M_S, Flag.LOAD_PAYLOAD)]


WINCH_COMPONENT = 169
MAV_TYPE_WINCH = 42


class Action(IntEnum):
    """WINCH_ACTIONS, param2."""

    RELAXED = 0
    RELATIVE_LENGTH = 1
    RATE = 2
    LOCK = 3
    DELIVER = 4
    HOLD = 5
    RETRACT = 6
    LOAD_LINE = 7
    ABANDON_LINE = 8
    LOAD_PAYLOAD = 9


@dataclass(slots=True)
class _Motion:
    action: Action
    legs: list[WinchLeg]
    answer: Answer
    pause_until_s: float | None = None


class Winch:
    """`height_m` returns how far down the ground is. `stuck`: the drum does not turn.

    A sequence is IN_PROGRESS, then ACCEPTED; asked for again meanwhile it is TEMPORARILY_REJECTED; any other action
    that is not refused cancels it (CANCELLED, to the one who had asked). Relaxing, holding, locking and a rate are
    ACCEPTED at once. The instance (param1) is ignored.
    """

    component_id = WINCH_COMPONENT
    mav_type = MAV_TYPE_WINCH
    command = int(Cmd.DO_WINCH)

    def __init__(self, clock: VehicleClock, height_m: Callable[[], float]) -> None:
        self._clock = clock
        self._height_m = height_m
        self._motion: _Motion | None = None
        self._resting = Flag.LOCKED
        """LOCKED, CLUTCH_ENGAGED (the line runs freely) or nothing: the motor holds."""
        self._line_gone = False
        self.line_m = 0.0
        """Let out."""
        self.delivered = False
        self.stuck = False

    def execute(self, params: Params4, answer: Answer) -> None:
        """DO_WINCH: action, length (positive lets out), rate (its sign counts for the rate action only)."""
        _, number, length_m, rate_m_s = params
        if number not in {*Action}:
            answer(Result.DENIED)
            return
        action = Action(int(number))
        if action in (Action.RELAXED, Action.HOLD, Action.LOCK):
            self._rest(action, answer)
        elif action is Action.RATE:
            self._turn(rate_m_s, answer)
        elif self._motion is not None and self._motion.action is action:
            answer(Result.TEMPORARILY_REJECTED)
        elif action is Action.RELATIVE_LENGTH and not math.isfinite(length_m):
            answer(Result.DENIED)
        else:
            self._begin(action, self._legs(action, length_m, rate_m_s), answer)

    def step(self) -> None:
        """Move the line."""
        motion = self._motion
        if motion is None:
            return
        if motion.pause_until_s is not None:
            if self._clock.now_s < motion.pause_until_s:
                return
            self.delivered = True
            motion.pause_until_s = None
        leg = motion.legs[0]
        step_m = leg.rate_m_s * VehicleClock.STEP_S
        self.line_m += max(-step_m, min(step_m, leg.target_m - self.line_m))
        if abs(leg.target_m - self.line_m) > 1e-6:
            return
        motion.legs.pop(0)
        if leg.releases:
            motion.pause_until_s = self._clock.now_s + RELEASE_S
        if not motion.legs:
            self._end(motion)

    def status(self) -> Message:
        """WINCH_STATUS: length and speed of the line (winding in is negative); NaN is "unknown"."""
        speed_m_s, flags = 0.0, Flag.HEALTHY
        if self._motion is None:
            flags |= self._resting
        else:
            leg = self._motion.legs[0]
            flags |= Flag.MOVING | leg.flags
            speed_m_s = math.copysign(leg.rate_m_s, leg.target_m - self.line_m)
        if self.line_m <= 0.0:
            flags |= Flag.FULLY_RETRACTED
        return mavlink.MAVLink_winch_status_message(
            int(self._clock.now_s * 1e6), self.line_m, speed_m_s, math.nan, 16.2, math.nan, 25, flags
        )

    def _legs(self, action: Action, length_m: float, rate_m_s: float) -> list[WinchLeg]:
        if action is Action.RELATIVE_LENGTH:
            return let_out(self.line_m + length_m, rate_m_s)
        if action is Action.DELIVER:
            return deliver(self._height_m())
        makers = {
            Action.RETRACT: retract,
            Action.LOAD_LINE: load_line,
            Action.ABANDON_LINE: abandon,
            Action.LOAD_PAYLOAD: present_hook,
        }
        return makers[action]()

    def _begin(self, action: Action, legs: list[WinchLeg], answer: Answer) -> None:
        """No legs: it is impossible (the ground is too far down)."""
        if self.stuck or not legs or (self._line_gone and action is not Action.LOAD_LINE):
            answer(Result.FAILED)
            return
        self._cancel()
        self._motion = _Motion(action, legs, answer)
        answer(Result.IN_PROGRESS)

    def _turn(self, rate_m_s: float, answer: Answer) -> None:
        """Until the line ends or something else is asked for; a new rate takes over."""
        if not math.isfinite(rate_m_s):
            answer(Result.DENIED)
        elif self.stuck or self._line_gone:
            answer(Result.FAILED)
        else:
            self._cancel()
            if rate_m_s != 0.0:
                legs = let_out(FULL_LENGTH_M if rate_m_s > 0.0 else 0.0, rate_m_s)
                self._motion = _Motion(Action.RATE, legs, _nobody)
            answer(Result.ACCEPTED)

    def _rest(self, action: Action, answer: Answer) -> None:
        """The lock is made for the fully retracted position."""
        if action is Action.LOCK and self.line_m > 0.0:
            answer(Result.TEMPORARILY_REJECTED)
            return
        self._cancel()
        self._resting = {Action.LOCK: Flag.LOCKED, Action.RELAXED: Flag.CLUTCH_ENGAGED}.get(action, Flag(0))
        answer(Result.ACCEPTED)

    def _cancel(self) -> None:
        motion, self._motion = self._motion, None
        self._resting = Flag(0)
        if motion is not None:
            motion.answer(Result.CANCELLED)

    def _end(self, motion: _Motion) -> None:
        self._motion = None
        if motion.action is Action.DELIVER:
            self._resting = Flag.LOCKED
        elif motion.action in (Action.ABANDON_LINE, Action.LOAD_LINE):
            self._line_gone = motion.action is Action.ABANDON_LINE
        motion.answer(Result.ACCEPTED)


def _nobody(result: Result) -> None:
    """A rate was accepted when it began; nobody waits for its end."""
