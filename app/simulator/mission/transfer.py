"""The mission protocol as PX4 speaks it: one transfer at a time over all links, repeats every 0.26 s, 5 s patience.

Its timers are wall clock at every speed factor: they belong to the radio link, not to the flight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum, auto

from app.simulator.airframe import Airframe
from app.simulator.channel import Radio, Sender
from app.simulator.dialect import Message, mavlink
from app.simulator.faults import VehicleFaults
from app.simulator.firmware import FirmwareProfile
from app.simulator.mission import item as items
from app.simulator.mission.geofence import fence_refusal, stored_fence_item
from app.simulator.mission.item import refusal
from app.simulator.mission.store import LIMITS, MissionStore, plan_of
from app.simulator.wire import MissionAck, MissionType, Severity

REPEAT_S = 0.26
GIVE_UP_S = 5.04


class _State(Enum):
    IDLE = auto()
    RECEIVING = auto()
    SENDING = auto()


@dataclass(slots=True)
class _Transfer:
    """The transfer in progress."""

    channel: Sender
    partner: tuple[int, int]
    mission_type: int
    count: int
    seq: int = 0
    received: list[items.Item] = field(default_factory=list)
    start_seq: int = 0
    heard_at_s: float = 0.0
    spoke_at_s: float = 0.0


class MissionTransfer:
    """Receives and sends mission, fence and rally lists. `wall` gives wall-clock seconds."""

    def __init__(
        self,
        store: MissionStore,
        radio: Radio,
        profile: FirmwareProfile,
        airframe: Airframe,
        faults: VehicleFaults,
        wall: Callable[[], float],
    ) -> None:
        self._store = store
        self._radio = radio
        self._profile = profile
        self._airframe = airframe
        self._faults = faults
        self._wall = wall
        self._state = _State.IDLE
        self._transfer: _Transfer | None = None
        self._partners: dict[int, tuple[Sender, tuple[int, int]]] = {}
        """Who transferred a list last, by link."""
        self._last_upload: tuple[int, int] | None = None
        """Type and count of the last complete upload: a repeated last item is acknowledged again."""
        self._int_mode = True
        """Whether requests are MISSION_REQUEST_INT: PX4 follows the partner's last dialect."""

    @property
    def busy(self) -> bool:
        """A transfer is open: set-current and clear are refused."""
        return self._state is not _State.IDLE

    def reset(self) -> None:
        """A reboot: the transfer is forgotten."""
        self._end()
        self._partners.clear()
        self._last_upload = None
        self._int_mode = True

    def send_changed(self, seq: int) -> None:
        """A DO_JUMP was taken: PX4 sends its item again, unasked, to whom each link had its last transfer with."""
        if self.busy or seq >= len(self._store.mission.items):
            return
        for channel, partner in self._partners.values():
            item, current = self._store.mission.items[seq], seq == self._store.current_seq
            self._radio.reply(channel, items.to_message(item, seq, current, partner, MissionType.MISSION))

    def poll(self) -> None:
        """Repeat the last request, or give up. To be called every few milliseconds."""
        transfer = self._transfer
        if transfer is None:
            return
        now_s = self._wall()
        if now_s - transfer.heard_at_s >= GIVE_UP_S:
            self._end()
            self._radio.text(Severity.CRITICAL, "Mission sync timeout")
        elif now_s - transfer.spoke_at_s >= REPEAT_S:
            if self._state is _State.RECEIVING:
                self._request(transfer)
            elif transfer.seq == 0:
                self._send_count(transfer)

    # receiving ----------------------------------------------------------------------------------------------

    def on_count(self, channel: Sender, message: Message) -> None:
        """MISSION_COUNT: begin an upload."""
        partner = (message.get_srcSystem(), message.get_srcComponent())
        transfer = self._transfer
        if transfer is not None:
            self._count_while_busy(channel, partner, transfer)
        elif self._faults.refuse_upload:
            self._ack(channel, partner, self._faults.refuse_upload, message.mission_type)
        elif message.count > _limit(message.mission_type):
            self._ack(channel, partner, MissionAck.NO_SPACE, message.mission_type)
        elif message.count == 0:
            self._store.clear(message.mission_type)
            self._ack(channel, partner, MissionAck.ACCEPTED, message.mission_type)
        else:
            self._state = _State.RECEIVING
            self._partners[id(channel)] = channel, partner
            self._transfer = _Transfer(channel, partner, message.mission_type, message.count)
            self._transfer.heard_at_s = self._wall()
            self._request(self._transfer)

    def _count_while_busy(self, channel: Sender, partner: tuple[int, int], transfer: _Transfer) -> None:
        if self._state is _State.RECEIVING and transfer.seq == 0 and partner == transfer.partner:
            transfer.heard_at_s = self._wall()
            self._request(transfer)  # our first request was lost, PX4 thinks; a different count is ignored
            return
        if partner != transfer.partner:
            self._ack(channel, partner, MissionAck.ERROR, transfer.mission_type)  # and no text [03_upload_bad]
            return
        sending = self._state is _State.SENDING
        self._radio.text(Severity.CRITICAL, "WPM: IGN MISSION_COUNT: Busy" if sending else "WPM: REJ. CMD: Busy")
        self._ack(channel, partner, MissionAck.ERROR, transfer.mission_type)

    def on_item(self, channel: Sender, message: Message) -> None:
        """MISSION_ITEM_INT, or MISSION_ITEM: the next item of an upload."""
        partner = (message.get_srcSystem(), message.get_srcComponent())
        transfer = self._transfer
        if transfer is None or self._state is not _State.RECEIVING:
            self._stray_item(channel, partner, message)
            return
        self._int_mode = message.get_type() == "MISSION_ITEM_INT"
        if partner != transfer.partner:
            return
        transfer.heard_at_s = self._wall()
        if message.seq != transfer.seq:
            return  # the repeated request shows the partner which one is wanted
        item = items.from_message(message)
        result = refusal(item, transfer.mission_type, self._profile, self._airframe)
        if result is MissionAck.ACCEPTED and transfer.mission_type == MissionType.FENCE:
            result = fence_refusal(item)
        if result is not MissionAck.ACCEPTED:
            self._end()
            if result is not MissionAck.ERROR:
                self._radio.text(Severity.CRITICAL, "IGN MISSION_ITEM: Invalid item")
            self._ack(channel, partner, result, transfer.mission_type)
            return
        self._take(transfer, item, bool(message.current))

    def _take(self, transfer: _Transfer, item: items.Item, current: bool) -> None:
        if current:
            transfer.start_seq = transfer.seq
        transfer.received.append(item)
        transfer.seq += 1
        if transfer.seq < transfer.count:
            self._request(transfer)
            return
        plan = plan_of(transfer.received)
        if transfer.mission_type == MissionType.FENCE:
            plan = type(plan)(tuple(stored_fence_item(one) for one in plan.items), plan.plan_id)
        self._store.commit(transfer.mission_type, plan, transfer.start_seq)
        self._last_upload = (transfer.mission_type, transfer.count)
        self._end()
        self._ack(transfer.channel, transfer.partner, MissionAck.ACCEPTED, transfer.mission_type, plan.plan_id)

    def _stray_item(self, channel: Sender, partner: tuple[int, int], message: Message) -> None:
        if self._state is _State.IDLE and self._last_upload == (message.mission_type, message.seq + 1):
            plan_id = self._store.plan(message.mission_type).plan_id
            self._ack(channel, partner, MissionAck.ACCEPTED, message.mission_type, plan_id)
            return
        busy = self._state is not _State.IDLE
        self._radio.text(Severity.CRITICAL, f"IGN MISSION_ITEM: {'Busy' if busy else 'No transfer'}")
        self._ack(channel, partner, MissionAck.ERROR, message.mission_type)

    # sending ------------------------------------------------------------------------------------------------

    def on_request_list(self, channel: Sender, message: Message) -> None:
        """MISSION_REQUEST_LIST: begin a download, or begin it again."""
        if self._state is _State.RECEIVING:
            self._radio.text(Severity.INFO, "Mission download request ignored, already active")
            return
        partner = (message.get_srcSystem(), message.get_srcComponent())
        count = len(self._store.plan(message.mission_type))
        self._partners[id(channel)] = channel, partner
        transfer = _Transfer(channel, partner, message.mission_type, count, heard_at_s=self._wall())
        self._send_count(transfer)
        if count > 0:
            self._state, self._transfer = _State.SENDING, transfer
        else:
            self._end()

    def on_request(self, channel: Sender, message: Message) -> None:
        """MISSION_REQUEST_INT or MISSION_REQUEST: one item of a download. Ignored without a transfer."""
        self._int_mode = message.get_type() == "MISSION_REQUEST_INT"
        partner = (message.get_srcSystem(), message.get_srcComponent())
        transfer = self._transfer
        if transfer is None:
            return
        if self._state is _State.RECEIVING or partner != transfer.partner:
            self._radio.text(Severity.CRITICAL, "WPM: REJ. CMD: Busy")
            return
        transfer.heard_at_s = self._wall()
        if message.seq >= transfer.count or message.seq not in (transfer.seq, transfer.seq - 1):
            self._end()
            self._radio.text(Severity.CRITICAL, "WPM: REJ. CMD: Req. WP was unexpected")
            self._ack(channel, partner, MissionAck.ERROR, transfer.mission_type)
            return
        item = self._store.plan(transfer.mission_type).items[message.seq]
        transfer.seq = message.seq + 1
        transfer.spoke_at_s = self._wall()
        is_mission = transfer.mission_type == MissionType.MISSION
        current = message.seq == (self._store.current_seq if is_mission else 0)
        reply = items.to_message(item, message.seq, current, partner, transfer.mission_type)
        self._radio.reply(channel, reply)

    def on_ack(self, _channel: Sender, message: Message) -> None:
        """MISSION_ACK from the ground: a download is complete, or a transfer is cancelled."""
        transfer = self._transfer
        if transfer is None or (message.get_srcSystem(), message.get_srcComponent()) != transfer.partner:
            return
        if self._state is _State.SENDING or message.type == MissionAck.OPERATION_CANCELLED:
            self._end()

    def on_clear(self, channel: Sender, message: Message) -> None:
        if self.busy:
            self._radio.text(Severity.CRITICAL, "WPM: IGN CLEAR CMD: Busy")
            return
        self._store.clear(message.mission_type)
        partner = (message.get_srcSystem(), message.get_srcComponent())
        self._ack(channel, partner, MissionAck.ACCEPTED, message.mission_type)

    # helpers ------------------------------------------------------------------------------------------------

    def _end(self) -> None:
        self._state = _State.IDLE
        self._transfer = None

    def _request(self, transfer: _Transfer) -> None:
        kind = (
            mavlink.MAVLink_mission_request_int_message if self._int_mode else mavlink.MAVLink_mission_request_message
        )
        transfer.spoke_at_s = self._wall()
        self._radio.reply(transfer.channel, kind(*transfer.partner, transfer.seq, transfer.mission_type))

    def _send_count(self, transfer: _Transfer) -> None:
        transfer.spoke_at_s = self._wall()
        plan_id = self._reported(self._store.plan(transfer.mission_type).plan_id)
        message = mavlink.MAVLink_mission_count_message(
            *transfer.partner, transfer.count, transfer.mission_type, plan_id
        )
        self._radio.reply(transfer.channel, message)

    def _ack(self, channel: Sender, partner: tuple[int, int], result: int, mission_type: int, plan_id: int = 0) -> None:
        if self._faults.take_lost_ack():
            return
        message = mavlink.MAVLink_mission_ack_message(*partner, result, mission_type, self._reported(plan_id))
        self._radio.reply(channel, message)

    def _reported(self, plan_id: int) -> int:
        return plan_id if self._profile.reports_mission_ids else 0


def _limit(mission_type: int) -> int:
    """Items that fit; 0 for an unknown type."""
    return LIMITS[MissionType(mission_type)] if mission_type in (0, 1, 2) else 0
