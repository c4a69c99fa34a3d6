"""Photos, signatures and documents that the dispatcher's own app adds to a drop's evidence."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Sequence

from app.domain.errors import AttachmentAlteredError, AttachmentExpiredError, ConflictError, NotFoundError
from app.domain.events.run import RunAttachment
from app.domain.ports.journal import EventJournal, RunReader
from app.domain.ports.stores import AttachmentStore
from app.domain.run.attachment import MAX_PER_DROP, Attachment, checked_name, checked_type, with_ending
from app.domain.run.run import Run
from app.services.clock import Clock


class Attachments:
    """A file is on the disk before its event is stored: whatever the journal says was attached, was there."""

    def __init__(self, runs: RunReader, store: AttachmentStore, journal: EventJournal, clock: Clock) -> None:
        self._runs = runs
        self._store = store
        self._journal = journal
        self._clock = clock
        self._turn = asyncio.Lock()

    async def add(
        self, run_id: str, plan_item_id: str, *, name: str, media_type: str | None, content: bytes, actor: str
    ) -> tuple[Attachment, bool]:
        """Attach a file to a drop; the attachment, and whether it is new: the same file is attached once.

        `media_type` None: detected from the file.

        Raises:
            NotFoundError, ConflictError (the drop has too many), InvalidInputError, AttachmentQuotaError, StorageError.
        """
        run = await self._run_with(run_id, plan_item_id)
        media_type = checked_type(media_type, content)
        name = with_ending(checked_name(name), media_type)
        sha256 = await asyncio.to_thread(lambda: hashlib.sha256(content).hexdigest())
        async with self._turn:
            attached = await self.of_drop(run_id, plan_item_id)
            for other in attached:
                if other.sha256 == sha256:
                    await self._store.put(sha256, content)  # repairs one that was altered on the disk
                    return other, False
            if len(attached) >= MAX_PER_DROP:
                raise ConflictError(f"drop {plan_item_id} has {MAX_PER_DROP} attachments, which is the limit")
            await self._store.put(sha256, content)
            attachment = Attachment(
                plan_item_id=plan_item_id,
                name=name,
                media_type=media_type,
                size_bytes=len(content),
                sha256=sha256,
                at=self._clock.now(),
                actor=actor,
            )
            await self._record(run, attachment)
        return attachment, True

    async def find_drop(self, run_id: str, plan_item_id: str) -> None:
        """Raises NotFoundError if the run has no such drop, StorageError."""
        await self._run_with(run_id, plan_item_id)

    async def of_drop(self, run_id: str, plan_item_id: str) -> Sequence[Attachment]:
        """A drop's attachments, in order. Raises NotFoundError, StorageError."""
        await self._run_with(run_id, plan_item_id)
        return [one for one in await self._store.of_run(run_id) if one.plan_item_id == plan_item_id]

    async def get(self, run_id: str, plan_item_id: str, sha256: str) -> tuple[Attachment, bytes]:
        """One attachment with its file.

        Raises NotFoundError, AttachmentExpiredError, AttachmentAlteredError, StorageError.
        """
        for attachment in await self.of_drop(run_id, plan_item_id):
            if attachment.sha256 == sha256:
                return attachment, await self._content(attachment)
        raise NotFoundError(
            f"drop {plan_item_id} has no attachment {sha256}", hint="the delivery report lists the attachments"
        )

    async def _content(self, attachment: Attachment) -> bytes:
        try:
            return await self._store.get(attachment.sha256)
        except AttachmentAlteredError as error:
            pruned = self._journal.pruned
            expired = None if pruned is None else pruned.attachments_before
            if expired is None or attachment.at >= expired:
                raise
            raise AttachmentExpiredError(
                f"the file {attachment.name} was deleted at the end of its retention period", before=expired
            ) from error

    async def _run_with(self, run_id: str, plan_item_id: str) -> Run:
        run = await self._runs.get(run_id)
        if all(drop.plan_item_id != plan_item_id for drop in run.drops):
            raise NotFoundError(f"run {run_id} has no drop {plan_item_id!r}", hint="get the run to see its drops")
        return run

    async def _record(self, run: Run, attachment: Attachment) -> None:
        payload = RunAttachment(attachment)
        await self._journal.record(self._journal.new_event(payload, vehicle_id=run.vehicle_id, run_id=run.id))
