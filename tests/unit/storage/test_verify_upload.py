"""`verify-journal` beside a service that is uploading, or on what one left that was killed then."""

from __future__ import annotations

from pathlib import Path

from app.domain.events import EventKind
from app.storage import open_storage, verify_journal
from tests.contract.storage.samples import run
from tests.unit.storage.test_verify import told


async def test_a_run_in_the_middle_of_its_upload_is_as_written(tmp_path: Path) -> None:
    whole = run().model_copy(update={"upload_percent": None})
    half = whole.model_copy(update={"upload_percent": 50.0})
    progress = told(EventKind.RUN_UPLOAD_PROGRESS, mission_type="mission", sent=2, total=4, attempt=1, percent=50.0)
    async with open_storage(tmp_path / "journal.db") as storage:
        await storage.events.append([told(EventKind.RUN_CREATED, **whole.model_dump(mode="json"))], [whole])
        await storage.events.append([progress], [half])
    found = (await verify_journal(tmp_path / "journal.db")).alterations
    assert [one for one in found if one.startswith("run ")] == []
