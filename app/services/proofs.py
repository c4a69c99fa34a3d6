"""Makes proofs of delivery from runs, their plans and their events."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

from app.domain.attachment import PICTURES
from app.domain.attachment_port import AttachmentStore
from app.domain.errors import AttachmentAlteredError
from app.domain.events import Event
from app.domain.ports import PlanStore
from app.domain.proof import Proof, Story, proof_of
from app.services.clock import Clock
from app.services.journal import Journal
from app.services.runs import Runs

PAGE_EVENTS: Final = 100
"""A run's events hold the whole run each: the journal takes a millisecond of the loop to read one."""

PICTURE_BYTES: Final = 300_000
SHEET_PICTURES_BYTES: Final = 3_000_000
"""Larger pictures are told by name and hash: a sheet is sent by mail and kept for years."""


@dataclass(frozen=True, slots=True)
class IssuedProof:
    """A proof, and the document of the plan that it is about: empty if the plan is gone from the disk."""

    proof: Proof
    plan: dict[str, Any]

    @property
    def small_pictures(self) -> Iterator[str]:
        """The hashes of its pictures that a sheet can hold, as many as it can hold."""
        room = SHEET_PICTURES_BYTES
        for one in self.proof.attachments:
            if one.media_type in PICTURES and one.is_as_attached and one.size_bytes <= min(PICTURE_BYTES, room):
                room -= one.size_bytes
                yield one.sha256


class Proofs:
    """A proof is made anew from what is stored each time it is asked for."""

    def __init__(
        self,
        runs: Runs,
        plans: PlanStore,
        attachments: AttachmentStore,
        journal: Journal,
        clock: Clock,
        gateway_id: str,
    ) -> None:
        self._runs = runs
        self._plans = plans
        self._attachments = attachments
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
        hashes = {attachment.sha256 for attachment in story.attachments}
        altered = {sha256 for sha256 in hashes if not await self._attachments.is_intact(sha256)}
        proof = await asyncio.to_thread(
            proof_of,
            run,
            story,
            gateway=self._gateway_id,
            document=document,
            altered=altered,
            issued_at=self._clock.now(),
        )
        return IssuedProof(proof, document)

    async def pictures(self, issued: IssuedProof) -> dict[str, bytes]:
        """The small pictures of a proof by their SHA-256, for its sheet. Raises StorageError."""
        found = {}
        for sha256 in issued.small_pictures:
            with suppress(AttachmentAlteredError):  # since the proof was made: its name and hash stand there alone
                found[sha256] = await self._attachments.get(sha256)
        return found


def _tell(story: Story, events: Sequence[Event]) -> None:
    for event in events:
        story.take(event)
