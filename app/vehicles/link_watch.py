"""From messages to facts: what a vehicle's messages mean for those who listen to its link."""

from __future__ import annotations

import time

from app.domain.autopilot.base import GripperChannel
from app.domain.mav_type import vehicle_type
from app.domain.ports import (
    DuplicateSystem,
    GripperOutput,
    IdentityKnown,
    ItemReached,
    LinkFact,
    LinkLost,
    LinkRestored,
    Rebooted,
)
from app.domain.reason import ReasonCode, because
from app.domain.vehicle import MissionState
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
from app.vehicles.event_reasons import reason_of
from app.vehicles.fact_stream import FactStream
from app.vehicles.gripper_output import output_us
from app.vehicles.identity import Identity
from app.vehicles.inbox import Inbox
from app.vehicles.item_visits import ItemVisits
from app.vehicles.measurements import Measurements, mission_state
from app.vehicles.settings import LinkSettings
from app.vehicles.status_texts import StatusTexts
from app.vehicles.timeline import Fix, Timeline, Verdict


class LinkWatch:
    """Takes every message of one vehicle in, keeps its measurements, and tells what changed."""

    def __init__(
        self,
        inbox: Inbox,
        measurements: Measurements,
        identity: Identity,
        texts: StatusTexts,
        facts: FactStream,
        settings: LinkSettings,
    ) -> None:
        self._measurements = measurements
        self._identity = identity
        self._texts = texts
        self._facts = facts
        self._settings = settings
        self._timeline = Timeline()
        self._visits = ItemVisits()
        self.lost = False
        self.gripper: GripperChannel | None = None
        inbox.on(Heartbeat, self._heartbeat)
        inbox.on(CurrentMode, lambda message, _: self._tell(measurements.take_mode(message)))
        inbox.on(ExtendedSysState, lambda message, _: self._tell(measurements.take_system(message)))
        inbox.on(GlobalPositionInt, self._position)
        inbox.on(SystemTime, lambda message, at_s: self._judge(self._timeline.take(message.time_boot_ms, at_s), at_s))
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
        self._measurements.has_gripper_output = is_assigned
        if gripper != self.gripper:
            self.gripper = gripper
            self._measurements.gripper_output_us = self._measurements.gripper_output_s = None

    def tick(self, now_s: float) -> None:
        """Look at the silence. Called a few times a second."""
        self._texts.tick(now_s)
        heard_s = self._measurements.heartbeat_s
        if heard_s is not None and not self.lost and now_s - heard_s > self._settings.link_lost_s:
            self.lost = True
            self._facts.tell(LinkLost(heartbeat_age_s=now_s - heard_s))

    def is_connected(self) -> bool:
        """Whether a HEARTBEAT came lately."""
        heard_s = self._measurements.heartbeat_s
        return heard_s is not None and time.monotonic() - heard_s <= self._settings.link_lost_s

    def _tell(self, fact: LinkFact | None) -> None:
        if fact is not None:
            self._facts.tell(fact)

    def _heartbeat(self, message: Heartbeat, received_s: float) -> None:
        before = self._measurements.heartbeat
        changed = self._measurements.take_heartbeat(message, received_s)
        if self.lost:
            self.lost = False
            self._facts.tell(LinkRestored())
        if before is None or vehicle_type(before.type) is not vehicle_type(message.type):
            self._facts.tell(IdentityKnown())
        self._tell(changed)

    def _position(self, message: GlobalPositionInt, received_s: float) -> None:
        self._measurements.take_position(message, received_s)
        fix = Fix(message.lat / 1e7, message.lon / 1e7, message.vx / 1e2, message.vy / 1e2)
        self._judge(self._timeline.take(message.time_boot_ms, received_s, fix), received_s)

    def _judge(self, verdict: Verdict | None, now_s: float) -> None:
        if verdict is Verdict.REBOOTED:
            self._measurements.forget_after_reboot()
            self._identity.forget_after_reboot()
            self._visits.reset()
            self._facts.tell(Rebooted())
        elif verdict is Verdict.SUSPECT:
            self._identity.ask_soon(now_s)
        elif verdict is Verdict.DUPLICATE:
            self._facts.tell(DuplicateSystem(because(ReasonCode.TWO_CLOCKS)))

    def _version(self, message: AutopilotVersion, received_s: float) -> None:
        known = self._identity.uid
        news, other = self._identity.take(message, received_s)
        if other is not None:
            self._facts.tell(DuplicateSystem(because(ReasonCode.TWO_UIDS, known=known or "?", other=other)))
        elif news:
            self._facts.tell(IdentityKnown())

    def _mission_current(self, message: MissionCurrentReport, received_s: float) -> None:
        before = self._measurements.mission
        fact = self._measurements.take_mission(message, received_s)
        if before is not None and _began_anew(before, message):
            self._visits.reset()
        self._visits.now_current(message.seq)
        self._tell(fact)

    def _item_reached(self, message: MissionItemReached, received_s: float) -> None:
        if self._visits.reached(message.seq, received_s):
            self._facts.tell(ItemReached(message.seq, self._measurements.mode))

    def _servo(self, message: ServoOutputRaw, received_s: float) -> None:
        output = output_us(self.gripper, message)
        if output is None:
            return
        before = self._measurements.gripper_output_us
        self._measurements.gripper_output_us, self._measurements.gripper_output_s = output, received_s
        if output != before:
            self._facts.tell(GripperOutput(output_us=output))

    def _event(self, message: EventReport, received_s: float) -> None:
        reason = reason_of(message)
        if reason is not None:
            self._texts.told(reason.text, received_s, reason.topic)


def _began_anew(before: MissionCurrentReport, now: MissionCurrentReport) -> bool:
    """Another mission, or the same one started from where it had ended."""
    restarted = mission_state(before) in {MissionState.COMPLETE, MissionState.NOT_STARTED}
    return before.mission_id != now.mission_id or (restarted and mission_state(now) is MissionState.ACTIVE)
