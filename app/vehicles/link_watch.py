"""From messages to facts: what a vehicle's messages mean for those who listen to its link."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Final

from app.domain.autopilot.base import GripperChannel
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.facts import (
    GripperOutput,
    IdentityKnown,
    ItemReached,
    LinkFact,
    LinkLost,
    LinkRestored,
    Rebooted,
)
from app.domain.vehicle.state import FlightMode, MissionState, vehicle_type
from app.vehicles.decoders import (
    AutopilotVersion,
    BatteryStatus,
    CurrentMode,
    EventReport,
    ExtendedSysState,
    GlobalPositionInt,
    GpsRawInt,
    Heartbeat,
    HomePosition,
    MissionCurrentReport,
    MissionItemReached,
    Report,
    ServoOutputRaw,
    StatusTextChunk,
    SysStatus,
    SystemTime,
)
from app.vehicles.fact_stream import FactStream
from app.vehicles.facts import Identity
from app.vehicles.inbox import Inbox
from app.vehicles.measurements import Measurements, mission_state
from app.vehicles.quarantine import Quarantine
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts

# MISSION_ITEM_REACHED once per visit, and confirmed: PX4 repeats it about eleven times, a second apart, until another
# is reached.


_SILENCE_S: Final = 3.0


class _Visit(Enum):
    REPORTED = auto()
    """Reached and reported; repetitions follow."""
    BACK = auto()
    """Current again after it was left: a repetition and a new arrival look alike."""
    LEFT_AGAIN = auto()
    """Left for the second time: what is said now belongs to the second visit."""


class ItemVisits:
    """Decides which REACHED is news. In doubt it waits: it may say nothing, never the same arrival twice.

    One REACHED alone, which could be forged, says nothing: MISSION_CURRENT must have left that item, or show it while
    the REACHED is repeated.
    """

    def __init__(self) -> None:
        self._seq: int | None = None
        self._visit = _Visit.REPORTED
        self._current: int | None = None
        self._left: int | None = None
        self._unconfirmed: int | None = None
        self._last_s = 0.0

    def reset(self) -> None:
        """A new mission, a new start or a reboot: all is news again."""
        self._seq = self._current = self._left = self._unconfirmed = None

    def now_current(self, seq: int) -> int | None:
        """MISSION_CURRENT shows `seq`. The item that is confirmed as reached by that; None if none is."""
        if self._current == seq:
            return None
        left, self._left, self._current = self._current, self._current, seq
        confirmed = self._unconfirmed
        if confirmed is not None and self._is_left(confirmed):
            self._confirm(confirmed)
        else:
            if confirmed is not None and left is not None and seq < left:
                self._confirm(confirmed)  # it was of the visit before the step back, and its repetitions are too
            confirmed = None
        if self._seq is None or left is None:
            return confirmed
        if seq == self._seq:
            self._visit = _Visit.BACK
        elif left == self._seq and self._visit is _Visit.BACK:
            self._visit = _Visit.LEFT_AGAIN
        return confirmed

    def reached(self, seq: int, now_s: float) -> bool:
        """Whether this REACHED confirms the first of its visit."""
        quiet_s, self._last_s = now_s - self._last_s, now_s
        is_repeated = seq == self._unconfirmed
        news = is_repeated or seq != self._seq or self._visit is _Visit.LEFT_AGAIN
        news = news or (self._visit is _Visit.BACK and quiet_s > _SILENCE_S)
        self._unconfirmed = seq if news else None
        confirmed = news and (self._is_left(seq) or (is_repeated and seq == self._current))
        if confirmed:
            self._confirm(seq)
        return confirmed

    def _is_left(self, seq: int) -> bool:
        """Whether MISSION_CURRENT went on from this item, or from one before it to one behind it."""
        left, current = self._left, self._current
        return left is not None and current is not None and (seq == left or left < seq < current)

    def _confirm(self, seq: int) -> None:
        self._seq, self._visit, self._unconfirmed = seq, _Visit.REPORTED, None


def output_us(channel: GripperChannel | None, message: ServoOutputRaw) -> int | None:
    """The gripper's output in this message; None if it is for other outputs or carries none."""
    if channel is None or message.port != channel.port:
        return None
    return message.outputs_us[channel.output - 1] or None


# A vehicle's clock and place, sample by sample: it restarted, or two vehicles speak under one system id.
#
# mavsdk does not show from which address a message came: two vehicles with one id look like one whose time since boot
# and position jump to and fro.


_REORDER_MS: Final = 1000
"""Datagrams that overtake each other set the clock back by less."""
_SILENT_S: Final = 1.0
"""A vehicle that restarts is silent for longer (1.2 s of its own time); one that shares its id is not."""
_GOES_ON: Final = 2
"""So many samples behind, and none that goes on as before: one message restarts no vehicle."""
_GOES_ON_S: Final = 0.2
"""And for so long: what a link that stood still delivers late is soon followed by something new."""
_EARLIER_MS: Final = 2000
"""A vehicle that restarted has been up for no longer than since it was heard, and so much: that may have come late."""
_ENDED_S: Final = 10.0
"""The old clock has ended if nothing went on with it for so long."""
_CERTAIN_MS: Final = 10_000
"""Two clocks, and not one that a link delivers late."""
_FAR_M: Final = 50.0
_WINDOW_S: Final = 5.0
_JUMPS: Final = 4
_METRES_PER_DEG: Final = 111_320.0


class ClockAssessment(Enum):
    """What a sample of a vehicle's clock means, if it does not simply continue."""

    REBOOTED = auto()
    SUSPECT = auto()
    """Ask for AUTOPILOT_VERSION: two vehicles answer with two uids."""
    DUPLICATE = auto()


@dataclass(frozen=True, slots=True)
class Fix:
    """Where and how fast, of one GLOBAL_POSITION_INT."""

    latitude_deg: float
    longitude_deg: float
    velocity_north_m_s: float
    velocity_east_m_s: float


@dataclass(slots=True)
class Timeline:
    """Feed it each time_boot_ms, with the position where there is one."""

    boot_ms: int | None = None
    at_s: float = 0.0
    fix: Fix | None = None
    fix_boot_ms: int = 0
    behind: int = 0
    behind_since_s: float = 0.0
    ahead_ms: int | None = None
    jumps_s: list[float] = field(default_factory=list)

    def take(self, boot_ms: int, now_s: float, fix: Fix | None = None, *, rate: float = 1.0) -> ClockAssessment | None:
        """What this sample means; None if it goes on as before. `rate`: of the vehicle's clock beside ours."""
        assessment = self._clock(boot_ms, now_s, max(1.0, rate))
        if fix is not None and assessment is not ClockAssessment.REBOOTED:
            assessment = self._place(boot_ms, now_s, fix) or assessment
        if fix is not None:
            self.fix, self.fix_boot_ms = fix, boot_ms
        return assessment

    @property
    def is_in_doubt(self) -> bool:
        """Whether the last sample does not continue the clock: late, of another vehicle, or of a restarted one."""
        return self.behind > 0 or self.ahead_ms is not None

    def _clock(self, boot_ms: int, now_s: float, rate: float) -> ClockAssessment | None:
        back_ms = 0 if self.boot_ms is None else self.boot_ms - boot_ms
        if self._is_far_ahead(boot_ms, now_s, rate):
            return self._jumped(now_s, certain=True)
        silent = now_s - self.at_s >= _SILENT_S
        if back_ms <= (0 if silent else _REORDER_MS):
            self.boot_ms, self.at_s, self.behind = boot_ms, now_s, 0
            return None
        self.behind += 1
        if self.behind == 1:
            self.behind_since_s = now_s
        behind_s = now_s - self.behind_since_s
        is_young = boot_ms <= (now_s - self.at_s) * 1e3 * rate + _EARLIER_MS
        if self.behind >= _GOES_ON and behind_s >= (_GOES_ON_S if is_young else _ENDED_S / rate):
            self.boot_ms, self.at_s, self.behind, self.fix = boot_ms, now_s, 0, None
            self.jumps_s.clear()
            return ClockAssessment.REBOOTED
        return self._jumped(now_s, certain=back_ms > _CERTAIN_MS and self.behind == 1)

    def _is_far_ahead(self, boot_ms: int, now_s: float, rate: float) -> bool:
        """Whether this may be of another clock: one before a restart, or another vehicle's. Two in a row are none."""
        before, self.ahead_ms = self.ahead_ms, None
        if self.boot_ms is None or boot_ms - self.boot_ms <= (now_s - self.at_s) * 1e3 * rate + _CERTAIN_MS:
            return False
        if before is not None and before <= boot_ms <= before + _CERTAIN_MS:
            return False
        self.ahead_ms = boot_ms
        return True

    def _place(self, boot_ms: int, now_s: float, fix: Fix) -> ClockAssessment | None:
        if self.fix is None:
            return None
        passed_s = abs(boot_ms - self.fix_boot_ms) / 1e3
        north = (fix.latitude_deg - self.fix.latitude_deg) * _METRES_PER_DEG
        east = (fix.longitude_deg - self.fix.longitude_deg) * _METRES_PER_DEG * math.cos(math.radians(fix.latitude_deg))
        speed = max(math.hypot(f.velocity_north_m_s, f.velocity_east_m_s) for f in (fix, self.fix))
        far_m = _FAR_M + 2 * speed * passed_s
        return self._jumped(now_s, certain=True) if math.hypot(north, east) > far_m else None

    def _jumped(self, now_s: float, *, certain: bool) -> ClockAssessment:
        self.jumps_s = [at_s for at_s in self.jumps_s if now_s - at_s < _WINDOW_S]
        if certain:
            self.jumps_s.append(now_s)
        return ClockAssessment.DUPLICATE if len(self.jumps_s) >= _JUMPS else ClockAssessment.SUSPECT


class LinkWatch:
    """Takes every message of one vehicle in, keeps its measurements, and emits what changed."""

    def __init__(
        self,
        inbox: Inbox,
        measurements: Measurements,
        identity: Identity,
        texts: StatusTexts,
        facts: FactStream,
        quarantine: Quarantine,
        settings: LinkSettings,
    ) -> None:
        self._measurements = measurements
        self._identity = identity
        self._texts = texts
        self._facts = facts
        self._quarantine = quarantine
        self._settings = settings
        self._timeline = Timeline()
        self._clock_rate = 1.0
        self._visits = ItemVisits()
        self._reached_in: FlightMode | None = None
        self.lost = False
        self.heard_since_s = math.inf
        """When the vehicle was heard again after its last silence, or first (monotonic)."""
        self.gripper: GripperChannel | None = None
        inbox.on(Heartbeat, self._heartbeat)
        inbox.on(CurrentMode, lambda message, at_s: self._emit(measurements.take_mode(message, at_s)))
        inbox.on(ExtendedSysState, lambda message, at_s: self._emit(measurements.take_system(message, at_s)))
        inbox.on(GlobalPositionInt, self._position)
        inbox.on(SystemTime, lambda message, at_s: self._sample(message.time_boot_ms, at_s))
        inbox.on(GpsRawInt, measurements.take_gnss)
        inbox.on(HomePosition, lambda message, _: measurements.take_home(message))
        inbox.on(BatteryStatus, lambda message, _: measurements.take_battery(message))
        inbox.on(SysStatus, lambda message, _: measurements.take_battery(message))
        inbox.on(MissionCurrentReport, self._mission_current)
        inbox.on(MissionItemReached, self._item_reached)
        inbox.on(ServoOutputRaw, self._servo)
        inbox.on(StatusTextChunk, texts.take)
        inbox.on(EventReport, self._event)
        inbox.on(AutopilotVersion, self._version)
        inbox.on(Report, lambda message, _: measurements.take_report(message))

    def look_at(self, gripper: GripperChannel | None, is_assigned: bool | None) -> None:
        """Take the gripper's position from this output; None: it shows nowhere. `is_assigned`: whether it has one."""
        self._measurements.take_gripper_assignment(is_assigned, is_same=gripper == self.gripper)
        self.gripper = gripper

    def tick(self, now_s: float) -> None:
        """Look at the silence. Called a few times a second."""
        self._texts.tick(now_s)
        heard_s = self._measurements.heartbeat_s
        if heard_s is not None and not self.lost and now_s - heard_s > self._settings.link_lost_s:
            self.lost = True
            self._facts.emit(LinkLost(heartbeat_age_s=now_s - heard_s))
        self._quarantine.tick(now_s, connected=self.is_connected())

    def is_connected(self) -> bool:
        """Whether a HEARTBEAT came lately."""
        heard_s = self._measurements.heartbeat_s
        return heard_s is not None and time.monotonic() - heard_s <= self._settings.link_lost_s

    def _emit(self, fact: LinkFact | None) -> None:
        if fact is not None:
            self._facts.emit(fact)

    def _heartbeat(self, message: Heartbeat, received_s: float) -> None:
        before = self._measurements.heartbeat
        changed = self._measurements.take_heartbeat(message, received_s)
        if before is None or self.lost:
            self.heard_since_s = received_s
        if self.lost:
            self.lost = False
            self._facts.emit(LinkRestored())
        if before is None or vehicle_type(before.type) is not vehicle_type(message.type):
            self._facts.emit(IdentityKnown())
        self._emit(changed)

    def _position(self, message: GlobalPositionInt, received_s: float) -> None:
        fix = Fix(message.lat / 1e7, message.lon / 1e7, message.vx / 1e2, message.vy / 1e2)
        self._sample(message.time_boot_ms, received_s, fix)
        if not self._timeline.is_in_doubt:
            self._measurements.take_position(message, received_s)

    def _sample(self, boot_ms: int, received_s: float, fix: Fix | None = None) -> None:
        clock = self._measurements.clock
        if clock.is_measured or clock.commanded_rate is not None:
            self._clock_rate = clock.rate
        self._judge(self._timeline.take(boot_ms, received_s, fix, rate=self._clock_rate), received_s)

    def _judge(self, assessment: ClockAssessment | None, now_s: float) -> None:
        if assessment is not None:
            self._quarantine.doubt(now_s)
        if assessment is ClockAssessment.REBOOTED:
            self._measurements.forget_after_reboot()
            self._identity.forget_after_reboot()
            self._visits.reset()
            self._facts.emit(Rebooted())
        elif assessment is ClockAssessment.SUSPECT:
            self._identity.ask_soon(now_s)
        elif assessment is ClockAssessment.DUPLICATE:
            self._quarantine.begin(Reason.of(ReasonCode.TWO_CLOCKS), now_s)

    def _version(self, message: AutopilotVersion, received_s: float) -> None:
        known = self._identity.uid
        news, other = self._identity.take(message, received_s)
        if other is not None:
            self._quarantine.begin(Reason.of(ReasonCode.TWO_UIDS, known=known or "?", other=other), received_s)
        elif news:
            self._facts.emit(IdentityKnown())

    def _mission_current(self, message: MissionCurrentReport, received_s: float) -> None:
        before = self._measurements.mission
        fact = self._measurements.take_mission(message, received_s)
        if before is not None and _began_anew(before, message):
            self._visits.reset()
        reached = self._visits.now_current(message.seq)
        if reached is not None:
            self._facts.emit(ItemReached(reached, self._reached_in))
        self._emit(fact)

    def _item_reached(self, message: MissionItemReached, received_s: float) -> None:
        self._reached_in = self._measurements.mode
        if self._visits.reached(message.seq, received_s):
            self._facts.emit(ItemReached(message.seq, self._reached_in))

    def _servo(self, message: ServoOutputRaw, received_s: float) -> None:
        output = output_us(self.gripper, message)
        if output is None:
            return
        if self._measurements.take_gripper_output(output, received_s):
            self._facts.emit(GripperOutput(output_us=output))

    def _event(self, message: EventReport, received_s: float) -> None:
        self._texts.take_event(message, received_s, self._measurements.mode, self._measurements.intended_mode)


def _began_anew(before: MissionCurrentReport, now: MissionCurrentReport) -> bool:
    """Another mission, or the same one started from where it had ended."""
    restarted = mission_state(before) in {MissionState.COMPLETE, MissionState.NOT_STARTED}
    return before.mission_id != now.mission_id or (restarted and mission_state(now) is MissionState.ACTIVE)
