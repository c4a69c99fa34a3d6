"""What every AttachmentStore promises."""

from __future__ import annotations

import hashlib

import pytest

from app.domain.errors import AttachmentAlteredError
from app.domain.events import NewEvent
from app.domain.events.run import RunAttachment
from app.domain.run.attachment import Attachment
from tests.contract.storage.conftest import Opener, Stores
from tests.support.events import item

PHOTO = b"\xff\xd8\xff photo"
HASH = hashlib.sha256(PHOTO).hexdigest()


def attached(run_id: str, name: str) -> NewEvent:
    photo = Attachment(
        plan_item_id="drop", name=name, media_type="image/jpeg", size_bytes=9, sha256=HASH, at=1.0, actor="x"
    )
    return NewEvent.of(RunAttachment(photo), 1.0, run_id=run_id)


async def test_a_file_comes_back_after_a_restart_byte_by_byte(opener: Opener) -> None:
    async with opener() as stores:
        await stores.attachments.put(HASH, PHOTO)
        await stores.attachments.put(HASH, PHOTO)
    async with opener() as stores:
        assert await stores.attachments.get(HASH) == PHOTO
        assert await stores.attachments.is_intact(HASH)


@pytest.mark.parametrize("name", [HASH, "../../etc/passwd", "", HASH.upper(), "ab"])
async def test_what_was_never_stored_is_not_there(stores: Stores, name: str) -> None:
    assert not await stores.attachments.is_intact(name)
    with pytest.raises(AttachmentAlteredError):
        await stores.attachments.get(name)


async def test_the_journal_says_what_belongs_to_a_run(stores: Stores) -> None:
    other = NewEvent.of(item(), 1.0, run_id="run-1")
    await stores.events.append([attached("run-1", "b"), other, attached("run-2", "c"), attached("run-1", "a")])
    assert [one.name for one in await stores.attachments.of_run("run-1")] == ["b", "a"]
    assert list(await stores.attachments.of_run("run-3")) == []
