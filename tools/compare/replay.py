"""Flies one recording's ground side against a simulated vehicle, in simulated time."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.fleet import build_vehicle
from app.simulator.options import Options, VehicleOptions
from app.simulator.vehicle import Vehicle
from tools.compare.trace import Dialogue, Fields, ReceivedMessage, Sent, Trace

# The recorded ground side as a schedule: it sends what was sent then, when the vehicle is as far as it was then.
#
# A person or program on the ground acts on what the vehicle did last (it arrived, it landed), so the schedule's time
# stands still until the simulated vehicle has done the same, and jumps ahead when it is earlier. Inside a mission
# transfer every message waits for the request that it answers.


MAX_WAIT_S = 20.0
"""So long the schedule waits for an action of the vehicle; then it goes on without."""
ANSWER_S = 0.05
"""A message sent so soon after a request of the mission protocol is its answer."""
SAME_MOMENT_S = 0.008
"""The vehicle works between two messages that were sent further apart."""
HEARTBEAT_S = 1.0
REQUESTS = ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM")


@dataclass(frozen=True, slots=True)
class VehicleAction:
    """Something the vehicle did that a ground side may act on."""

    t_s: float
    what: str


def deed_of(name: str, fields: Fields) -> str | None:
    """The action that a message shows, if any."""
    if name == "MISSION_ITEM_REACHED":
        return f"reached {fields['seq']}"
    if name == "EXTENDED_SYS_STATE":
        return f"landed_state {fields['landed_state']}"
    return None


def vehicle_actions(received: tuple[ReceivedMessage, ...]) -> Iterator[VehicleAction]:
    """The actions in order, repetitions left out."""
    last: dict[str, str] = {}
    for one in received:
        what = deed_of(one.name, one.fields)
        if what is not None and last.get(one.name) != what:
            last[one.name] = what
            yield VehicleAction(one.t_s, what)


class Ground:
    """Give it the simulated vehicle's messages with `receive`, ask it with `due` what to send."""

    def __init__(self, recorded: Dialogue) -> None:
        self.now_s = 0.0
        """The recording's time that the schedule has come to."""
        self._sent = deque(_with_answers(recorded))
        acts = [sent.t_s for sent, _ in self._sent if sent.name != "HEARTBEAT"]
        last_act_s = max(acts, default=0.0)
        self._vehicle_actions = deque(
            action for action in vehicle_actions(recorded.received) if 0.0 < action.t_s <= last_act_s
        )
        self._waited_s = 0.0
        self._last: dict[str, str] = {}
        self._asked: set[str] = set()
        self._heartbeat: Sent | None = None
        self._heartbeat_age_s = 0.0
        self.missed: list[str] = []
        """Deeds that did not come in time."""

    def receive(self, name: str, fields: Fields) -> None:
        """A message from the simulated vehicle."""
        if name in REQUESTS:
            self._asked.add(_request_key(name, fields))
        what = deed_of(name, fields)
        if what is None or self._last.get(name) == what:
            return
        self._last[name] = what
        ahead = next((action for action in list(self._vehicle_actions)[:2] if action.what == what), None)
        if ahead is None or ahead.t_s - self.now_s > MAX_WAIT_S:
            return
        while self._vehicle_actions and self._vehicle_actions.popleft() is not ahead:
            pass
        self.now_s = max(self.now_s, ahead.t_s)
        self._waited_s = 0.0

    def advance(self, dt_s: float) -> None:
        """Vehicle time passes."""
        self._heartbeat_age_s += dt_s
        if self._vehicle_actions and self.now_s + dt_s > self._vehicle_actions[0].t_s:
            self._waited_s += dt_s
            if self._waited_s < MAX_WAIT_S:
                return
            self.missed.append(self._vehicle_actions.popleft().what)
            self._waited_s = 0.0
        self.now_s += dt_s

    def due(self) -> Iterator[Sent]:
        """What is to be sent now. Heartbeats go on while the schedule stands still, if they did so at that time."""
        batch_s: float | None = None
        while self._sent and self._sent[0][0].t_s <= self.now_s:
            sent, answers = self._sent[0]
            if batch_s is not None and sent.t_s - batch_s > SAME_MOMENT_S:
                return
            batch_s = sent.t_s
            if answers is not None and answers not in self._asked and self.now_s - sent.t_s < ANSWER_S * 4:
                return
            self._asked.discard(answers or "")
            self._sent.popleft()
            if sent.name == "HEARTBEAT":
                self._heartbeat, self._heartbeat_age_s = sent, 0.0
            yield sent
        stands_still = self._waited_s > 0.0
        heartbeat = self._heartbeat
        if not stands_still or heartbeat is None or self._heartbeat_age_s < HEARTBEAT_S:
            return
        if self.now_s - heartbeat.t_s < 2.0 * HEARTBEAT_S:
            self._heartbeat_age_s = 0.0
            yield heartbeat

    @property
    def done(self) -> bool:
        """Nothing is left to send."""
        return not self._sent


def _with_answers(recorded: Dialogue) -> Iterator[tuple[Sent, str | None]]:
    """Every sent message with the key of the request that it answers, None for one sent of its own accord."""
    requests = deque(received for received in recorded.received if received.name in REQUESTS)
    newest: ReceivedMessage | None = None
    for sent in recorded.sent:
        while requests and requests[0].t_s <= sent.t_s:
            newest = requests.popleft()
        if newest is None or not _is_answer(sent, newest):
            yield sent, None
            continue
        yield sent, _request_key(newest.name, newest.fields)


def _is_answer(sent: Sent, request: ReceivedMessage) -> bool:
    if sent.t_s - request.t_s > ANSWER_S or sent.source[0] != request.fields["target_system"]:
        return False
    if request.name.startswith("MISSION_REQUEST"):
        return sent.name.startswith("MISSION_ITEM") and bool(sent.fields["seq"] == request.fields["seq"])
    return sent.name in ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK")


def _request_key(name: str, fields: Fields) -> str:
    return f"{name} {fields.get('seq', '')} {fields['target_system']}"


NOT_COMPARED = frozenset({"ATTITUDE", "ALTITUDE", "BATTERY_STATUS", "GPS_RAW_INT", "SYS_STATUS", "VFR_HUD", "TIMESYNC"})
"""Streams that no judge looks at: they are not decoded."""


class ReplayLink:
    """A channel as the vehicle's radio sees it; every message is packed and parsed, as on a wire."""

    def __init__(self, name: str | None, take: Callable[[str | None, str, Fields], None]) -> None:
        self.gcs_heard_s: float | None = None
        self._name = name
        self._take = take
        self._packer: Message = None

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        """From the vehicle."""
        name = message.get_type()
        if name in NOT_COMPARED:
            return
        if self._packer is None:
            self._packer = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        parsed = mavlink.MAVLink(None).decode(bytearray(message.pack(self._packer)))
        self._take(self._name, name, {field: _plain(getattr(parsed, field)) for field in parsed.fieldnames})


class Replay:
    """Run it once with `run`; `missed` then names what the ground side waited for in vain."""

    def __init__(self, trace: Trace) -> None:
        self._trace = trace
        self._now_s = 0.0
        self._heard: list[ReceivedMessage] = []
        self._sent: list[Sent] = []
        self._ground = Ground(trace.dialogue)
        self._links: dict[str | None, ReplayLink] = {}
        self._vehicle = self._build()
        self._closes_s = {one.link: one.t_s for one in trace.dialogue.received if one.link is not None}
        """When the recording's further ground stations went away."""
        self._ons = list(trace.on_s)
        self._offs = list(trace.off_s)
        self._powered = True
        self._unsent: list[str] = []

    @property
    def missed(self) -> list[str]:
        """Deeds of the vehicle that the ground side waited for in vain."""
        return self._ground.missed

    @property
    def unsent(self) -> list[str]:
        """Names of recorded messages that cannot be made: not of this dialect, or without all their fields."""
        return self._unsent

    @property
    def wind_m_s(self) -> tuple[float, float]:
        """North and east, that the vehicle flies in."""
        return self._vehicle.faults.wind_north_m_s, self._vehicle.faults.wind_east_m_s

    def run(self) -> Dialogue:
        """As long as the recording, and longer when the ground side had to wait."""
        while self._now_s < self._trace.end_s or not self._ground.done:
            self._step()
        return Dialogue(tuple(self._sent), tuple(self._heard))

    def _build(self) -> Vehicle:
        trace = self._trace
        options = Options(fleet=(), speed=trace.speed, home=trace.home, params=tuple(trace.params.items()))
        entry = VehicleOptions(trace.model, trace.system_id)
        vehicle = build_vehicle(options, 0, entry, lambda: self._now_s / trace.speed)
        vehicle.faults.wind_north_m_s, vehicle.faults.wind_east_m_s = trace.wind_m_s
        names = {None, *(one.link for one in trace.dialogue.sent), *(one.link for one in trace.dialogue.received)}
        for name in sorted(names, key=str):
            self._links[name] = ReplayLink(name, self._take)
            vehicle.radio.channels.append(self._links[name])
        return vehicle

    def _step(self) -> None:
        for sent in self._ground.due():
            self._send(sent)
        self._now_s += VehicleClock.STEP_S
        self._ground.advance(VehicleClock.STEP_S)
        self._switch_power()
        if self._powered:
            self._vehicle.step()
            self._vehicle.poll()

    def _switch_power(self) -> None:
        if self._offs and self._ground.now_s >= self._offs[0]:
            self._offs.pop(0)
            self._powered = False
        if self._ons and self._ground.now_s >= self._ons[0]:
            self._ons.pop(0)
            self._powered = True
            self._vehicle.reboot()

    def _send(self, sent: Sent) -> None:
        message = _message(sent)
        if message is None:
            self._unsent.append(sent.name)
            return
        self._sent.append(Sent(self._now_s, sent.name, sent.fields, sent.source, sent.link))
        if not self._powered:
            return
        packer = mavlink.MAVLink(None, srcSystem=sent.source[0], srcComponent=sent.source[1])
        self._vehicle.receive(self._links[sent.link], mavlink.MAVLink(None).decode(bytearray(message.pack(packer))))

    def _take(self, link: str | None, name: str, fields: Fields) -> None:
        if self._ground.now_s > self._closes_s.get(link or "", math.inf):
            return
        self._heard.append(ReceivedMessage(self._now_s, name, fields, link))
        self._ground.receive(name, fields)


def _message(sent: Sent) -> Message | None:
    """None for one that this dialect does not know, and for one that lacks fields."""
    kind = getattr(mavlink, f"MAVLink_{sent.name.lower()}_message", None)
    if kind is None:
        return None
    fields = {name: _wire_value(value) for name, value in sent.fields.items() if name in kind.fieldnames}
    try:
        return kind(**fields)
    except TypeError:
        return None


def _wire_value(value: Any) -> Any:
    if value is None:
        return math.nan
    return value.encode() if isinstance(value, str) else value


def _plain(value: Any) -> Any:
    """As recordings write it: None for what is no number, text without padding."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value.rstrip("\0") if isinstance(value, str) else value
