"""The vehicles of all sites that may fly a job, as their gateways assess them."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Mapping, Sequence
from typing import Any, Final, TypeVar

import structlog

from app.domain.cluster.envelope import site_of
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, NoReplyError
from app.domain.errors import WaydropError
from app.domain.jobs.assignment import choose
from app.domain.jobs.job import Candidate
from app.domain.ports.stores import StoredPlan
from app.services.jobs.views import AssignmentView, JobRequest
from app.services.remote.calls import CALL_TIMEOUT_S
from app.services.remote.fleet import Gateways, RemoteFleet

T = TypeVar("T")
log = structlog.get_logger(__name__)

ASSESSED_S: Final = 2.0
FACTS_S: Final = 1.0
"""Vehicles that are slower to report their parameters are no candidates yet: their gateway goes on reading."""


class SiteCandidates:
    """Asks the gateways. Sites that do not answer have no candidates."""

    def __init__(self, fleet: RemoteFleet, gateways: Gateways) -> None:
        self._fleet = fleet
        self._gateways = gateways

    def sites_for(self, request: JobRequest) -> Sequence[str]:
        """The sites that may fly it. Raises NotFoundError: a vehicle that it names. GatewayUnreachableError.

        Of a single site its gateway knows better: after a restart a vehicle that is off is in its journal alone.
        """
        sites = self._sites(request)
        for vehicle_id in request.selector().named:
            if len(sites) == 1:
                self._fleet.require_site(vehicle_id)
            else:
                self._fleet.view(vehicle_id)
        if not sites:
            raise GatewayUnreachableError("no gateway has reported yet", hint="see that gateways run and reach NATS")
        return sites

    def _sites(self, request: JobRequest) -> Sequence[str]:
        named = request.selector().named
        return sorted({site_of(vehicle_id) for vehicle_id in named}) if named else self._fleet.sites()

    async def assessed(self, request: JobRequest, plan: StoredPlan | None) -> tuple[Candidate, ...]:
        """All candidates of all sites; of those that can fly it, the best one is chosen.

        Raises as sites_for, BusDownError, and what all sites that answer raise.
        """
        return await self._assessed(self.sites_for(request), request, plan)

    async def assessed_soon(
        self, request: JobRequest, plan: StoredPlan, avoided: Collection[str] = ()
    ) -> tuple[Candidate, ...]:
        """The same of the sites that answer soon: one that does not holds up no job. Raises as assessed."""
        asked = [site for site in self._sites(request) if site not in avoided]
        return await self._assessed(asked, request, plan, ASSESSED_S, facts_s=FACTS_S)

    async def _assessed(
        self,
        sites: Sequence[str],
        request: JobRequest,
        plan: StoredPlan | None,
        timeout_s: float = CALL_TIMEOUT_S,
        **limits: float,
    ) -> tuple[Candidate, ...]:
        reporting = [site for site in sites if self._fleet.gateway_of(site) is not None]
        asked = {site: {"order": at_site(site, request), "plan": plan, **limits} for site in reporting}
        views = await self.all_that_answer(asked, "check_job", AssignmentView, timeout_s)
        candidates = [one for view in views.values() for one in view.candidates]
        return choose([one.model_copy(update={"chosen": False, "reason": None}) for one in candidates])

    async def all_that_answer(
        self,
        asked: Mapping[str, Mapping[str, Any]],
        method: str,
        returns: type[T],
        timeout_s: float = CALL_TIMEOUT_S,
    ) -> Mapping[str, T]:
        """What each site answers. Raises BusDownError, and what one site raises if no other one answers."""
        calls = (self._gateways.call(site, method, returns, timeout_s, **one) for site, one in asked.items())
        found: dict[str, T] = {}
        refused: WaydropError | None = None
        for site, answer in zip(asked, await asyncio.gather(*calls, return_exceptions=True), strict=True):
            if isinstance(answer, BusDownError) or not isinstance(answer, WaydropError | returns):
                raise answer
            if isinstance(answer, GatewayUnreachableError | NoReplyError):
                continue
            if isinstance(answer, WaydropError):
                log.warning("a site is left out", site=site, method=method, error=answer.detail)
                refused = answer
            else:
                found[site] = answer
        if refused is not None and not found:
            raise refused
        return found


def at_site(site: str, request: JobRequest) -> JobRequest:
    """The request as one site gets it: without vehicles of others."""
    here = tuple(one for one in request.allowed_vehicles if site_of(one) == site)
    return request.model_copy(update={"allowed_vehicles": here})
