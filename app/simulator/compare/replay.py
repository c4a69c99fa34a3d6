"""Flies one recording's ground side against a simulated vehicle, in simulated time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from app.simulator.clock import VehicleClock
from app.simulator.compare.ground import Ground
from app.simulator.compare.heard import Dialogue, Fields, Heard, Sent
from app.simulator.compare.trace import Trace
from app.simulator.dialect import Message, mavlink
from app.simulator.fleet import build_vehicle
from app.simulator.options import Options, VehicleOptions
from app.simulator.vehicle import Vehicle

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
        self._heard: list[Heard] = []
        self._sent: list[Sent] = []
        self._ground = Ground(trace.dialogue)
        self._links: dict[str | None, ReplayLink] = {}
        self._vehicle = self._build()
        self._closes_s = {one.link: one.t_s for one in trace.dialogue.heard if one.link is not None}
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
        names = {None, *(one.link for one in trace.dialogue.sent), *(one.link for one in trace.dialogue.heard)}
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
        self._heard.append(Heard(self._now_s, name, fields, link))
        self._ground.hear(name, fields)


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
