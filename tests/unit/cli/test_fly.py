"""`waydrop fly` posts the plan, starts the run, follows it to its end and judges it."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from typing import Any

import pytest

from app.cli.fly import StartFailedError, fly_and_follow
from app.cli.run_view import STRICT, RunAssessment
from app.cli.terminal import ServerRefusedError
from app.domain.drop.record import Certainty, DropOutcome, DropRecord
from app.domain.events import Event, EventKind
from app.domain.events.run import RunDrop
from app.domain.plan import Plan, parse_plan
from app.domain.run.run import Run, RunState
from tests.support.assessed_runs import ACKNOWLEDGED, INFERRED, a_drop, a_run
from tests.support.paths import ROOT
from tests.support.reasons import some
from tests.support.scripted_service import CUT, ScriptedService, changed, event


class Recorded:
    """A view that remembers."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.notes: list[str] = []
        self.assessment: RunAssessment | None = None

    def event(self, event: Event) -> None:
        self.events.append(event)

    def note(self, text: str) -> None:
        self.notes.append(text)

    def ended(self, run: Run, assessment: RunAssessment) -> None:
        self.assessment = assessment


@pytest.fixture(scope="module")
def plan() -> Plan:
    return parse_plan((ROOT / "plans" / "clinic-run.json").read_bytes())


def flown(end: Run, *between: Event | str) -> ScriptedService:
    """A service whose run goes on until it is as `end`."""
    last = 10 + len(between)
    return ScriptedService([*between, changed(last, end)], run=end)


async def fly(service: ScriptedService, plan: Plan, view: Recorded, least: Certainty = Certainty.INFERRED) -> int:
    return await fly_and_follow(plan, "v1", service.url, None, least, view)


async def test_a_delivered_run_ends_with_0_and_is_told_event_by_event(plan: Plan) -> None:
    view = Recorded()
    drop = event(2, RunDrop(ACKNOWLEDGED))
    async with flown(a_run(RunState.COMPLETED, ACKNOWLEDGED), event(1), drop).serving() as service:
        assert await fly(service, plan, view) == 0
        asked = {what: (document, key) for what, document, key in service.posted}
    assert parse_plan(json.dumps(asked["plans"][0])) == plan
    assert asked["runs"][0] == {"plan": "p1", "vehicle": "v1", "start": True}
    assert asked["plans"][1]
    assert asked["runs"][1] not in (None, asked["plans"][1])
    assert [seen.kind for seen in view.events] == [EventKind.RUN_ITEM, EventKind.RUN_DROP, EventKind.RUN_CHANGED]
    assert view.assessment == RunAssessment(())


@pytest.mark.parametrize(
    "end",
    [
        a_run(RunState.COMPLETED, a_drop(DropOutcome.KEPT)),
        a_run(RunState.COMPLETED, a_drop(DropOutcome.UNKNOWN)),
        a_run(RunState.ABORTED, ACKNOWLEDGED),
        a_run(RunState.LOST, ACKNOWLEDGED),
        a_run(RunState.FAILED),
    ],
)
async def test_anything_less_ends_with_1(plan: Plan, end: Run) -> None:
    async with flown(end).serving() as service:
        assert await fly(service, plan, Recorded()) == 1


@pytest.mark.parametrize(("drop", "status"), [(INFERRED, 1), (ACKNOWLEDGED, 0)])
async def test_strict_takes_no_inferred_release(plan: Plan, drop: DropRecord, status: int) -> None:
    async with flown(a_run(RunState.COMPLETED, drop)).serving() as service:
        assert await fly(service, plan, Recorded(), STRICT) == status


async def test_a_cut_connection_is_told_and_the_flight_followed_on(plan: Plan) -> None:
    view = Recorded()
    async with flown(a_run(RunState.COMPLETED, ACKNOWLEDGED), event(1), CUT, event(2)).serving() as service:
        assert await fly(service, plan, view) == 0
    assert [seen.seq for seen in view.events] == [1, 2, 13]
    assert any("the flight continues" in note for note in view.notes)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
async def test_whoever_ends_the_command_is_told_what_it_last_knew_and_that_the_flight_goes_on(
    number: signal.Signals, status: int
) -> None:
    flying = a_run(RunState.FLYING).model_copy(update={"item_id": "clinic"})
    async with ScriptedService([changed(1, flying)], run=a_run(RunState.CREATED)).serving() as service:
        command = (*["-m", "app", "fly", "plans/clinic-run.json", "--vehicle", "v1", "--json", "--server"], service.url)
        pipe = asyncio.subprocess.PIPE
        process = await asyncio.create_subprocess_exec(sys.executable, *command, cwd=ROOT, stdout=pipe, stderr=pipe)
        assert process.stdout is not None
        async for line in process.stdout:
            if b"run.changed" in line:
                break
        process.send_signal(number)
        _, told = await process.communicate()
    assert process.returncode == status, told
    said = " ".join(told.decode().split())
    assert "the flight continues. Last known: flying (item clinic)." in said
    assert "`waydrop runs return r1`" in said


async def test_events_of_other_runs_are_not_shown(plan: Plan) -> None:
    view = Recorded()
    other = changed(1, a_run(RunState.FAILED).model_copy(update={"id": "r2", "vehicle_id": "v2"}))
    async with flown(a_run(RunState.COMPLETED), other).serving() as service:
        assert await fly(service, plan, view) == 0
    assert [seen.run_id for seen in view.events] == ["r1"]


async def test_a_start_that_fails_on_the_ground_is_an_error_that_says_what_to_do(plan: Plan) -> None:
    starting, back = a_run(RunState.STARTING), a_run(RunState.UPLOADED, reason=some("arming denied: no GPS"))
    service = ScriptedService([changed(1, starting), changed(2, back)], run=a_run(RunState.CREATED))
    async with service.serving():
        with pytest.raises(StartFailedError, match="arming denied") as failed:
            await fly(service, plan, Recorded())
    assert "waydrop runs abort r1" in failed.value.hint


async def test_a_rejected_plan_carries_its_findings(plan: Plan) -> None:
    finding: dict[str, Any] = {"code": "x.y", "severity": "error", "pointer": "/items/1", "message": "no"}
    problem = {"status": 422, "code": "plan.rejected", "detail": "1 error", "findings": [finding]}
    async with ScriptedService(plan_problem=problem).serving() as service:
        with pytest.raises(ServerRefusedError) as refused:
            await fly(service, plan, Recorded())
    assert refused.value.code == "plan.rejected"
    assert refused.value.extra["findings"] == [finding]
