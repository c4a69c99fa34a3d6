"""What a flight keeps of its link, of offboard control and of pending commands, from one observation to the next."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from app.domain.flight.inputs import SETTLED_S
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction
from app.domain.vehicle.facts import MavSeverity, StatusText
from app.domain.vehicle.state import FlightMode, GlobalPosition, MissionState, VehicleState


@dataclass(frozen=True, slots=True)
class OffboardTracker:
    """Tracks offboard control. Entering it commands a pause; leaving to Hold commands again, the dead-man timer does
    not.

    `had_it`: the vehicle was in offboard control since the last command. `mode` is the mode of the last observation.
    """

    had_it: bool = False
    mode: FlightMode | None = None

    def commanded(self) -> OffboardTracker:
        """A user commands something now: what comes of it is as commanded, also before the vehicle has obeyed."""
        return OffboardTracker(False, self.mode)

    def seen(self, mode: FlightMode | None) -> OffboardTracker:
        """After an observation of a connected vehicle."""
        had_it = self.had_it
        if mode is FlightMode.OFFBOARD and self.mode is not FlightMode.OFFBOARD:
            had_it = True
        elif mode not in (FlightMode.OFFBOARD, FlightMode.HOLD, None):
            had_it = False
        return OffboardTracker(had_it, mode)


@dataclass(frozen=True, slots=True)
class LinkTracker:
    """When messages from the vehicle were received, in monotonic seconds of the service.

    `last_heard_s`: the last one. `connected_since_s`: start of the current connection without a gap; None while the
    vehicle is silent. `first_heard_s`: the first one in this flight. `was_away`: the vehicle may have flown on
    unobserved. `rebooted`: its clock restarted.
    """

    last_heard_s: float
    connected_since_s: float | None = None
    first_heard_s: float | None = None
    was_away: bool = False
    rebooted: bool = False

    def connected(self, now_s: float) -> LinkTracker:
        """The vehicle is connected. The first time it counts as having been so for ever."""
        since_s = self.connected_since_s
        if since_s is None:
            since_s = -math.inf if self.first_heard_s is None else now_s
        first_s = now_s if self.first_heard_s is None else self.first_heard_s
        return replace(self, last_heard_s=now_s, connected_since_s=since_s, first_heard_s=first_s)

    def heard_s(self, now_s: float) -> float:
        """For how long this flight has heard of it."""
        return 0.0 if self.first_heard_s is None else now_s - self.first_heard_s

    @property
    def is_just_back(self) -> bool:
        """Whether it was lost until now: what the vehicle repeats every second may be from before."""
        return self.connected_since_s is not None and self.last_heard_s - self.connected_since_s <= SETTLED_S

    def silent(self, *, was_airborne: bool) -> LinkTracker:
        """It is not. One in the air may fly on to its end, unseen."""
        return replace(self, connected_since_s=None, was_away=was_airborne)


@dataclass(frozen=True, slots=True)
class CommandTracker:
    """Commands of users and of the plan that are pending.

    `pending` is the command that is being sent; `obeyed` the one that the vehicle was observed to follow. `moving_on`
    counts unanswered commands that make another item current.
    """

    pending: RunAction | None = None
    obeyed: RunAction | None = None
    moving_on: int = 0


@dataclass(frozen=True, slots=True)
class OtherMissionTracker:
    """`since_s`: since when the vehicle names another mission than the run's; None: it does not."""

    since_s: float | None = None

    def seen(self, *, is_other: bool, now_s: float) -> OtherMissionTracker:
        """After an observation of a connected vehicle."""
        if not is_other:
            return OtherMissionTracker()
        return self if self.since_s is not None else OtherMissionTracker(now_s)

    def is_settled(self, now_s: float) -> bool:
        """Whether it is no late message: after an upload MISSION_CURRENT may name the mission before."""
        return self.since_s is not None and now_s - self.since_s > SETTLED_S


HOME_CORRECTED_M: Final = 3.0
"""PX4 itself corrects the altitude of home in steps of about 1 m, in the first two minutes after a takeoff (source)."""


@dataclass(frozen=True, slots=True)
class HomeTracker:
    """Whether somebody has moved home of a vehicle in the air: PX4 flies all altitudes above home from there then.

    `moved_m`: how far up home was moved.
    """

    moved_m: float = 0.0

    def seen(self, took_off_from: GlobalPosition, now: GlobalPosition) -> HomeTracker:
        """After an observation in the air."""
        moved_m = now.altitude_m - took_off_from.altitude_m
        return HomeTracker(0.0 if abs(moved_m) <= HOME_CORRECTED_M else round(moved_m, 1))

    @property
    def reason(self) -> Reason | None:
        """None while home is where it was."""
        if not self.moved_m:
            return None
        direction = "up" if self.moved_m > 0.0 else "down"
        return Reason.of(ReasonCode.HOME_MOVED, moved_m=abs(self.moved_m), direction=direction)


TEXT_BEFORE_S: Final = 3.0
"""MISSION_CURRENT may come a second after the text that explains it, and one may be lost."""
_SERIOUS: Final = frozenset({MavSeverity.EMERGENCY, MavSeverity.ALERT, MavSeverity.CRITICAL, MavSeverity.ERROR})


@dataclass(frozen=True, slots=True)
class LostMissionTracker:
    """Why PX4 has dropped the mission: its serious texts of the last seconds, until some time after it says so.

    `since_s`: since when MISSION_CURRENT.mission_state says that there is no valid mission; None: it does not.
    """

    since_s: float | None = None
    texts: tuple[tuple[float, str], ...] = ()

    def seen(self, state: VehicleState, now_s: float) -> LostMissionTracker:
        """After an observation of a connected vehicle."""
        if state.mission_state is not MissionState.NO_MISSION:
            return self if self.since_s is None else replace(self, since_s=None)
        return self if self.since_s is not None else replace(self, since_s=now_s)

    def told(self, text: StatusText, now_s: float) -> LostMissionTracker:
        """After a text of the vehicle."""
        is_late = self.since_s is not None and now_s - self.since_s > SETTLED_S
        if text.severity not in _SERIOUS or text.repeated or is_late:
            return self
        from_s = (now_s if self.since_s is None else self.since_s) - TEXT_BEFORE_S
        return replace(self, texts=(*(one for one in self.texts if one[0] >= from_s), (now_s, text.text)))

    @property
    def reason(self) -> Reason | None:
        """None while the vehicle has its mission."""
        if self.since_s is None:
            return None
        texts = dict.fromkeys(text for at_s, text in self.texts if at_s >= self.since_s - TEXT_BEFORE_S)
        return Reason.of(ReasonCode.NO_VALID_MISSION, detail="; ".join(texts) or "it gave no reason")
