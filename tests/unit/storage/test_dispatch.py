"""What is open is found by its index: a journal keeps all that is over, for years."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from app.domain.ports.stores import JobFilter, RunFilter
from app.domain.run.run import RunState
from app.storage.storage import open_storage
from tests.support.stored_samples import plan, run


class Asked:
    """The statements that SQLite gets in the block, and how it looks for their rows."""

    def __init__(self, journal: Path) -> None:
        self._journal = journal
        self._asked: list[tuple[str, Any]] = []

    def __enter__(self) -> Asked:
        sa.event.listen(sa.Engine, "before_cursor_execute", self._take)
        return self

    def __exit__(self, *_exc: object) -> None:
        sa.event.remove(sa.Engine, "before_cursor_execute", self._take)

    def how(self) -> str:
        engine = sa.create_engine(sa.URL.create("sqlite", database=str(self._journal)))
        with engine.connect() as connection:
            plans = [
                connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", parameters).all()
                for statement, parameters in self._asked
            ]
        engine.dispose()
        return "\n".join(str(step.detail) for plan in plans for step in plan)

    def _take(self, _connection: object, _cursor: object, statement: str, parameters: Any, *_more: object) -> None:
        self._asked.append((statement, parameters))


async def test_open_runs_are_found_without_reading_those_that_are_over(tmp_path: Path) -> None:
    async with open_storage(tmp_path / "waydrop.db") as storage:
        with Asked(storage.path) as asked:
            await storage.runs.list_runs(RunFilter(open_only=True), limit=500)
        assert "INDEX ix_runs_open" in asked.how()


async def test_open_runs_are_counted_by_state_without_reading_those_that_are_over(tmp_path: Path) -> None:
    states = (RunState.CREATED, RunState.FLYING, RunState.COMPLETED, RunState.FLYING)
    async with open_storage(tmp_path / "waydrop.db") as storage:
        await storage.events.append((), [run(number, state=state) for number, state in enumerate(states)], [plan()])
        with Asked(storage.path) as asked:
            assert await storage.runs.open_states() == {RunState.CREATED: 1, RunState.FLYING: 2}
        assert "INDEX ix_runs_open" in asked.how()


@pytest.mark.parametrize("wanted", [RunFilter(created_before=9.0), RunFilter(created_from=9.0)])
async def test_runs_of_a_time_are_found_without_reading_the_others(tmp_path: Path, wanted: RunFilter) -> None:
    async with open_storage(tmp_path / "waydrop.db") as storage:
        with Asked(storage.path) as asked:
            await storage.runs.list_runs(wanted, limit=50)
        how = asked.how()
    assert "SCAN" not in how
    assert "COVERING INDEX ix_runs_created_at_position" in how
    assert "SEARCH runs USING INTEGER PRIMARY KEY (rowid>? AND rowid<?)" in how
    assert "TEMP B-TREE" not in how, "the newest ones come first without sorting all"


async def test_runs_of_a_time_are_found_also_if_a_clock_jumped(tmp_path: Path) -> None:
    times = (5.0, 6.0, 1.0, 9.0, 7.0)
    runs = [run(number).model_copy(update={"created_at": time}) for number, time in enumerate(times)]
    async with open_storage(tmp_path / "waydrop.db") as storage:
        await storage.events.append((), runs, [plan()])
        found = await storage.runs.list_runs(RunFilter(created_from=5.0, created_before=8.0), limit=50)
    assert [one.created_at for one in found] == [7.0, 6.0, 5.0]


async def test_open_jobs_are_found_without_reading_those_that_are_over(tmp_path: Path) -> None:
    async with open_storage(tmp_path / "waydrop.db") as storage:
        with Asked(storage.path) as asked:
            await storage.jobs.list_jobs(JobFilter(open_only=True), limit=500)
        assert "INDEX ix_jobs_open" in asked.how()
