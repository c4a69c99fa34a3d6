"""The services that the API uses, and the keys under which handlers find them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from aiohttp import web

from app.api.ports import (
    FleetApi,
    GatewaysApi,
    JobsApi,
    LinksApi,
    ReroutingApi,
    RunsApi,
    SimulationApi,
    VehicleCommandsApi,
    WebhooksApi,
)
from app.domain.ports.journal import EventReader
from app.domain.ports.stores import AnswerStore, ClaimStore
from app.services.access import Access
from app.services.attachments import Attachments
from app.services.audit import Audit
from app.services.clock import Clock
from app.services.delivery_reports import Comparisons, DeliveryReports
from app.services.loop_watch import LoopWatch
from app.services.offboard import Offboard
from app.services.plans import Plans
from app.services.site_lease import SiteLease
from app.services.targets import Targets
from app.services.tasks import Tasks

ReadinessCheck = Callable[[], str | None]
"""Return None when ready, else the reason."""


@dataclass(frozen=True, slots=True)
class ApiServices:
    """The dependencies of `build_app`. `readiness` adds checks to /readyz, by name (`links`).

    `offboard` and `tasks` exist only on the gateway that has the vehicles; without them `gateways` says where that
    is. With `claims`, several nodes may get the same request. `site` is what a gateway of a cluster knows of its site.
    """

    journal: EventReader
    plans: Plans
    attachments: Attachments
    delivery_reports: DeliveryReports
    comparisons: Comparisons
    access: Access
    fleet: FleetApi
    runs: RunsApi
    rerouting: ReroutingApi
    targets: Targets
    jobs: JobsApi
    commands: VehicleCommandsApi
    offboard: Offboard | None
    tasks: Tasks | None
    simulation: SimulationApi
    webhooks: WebhooksApi
    answers: AnswerStore
    links: LinksApi
    audit: Audit
    loop_watch: LoopWatch
    clock: Clock
    gateways: GatewaysApi | None = None
    claims: ClaimStore | None = None
    readiness: Mapping[str, ReadinessCheck] = field(default_factory=dict)
    site: SiteLease | None = None


SERVICES: Final = web.AppKey("services", ApiServices)
OFFBOARD: Final = web.AppKey("offboard", Offboard)
TASKS: Final = web.AppKey("tasks", Tasks)
GATEWAYS: Final[web.AppKey[GatewaysApi]] = web.AppKey("gateways")


def install(app: web.Application, services: ApiServices) -> None:
    """Store the services for the handlers; under keys of their own those that not every application has."""
    app[SERVICES] = services
    if services.offboard is not None:
        app[OFFBOARD] = services.offboard
    if services.tasks is not None:
        app[TASKS] = services.tasks
    if services.gateways is not None:
        app[GATEWAYS] = services.gateways
