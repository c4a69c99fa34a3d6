"""What happens around a change in flight at the worst moment: nobody's command is overruled, and no drop made twice."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, Callable, Sequence
from typing import Any

import pytest

from app.domain.drop.record import DropOutcome, DropPhase, DropRecord
from app.domain.errors import (
    ChangeUnderWayError,
    ConflictError,
    StorageError,
    VehicleQuarantinedError,
    VehicleRefusedError,
    WaydropError,
    WrongStateError,
)
from app.domain.events import Event
from app.domain.events.run import RunAck
from app.domain.flight.snapshot import ContingencyCommand
from app.domain.mission import MavCmd, Mission
from app.domain.plan import parse_plan
from app.domain.ports.stores import StoredPlan
from app.domain.ports.vehicle_link import UploadProgress
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import FlightMode, LandedState
from app.services.plan_checks import PlanCheck
from app.services.plans import NewPlan
from tests.support.changed_flight import Document, begun, clinic_moved, fly, item, store
from tests.support.events import item as an_item
from tests.support.fake_links import MEASURED_CLOCK
from tests.support.run_service import RunService, run_service


def when_the_facts_are_read(service: RunService) -> tuple[asyncio.Event, asyncio.Event]:
    """Told when a change asks for the vehicle's facts; it gets them when the second is set."""
    asked, gate, read_facts = asyncio.Event(), asyncio.Event(), service.vehicle.read_facts

    async def later(*, fresh: bool = False) -> object:
        asked.set()
        await gate.wait()
        return await read_facts()

    service.vehicle.read_facts = later  # type: ignore[method-assign, assignment]
    return asked, gate


@pytest.mark.parametrize("command", ["return_to_launch", "land", "pause"])
async def test_a_command_given_while_a_change_is_prepared_breaks_it_off(command: str) -> None:
    async with run_service() as service:
        await fly(service)
        on_board = service.vehicle.on_board
        asked, gate = when_the_facts_are_read(service)
        change = asyncio.create_task(
            service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        )
        await asked.wait()
        await getattr(service.runs, command)(service.run_id)
        service.vehicle.put(mode=FlightMode.MISSION)  # its HEARTBEAT may say so for another second
        gate.set()
        with pytest.raises(ChangeUnderWayError) as caught:
            await asyncio.wait_for(change, 10.0)
        assert not caught.value.may_be_done
        assert (service.vehicle.on_board, service.run.changing, service.run.plan_id) == (on_board, None, "plan-1")


async def test_a_command_given_while_a_change_is_stored_breaks_it_off_and_nothing_is_sent() -> None:
    async with run_service() as service:
        await fly(service)
        on_board = service.vehicle.on_board
        service.events.pause()
        change = asyncio.create_task(
            service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        )
        await service.until(lambda: service.newest.changing is not None, "the change must begin")
        returns = asyncio.create_task(service.runs.return_to_launch(service.run_id))
        await service.until(lambda: service.newest.commanded == "return", "it is asked")
        service.events.open.set()
        with pytest.raises(ChangeUnderWayError) as caught:
            await asyncio.wait_for(change, 10.0)
        assert not caught.value.may_be_done
        await returns
        assert (service.vehicle.on_board, service.vehicle.sent[-1], service.run.changing) == (on_board, "return", None)


def when_the_change_is_stored(service: RunService, meanwhile: Callable[[], None]) -> None:
    """The disk stalls from then on, until `events.open` is set."""
    append = service.events.append

    async def stalls(*args: Any, **more: Any) -> Sequence[Event]:
        if service.newest.changing is not None and service.events.append is not append:
            service.events.append = append  # type: ignore[method-assign]
            service.events.pause()
            meanwhile()
        return await append(*args, **more)

    service.events.append = stalls  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ("meanwhile", "refused"),
    [
        ({"mode": FlightMode.POSITION}, WrongStateError),
        ({"landed": LandedState.LANDING}, WrongStateError),
        ({"clock": MEASURED_CLOCK.set_to(20.0)}, ConflictError),
    ],
    ids=["a pilot took over", "it lands", "the simulation was sped up"],
)
async def test_a_change_is_not_sent_if_it_is_not_fit_any_more_when_it_is_stored(
    meanwhile: dict[str, object], refused: type[WaydropError]
) -> None:
    async with run_service() as service:
        await fly(service)
        on_board = service.vehicle.on_board
        when_the_change_is_stored(service, lambda: service.vehicle.put(**meanwhile))
        change = asyncio.create_task(
            service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        )
        await service.until(lambda: not service.events.open.is_set(), "the disk stalls")
        service.events.open.set()
        with pytest.raises(refused):
            await asyncio.wait_for(change, 10.0)
        assert (service.vehicle.on_board, service.newest.changing, service.run.changes) == (on_board, None, 0)


async def test_a_new_plan_whose_change_could_not_be_stored_is_not_stored_later() -> None:
    async with run_service() as service:
        await fly(service)
        document = service.plan.model_dump(mode="json")
        clinic_moved(document)
        changed = parse_plan(document)
        stored = StoredPlan("new", "h", "a plan", service.plan.vehicle_type, 0.0, "ann", document)
        created = service.journal.new_event(an_item())
        plan = NewPlan(stored, changed, created, PlanCheck(findings=(), timeline=None))
        service.events.refuse = lambda event: StorageError("disk full")
        with pytest.raises(StorageError):
            await service.runs.change_mission(service.run_id, plan, None, "ann")
        service.events.refuse = lambda event: None
        service.vehicle.put(mission_seq=service.mission.seqs_of("clinic")[0])
        await service.until(lambda: service.run.item_id == "clinic", "it flies on, and is stored again")
        assert (service.events.plans, "plan.created" in [one.kind.value for one in service.events.events]) == (
            {},
            False,
        )


async def test_a_failed_drop_that_the_plan_answers_breaks_a_change_off() -> None:
    async with run_service() as service:
        await fly(service)
        change = await begun(service)
        service.flight.sender.carry_out([ContingencyCommand("return", "drop")])
        with pytest.raises(ChangeUnderWayError) as caught:
            await asyncio.wait_for(change, 10.0)
        assert caught.value.may_be_done, "its last item may have arrived"
        assert service.vehicle.sent[-1] == "return"


async def test_a_change_that_the_link_refused_to_send_is_not_done() -> None:
    async def refuses(mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        raise VehicleQuarantinedError("two vehicles have this system id")
        yield

    async with run_service() as service:
        await fly(service)
        service.vehicle.replace_mission = refuses  # type: ignore[method-assign]
        with pytest.raises(VehicleQuarantinedError) as caught:
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        assert not caught.value.may_be_done


async def test_a_change_that_arrived_is_done_even_if_the_vehicle_refuses_to_skip_what_it_passed() -> None:
    async with run_service() as service:
        await fly(service)
        change = await begun(service)
        service.vehicle.put(mission_seq=service.mission.seqs_of("clinic")[0])
        await service.until(lambda: service.run.item_id == "clinic", "it flies what it flew")

        async def refused(seq: int) -> None:
            raise VehicleRefusedError("denied")

        service.vehicle.set_current = refused  # type: ignore[method-assign]
        service.vehicle.upload_gate.set()
        with pytest.raises(VehicleRefusedError) as caught:
            await asyncio.wait_for(change, 10.0)
        assert caught.value.may_be_done


@pytest.mark.parametrize(("meanwhile", "asked"), [("land", "land"), (None, None)])
async def test_what_a_person_asks_while_the_plans_answer_fails_stays_asked(meanwhile: str | None, asked: str) -> None:
    async with run_service() as service:
        await fly(service)
        sent, fails = asyncio.Event(), asyncio.Event()

        async def refused() -> None:
            sent.set()
            await fails.wait()
            raise VehicleRefusedError("denied")

        service.vehicle.return_to_launch = refused  # type: ignore[method-assign]
        service.flight.sender.carry_out([ContingencyCommand("return", "drop")])
        await asyncio.wait_for(sent.wait(), 10.0)
        assert service.newest.commanded == "contingency"
        if meanwhile is not None:
            await getattr(service.runs, meanwhile)(service.run_id)
        fails.set()
        await service.until(
            lambda: any(isinstance(one.data, RunAck) and one.data.detail == "denied" for one in service.events.events),
            "it must be told",
        )
        assert service.newest.commanded == asked


async def test_a_vehicle_that_was_told_to_return_is_not_given_its_old_mission_again() -> None:
    async with run_service() as service:
        await fly(service)
        service.vehicle.infeasible = 1
        ready = service.vehicle.wait_mission_ready

        async def refused(**terms: object) -> None:
            try:
                await ready(**terms)  # type: ignore[arg-type]
            finally:
                service.events.pause()

        service.vehicle.wait_mission_ready = refused  # type: ignore[method-assign, assignment]
        change = asyncio.create_task(
            service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        )
        await service.until(lambda: not service.events.open.is_set(), "it is found infeasible")
        sent = service.vehicle.on_board
        returns = asyncio.create_task(service.runs.return_to_launch(service.run_id))
        await service.until(lambda: service.newest.commanded == "return", "it is asked")
        service.events.open.set()
        with pytest.raises(VehicleRefusedError):
            await asyncio.wait_for(change, 10.0)
        await returns
        assert (service.vehicle.on_board, service.newest.commanded, service.vehicle.sent[-1]) == (
            sent,
            "return",
            "return",
        )


async def test_a_vehicle_that_was_told_to_return_is_not_changed_while_it_still_says_mission() -> None:
    async with run_service() as service:
        await fly(service)
        await service.runs.return_to_launch(service.run_id)
        service.vehicle.put(mode=FlightMode.MISSION)
        with pytest.raises(WrongStateError):
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")


async def test_an_embedded_drop_that_was_made_unseen_is_not_made_again_by_a_change_in_the_hold_after_it() -> None:
    def with_a_way_back(document: Document) -> None:
        document["items"].insert(-1, {**item(document, "clinic"), "id": "back", "latitude_deg": 47.398})

    async with run_service("multicopter-embedded.json", changes=with_a_way_back) as service:
        await fly(service, "clinic")
        service.vehicle.put(connected=False)
        await service.until(lambda: service.flight.flight.link.connected_since_s is None, "the link must be lost")
        service.vehicle.put(connected=True, mode=FlightMode.HOLD)
        await service.until_state(RunState.PAUSED)
        await service.runs.pause(service.run_id)
        with pytest.raises(ConflictError, match="unseen"):  # MISSION_CURRENT comes a second after the HEARTBEAT
            await service.runs.change_mission(service.run_id, "plan-1", "clinic", "ann")
        service.vehicle.put(mission_seq=service.mission.seqs_of("back")[0])
        await service.until(lambda: service.run.item_id == "back", "what it flew unseen must show")
        await service.until(lambda: service.drop.phase is DropPhase.DONE, "the drop must have its outcome")
        await service.until(
            lambda: service.flight.flight.current_item_is_fresh(time.monotonic()), "it is heard for long enough"
        )
        await service.runs.change_mission(service.run_id, "plan-1", None, "ann")
        assert MavCmd.DO_GRIPPER not in [one.command for one in service.vehicle.on_board]


async def test_a_stop_put_into_a_flight_is_not_skipped_when_its_place_is_passed_meanwhile() -> None:
    def with_a_stop(document: Document) -> None:
        stop = {
            **item(document, "corner"),
            "id": "stop",
            "latitude_deg": item(document, "corner")["latitude_deg"] + 2e-4,
        }
        document["items"].insert(document["items"].index(item(document, "corner")) + 1, stop)

    async with run_service() as service:
        await fly(service)
        change = await begun(service, with_a_stop, needed=("stop",))
        service.vehicle.put(mission_seq=service.mission.seqs_of("clinic")[0])
        await service.until(lambda: service.run.item_id == "clinic", "it flies what it flew")
        service.vehicle.upload_gate.set()
        await asyncio.wait_for(change, 10.0)
        assert "set_current" not in service.vehicle.sent[-1]
        await service.until(lambda: service.run.item_id == "corner", "it flies back")
        assert "stop" not in service.run.flown_item_ids


async def test_a_drop_that_a_change_takes_out_is_not_told_as_flown() -> None:
    def without_drop(document: Document) -> None:
        document["items"] = [one for one in document["items"] if one["id"] != "drop"]

    async with run_service() as service:
        await fly(service, "clinic")
        await service.runs.change_mission(service.run_id, store(service, without_drop), None, "ann")
        assert service.drop.outcome is DropOutcome.KEPT
        assert "drop" not in service.run.flown_item_ids


async def test_a_mission_found_infeasible_before_it_was_looked_at_is_replaced_by_the_one_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with run_service() as service:
        await fly(service)
        service.vehicle.infeasible = 1
        monkeypatch.setattr("app.domain.flight.step.settle_change", lambda flight, change, observed: flight)
        with pytest.raises(VehicleRefusedError):
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        assert service.vehicle.on_board[1].x == round(service.mission.drops[0].latitude_deg * 1e7)
        assert service.run.commanded == "refused"


def test_a_parcel_that_came_back_from_its_alternate_and_was_tried_again_is_told_of_by_its_drop() -> None:
    def last(outcome: DropOutcome) -> list[str]:
        drop = DropRecord(plan_item_id="drop", supervised=True, phase=DropPhase.DONE, outcome=outcome)
        kept = drop.model_copy(update={"plan_item_id": "locker", "alternate_to": "drop", "outcome": DropOutcome.KEPT})
        run = Run(id="r", plan_id="p", plan_hash="h", vehicle_id="v", drops=(drop, kept), created_at=0, updated_at=0)
        return [record.plan_item_id for record in run.last_drops]

    assert last(DropOutcome.KEPT) == ["locker"]
    assert [last(DropOutcome.RELEASED), last(DropOutcome.UNKNOWN), last(DropOutcome.PENDING)] == [["drop"]] * 3


async def test_no_mission_is_changed_while_the_vehicle_is_sent_on_from_a_drop() -> None:
    """The command is sent again if its ack is lost: its number would be of another item by then."""
    async with run_service() as service:
        set_current, gate, sent = service.vehicle.set_current, asyncio.Event(), asyncio.Event()

        async def later(seq: int) -> None:
            if seq > 0:
                sent.set()
                await gate.wait()
            await set_current(seq)

        service.vehicle.set_current = later  # type: ignore[method-assign]
        await service.create()
        await service.fly_to_drop()
        await asyncio.wait_for(sent.wait(), 10.0)
        assert service.drop.outcome is DropOutcome.RELEASED
        service.vehicle.put(mission_seq=service.mission.drops[0].hold_seqs[-1] + 1)
        await service.until(lambda: service.flight.flight.progress.item_id == "home", "the hold is over")
        assert service.flight.flight.drop_is_busy
        gate.set()
        await service.until(lambda: not service.flight.flight.drop_is_busy, "the command is answered")
