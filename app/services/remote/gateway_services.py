"""What a gateway commands its vehicles with. It imports nothing of a cluster: a single Waydrop has it, too."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.ports.journal import EventJournal
from app.services.fleet import Fleet
from app.services.jobs import Jobs
from app.services.plans import Plans
from app.services.runs import Runs
from app.services.runs.rerouting import Rerouting
from app.services.targets import Targets
from app.services.vehicle_commands import VehicleCommands
from app.services.vehicle_links import VehicleLinks


@dataclass(frozen=True, slots=True)
class GatewayServices:
    """The services that calls of API nodes reach."""

    fleet: Fleet
    commands: VehicleCommands
    links: VehicleLinks
    plans: Plans
    runs: Runs
    rerouting: Rerouting
    jobs: Jobs
    targets: Targets
    journal: EventJournal
