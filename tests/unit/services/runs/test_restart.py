"""After a restart of ours a run goes on where its vehicle is, and nothing is started or released again."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.errors import (
    LinkTimeoutError,
    StorageError,
    VehicleQuarantinedError,
    VehicleRefusedError,
    WaydropError,
    WrongStateError,
)
from app.domain.events.event import NewEvent
from app.domain.events.run import RunChanged
from app.domain.mission import MissionItem, MissionType
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import RunState
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import FlightMode, LandedState
from tests.support.run_service import RunService, restarted, run_service
from tests.support.scripted_link import FAST


async def land(service: RunService) -> None:
    service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
    await service.until(lambda: service.run.is_over, "the run must end after the landing")


async def test_after_a_restart_the_run_goes_on_where_the_vehicle_is() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await service.until(lambda: service.run.item_id == "corner", "progress must show")
        sent = list(service.vehicle.sent)
        await restarted(service)
        assert service.fleet.view("v1").run_id == service.run_id or service.runs.open_runs()
        await service.fly_to_drop()
        await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "the taken-up run must drop")
        assert service.vehicle.sent == [*sent, "set_current 3"], "nothing is armed or started again"
        await land(service)
        assert service.run.state is RunState.COMPLETED
        assert service.run.flown_item_ids == ("takeoff", "corner", "clinic", "drop", "home")


async def test_after_a_restart_during_the_hold_its_end_is_counted_from_when_it_was_last_seen_waiting() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mission_seq=2, landed=LandedState.IN_AIR)
        await service.until(lambda: service.run.item_id == "clinic", "progress must show")
        drop = service.mission.drops[0]
        place = {"latitude_deg": drop.latitude_deg, "longitude_deg": drop.longitude_deg}
        height = {"relative_altitude_m": drop.relative_altitude_m}
        await restarted(service, meanwhile=lambda: service.vehicle.put(**place, **height))
        await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "25 s of the hold are surely left")
        assert len(service.vehicle.releases) == 1


async def test_after_a_restart_a_commanded_release_is_not_sent_again() -> None:
    async with run_service() as service:
        service.vehicle.answers = [LinkTimeoutError("killed meanwhile")] * 9
        service.vehicle.put(connected=True)
        await service.create()
        await service.fly_to_drop()
        await service.until(lambda: bool(service.vehicle.releases), "the release must be sent")
        await service.until(lambda: service.drop.attempts >= 1, "the release must be recorded")
        service.vehicle.releases.clear()
        await restarted(service)
        await service.until(lambda: service.drop.outcome is not DropOutcome.PENDING, "the drop must end")
        assert service.vehicle.releases == []
        assert service.drop.outcome is DropOutcome.UNKNOWN


async def test_after_a_restart_a_vehicle_with_another_mission_is_not_followed() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.on_board = service.vehicle.on_board[:-1]
        await restarted(service)
        await service.until_state(RunState.FAILED)
        assert "the mission on board is not" in describe(service.run.reason)


async def test_after_a_restart_during_an_upload_nothing_is_started() -> None:
    async with run_service() as service:
        service.vehicle.upload_gate.clear()
        await service.create()
        await service.until(lambda: service.run.state is RunState.UPLOADING, "the upload must begin")
        await restarted(service)
        await service.until_state(RunState.FAILED)
        assert service.vehicle.sent == []


@pytest.mark.parametrize("is_ended", [False, True])
async def test_an_uploaded_run_waits_for_its_vehicle_without_a_limit_until_somebody_ends_it(is_ended: bool) -> None:
    impatient = replace(FAST, lost_after_s=0.05)
    async with run_service(settings=impatient) as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        await restarted(service, meanwhile=lambda: service.vehicle.put(connected=False), settings=impatient)
        await asyncio.sleep(impatient.lost_after_s * 4)
        assert service.run.state is RunState.UPLOADED
        if is_ended:
            await service.runs.abort(service.run_id)
            await service.until_state(RunState.ABORTED)
            await service.until(lambda: not service.runs.open_runs(), "the vehicle must be free")
        service.vehicle.put(connected=True)
        if not is_ended:
            await service.until(lambda: service.runs.flight(service.run_id) is not None, "it must be followed")
            await service.runs.start(service.run_id)
            await service.until_state(RunState.FLYING)


async def _refuses_to_arm(service: RunService) -> None:
    """A start that a person has asked waits for the vehicle to arm."""
    service.vehicle.arm_refusals = 1_000_000
    tried = service.vehicle.sent.count("arm")
    await service.runs.start(service.run_id)
    await service.until(lambda: service.vehicle.sent.count("arm") > tried, "it must try to arm")


@pytest.mark.parametrize("failed_before", [False, True], ids=["first start", "after one that failed"])
async def test_a_start_that_a_restart_interrupted_before_the_mission_was_commanded_is_a_persons_to_repeat(
    failed_before: bool,
) -> None:
    patient = replace(FAST, armable_s=60.0)
    async with run_service(settings=patient) as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        if failed_before:
            service.vehicle.start_error = LinkTimeoutError("no ack of the start")
            await service.runs.start(service.run_id)
            await service.until(lambda: "no ack" in describe(service.run.reason), "that start must fail")
            service.vehicle.start_error = None
        await _refuses_to_arm(service)
        await restarted(service, settings=patient)
        service.vehicle.arm_refusals = 0
        await service.until_state(RunState.UPLOADED)
        assert service.run.reason == Reason.of(ReasonCode.RESTART_DURING_START_DISARMED)
        sent = list(service.vehicle.sent)
        await service.until(lambda: service.runs.flight(service.run_id) is not None, "it must be followed")
        await asyncio.sleep(FAST.poll_every_s * 10)
        assert service.vehicle.sent == sent, "nothing is started by itself"
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)


async def test_a_start_whose_mission_was_commanded_before_a_restart_is_not_repeated() -> None:
    """It may have flown, and have released its parcel, before it was found disarmed."""
    async with run_service() as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        service.vehicle.start_gate.clear()
        await service.runs.start(service.run_id)
        await service.until(lambda: "start" in service.vehicle.sent, "the mission must be commanded")
        service.vehicle.disarm_error = LinkTimeoutError("killed")
        await restarted(service, meanwhile=lambda: service.vehicle.put(armed=False))
        await service.until_state(RunState.FAILED)
        assert service.run.reason == Reason.of(ReasonCode.RESTART_DURING_START_DISARMED)


@pytest.mark.parametrize("is_held", [True, False])
async def test_a_vehicle_that_a_broken_start_left_in_mission_mode_is_put_in_hold(is_held: bool) -> None:
    """It would take off as soon as anybody arms it. The run ends all the same if it stays in it."""
    async with run_service() as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        service.vehicle.start_gate.clear()
        await service.runs.start(service.run_id)
        await service.until(lambda: "start" in service.vehicle.sent, "the mission must be commanded")
        service.vehicle.disarm_error = LinkTimeoutError("killed")
        await service.runs.close()
        service.vehicle.sent.clear()
        service.vehicle.hold_error = None if is_held else LinkTimeoutError("no ack")
        await restarted(service, meanwhile=lambda: service.vehicle.put(armed=False, mode=FlightMode.MISSION))
        await service.until_state(RunState.FAILED)
        assert service.run.reason == Reason.of(ReasonCode.RESTART_DURING_START_DISARMED)
        assert service.vehicle.sent == ["hold_disarmed"]
        assert service.kinds()[-3:] == ["run.command", "run.ack", "run.changed"]


async def left_armed(service: RunService) -> None:
    """A restart of ours broke its start off: it stands in Hold mode, armed, and was never in the air."""
    await service.create(start=False)
    await service.until_state(RunState.UPLOADED)
    service.vehicle.start_gate.clear()
    await service.runs.start(service.run_id)
    await service.until(lambda: "start" in service.vehicle.sent, "the mission must be commanded")
    service.vehicle.disarm_error = LinkTimeoutError("killed")
    await restarted(service)
    await service.until_state(RunState.FLYING)
    service.vehicle.disarm_error = None
    service.vehicle.sent.clear()


@pytest.mark.parametrize("plan_file", ["clinic-run.json", "rover-drop.json"])
@pytest.mark.parametrize("restarts", [1, 2])
async def test_an_abort_disarms_a_vehicle_that_a_broken_start_left_armed(plan_file: str, restarts: int) -> None:
    """A rover says that it is in the air, soon after it was armed."""
    async with run_service(plan_file) as service:
        await left_armed(service)
        if plan_file.startswith("rover"):
            service.vehicle.put(landed=LandedState.IN_AIR)
        for _ in range(restarts - 1):
            await restarted(service)
            await service.until(lambda: service.runs.flight(service.run_id) is not None, "it must be followed")
        await service.runs.abort(service.run_id)
        await service.until_state(RunState.ABORTED)
        assert service.run.reason == Reason.of(ReasonCode.ABORTED_ON_GROUND)
        assert (service.vehicle.sent, service.drop.outcome) == (["disarm"], DropOutcome.KEPT)


async def test_an_abort_returns_a_vehicle_that_took_off_meanwhile() -> None:
    """PX4 disarms nothing that flies."""
    async with run_service() as service:
        await left_armed(service)
        service.vehicle.disarm_error = VehicleRefusedError("it flies")
        await service.runs.abort(service.run_id)
        assert service.vehicle.sent == ["disarm", "return"]


@pytest.mark.parametrize("mode", [FlightMode.POSITION, FlightMode.OFFBOARD])
async def test_an_abort_disarms_nothing_that_somebody_else_has(mode: FlightMode) -> None:
    async with run_service() as service:
        await left_armed(service)
        service.vehicle.put(mode=mode)
        await service.runs.abort(service.run_id)
        assert service.vehicle.sent == ["return"]


async def test_an_abort_of_a_left_vehicle_that_does_not_disarm_says_so() -> None:
    async with run_service() as service:
        await left_armed(service)
        service.vehicle.disarm_error = LinkTimeoutError("no ack")
        with pytest.raises(LinkTimeoutError):
            await service.runs.abort(service.run_id)
        assert service.run.state is RunState.FLYING
        service.vehicle.disarm_error = None
        await service.runs.abort(service.run_id)
        await service.until_state(RunState.ABORTED)


async def vanish(service: RunService) -> None:
    """The link is away, and that was noticed."""
    service.vehicle.put(connected=False)
    before = service.vehicle.looks
    await service.until(lambda: service.vehicle.looks > before + 3, "the silence must be looked at")


@pytest.mark.parametrize("ours", [False, True])
async def test_a_flight_that_went_on_to_its_end_unseen_is_completed_and_its_parcel_kept(ours: bool) -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await service.until(lambda: service.run.item_id == "corner", "progress must show")

        def fly_on() -> None:
            service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)

        if ours:
            await restarted(service, meanwhile=fly_on)
        else:
            await vanish(service)
            fly_on()
            service.vehicle.put(connected=True)
        await service.until(lambda: service.run.is_over, "the run must end")
        assert service.run.state is RunState.COMPLETED, service.run.reason
        assert (service.drop.outcome, service.vehicle.releases) == (DropOutcome.KEPT, [])


@pytest.mark.parametrize("changes", [{"mission_seq": 2}, {"mission_id": 5}, {"mission_id": None}])
async def test_a_flight_that_ended_unseen_before_its_last_item_or_with_another_mission_is_no_completed_one(
    changes: dict[str, object],
) -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await service.until(lambda: service.run.item_id == "corner", "progress must show")
        await vanish(service)
        service.vehicle.touch_down(complete=True, last_seq=len(service.mission.items) - 1)
        service.vehicle.put(connected=True, **changes)
        await service.until(lambda: service.run.is_over, "the run must end")
        assert service.run.state is RunState.FAILED


async def taken_up(service: RunService) -> None:
    """The new process follows the vehicle: its fleet listens, and its run."""
    await service.until(lambda: len(service.vehicle.listeners) > 1, "the run must be taken up")


async def test_an_item_that_px4_reports_again_after_a_restart_is_not_flown_twice() -> None:
    """MISSION_ITEM_REACHED is repeated for ten seconds, and may come before the first MISSION_CURRENT."""
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await service.until(lambda: service.run.flown_item_ids == ("takeoff",), "the takeoff must count as flown")
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_seq=None))
        await taken_up(service)
        service.vehicle.put(ItemReached(0))
        service.vehicle.put(mission_seq=2)
        await service.until(lambda: service.run.item_id == "clinic", "progress must show")
        assert service.run.flown_item_ids == ("takeoff", "corner")


async def test_what_was_flown_during_a_restart_shows_at_once() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mission_seq=1, landed=LandedState.IN_AIR)
        await service.until(lambda: service.run.flown_item_ids == ("takeoff",), "the takeoff must count as flown")
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_seq=2))
        await service.until(lambda: service.run.item_id == "clinic", "progress must show")
        assert service.run.flown_item_ids == ("takeoff", "corner")


async def _started(service: RunService) -> bool:
    """Whether the run takes an order to start; not before the service has seen its vehicle."""
    try:
        await service.runs.start(service.run_id)
    except WrongStateError:
        return False
    return True


@pytest.mark.parametrize("is_restarted", [False, True])
async def test_a_mission_that_would_be_another_now_is_not_started_also_after_a_restart(is_restarted: bool) -> None:
    async with run_service("multicopter-embedded.json") as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        facts = service.vehicle.facts
        other = replace(facts, parameters={**facts.parameters, "PD_GRIPPER_TO": 7.0})
        if is_restarted:
            await restarted(service, meanwhile=lambda: setattr(service.vehicle, "facts", other))
        else:
            service.vehicle.facts = other
        async with asyncio.timeout(5.0):
            while not await _started(service):
                await asyncio.sleep(0.01)
        await service.until(
            lambda: "would change the mission" in describe(service.run.reason), "the start must be refused"
        )
        assert "arm" not in service.vehicle.sent


@pytest.mark.parametrize("error", [LinkTimeoutError("no answer"), VehicleQuarantinedError("two vehicles")])
async def test_after_a_restart_a_run_is_followed_as_soon_as_its_mission_can_be_read(
    error: WaydropError, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        download, failures = service.vehicle.download, [error, error]

        async def read(mission_type: MissionType) -> tuple[MissionItem, ...]:
            if failures:
                raise failures.pop()
            return await download(mission_type)

        monkeypatch.setattr(service.vehicle, "download", read)
        monkeypatch.setattr("app.services.runs.recovery.AGAIN_S", 0.01)
        await restarted(service)
        await service.until(lambda: service.runs.flight(service.run_id) is not None, "it is followed")
        await land(service)


async def test_the_end_of_a_run_that_cannot_be_followed_waits_for_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.on_board = service.vehicle.on_board[:-1]
        failing = [StorageError("disk full")] * 3

        def refuse(event: NewEvent) -> WaydropError | None:
            is_the_run = isinstance(event.data, RunChanged) and event.data.root.state is RunState.FAILED
            return failing.pop() if failing and is_the_run else None

        monkeypatch.setattr("app.services.runs.recovery.AGAIN_S", 0.01)
        service.events.refuse = refuse
        await restarted(service)
        await service.until_state(RunState.FAILED)
        assert failing == []
