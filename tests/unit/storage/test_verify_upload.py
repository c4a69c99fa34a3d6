"""`verify-journal` beside a service that is uploading, or on what one left that was killed then."""

from __future__ import annotations

from pathlib import Path

from app.domain.events.run import RunUploadProgress
from app.storage import open_storage, verify_journal
from tests.support.verified_journal import new_event, write_journal


async def test_a_run_in_the_middle_of_its_upload_is_as_written(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    await write_journal(path)
    progress = new_event(RunUploadProgress(mission_type="mission", sent=2, total=4, attempt=1, percent=50.0))
    async with open_storage(path) as storage:
        stored = await storage.runs.get("run-1")
        assert stored is not None
        await storage.events.append([progress], [stored.model_copy(update={"upload_percent": 50.0})])
    assert (await verify_journal(path)).alterations == []
