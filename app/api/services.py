"""The services that the API uses, and the keys under which handlers find them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from aiohttp import web

from app.domain.ports.stores import AnswerStore
from app.services.access import Access
from app.services.attachments import Attachments
from app.services.clock import Clock
from app.services.delivery_reports import Comparisons, DeliveryReports
from app.services.fleet import Fleet
from app.services.jobs import Jobs
from app.services.journal import Journal
from app.services.loop_watch import LoopWatch
from app.services.offboard import Offboard
from app.services.plans import Plans
from app.services.runs import Runs
from app.services.runs.rerouting import Rerouting
from app.services.simulation import Simulation
from app.services.targets import Targets
from app.services.tasks import Tasks
from app.services.telemetry import TelemetryFeed
from app.services.vehicle_commands import VehicleCommands
from app.services.webhooks import Webhooks

ReadinessCheck = Callable[[], str | None]
"""Return None when ready, else the reason."""


@dataclass(frozen=True, slots=True)
class ApiServices:
    """The dependencies of `build_app`. `readiness` adds checks to /readyz, by name (`links`)."""

    journal: Journal
    plans: Plans
    attachments: Attachments
    delivery_reports: DeliveryReports
    comparisons: Comparisons
    access: Access
    fleet: Fleet
    telemetry: TelemetryFeed
    runs: Runs
    rerouting: Rerouting
    targets: Targets
    jobs: Jobs
    commands: VehicleCommands
    offboard: Offboard
    tasks: Tasks
    simulation: Simulation
    webhooks: Webhooks
    answers: AnswerStore
    loop_watch: LoopWatch
    clock: Clock
    readiness: Mapping[str, ReadinessCheck] = field(default_factory=dict)


ACCESS: Final = web.AppKey("access", Access)
ATTACHMENTS: Final = web.AppKey("attachments", Attachments)
CLOCK: Final = web.AppKey("clock", Clock)
COMPARISONS: Final = web.AppKey("comparisons", Comparisons)
COMMANDS: Final = web.AppKey("commands", VehicleCommands)
FLEET: Final = web.AppKey("fleet", Fleet)
JOBS: Final = web.AppKey("jobs", Jobs)
JOURNAL: Final = web.AppKey("journal", Journal)
OFFBOARD: Final = web.AppKey("offboard", Offboard)
PLANS: Final = web.AppKey("plans", Plans)
DELIVERY_REPORTS: Final = web.AppKey("delivery_reports", DeliveryReports)
RUNS: Final = web.AppKey("runs", Runs)
REROUTING: Final = web.AppKey("rerouting", Rerouting)
SIMULATION: Final = web.AppKey("simulation", Simulation)
WEBHOOKS: Final = web.AppKey("webhooks", Webhooks)
TARGETS: Final = web.AppKey("targets", Targets)
TASKS: Final = web.AppKey("tasks", Tasks)


def install(app: web.Application, services: ApiServices) -> None:
    """Store each service under its own key: a handler reaches only the services whose keys it names."""
    app[ACCESS] = services.access
    app[ATTACHMENTS] = services.attachments
    app[CLOCK] = services.clock
    app[COMPARISONS] = services.comparisons
    app[COMMANDS] = services.commands
    app[FLEET] = services.fleet
    app[JOBS] = services.jobs
    app[JOURNAL] = services.journal
    app[OFFBOARD] = services.offboard
    app[PLANS] = services.plans
    app[DELIVERY_REPORTS] = services.delivery_reports
    app[RUNS] = services.runs
    app[REROUTING] = services.rerouting
    app[SIMULATION] = services.simulation
    app[WEBHOOKS] = services.webhooks
    app[TARGETS] = services.targets
    app[TASKS] = services.tasks
