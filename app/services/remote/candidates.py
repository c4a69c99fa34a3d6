"""The vehicles of all sites that may fly a job, as their gateways assess them."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from app.domain.cluster.envelope import site_of
from app.domain.cluster.errors import GatewayUnreachableError, NoReplyError
from app.domain.jobs.assignment import best_of
from app.domain.jobs.job import Candidate
from app.domain.ports.stores import StoredPlan
from app.services.jobs.views import AssignmentView, JobRequest
from app.services.remote.calls import CALL_TIMEOUT_S
from app.services.remote.fleet import Gateways, RemoteFleet

T = TypeVar("T")


class SiteCandidates:
    """Asks the gateways. Sites that do not answer have no candidates."""

    def __init__(self, fleet: RemoteFleet, gateways: Gateways) -> None:
        self._fleet = fleet
        self._gateways = gateways

    def sites_for(self, order: JobRequest) -> Sequence[str]:
        """The sites that may fly it. Raises NotFoundError: a vehicle that it names. GatewayUnreachableError."""
        named = order.selector().named
        for vehicle_id in named:
            self._fleet.view(vehicle_id)
        sites = sorted({site_of(vehicle_id) for vehicle_id in named}) if named else self._fleet.sites()
        if not sites:
            raise GatewayUnreachableError("no gateway has reported yet", hint="see that gateways run and reach NATS")
        return sites

    async def assessed(
        self, order: JobRequest, plan: StoredPlan | None, timeout_s: float = CALL_TIMEOUT_S
    ) -> tuple[Candidate, ...]:
        """All candidates; of those that their sites chose, the best one stays chosen.

        Raises as sites_for, and BusDownError.
        """
        sites = [site for site in self.sites_for(order) if self._fleet.gateway_of(site) is not None]
        asked = {site: {"order": at_site(site, order), "plan": plan} for site in sites}
        views = await self.all_that_answer(asked, "check_job", AssignmentView, timeout_s)
        candidates = [one for view in views.values() for one in view.candidates]
        able = [one for one in candidates if one.chosen]
        chosen = best_of(able).vehicle_id if able else None
        return tuple(one.model_copy(update={"chosen": one.vehicle_id == chosen}) for one in candidates)

    async def all_that_answer(
        self,
        asked: Mapping[str, Mapping[str, Any]],
        method: str,
        returns: type[T],
        timeout_s: float = CALL_TIMEOUT_S,
    ) -> Mapping[str, T]:
        """What each site answers."""
        calls = (
            self._gateways.call(site, method, returns, timeout_s, **arguments) for site, arguments in asked.items()
        )
        found: dict[str, T] = {}
        for site, answer in zip(asked, await asyncio.gather(*calls, return_exceptions=True), strict=True):
            if isinstance(answer, GatewayUnreachableError | NoReplyError):
                continue
            if isinstance(answer, BaseException):
                raise answer
            found[site] = answer
        return found


def at_site(site: str, order: JobRequest) -> JobRequest:
    """The order as one site gets it: without vehicles of others."""
    here = tuple(one for one in order.allowed_vehicles if site_of(one) == site)
    return order.model_copy(update={"allowed_vehicles": here})
