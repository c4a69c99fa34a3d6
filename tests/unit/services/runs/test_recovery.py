"""After a restart of ours: a mission on board is known by its id, and a run says so while it cannot be read."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.errors import LinkTimeoutError, RunNotFollowedError, StorageError
from app.domain.events import Event
from app.domain.events.run import RunChanged
from app.domain.mission import MissionItem, MissionType
from app.domain.plan.compiler import compile_plan
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import Run, RunAction, RunState
from app.domain.vehicle.facts import DuplicateSystem
from app.domain.vehicle.state import FlightMode, GlobalPosition, LandedState
from tests.support.changed_flight import clinic_moved, fly, store
from tests.support.run_service import RunService, restarted, run_service

UNREAD = "run.mission_unread"


@dataclass
class MissionList:
    """The vehicle's answer to MISSION_REQUEST_LIST, which the test may withhold."""

    service: RunService
    is_answered: bool = False
    asked_s: list[float] = field(default_factory=list)

    async def download(self, mission_type: MissionType) -> tuple[MissionItem, ...]:
        """As VehicleLink.download."""
        self.asked_s.append(time.monotonic())
        if not self.is_answered:
            raise LinkTimeoutError("the mission list could not be read back: TIMEOUT")
        return self.service.vehicle.on_board


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.services.runs.recovery.AGAIN_S", 0.01)


async def flying(service: RunService, monkeypatch: pytest.MonkeyPatch) -> MissionList:
    """On its way to the corner, named by its checksum as PX4 does, with nobody who reads its list."""
    service.vehicle.upload_id = service.vehicle.mission_id_of(service.mission)
    await fly(service)
    listed = MissionList(service)
    monkeypatch.setattr(service.vehicle, "download", listed.download)
    return listed


def is_followed(service: RunService) -> Callable[[], bool]:
    return lambda: service.runs.flight(service.run_id) is not None


def is_unread(run: Run) -> bool:
    return run.reason is not None and run.reason.code.value == UNREAD


def told_unread(service: RunService) -> list[Event]:
    """The events in which the run says it."""
    of_run = [event for event in service.events.events if event.run_id == service.run_id]
    return [event for event in of_run if isinstance(event.data, RunChanged) and is_unread(event.data.root)]


async def told_times(service: RunService, count: int) -> None:
    await service.until(lambda: len(told_unread(service)) == count, "each process tells it")


async def unread(service: RunService) -> None:
    """Stored, and shown to whoever asks."""
    await service.until(lambda: any(map(is_unread, service.runs.open_runs())), "it must say why it is not followed")


async def test_a_run_whose_mission_the_vehicle_names_is_followed_without_reading_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        await restarted(service)
        await service.until(is_followed(service), "the id is what its upload was verified by")
        await service.fly_to_drop()
        await service.until(lambda: service.drop.outcome is DropOutcome.RELEASED, "the drop is attended")
        assert (listed.asked_s, told_unread(service)) == ([], [])


@pytest.mark.parametrize("arrived", [True, False])
async def test_amid_a_change_the_mission_that_the_vehicle_names_is_followed(
    arrived: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        lost = LinkTimeoutError("killed meanwhile")
        service.vehicle.lost_ack, service.vehicle.upload_error = (lost, None) if arrived else (None, lost)
        with pytest.raises(LinkTimeoutError):
            await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        changing = service.run.changing
        assert changing is not None

        def meanwhile() -> None:
            if arrived:
                service.vehicle.put(mission_id=changing.mission_id, mission_seq=0)

        await restarted(service, meanwhile=meanwhile)
        await service.until(is_followed(service), "the vehicle names what it flies")
        await service.until(lambda: service.run.changing is None, "it is known again what is flown")
        assert service.run.plan_id == ("plan-2" if arrived else "plan-1")
        assert service.kinds().count("run.mission_changed") == int(arrived)
        assert bool(listed.asked_s) is not arrived, "MISSION_CURRENT may name the one of before for a moment"


async def test_a_mission_that_the_change_brought_is_followed_by_its_id(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        await service.runs.change_mission(service.run_id, store(service, clinic_moved), None, "ann")
        await restarted(service)
        await service.until(is_followed(service), "the vehicle names what it flies")
        assert (service.run.plan_id, listed.asked_s) == ("plan-2", [])


def other_speed(service: RunService) -> None:
    """Parameters by which the plan is another mission now."""
    facts = service.vehicle.facts
    service.vehicle.facts = replace(facts, parameters={**facts.parameters, "PD_GRIPPER_TO": 7.0})


@pytest.mark.parametrize("mission_id", [None, 5])
async def test_a_mission_that_the_vehicle_does_not_name_is_read(
    mission_id: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        listed.is_answered = True
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=mission_id))
        await service.until(is_followed(service), "it is the run's, item by item")
        assert len(listed.asked_s) == 1


async def test_a_mission_whose_plan_compiles_to_another_one_now_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service("multicopter-embedded.json") as service:
        service.vehicle.upload_id = service.vehicle.mission_id_of(service.mission)
        await service.create()
        await service.until_state(RunState.FLYING)
        listed = MissionList(service, is_answered=True)
        monkeypatch.setattr(service.vehicle, "download", listed.download)
        await restarted(service, meanwhile=lambda: other_speed(service))
        await service.until(is_followed(service), "it is the run's by its id")
        assert len(listed.asked_s) == 1, "how it was uploaded is read from the vehicle"


async def test_a_mission_is_known_by_its_id_although_home_has_moved_as_it_took_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """PX4 sets home anew as it arms; the takeoff of this plan has no position of its own."""
    async with run_service() as service:
        home = GlobalPosition(47.3977433, 8.5455937, 488.0)
        facts = service.vehicle.facts = replace(service.vehicle.facts, home=home)
        service.mission = compile_plan(service.plan, facts)
        listed = await flying(service, monkeypatch)

        def home_moves() -> None:
            service.vehicle.facts = replace(facts, home=replace(home, longitude_deg=8.5455936))

        await restarted(service, meanwhile=home_moves)
        await service.until(is_followed(service), "compiled with the home of its upload, it is the same")
        assert listed.asked_s == []


async def test_a_name_from_before_a_silence_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        await flying(service, monkeypatch)
        service.vehicle.mission_age_s = 20.0
        await restarted(service)
        await unread(service)
        service.vehicle.mission_age_s = 0.5
        await service.until(is_followed(service), "now it is named")


async def test_while_the_mission_cannot_be_read_the_run_says_so_once_and_is_followed_as_soon_as_it_can(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        await service.runs.pause(service.run_id)
        await service.until_state(RunState.PAUSED)
        before = service.run
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=None))
        await unread(service)
        assert describe(service.run.reason) == (
            "after a restart the mission on board cannot be read; Waydrop does not follow the run yet "
            "(the mission list could not be read back: TIMEOUT)"
        )
        assert service.runs.open_runs() == [service.run]
        assert service.run.updated_at == before.updated_at, "from then on a hold that was seen is counted"
        asked = len(listed.asked_s)
        await service.until(lambda: len(listed.asked_s) > asked + 1, "it goes on asking")
        assert len(told_unread(service)) == 1
        listed.is_answered = True
        await service.until(is_followed(service), "its mission was read")
        await service.until(lambda: not is_unread(service.run), "it is followed")
        assert service.run.reason == before.reason


@pytest.mark.parametrize(
    ("north_deg", "commanded", "state", "code"),
    [
        (0.0, RunAction.RETURN, RunState.ABORTED, ReasonCode.ASKED_BEFORE_DONE),
        (0.002, RunAction.RETURN, RunState.ABORTED, ReasonCode.LANDED_ELSEWHERE),
        (0.0, None, RunState.FAILED, ReasonCode.ENDED_EARLY_BECAUSE),
        (0.002, None, RunState.FAILED, ReasonCode.LANDED_ELSEWHERE),
    ],
)
async def test_a_run_that_is_never_read_ends_as_its_vehicle_has_landed_by_where_it_stands(
    monkeypatch: pytest.MonkeyPatch, north_deg: float, commanded: RunAction | None, state: RunState, code: ReasonCode
) -> None:
    """What it names as its mission by then may be another one."""
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        service.vehicle.put(home=GlobalPosition(47.397742, 8.545594, 488.0))
        await service.until(lambda: service.newest.home is not None, "home of its takeoff is known")
        if commanded is not None:
            await service.runs.return_to_launch(service.run_id)
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=5))
        await unread(service)
        service.vehicle.put(latitude_deg=47.397742 + north_deg, mode=FlightMode.HOLD)
        service.vehicle.touch_down(complete=False, last_seq=0)
        await service.until_state(state)
        assert service.run.reason is not None
        assert service.run.reason.code is code
        assert (service.drop.outcome, service.vehicle.releases) == (DropOutcome.KEPT, [])
        assert len(listed.asked_s) >= 4, "it was asked until then"
        await service.until(lambda: not service.runs.open_runs(), "it is over")


@pytest.mark.parametrize("armed", [True, False])
async def test_a_run_that_is_not_read_can_be_aborted(monkeypatch: pytest.MonkeyPatch, armed: bool) -> None:
    monkeypatch.setattr("app.services.runs.recovery.AGAIN_S", 30.0)
    async with run_service() as service:
        await flying(service, monkeypatch)
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=None, armed=armed))
        await unread(service)
        service.vehicle.sent.clear()
        await service.runs.abort(service.run_id)
        await service.until_state(RunState.ABORTED)
        assert service.run.reason == Reason.of(ReasonCode.ABORTED_UNREAD)
        assert service.vehicle.sent == (["return"] if armed else ["hold_disarmed"])
        await service.until(lambda: not service.runs.open_runs(), "it is over")


async def test_a_vehicle_that_would_take_off_as_it_arms_is_put_in_hold_before_its_unread_run_ends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with run_service() as service:
        await flying(service, monkeypatch)
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=5))
        await unread(service)
        service.vehicle.sent.clear()
        service.vehicle.touch_down(complete=False, last_seq=0)
        await service.until(lambda: service.run.is_over, "it must end")
        assert (service.vehicle.sent, service.vehicle.truth.mode) == (["hold_disarmed"], FlightMode.HOLD)
        assert service.kinds()[-3:] == ["run.command", "run.ack", "run.changed"]


@pytest.mark.parametrize("is_same", [True, False])
async def test_a_vehicle_with_another_mission_is_put_in_hold_unless_it_is_another_vehicle(
    monkeypatch: pytest.MonkeyPatch, is_same: bool
) -> None:
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        listed.is_answered = True
        service.vehicle.on_board = service.vehicle.on_board[:-1]
        service.vehicle.sent.clear()
        if not is_same:
            service.vehicle.identity = replace(service.vehicle.identity, uid="uid-2")
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=5, armed=False))
        await service.until_state(RunState.FAILED)
        assert service.vehicle.sent == (["hold_disarmed"] if is_same else [])


async def test_a_run_whose_vehicle_cannot_be_told_to_return_is_not_aborted(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        await flying(service, monkeypatch)
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=None))
        await unread(service)

        async def unheard() -> None:
            raise LinkTimeoutError("no ack")

        monkeypatch.setattr(service.vehicle, "return_to_launch", unheard)
        with pytest.raises(LinkTimeoutError):
            await service.runs.abort(service.run_id)
        assert is_unread(service.run)


async def test_a_reason_of_before_outlasts_a_second_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        await service.runs.pause(service.run_id)
        await service.until_state(RunState.PAUSED)
        before = service.run.reason
        for count in (1, 2):
            await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=None, mission_seq=None))
            await told_times(service, count)
        listed.is_answered = True
        await restarted(service)
        await service.until(is_followed(service), "its mission was read")
        await service.until(lambda: not is_unread(service.run), "it is followed")
        assert service.run.reason == before


async def test_a_run_that_waits_for_its_start_does_not_go_on_saying_it(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        before, listed = service.run, MissionList(service)
        monkeypatch.setattr(service.vehicle, "download", listed.download)
        await restarted(service)
        await unread(service)
        listed.is_answered = True
        await service.until(lambda: service.run == before, "it waits for its start as before")


async def test_a_vehicle_that_does_not_answer_is_asked_less_and_less_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.services.runs.recovery.AGAIN_S", 0.05)
    monkeypatch.setattr("app.services.runs.recovery.MOST_AGAIN_S", 0.15, raising=False)
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=None))
        await service.until(lambda: len(listed.asked_s) > 4, "it goes on asking")
        waits_s = [later - earlier for earlier, later in itertools.pairwise(listed.asked_s)]
        assert all(wait_s >= least_s for wait_s, least_s in zip(waits_s, (0.05, 0.1, 0.15, 0.15), strict=False)), (
            waits_s
        )


async def test_a_run_that_cannot_say_it_because_of_the_disk_says_it_later(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        await flying(service, monkeypatch)
        failing = [StorageError("disk full")] * 2
        service.events.refuse = lambda event: (
            failing.pop() if failing and isinstance(event.data, RunChanged) and is_unread(event.data.root) else None
        )
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=None))
        await unread(service)
        assert (failing, len(told_unread(service))) == ([], 1)


async def test_a_disk_that_hangs_does_not_keep_a_run_from_being_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=None))
        service.events.pause()
        await service.until(lambda: bool(listed.asked_s), "it is asked")
        listed.is_answered = True
        await service.until(is_followed(service), "its mission was read")
        service.events.open.set()
        await service.until(lambda: len(told_unread(service)) <= 1 and not is_unread(service.run), "it is followed")


async def test_whoever_commands_a_run_that_is_not_followed_is_told_the_true_cause(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with run_service() as service:
        listed = await flying(service, monkeypatch)
        await restarted(service, meanwhile=lambda: service.vehicle.put(mission_id=None))
        await unread(service)

        async def refused(cause: str) -> None:
            with pytest.raises(RunNotFollowedError, match=cause):
                await service.runs.pause(service.run_id)

        await refused("its vehicle is connected, but its mission cannot be read: the mission list .* TIMEOUT")
        service.vehicle.put(DuplicateSystem(Reason.of(ReasonCode.TWO_CLOCKS)))
        await refused("its vehicle is quarantined")
        await service.fleet.end_quarantine("v1", "ann")
        service.vehicle.put(connected=False)
        await refused("the link to its vehicle is lost")
        service.vehicle.put(connected=True, landed=LandedState.IN_AIR)
        listed.is_answered = True
        await service.until(is_followed(service), "its mission was read")
        await service.runs.pause(service.run_id)


async def test_before_a_first_answer_nobody_is_told_that_a_connected_vehicle_has_not_connected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with run_service() as service:
        await flying(service, monkeypatch)
        service.vehicle.put(mode=None)
        await restarted(service)
        with pytest.raises(RunNotFollowedError, match="is connected, and what it carries is being read"):
            await service.runs.pause(service.run_id)
