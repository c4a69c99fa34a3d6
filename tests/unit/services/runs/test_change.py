"""A run whose plan is changed in flight: what is sent, what is followed, and what is refused."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.errors import (
    ConflictError,
    DropInProgressError,
    HoldRequiredError,
    LinkTimeoutError,
    PlanRejectedError,
    VehicleRefusedError,
    WrongStateError,
)
from app.domain.mission import MavCmd
from app.domain.reasons import describe
from app.domain.run.run import RunState
from app.domain.vehicle.state import LandedState
from tests.support.changed_flight import Document, clinic_moved, fly, item, store
from tests.support.run_service import RunService, run_service


def commands(service: RunService) -> list[MavCmd]:
    return [one.command for one in service.vehicle.on_board]


async def test_a_changed_plan_is_flown_on_from_the_item_now_flown_without_a_pause() -> None:
    async with run_service() as service:
        await fly(service)
        sent, before = list(service.vehicle.sent), service.run
        run = await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        assert commands(service) == [MavCmd.NAV_WAYPOINT, MavCmd.NAV_WAYPOINT, MavCmd.NAV_RETURN_TO_LAUNCH]
        assert service.vehicle.on_board[0].x == 473981920, "it begins with the item that is flown"
        assert service.vehicle.sent == [*sent, "wait_ready"], "nothing else is commanded"
        assert (run.plan_id, run.changes, run.changing, run.state) == ("plan-2", 1, None, RunState.FLYING)
        assert run.change is not None
        assert (run.change.continue_at, run.change.actor) == ("corner", "ann")
        assert (run.item_id, run.flown_item_ids) == ("corner", ("takeoff",))
        assert run.mission_hash not in (None, before.mission_hash)
        assert "run.mission_changed" in service.kinds()


async def test_the_drop_of_a_changed_plan_is_released_at_its_new_place_and_the_run_completed() -> None:
    async with run_service() as service:
        await fly(service)
        await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        await service.vehicle.fly_to_hold(47.398700, 8.546656, 1)
        await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "the moved drop must be released")
        assert service.drop.planned_latitude_deg == 47.398700
        service.vehicle.touch_down(complete=True, last_seq=2)
        await service.until(lambda: service.run.is_over, "the run must end")
        assert service.run.state is RunState.COMPLETED, service.run.reason
        assert service.run.flown_item_ids == ("takeoff", "corner", "clinic", "drop", "home")


async def test_a_drop_that_is_over_is_not_on_board_any_more_wherever_the_flight_goes_on() -> None:
    async with run_service() as service:
        await fly(service)
        await service.fly_to_drop()
        await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "the drop must be released")
        await service.until(lambda: service.run.item_id == "home", "the mission must move on")
        await service.until(
            lambda: service.run.state is RunState.RETURNING or service.run.state is RunState.FLYING, "it flies on"
        )
        service.vehicle.put(mission_seq=2)
        await service.until(lambda: service.run.item_id == "clinic", "it is taken back")
        run = await service.runs.change_mission(service.run_id, store(service, lambda _: None), "corner", "ann")
        assert run.change is not None
        assert run.change.omitted == ("drop",)
        holds = [one.param1 for one in service.vehicle.on_board if one.command is MavCmd.NAV_WAYPOINT]
        assert holds == [0.0, 0.0], "nothing waits for a drop"
        assert run.drops[0].outcome is DropOutcome.RELEASED
        with pytest.raises(PlanRejectedError) as refused:
            await service.runs.change_mission(service.run_id, "plan-2", "drop", "ann")
        assert codes(refused.value) == ["change.drop_concluded"]


def codes(error: PlanRejectedError) -> list[str]:
    findings = error.extra["findings"]
    assert isinstance(findings, list)
    return [finding["code"] for finding in findings]


def without_takeoff_altitude(document: Document) -> None:
    item(document, "takeoff")["relative_altitude_m"] = 12


def other_fence(document: Document) -> None:
    document["geofence"]["circles"] = []


def into_the_keep_out(document: Document) -> None:
    item(document, "clinic").update(latitude_deg=47.398641, longitude_deg=8.545594)


def no_corner(document: Document) -> None:
    document["items"] = [one for one in document["items"] if one["id"] != "corner"]


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (without_takeoff_altitude, "change.flown_item"),
        (other_fence, "change.fence_altered"),
        (into_the_keep_out, "geofence.leg_outside"),
        (no_corner, "change.continue_at_unknown"),
    ],
)
async def test_what_cannot_be_flown_is_refused_with_nothing_sent(change: Callable[[Document], None], code: str) -> None:
    async with run_service() as service:
        await fly(service)
        on_board, run = service.vehicle.on_board, service.run
        with pytest.raises(PlanRejectedError) as refused:
            await service.runs.change_mission(service.run_id, store(service, change), None, "ann")
        assert code in codes(refused.value)
        assert (service.vehicle.on_board, service.run) == (on_board, run)


async def test_a_vehicle_that_wants_a_takeoff_in_every_mission_keeps_the_one_it_has() -> None:
    async with run_service() as service:
        await fly(service)
        service.vehicle.facts.parameters["MIS_TKO_LAND_REQ"] = 1  # type: ignore[index]
        with pytest.raises(PlanRejectedError) as refused:
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        assert "landing.required" in codes(refused.value)


async def test_a_change_waits_for_the_outcome_of_a_drop_in_progress() -> None:
    async with run_service() as service:
        await fly(service)
        service.vehicle.answers = [LinkTimeoutError("silence")] * 9
        await service.fly_to_drop()
        await service.until(lambda: service.run.state is RunState.AT_DROP, "it must hold")
        with pytest.raises(DropInProgressError):
            await service.runs.change_mission(service.run_id, store(service, lambda _: None), "home", "ann")


async def test_nothing_is_changed_before_the_take_off_while_returning_or_without_a_link() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        plan = store(service, clinic_moved)
        with pytest.raises(WrongStateError):
            await service.runs.change_mission(service.run_id, plan, "corner", "ann")
        service.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR, relative_altitude_m=15.0, connected=False)
        with pytest.raises(ConflictError):
            await service.runs.change_mission(service.run_id, plan, "corner", "ann")
        service.vehicle.put(connected=True)
        await service.runs.return_to_launch(service.run_id)
        await service.until_state(RunState.RETURNING)
        with pytest.raises(WrongStateError):
            await service.runs.change_mission(service.run_id, plan, "corner", "ann")


async def test_an_embedded_drop_that_is_near_wants_a_pause_first() -> None:
    async with run_service("multicopter-embedded.json") as service:
        await fly(service, "clinic")
        plan = store(service, lambda _: None)
        with pytest.raises(HoldRequiredError):
            await service.runs.change_mission(service.run_id, plan, None, "ann")
        await service.runs.pause(service.run_id)
        await service.until_state(RunState.PAUSED)
        run = await service.runs.change_mission(service.run_id, plan, None, "ann")
        assert (run.state, run.changes) == (RunState.PAUSED, 1)


async def test_a_drop_that_a_change_takes_out_is_kept_and_one_that_it_brings_is_made() -> None:
    def other_drop(document: Document) -> None:
        item(document, "drop")["id"] = "drop-b"

    async with run_service() as service:
        await fly(service)
        run = await service.runs.change_mission(service.run_id, store(service, other_drop), None, "ann")
        assert [(drop.plan_item_id, drop.outcome) for drop in run.drops] == [
            ("drop", DropOutcome.KEPT),
            ("drop-b", DropOutcome.PENDING),
        ]
        await service.vehicle.fly_to_hold(service.mission.drops[0].latitude_deg, 8.546656, 1)
        await service.until(lambda: service.run.drops[1].outcome is DropOutcome.RELEASED, "the new drop must be made")


async def test_a_mission_that_the_vehicle_finds_infeasible_is_replaced_by_the_one_before_and_it_holds() -> None:
    async with run_service() as service:
        await fly(service)
        service.vehicle.infeasible = 1
        with pytest.raises(VehicleRefusedError):
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        await service.until_state(RunState.PAUSED)
        assert service.run.plan_id == "plan-1"
        assert service.vehicle.on_board[1].x == round(service.mission.drops[0].latitude_deg * 1e7)
        assert "rejected the changed mission" in describe(service.run.reason)
        await service.runs.resume(service.run_id)
        await service.until_state(RunState.FLYING)
