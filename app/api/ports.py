"""What the API needs of services that a gateway and an API node of a cluster have of different kinds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from app.domain.drop.consent import Answer
from app.domain.jobs.job import Job
from app.domain.ports.journal import RunReader
from app.domain.ports.simulated_vehicles import Fault
from app.domain.ports.stores import ALL_JOBS, AnswerTo, JobFilter
from app.domain.prediction import CALM, Wind
from app.domain.run.run import Run
from app.domain.vehicle.link_security import Refused, Relayed
from app.domain.vehicle.state import VehicleProfile
from app.services.jobs.views import AssignmentView, JobQueuesView, JobRequest, JobUpdate, VehicleQueueView
from app.services.simulation import FaultSet, SimulatorView, SpeedView
from app.services.vehicle_links import LinkKeySetUp
from app.services.views import SiteStatus, VehicleView
from app.services.webhooks.views import WebhookRequest, WebhookTestView, WebhookUpdate, WebhookView

# Each method raises what the service's own does, and on an API node GatewayUnreachableError and NoReplyError too.


class FleetApi(Protocol):
    """The vehicles."""

    def vehicles(self) -> Sequence[VehicleView]:
        """All vehicles, by id."""

    def view(self, vehicle_id: str) -> VehicleView:
        """One vehicle. Raises NotFoundError."""

    def require_usable(self, vehicle_id: str) -> None:
        """Raises NotFoundError, VehicleQuarantinedError."""

    async def facts(self, vehicle_id: str) -> VehicleProfile:
        """What plans are checked against. Raises NotFoundError, VehicleQuarantinedError, LinkError."""

    async def end_quarantine(self, vehicle_id: str, actor: str) -> VehicleView:
        """A user decides that one vehicle is left. Raises NotFoundError, ConflictError."""


class VehicleCommandsApi(Protocol):
    """Commands outside a run. Each returns the vehicle as it is then."""

    async def hold(self, vehicle_id: str, actor: str) -> VehicleView:
        """Enter Hold mode."""

    async def return_to_launch(self, vehicle_id: str, actor: str) -> VehicleView:
        """Return mode."""

    async def land(self, vehicle_id: str, actor: str) -> VehicleView:
        """Land mode."""


class LinksApi(Protocol):
    """The vehicle links and their guards."""

    def refused(self) -> Sequence[Refused]:
        """Frames rejected since the start, by connection and reason."""

    def relayed(self) -> Sequence[Relayed]:
        """What passed since the start, by connection."""

    async def set_up_signing(self, vehicle_id: str, actor: str) -> LinkKeySetUp:
        """Send a vehicle its newest key over its link."""


class SimulationApi(Protocol):
    """The simulated vehicles behind the real ones."""

    async def view(self) -> SimulatorView:
        """Their true state, or that none are there."""

    async def set_fault(self, fault: Fault, actor: str) -> FaultSet:
        """Set or clear a fault. Raises SimulatorNotRunningError and others of Simulation."""

    async def set_speed(self, speed: float, actor: str) -> SpeedView:
        """Set the speed of simulated time. Raises as set_fault."""


class GatewaysApi(Protocol):
    """The gateways of a cluster, as an API node knows them."""

    def site_statuses(self) -> Sequence[SiteStatus]:
        """The sites that have reported since the start of this node, by name."""

    def url_of(self, vehicle_id: str) -> str:
        """The gateway that has the vehicle; empty if it does not say. Raises NotFoundError: no site has this name."""


class RunsApi(RunReader, Protocol):
    """Runs, and their commands."""

    async def open_and_recent(self, recent: int) -> Sequence[Run]:
        """All open runs and the newest ones, each once, newest first."""

    async def create(
        self,
        plan: str,
        vehicle_id: str,
        *,
        start: bool,
        actor: str,
        wind: Wind = CALM,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """Create a run and begin its upload. `answer`: stored in the same commit, if it is stored here."""

    async def start(self, run_id: str) -> Run:
        """Start an uploaded run."""

    async def pause(self, run_id: str) -> Run:
        """Enter Hold mode."""

    async def resume(self, run_id: str) -> Run:
        """Fly on."""

    async def return_to_launch(self, run_id: str) -> Run:
        """Return."""

    async def divert(self, run_id: str) -> Run:
        """Return to a rally point."""

    async def land(self, run_id: str) -> Run:
        """Land where it is."""

    async def abort(self, run_id: str) -> Run:
        """Before takeoff: cancel. In flight: return."""

    async def answer_consent(self, run_id: str, plan_item_id: str, answer: Answer, actor: str) -> Run:
        """Answer a consent request of a drop."""


class ReroutingApi(Protocol):
    """Changes of the mission of a run. `answer`: stored in the same commit, if it is stored here."""

    async def change(
        self,
        run_id: str,
        plan_id: str | None,
        continue_at: str | None,
        actor: str,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """Fly on with another plan, or from another item."""

    async def insert(
        self,
        run_id: str,
        items: Sequence[Any],
        *,
        at: str,
        after: bool,
        actor: str,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """Fly to more items."""

    async def continue_over(
        self,
        run_id: str,
        continue_at: str | None,
        wind: Wind | None,
        actor: str,
        answer: AnswerTo[Run] | None = None,
    ) -> Run:
        """Create a run of the remaining items of one that has ended."""


class JobsApi(Protocol):
    """The queue of jobs."""

    async def create(self, request: JobRequest, actor: str, answer: AnswerTo[Job] | None = None) -> Job:
        """A new job. `answer`: stored in the same commit, if it is stored here."""

    async def check(self, request: JobRequest) -> AssignmentView:
        """Which vehicle would get it now."""

    async def get(self, job_id: str) -> Job:
        """One job."""

    async def list_jobs(self, limit: int, wanted: JobFilter = ALL_JOBS) -> Sequence[Job]:
        """Newest first."""

    async def cancel(self, job_id: str, actor: str) -> Job:
        """End a job that does not fly."""

    async def move(self, job_id: str, move: JobUpdate, actor: str) -> Job:
        """Another place for a job that waits."""

    async def clear_claim(self, job_id: str, actor: str) -> Job:
        """Take a job from a gateway that does not answer: another one may get it."""

    async def queues(self) -> JobQueuesView:
        """All waiting jobs, and the state of each vehicle's queue."""

    async def stop(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        """Begin and start nothing on this vehicle."""

    async def resume(self, vehicle_id: str, actor: str) -> VehicleQueueView:
        """Resume the queue of a vehicle."""


class WebhooksApi(Protocol):
    """Webhooks and their delivery."""

    async def create(self, request: WebhookRequest, *, actor: str) -> tuple[WebhookView, str]:
        """A new webhook and its secret."""

    async def list_webhooks(self) -> Sequence[WebhookView]:
        """All, oldest first."""

    async def get(self, hook_id: str) -> WebhookView:
        """One."""

    async def change(self, hook_id: str, change: WebhookUpdate, *, actor: str) -> WebhookView:
        """Change the given fields."""

    async def delete(self, hook_id: str, *, actor: str) -> None:
        """Remove it."""

    async def test(self, hook_id: str) -> WebhookTestView:
        """Send a test message."""
