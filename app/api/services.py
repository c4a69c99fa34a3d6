"""The services that the API uses, and the keys under which handlers find them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from aiohttp import web

from app.api.ports import (
    AuditApi,
    FleetApi,
    GatewayAddresses,
    JobsApi,
    LinksApi,
    PlansApi,
    ReroutingApi,
    RunsApi,
    SimulationApi,
    TargetsApi,
    TelemetryApi,
    VehicleCommandsApi,
    WebhooksApi,
)
from app.domain.ports.journal import EventReader
from app.domain.ports.stores import AnswerStore, ClaimStore
from app.services.access import Access
from app.services.attachments import Attachments
from app.services.clock import Clock
from app.services.delivery_reports import Comparisons, DeliveryReports
from app.services.loop_watch import LoopWatch
from app.services.offboard import Offboard
from app.services.tasks import Tasks

ReadinessCheck = Callable[[], str | None]
"""Return None when ready, else the reason."""


@dataclass(frozen=True, slots=True)
class ApiServices:
    """The dependencies of `build_app`. `readiness` adds checks to /readyz, by name (`links`).

    `offboard` and `tasks` exist only on the gateway that has the vehicles; without them `gateways` says where that
    is. With `claims`, several nodes may get the same request.
    """

    journal: EventReader
    plans: PlansApi
    attachments: Attachments
    delivery_reports: DeliveryReports
    comparisons: Comparisons
    access: Access
    fleet: FleetApi
    telemetry: TelemetryApi
    runs: RunsApi
    rerouting: ReroutingApi
    targets: TargetsApi
    jobs: JobsApi
    commands: VehicleCommandsApi
    offboard: Offboard | None
    tasks: Tasks | None
    simulation: SimulationApi
    webhooks: WebhooksApi
    answers: AnswerStore
    links: LinksApi
    audit: AuditApi
    loop_watch: LoopWatch
    clock: Clock
    gateways: GatewayAddresses | None = None
    claims: ClaimStore | None = None
    readiness: Mapping[str, ReadinessCheck] = field(default_factory=dict)


ACCESS: Final = web.AppKey("access", Access)
ATTACHMENTS: Final = web.AppKey("attachments", Attachments)
AUDIT: Final[web.AppKey[AuditApi]] = web.AppKey("audit")
CLOCK: Final[web.AppKey[Clock]] = web.AppKey("clock")
COMPARISONS: Final = web.AppKey("comparisons", Comparisons)
COMMANDS: Final[web.AppKey[VehicleCommandsApi]] = web.AppKey("commands")
GATEWAYS: Final[web.AppKey[GatewayAddresses]] = web.AppKey("gateways")
FLEET: Final[web.AppKey[FleetApi]] = web.AppKey("fleet")
JOBS: Final[web.AppKey[JobsApi]] = web.AppKey("jobs")
JOURNAL: Final[web.AppKey[EventReader]] = web.AppKey("journal")
LINKS: Final[web.AppKey[LinksApi]] = web.AppKey("links")
OFFBOARD: Final = web.AppKey("offboard", Offboard)
PLANS: Final[web.AppKey[PlansApi]] = web.AppKey("plans")
DELIVERY_REPORTS: Final = web.AppKey("delivery_reports", DeliveryReports)
RUNS: Final[web.AppKey[RunsApi]] = web.AppKey("runs")
REROUTING: Final[web.AppKey[ReroutingApi]] = web.AppKey("rerouting")
SIMULATION: Final[web.AppKey[SimulationApi]] = web.AppKey("simulation")
WEBHOOKS: Final[web.AppKey[WebhooksApi]] = web.AppKey("webhooks")
TARGETS: Final[web.AppKey[TargetsApi]] = web.AppKey("targets")
TASKS: Final = web.AppKey("tasks", Tasks)


def install(app: web.Application, services: ApiServices) -> None:
    """Store each service under its own key: a handler reaches only the services whose keys it names."""
    app[ACCESS] = services.access
    app[ATTACHMENTS] = services.attachments
    app[AUDIT] = services.audit
    app[CLOCK] = services.clock
    app[COMPARISONS] = services.comparisons
    app[COMMANDS] = services.commands
    app[FLEET] = services.fleet
    app[JOBS] = services.jobs
    app[LINKS] = services.links
    app[JOURNAL] = services.journal
    app[PLANS] = services.plans
    app[DELIVERY_REPORTS] = services.delivery_reports
    app[RUNS] = services.runs
    app[REROUTING] = services.rerouting
    app[SIMULATION] = services.simulation
    app[WEBHOOKS] = services.webhooks
    app[TARGETS] = services.targets
    if services.offboard is not None:
        app[OFFBOARD] = services.offboard
    if services.tasks is not None:
        app[TASKS] = services.tasks
    if services.gateways is not None:
        app[GATEWAYS] = services.gateways
