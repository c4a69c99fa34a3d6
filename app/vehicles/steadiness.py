"""What one message says is no fact yet: for how long all messages of a kind have said the same."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from app.domain.vehicle.state import SignalDurations
from app.vehicles.decoders import ExtendedSysState, GlobalPositionInt, Heartbeat, MissionCurrentReport

GAP_S: Final = 5.0
"""After so long without a message of its kind nothing is known of the time between."""
LONGEST_S: Final = 60.0
"""More digits are not reported, or two polls of a standing vehicle would differ."""
REST_CM_S: Final = 100
ON_GROUND: Final = 1
ARMED: Final = 128
OUTPUT_SURE_S: Final = 0.25
"""SERVO_OUTPUT_RAW comes ten times a second: two more of them must say the same."""


@dataclass(slots=True)
class Span:
    """From the first message that said something to the newest, if none said otherwise."""

    first_s: float | None = None
    newest_s: float = 0.0

    def observe(self, holds: bool, at_s: float) -> None:
        if not holds:
            self.first_s = None
            return
        if self.first_s is None or at_s - self.newest_s > GAP_S:
            self.first_s = at_s
        self.newest_s = at_s

    @property
    def length_s(self) -> float:
        """How long it is."""
        return 0.0 if self.first_s is None else round(min(self.newest_s - self.first_s, LONGEST_S), 2)


@dataclass(slots=True)
class Steadiness:
    """Receives each message before it replaces the one before."""

    disarmed: Span = field(default_factory=Span)
    on_ground: Span = field(default_factory=Span)
    at_rest: Span = field(default_factory=Span)
    mission_current: Span = field(default_factory=Span)
    failsafe_delay: Span = field(default_factory=Span)
    _mission: MissionCurrentReport | None = None

    def heartbeat(self, message: Heartbeat, at_s: float) -> None:
        self.disarmed.observe(not message.base_mode & ARMED, at_s)

    def system(self, message: ExtendedSysState, at_s: float) -> None:
        self.on_ground.observe(message.landed_state == ON_GROUND, at_s)

    def position(self, message: GlobalPositionInt, at_s: float) -> None:
        fastest = max(abs(message.vx), abs(message.vy), abs(message.vz))
        self.at_rest.observe(fastest <= REST_CM_S, at_s)

    def mission(self, message: MissionCurrentReport, at_s: float) -> None:
        if message != self._mission:
            self.mission_current.observe(False, at_s)
            self._mission = message
        self.mission_current.observe(True, at_s)

    @property
    def failsafe_delay_s(self) -> float | None:
        """See VehicleState."""
        return None if self.failsafe_delay.first_s is None else self.failsafe_delay.length_s

    def durations(self) -> SignalDurations:
        return SignalDurations(
            self.disarmed.length_s, self.on_ground.length_s, self.at_rest.length_s, self.mission_current.length_s
        )


@dataclass(slots=True)
class SteadyOutput:
    """A servo output, once it has been said for long enough. `us` and `heard_s` are None before."""

    us: int | None = None
    heard_s: float | None = None
    newest_us: int | None = None
    _other: int | None = None
    _since_s: float = 0.0

    def observe(self, us: int, at_s: float) -> bool:
        """One SERVO_OUTPUT_RAW. Whether the output is now another."""
        self.newest_us = us
        if us == self.us:
            self.heard_s, self._other = at_s, None
            return False
        if us != self._other or at_s - self._since_s > GAP_S:
            self._other, self._since_s = us, at_s
            return False
        if at_s - self._since_s < OUTPUT_SURE_S:
            return False
        self.us, self.heard_s, self._other = us, at_s, None
        return True
