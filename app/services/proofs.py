"""Makes proofs of delivery from runs, their plans and their events."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.domain.events import Event
from app.domain.ports import PlanStore
from app.domain.proof import Proof, Story, proof_of
from app.services.clock import Clock
from app.services.journal import Journal
from app.services.runs import Runs

PAGE_EVENTS: Final = 100
"""A run's events hold the whole run each: the journal takes a millisecond of the loop to read one."""


@dataclass(frozen=True, slots=True)
class IssuedProof:
    """A proof, and the document of the plan that it is about: empty if the plan is gone from the disk."""

    proof: Proof
    plan: dict[str, Any]


class Proofs:
    """A proof is made anew from what is stored each time it is asked for."""

    def __init__(self, runs: Runs, plans: PlanStore, journal: Journal, clock: Clock, gateway_id: str) -> None:
        self._runs = runs
        self._plans = plans
        self._journal = journal
        self._clock = clock
        self._gateway_id = gateway_id

    async def of(self, run_id: str) -> IssuedProof:
        """The proof of one run, of this moment. Raises NotFoundError, StorageError."""
        run = await self._runs.get(run_id)
        stored = await self._plans.get(run.plan_id)
        document = {} if stored is None else stored.document
        story, after = Story(), 0
        while events := await self._journal.read(after, PAGE_EVENTS, run_id=run.id):
            await asyncio.to_thread(_tell, story, events)
            after = events[-1].seq
        proof = await asyncio.to_thread(
            proof_of,
            run,
            story,
            gateway=self._gateway_id,
            document=document,
            issued_at=self._clock.now(),
        )
        return IssuedProof(proof, document)


def _tell(story: Story, events: Sequence[Event]) -> None:
    for event in events:
        story.take(event)
