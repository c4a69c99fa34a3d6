"""Vehicles of all sites: gateways report them several times a second, API nodes keep the newest report."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from typing import Any, Final, Protocol, get_type_hints

import structlog
from pydantic import ValidationError, create_model

from app.domain.cluster.envelope import site_of
from app.domain.cluster.errors import BusDownError
from app.domain.cluster.ports import Bus, GatewayReport, GatewaySite, calls_of, states_of
from app.domain.errors import NotFoundError, VehicleQuarantinedError
from app.domain.ports.journal import EventReader
from app.domain.vehicle.link_security import Refused, Relayed
from app.domain.vehicle.state import VehicleProfile
from app.services.clock import Clock
from app.services.remote.calls import CALL_TIMEOUT_S, Caller
from app.services.vehicle_links import LinkKeySetUp
from app.services.views import SiteStatus, VehicleView

log = structlog.get_logger(__name__)

SILENT_S: Final = 3.0
"""A vehicle that was not reported for so long is shown as disconnected."""
MISSED_S: Final = 30.0
"""So long a vehicle is shown that its gateway does not report any more: one that restarts has not heard all yet."""

WIRE_FIELDS: Final[dict[str, Any]] = {
    field.name: (get_type_hints(VehicleProfile)[field.name], ...)
    for field in fields(VehicleProfile)
    if field.init and field.name != "assuming"
}
WireProfile: Final = create_model("WireProfile", **WIRE_FIELDS)
"""A VehicleProfile as it travels."""


class SiteHead(GatewayReport):
    """What a gateway reports of itself. `url` is where its own page and API are, empty if nobody but its site reaches
    them.

    `address` is where calls to it go: see RemoteCall.
    """

    url: str
    address: str = ""


class SiteReport(SiteHead):
    """What a gateway reports."""

    vehicles: tuple[VehicleView, ...]


_VEHICLES: Final = b',"vehicles":'


def head_of(message: bytes) -> SiteHead:
    """A report without its vehicles, which are most of it. Raises ValidationError."""
    head, found, _ = message.partition(_VEHICLES)
    return SiteHead.model_validate_json(head + b"}" if found else message)


class Fleetlike(Protocol):
    """What a reporter needs of the fleet."""

    def vehicles(self) -> Sequence[VehicleView]:
        """All vehicles."""


class Reporter:
    """Reports a gateway's vehicles. What cannot be sent is left out: only the newest report counts."""

    def __init__(self, part: GatewaySite, url: str, fleet: Fleetlike, journal: EventReader, bus: Bus) -> None:
        self._part = part
        self._url = url
        self._fleet = fleet
        self._journal = journal
        self._bus = bus

    async def run(self, period_s: float) -> None:
        """Report until cancelled."""
        while True:
            report = SiteReport(
                gateway=self._part.gateway,
                site=self._part.site,
                seq=self._journal.last_seq,
                url=self._url,
                address=self._part.address,
                vehicles=tuple(self._fleet.vehicles()),
            )
            with suppress(BusDownError):
                await self._bus.publish(states_of(report.site), report.model_dump_json().encode())
            await asyncio.sleep(period_s)


@dataclass(slots=True)
class _ReceivedReport:
    """The newest report of a site. Its vehicles are parsed when somebody asks for them: a node that is late parses
    none that a newer report has replaced.
    """

    head: SiteHead
    at_s: float
    _message: bytes | None
    _parsed: Mapping[str, tuple[VehicleView, float]] = field(default_factory=dict)
    _parsed_at_s: float = -math.inf

    def followed_by(self, head: SiteHead, message: bytes, now_s: float) -> _ReceivedReport:
        return _ReceivedReport(head, now_s, message, self._parsed, self._parsed_at_s)

    def vehicles(self) -> Mapping[str, tuple[VehicleView, float]]:
        """By their ids, each with the time of its report: those of the newest report that can be read, whose time is
        `at_s`, and those that are missing in it.
        """
        message, self._message = self._message, None
        if message is not None:
            try:
                reported = {view.id: (view, self.at_s) for view in SiteReport.model_validate_json(message).vehicles}
                missing = {of: seen for of, seen in self._parsed.items() if self.at_s - seen[1] < MISSED_S}
                self._parsed, self._parsed_at_s = missing | reported, self.at_s
            except ValidationError as error:
                _log_unreadable(error)
                self.at_s = self._parsed_at_s
        return self._parsed


def _log_unreadable(error: ValidationError) -> None:
    log.warning("a gateway's report cannot be read", problem=error.errors(include_url=False)[0]["msg"])


class RemoteFleet:
    """The vehicles of all sites as an API node sees them: the reading part of FleetApi."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._reports: dict[str, _ReceivedReport] = {}
        self._second: dict[str, tuple[str, str]] = {}

    def receive(self, message: bytes) -> GatewayReport | None:
        """Take a report; what it says, also if another gateway has its site. None: it cannot be read."""
        try:
            head = head_of(message)
        except ValidationError as error:
            _log_unreadable(error)
            return None
        now_s, known = self._clock.monotonic(), self._reports.get(head.site)
        if known is None:
            self._take(_ReceivedReport(head, now_s, message))
        elif _place(known.head) == _place(head) or self._is_silent(known):
            self._take(known.followed_by(head, message, now_s))
        else:
            self._log_second(known.head, head)
        return head

    def _take(self, received: _ReceivedReport) -> None:
        self._reports[received.head.site] = received

    def _log_second(self, known: SiteHead, other: SiteHead) -> None:
        if self._second.get(known.site) != _place(other):  # it reports several times a second
            self._second[known.site] = _place(other)
            log.error("two gateways have one site", site=known.site, one=known.gateway, other=other.gateway)

    def sites(self) -> Sequence[str]:
        """The sites that have reported since the start of this node."""
        return sorted(self._reports)

    def url_of(self, vehicle_id: str) -> str:
        """Where the vehicle's gateway is; empty if it does not say. Raises NotFoundError: no site has this name."""
        known = self._reports.get(site_of(vehicle_id))
        if known is None:
            raise self._unknown(vehicle_id)
        return known.head.url

    def site_statuses(self) -> Sequence[SiteStatus]:
        """The same with what is known of each."""
        return [self._status_of(self._reports[site]) for site in self.sites()]

    def _status_of(self, received: _ReceivedReport) -> SiteStatus:
        head = received.head
        return SiteStatus(
            site=head.site,
            gateway=head.gateway,
            url=head.url,
            connected=not self._is_silent(received),
            report_age_s=round(self._clock.monotonic() - received.at_s, 3),
            seq=head.seq,
            vehicle_ids=tuple(sorted(received.vehicles())),
        )

    def gateway_of(self, site: str) -> str | None:
        """The gateway of a site; None if it does not report."""
        known = self._reports.get(site)
        return None if known is None or self._is_silent(known) else known.head.gateway

    def urls(self) -> Sequence[str]:
        return [url for site in self.sites() if (url := self._reports[site].head.url)]

    def vehicles(self) -> Sequence[VehicleView]:
        found = (seen for site in self.sites() for seen in self._reports[site].vehicles().values())
        return [self._shown(view, at_s) for view, at_s in found]

    def view(self, vehicle_id: str) -> VehicleView:
        received = self._reports.get(site_of(vehicle_id))
        seen = None if received is None else received.vehicles().get(vehicle_id)
        if seen is None:
            raise self._unknown(vehicle_id)
        return self._shown(*seen)

    def require_site(self, vehicle_id: str) -> None:
        """Raises NotFoundError: no gateway of the vehicle's site has reported."""
        if site_of(vehicle_id) not in self._reports:
            raise self._unknown(vehicle_id)

    def _unknown(self, vehicle_id: str) -> NotFoundError:
        known = ", ".join(view.id for view in self.vehicles()) or "none yet"
        return NotFoundError(
            f"no vehicle {vehicle_id!r} is reported by a gateway",
            hint=f"reported: {known}. Of one that is off since its gateway started, runs and jobs are listed",
        )

    def require_usable(self, vehicle_id: str) -> None:
        if self.view(vehicle_id).quarantined is not None:
            raise VehicleQuarantinedError(f"vehicle {vehicle_id} is quarantined: two vehicles have its system id")

    def _shown(self, view: VehicleView, reported_s: float) -> VehicleView:
        silent_s, state = self._clock.monotonic() - reported_s, view.state
        if silent_s <= SILENT_S:
            return view
        ages = {name: getattr(state, name) for name in ("position_age_s", "heartbeat_age_s")}
        older = {name: age_s + silent_s for name, age_s in ages.items() if age_s is not None}
        return view.model_copy(update={"state": state.model_copy(update={"connected": False, **older})})

    def _is_silent(self, received: _ReceivedReport) -> bool:
        return self._clock.monotonic() - received.at_s > SILENT_S


def _place(report: SiteHead) -> tuple[str, str]:
    return report.gateway, report.address


class Gateways:
    """Calls the gateway that has a vehicle: of two with one site, the one whose reports are shown."""

    def __init__(self, caller: Caller) -> None:
        self._caller = caller
        self._addresses: dict[str, str] = {}

    def set_address(self, site: str, address: str) -> None:
        """The gateway of the site is there now."""
        self._addresses[site] = address

    async def call(
        self, site: str, method: str, returns: type[Any], timeout_s: float = CALL_TIMEOUT_S, /, **arguments: object
    ) -> Any:
        address = self._addresses.get(site, "")
        return await self._caller.call(calls_of(site), site, method, returns, address, timeout_s, **arguments)


class CallableFleet(RemoteFleet):
    """The fleet, its commands and its links: FleetApi, VehicleCommandsApi and LinksApi of an API node."""

    def __init__(self, clock: Clock, gateways: Gateways) -> None:
        super().__init__(clock)
        self._gateways = gateways

    def _take(self, received: _ReceivedReport) -> None:
        super()._take(received)
        self._gateways.set_address(received.head.site, received.head.address)

    async def facts(self, vehicle_id: str) -> VehicleProfile:
        self.view(vehicle_id)
        wire = await self._gateways.call(site_of(vehicle_id), "facts", WireProfile, vehicle_id=vehicle_id)
        return VehicleProfile(**{name: getattr(wire, name) for name in WIRE_FIELDS})

    async def end_quarantine(self, vehicle_id: str, actor: str) -> VehicleView:
        return await self._command("end_quarantine", vehicle_id, actor)

    async def hold(self, vehicle_id: str, actor: str) -> VehicleView:
        return await self._command("hold", vehicle_id, actor)

    async def return_to_launch(self, vehicle_id: str, actor: str) -> VehicleView:
        return await self._command("return_vehicle", vehicle_id, actor)

    async def land(self, vehicle_id: str, actor: str) -> VehicleView:
        return await self._command("land_vehicle", vehicle_id, actor)

    def refused(self) -> Sequence[Refused]:
        """See LinksApi: each gateway counts its own."""
        return ()

    def relayed(self) -> Sequence[Relayed]:
        """See LinksApi: each gateway counts its own."""
        return ()

    async def set_up_signing(self, vehicle_id: str, actor: str) -> LinkKeySetUp:
        self.view(vehicle_id)
        site = site_of(vehicle_id)
        done: LinkKeySetUp = await self._gateways.call(
            site, "set_up_signing", LinkKeySetUp, vehicle_id=vehicle_id, actor=actor
        )
        return done

    async def _command(self, method: str, vehicle_id: str, actor: str) -> VehicleView:
        self.view(vehicle_id)
        site = site_of(vehicle_id)
        view: VehicleView = await self._gateways.call(site, method, VehicleView, vehicle_id=vehicle_id, actor=actor)
        return view
