"""A run that is over and is continued: both are stored in one step, and only once."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.errors import ConflictError, RunContinuedError, RunNotOverError, StorageError
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import LandedState
from tests.support.events import data_of
from tests.support.run_service import RunService, run_service


async def ended(service: RunService) -> str:
    """A run that was aborted before its take-off."""
    run = await service.create(start=False)
    await service.until_state(RunState.UPLOADED)
    await service.runs.abort(run.id)
    await service.until_state(RunState.ABORTED)
    await service.until(lambda: run.id not in {one.id for one in service.runs.open_runs()}, "its end must be recorded")
    return run.id


async def go_on(service: RunService, old: str) -> Run:
    return await service.runs.create("plan-1", "v1", start=False, actor="ann", continues=old)


async def test_both_runs_know_each_other_and_nothing_starts_by_itself() -> None:
    async with run_service() as service:
        old = await ended(service)
        sent = list(service.vehicle.sent)
        new = await go_on(service, old)
        assert (new.continues, service.events.runs[old].continued_by) == (old, new.id)
        (told,) = [event for event in service.events.events if event.kind == "run.continued"]
        assert (told.run_id, Run.model_validate(data_of(told))) == (old, service.events.runs[old])
        created = next(event for event in service.events.events if event.run_id == new.id)
        assert (created.kind, created.seq) == ("run.created", told.seq + 1), "one step: nothing lies between"
        service.run_id = new.id
        await service.until_state(RunState.UPLOADED)
        assert [order for order in service.vehicle.sent[len(sent) :] if order in ("arm", "start")] == []


async def test_of_two_continuations_at_once_one_is_made() -> None:
    async with run_service() as service:
        old = await ended(service)
        made = await asyncio.gather(go_on(service, old), go_on(service, old), return_exceptions=True)
        (new,) = [one for one in made if isinstance(one, Run)]
        (refused,) = [one for one in made if not isinstance(one, Run)]
        assert isinstance(refused, ConflictError)
        await service.runs.abort(new.id)
        service.run_id = new.id
        await service.until_state(RunState.ABORTED)
        await service.until(lambda: not service.runs.open_runs(), "the vehicle must be free")
        with pytest.raises(RunContinuedError):
            await go_on(service, old)
        assert (await go_on(service, new.id)).continues == new.id, (
            "a continuation that ended early is continued in turn"
        )


async def test_a_full_disk_leaves_neither_run_continued_and_the_vehicle_free() -> None:
    async with run_service() as service:
        old = await ended(service)
        service.events.failures = [StorageError("full")] * 2
        with pytest.raises(StorageError):
            await go_on(service, old)
        service.events.failures = []
        assert service.events.runs[old].continued_by is None
        assert [run.continues for run in service.events.runs.values()] == [None]
        assert (await go_on(service, old)).continues == old


async def test_only_a_run_that_is_over_is_continued_by_its_own_vehicle_on_the_ground() -> None:
    async with run_service() as service:
        run = await service.create(start=False)
        with pytest.raises(RunNotOverError):
            await service.runs.continuable(run.id)
        await service.until_state(RunState.UPLOADED)
        await service.runs.abort(run.id)
        await service.until(lambda: not service.runs.open_runs(), "its end must be recorded")
        service.vehicle.put(landed=LandedState.UNDEFINED)
        with pytest.raises(ConflictError):
            await go_on(service, run.id)
        service.vehicle.put(landed=LandedState.ON_GROUND)
        known = service.vehicle.identity
        service.vehicle.identity = type(known)(
            known.system_id, known.connection, known.vehicle_type, known.firmware, "uid-2"
        )
        with pytest.raises(ConflictError, match="different vehicle"):
            await go_on(service, run.id)
