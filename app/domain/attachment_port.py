"""Where attachments lie: storage/ implements it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from app.domain.attachment import Attachment


class AttachmentStore(Protocol):
    """Files by their SHA-256, and what the journal says of them. Each method may raise StorageError."""

    async def put(self, sha256: str, content: bytes) -> None:
        """Store a file, whole or not at all; on the disk when this returns. One that is there already is left.

        Raises AttachmentsFullError.
        """

    async def get(self, sha256: str) -> bytes:
        """The file. Raises AttachmentAlteredError if it is gone or has another hash."""

    async def is_intact(self, sha256: str) -> bool:
        """Whether the file is there and has this hash."""

    async def of_run(self, run_id: str) -> Sequence[Attachment]:
        """What the journal's events say was attached to a run, in order."""
