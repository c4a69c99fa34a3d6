"""A run that is over and is continued: both are stored in one step, and only once."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.errors import ConflictError, RunContinuedError, RunNotOverError, StorageError
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import LandedState
from tests.support.events import data_of
from tests.support.runs_fixture import Desk, desk


async def ended(at: Desk) -> str:
    """A run that was aborted before its take-off."""
    run = await at.create(start=False)
    await at.until_state(RunState.UPLOADED)
    await at.runs.abort(run.id)
    await at.until_state(RunState.ABORTED)
    await at.until(lambda: run.id not in {one.id for one in at.runs.open_runs()}, "its end must be recorded")
    return run.id


async def go_on(at: Desk, old: str) -> Run:
    return await at.runs.create("plan-1", "v1", start=False, actor="ann", continues=old)


async def test_both_runs_know_each_other_and_nothing_starts_by_itself() -> None:
    async with desk() as at:
        old = await ended(at)
        sent = list(at.vehicle.sent)
        new = await go_on(at, old)
        assert (new.continues, at.events.runs[old].continued_by) == (old, new.id)
        (told,) = [event for event in at.events.events if event.kind == "run.continued"]
        assert (told.run_id, Run.model_validate(data_of(told))) == (old, at.events.runs[old])
        created = next(event for event in at.events.events if event.run_id == new.id)
        assert (created.kind, created.seq) == ("run.created", told.seq + 1), "one step: nothing lies between"
        at.run_id = new.id
        await at.until_state(RunState.UPLOADED)
        assert [order for order in at.vehicle.sent[len(sent) :] if order in ("arm", "start")] == []


async def test_of_two_continuations_at_once_one_is_made() -> None:
    async with desk() as at:
        old = await ended(at)
        made = await asyncio.gather(go_on(at, old), go_on(at, old), return_exceptions=True)
        (new,) = [one for one in made if isinstance(one, Run)]
        (refused,) = [one for one in made if not isinstance(one, Run)]
        assert isinstance(refused, ConflictError)
        await at.runs.abort(new.id)
        at.run_id = new.id
        await at.until_state(RunState.ABORTED)
        await at.until(lambda: not at.runs.open_runs(), "the vehicle must be free")
        with pytest.raises(RunContinuedError):
            await go_on(at, old)
        assert (await go_on(at, new.id)).continues == new.id, "a continuation that ended early is continued in turn"


async def test_a_full_disk_leaves_neither_run_continued_and_the_vehicle_free() -> None:
    async with desk() as at:
        old = await ended(at)
        at.events.failures = [StorageError("full")] * 2
        with pytest.raises(StorageError):
            await go_on(at, old)
        at.events.failures = []
        assert at.events.runs[old].continued_by is None
        assert [run.continues for run in at.events.runs.values()] == [None]
        assert (await go_on(at, old)).continues == old


async def test_only_a_run_that_is_over_is_continued_by_its_own_vehicle_on_the_ground() -> None:
    async with desk() as at:
        run = await at.create(start=False)
        with pytest.raises(RunNotOverError):
            await at.runs.continuable(run.id)
        await at.until_state(RunState.UPLOADED)
        await at.runs.abort(run.id)
        await at.until(lambda: not at.runs.open_runs(), "its end must be recorded")
        at.vehicle.put(landed=LandedState.UNDEFINED)
        with pytest.raises(ConflictError):
            await go_on(at, run.id)
        at.vehicle.put(landed=LandedState.ON_GROUND)
        known = at.vehicle.identity
        at.vehicle.identity = type(known)(
            known.system_id, known.connection, known.vehicle_type, known.firmware, "uid-2"
        )
        with pytest.raises(ConflictError, match="different vehicle"):
            await go_on(at, run.id)
