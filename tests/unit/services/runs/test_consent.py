"""A drop that needs consent: who answered is on record, one answer counts, and no restart or silence ever releases."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.drop.consent import Answer, ConsentRecord, ConsentState, is_new_answer
from app.domain.drop.record import DropOutcome, DropPhase, DropRecord
from app.domain.errors import (
    ConsentAnsweredError,
    ConsentNotAskedError,
    ConsentTooLateError,
    NotFoundError,
    StorageError,
)
from app.domain.events import EventKind
from app.domain.flight.progress import MissionProgress
from app.domain.flight.snapshot import ResumeCommand, VehicleSnapshot
from app.domain.flight.supervised_release import SupervisedRelease
from app.domain.plan import parse_plan
from app.domain.plan.compiler import compile_plan
from app.domain.reasons import describe
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode, VehicleState, VehicleType
from tests.support.events import data_of
from tests.support.paths import PLANS
from tests.support.run_service import RunService, restarted, run_service
from tests.support.scripted_link import FAST

MISSION = compile_plan(parse_plan((PLANS / "clinic-run.json").read_text()), default_facts(VehicleType.MULTICOPTER))
COMPILED = MISSION.drops[0]

GRANT, REFUSE = Answer(grant=True, question=1), Answer(grant=False, comment="children in the yard")


@asynccontextmanager
async def asked_desk(timeout_s: float | None = None, on_failure: str = "continue") -> AsyncIterator[RunService]:
    """A vehicle that holds at a drop which asks for consent."""

    def with_consent(document: dict[str, Any]) -> None:
        drop = next(item for item in document["items"] if item["type"] == "gripper")
        drop |= {"consent": "operator", "consent_timeout_s": timeout_s}
        document["contingency"] = {"on_drop_failure": on_failure}

    async with run_service(changes=with_consent) as service:
        await service.create()
        await service.fly_to_drop()
        await service.until(lambda: consent(service).state is ConsentState.ASKED, "the operator must be asked")
        yield service


def consent(service: RunService) -> ConsentRecord:
    assert service.drop.consent is not None
    return service.drop.consent


def told(service: RunService, kind: EventKind) -> list[dict[str, Any]]:
    """The data of this run's events of one kind, in order."""
    return [data_of(event) for event in service.events.events if event.run_id == service.run_id and event.kind is kind]


async def ends(service: RunService) -> None:
    await service.until(lambda: service.drop.outcome is not DropOutcome.PENDING, "the drop must end")


async def test_the_question_says_what_was_checked_and_until_when_it_can_be_answered() -> None:
    async with asked_desk() as service:
        (asked,) = told(service, EventKind.DROP_CONSENT_ASKED)
        await service.until(lambda: "consent" in describe(service.run.reason), "the run must say what it waits for")
        assert (service.run.state, service.drop.phase) == (RunState.AT_DROP, DropPhase.ASKING)
        assert asked["plan_item_id"] == "drop"
        assert asked["question"] == 1
        assert asked["checked"]["offset_m"] < 1.0
        assert 20.0 < asked["checked"]["hold_left_s"] <= 30.0
        record = consent(service)
        assert record.asked_at is not None
        assert record.deadline_at == asked["deadline_at"]
        assert 15.0 < asked["deadline_at"] - record.asked_at < 30.0
        assert service.vehicle.releases == []


async def test_a_grant_is_stored_with_who_gave_it_before_the_release_is_sent() -> None:
    async with asked_desk() as service:
        run = await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        assert run.drops[0].consent is not None
        assert run.drops[0].consent.state is ConsentState.GRANTED
        await ends(service)
        assert service.drop.outcome is DropOutcome.RELEASED
        assert (consent(service).state, consent(service).answered_by) == (ConsentState.GRANTED, "anna")
        granted = [e.seq for e in service.events.events if e.kind is EventKind.DROP_CONSENT_CLOSED]
        released = [
            e.seq for e in service.events.events if data_of(e).get("attempt") and e.kind is EventKind.RUN_COMMAND
        ]
        assert granted[0] < released[0]


@pytest.mark.parametrize(("on_failure", "sent"), [("continue", "set_current 3"), ("return", "return")])
async def test_a_refusal_keeps_the_parcel_and_does_what_the_plan_says(on_failure: str, sent: str) -> None:
    async with asked_desk(on_failure=on_failure) as service:
        await service.runs.answer_consent(service.run_id, "drop", REFUSE, "anna")
        await ends(service)
        assert service.drop.outcome is DropOutcome.KEPT
        assert "refused" in describe(service.drop.reason)
        assert (consent(service).comment, consent(service).answered_by) == ("children in the yard", "anna")
        await service.until(lambda: service.vehicle.sent[-1] == sent, "the plan's choice must be sent")
        assert service.vehicle.releases == []


async def test_one_answer_counts_and_the_same_again_changes_nothing() -> None:
    async with asked_desk() as service:
        await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        with pytest.raises(ConsentAnsweredError, match="anna"):
            await service.runs.answer_consent(service.run_id, "drop", REFUSE, "bert")
        await ends(service)
        again = await service.runs.answer_consent(service.run_id, "drop", GRANT, "bert")
        assert again.drops[0].consent is not None
        assert again.drops[0].consent.answered_by == "anna"
        assert len(told(service, EventKind.DROP_CONSENT_CLOSED)) == 1
        assert len(service.vehicle.releases) == 1
        service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
        await service.until(lambda: service.run.is_over, "the run must end")
        await service.until(lambda: not service.runs.open_runs(), "nobody must follow it any more")
        assert (await service.runs.answer_consent(service.run_id, "drop", GRANT, "bert")).is_over


def asking_release() -> tuple[SupervisedRelease, Callable[[float], VehicleSnapshot]]:
    """A drop whose question was asked at 101 s with 8 s to answer, and how the vehicle looks at any time."""
    compiled = replace(COMPILED, needs_consent=True, consent_timeout_s=8.0)
    record = DropRecord(plan_item_id="drop", supervised=True, consent=ConsentRecord())
    release = SupervisedRelease.of(compiled, record, 2.0, "continue")

    def look(now_s: float, latitude_deg: float = compiled.latitude_deg) -> VehicleSnapshot:
        state = VehicleState(
            connected=True,
            mode=FlightMode.MISSION,
            armed=True,
            mission_seq=compiled.hold_seqs[0],
            boot_time_s=now_s,
            position_age_s=0.0,
            latitude_deg=latitude_deg,
            longitude_deg=compiled.longitude_deg,
            relative_altitude_m=compiled.relative_altitude_m,
            velocity_north_m_s=0.0,
            velocity_east_m_s=0.0,
        )
        return VehicleSnapshot(state, now_s, 5000.0 + now_s, 1.0)

    for seen in (look(100.0, compiled.latitude_deg - 0.0001), look(100.5), look(101.0)):
        release, _ = release.observe(seen, MissionProgress.of(MISSION))
    assert release.is_asking
    return release, look


def test_no_answer_in_time_is_a_refusal_by_time_and_the_mission_moves_on() -> None:
    release, look = asking_release()
    release, orders = release.observe(look(108.9), MissionProgress.of(MISSION))
    assert orders == ()
    release, (order,) = release.observe(look(109.1), MissionProgress.of(MISSION))
    assert isinstance(order, ResumeCommand)
    assert release.record.consent is not None
    assert release.record.consent.state is ConsentState.TIMED_OUT
    assert release.record.outcome is DropOutcome.KEPT
    with pytest.raises(ConsentTooLateError):
        is_new_answer(release.record.consent, GRANT)


def test_an_answer_after_its_time_does_not_count_although_nobody_looked_since() -> None:
    release, look = asking_release()
    assert release.answered(GRANT, "anna", look(109.1)) is None


def test_the_time_to_answer_is_over_without_a_link_too() -> None:
    release, look = asking_release()
    release = release.silent(look(109.1))
    assert release.record.consent is not None
    assert release.record.consent.state is ConsentState.TIMED_OUT
    assert release.record.outcome is DropOutcome.PENDING, "what the plan says then could not be sent"


async def test_an_answer_to_what_nobody_asks_is_refused() -> None:
    async with run_service() as service:
        await service.create()
        with pytest.raises(ConsentNotAskedError, match="does not request consent"):
            await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        with pytest.raises(NotFoundError):
            await service.runs.answer_consent(service.run_id, "nothing", GRANT, "anna")


async def test_a_vehicle_that_left_its_hold_is_asked_for_anew_and_the_first_number_does_not_count() -> None:
    async with asked_desk() as service:
        await service.runs.pause(service.run_id)
        await service.until(lambda: consent(service).state is ConsentState.WITHDRAWN, "the question must be withdrawn")
        with pytest.raises(ConsentNotAskedError, match="left its hold"):
            await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        await service.runs.resume(service.run_id)
        await service.until(lambda: consent(service).question == 2, "it must be asked again")
        with pytest.raises(ConsentNotAskedError):
            await service.runs.answer_consent(service.run_id, "drop", Answer(grant=True, question=1), "anna")
        assert service.vehicle.releases == []
        await service.runs.answer_consent(service.run_id, "drop", Answer(grant=True, question=2), "anna")
        await ends(service)
        assert service.drop.outcome is DropOutcome.RELEASED


async def test_a_grant_over_a_lost_link_releases_only_when_the_vehicle_is_seen_at_its_drop_again() -> None:
    async with asked_desk() as service:
        service.vehicle.put(connected=False)
        await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        looks = service.vehicle.looks
        await service.until(lambda: service.vehicle.looks > looks + 5, "it must be looked at")
        assert service.vehicle.releases == []
        service.vehicle.put(connected=True)
        await ends(service)
        assert (service.drop.outcome, len(service.vehicle.releases)) == (DropOutcome.RELEASED, 1)


async def test_a_grant_that_finds_the_vehicle_gone_from_the_drop_releases_nothing() -> None:
    async with asked_desk() as service:
        service.vehicle.put(connected=False)
        await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        service.vehicle.put(connected=True, mission_seq=3)
        await ends(service)
        assert (service.drop.outcome, service.vehicle.releases) == (DropOutcome.KEPT, [])


async def test_a_grant_that_cannot_be_stored_releases_nothing() -> None:
    async with asked_desk() as service:
        service.events.refuse = lambda event: StorageError("disk full")
        with pytest.raises(StorageError):
            await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        looks = service.vehicle.looks
        await service.until(lambda: service.vehicle.looks > looks + 20, "it must be looked at")
        assert service.vehicle.releases == []
        service.vehicle.put(mission_seq=3)
        service.events.refuse = lambda event: None
        await ends(service)
        assert service.drop.outcome is DropOutcome.KEPT


@pytest.mark.parametrize("granted", [False, True])
async def test_a_restart_in_the_question_or_after_a_grant_never_releases(granted: bool) -> None:
    async with asked_desk(on_failure="return") as service:
        if granted:
            service.vehicle.put(in_failsafe=True)  # so that the grant is stored and nothing sent
            await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        await restarted(service, meanwhile=lambda: service.vehicle.put(in_failsafe=False))
        await ends(service)
        assert (service.drop.outcome, service.vehicle.releases) == (DropOutcome.KEPT, [])
        assert consent(service).state is ConsentState.WITHDRAWN
        assert "restarted" in describe(consent(service).reason)
        await service.until(lambda: service.vehicle.sent[-1] == "return", "the plan's choice must be sent")
        with pytest.raises(ConsentNotAskedError):
            await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")


async def test_after_a_restart_before_the_hold_it_is_asked_as_before() -> None:
    def with_consent(document: dict[str, Any]) -> None:
        next(item for item in document["items"] if item["type"] == "gripper")["consent"] = "operator"

    async with run_service(changes=with_consent) as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        await restarted(service)
        await service.fly_to_drop()
        await service.until(lambda: consent(service).state is ConsentState.ASKED, "the operator must be asked")
        await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        await ends(service)
        assert service.drop.outcome is DropOutcome.RELEASED


async def test_a_vehicle_that_is_not_found_after_a_restart_takes_no_answer() -> None:
    async with asked_desk() as service:
        settings = replace(FAST, lost_after_s=1.0)
        await restarted(service, meanwhile=lambda: service.vehicle.put(connected=False), settings=settings)
        with pytest.raises(ConsentNotAskedError, match="restarted"):
            await service.runs.answer_consent(service.run_id, "drop", GRANT, "anna")
        await service.until_state(RunState.LOST)
        assert (service.drop.outcome, consent(service).state) == (DropOutcome.KEPT, ConsentState.WITHDRAWN)


async def test_a_pilot_who_takes_over_withdraws_the_question() -> None:
    async with asked_desk() as service:
        service.vehicle.put(mode=FlightMode.POSITION)
        await service.until(lambda: consent(service).state is ConsentState.WITHDRAWN, "the question must be withdrawn")
        assert told(service, EventKind.DROP_CONSENT_CLOSED)[-1]["state"] == "withdrawn"
        assert service.vehicle.releases == []
