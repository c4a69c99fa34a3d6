"""Around the start: what stood before it is no part of the flight, and no end is claimed of a vehicle that may fly."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from app.domain.drop.record import DropOutcome
from app.domain.errors import LinkTimeoutError, VehicleRefusedError, VehicleTakenError, WaydropError
from app.domain.reasons import describe
from app.domain.run.run import RunState
from app.domain.vehicle.clock import VehicleClock
from app.domain.vehicle.facts import MissionCurrent, Rebooted
from app.domain.vehicle.state import FlightMode, LandedState
from app.services.runs import gates
from app.services.runs.prepare import Preparation
from tests.support.run_service import RunService, restarted, run_service
from tests.support.scripted_link import FAST


async def _uploaded(service: RunService) -> None:
    await service.create(start=False)
    await service.until_state(RunState.UPLOADED)


async def test_a_reboot_before_the_start_does_not_fail_the_flight() -> None:
    async with run_service() as service:
        await _uploaded(service)
        service.vehicle.put(Rebooted())
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)
        await service.some_looks()
        assert service.run.state is RunState.FLYING


async def test_an_uploaded_run_is_not_started_while_somebody_else_flies_the_vehicle() -> None:
    async with run_service() as service:
        await _uploaded(service)
        service.vehicle.put(armed=True, landed=LandedState.IN_AIR)
        sent = list(service.vehicle.sent)
        with pytest.raises(VehicleTakenError) as caught:
            await service.runs.start(service.run_id)
        assert (caught.value.code, caught.value.extra) == ("vehicle.taken", {"mode": "hold", "armed": True})
        assert service.run.state is RunState.UPLOADED
        assert service.vehicle.sent == sent


def _clock(rate: float, seconds: float) -> VehicleClock:
    return VehicleClock(tuple((n * 0.1, n * 0.1 * rate) for n in range(round(seconds * 10))), window_s=10.0)


async def test_a_vehicle_whose_clock_runs_too_fast_is_not_armed_for_a_supervised_drop() -> None:
    async with run_service() as service:
        await _uploaded(service)
        service.vehicle.put(clock=_clock(10.0, 5.0))
        await service.runs.start(service.run_id)
        await service.until(
            lambda: "supervised drops work up to 4 times" in describe(service.run.reason), "the reason must be told"
        )
        assert service.run.state is RunState.UPLOADED
        assert "arm" not in service.vehicle.sent


async def test_the_same_vehicle_flies_embedded_drops() -> None:
    async with run_service("multicopter-embedded.json") as service:
        service.vehicle.put(clock=_clock(50.0, 5.0))
        await service.create()
        await service.until_state(RunState.FLYING)


async def test_a_clock_that_seems_too_fast_is_listened_to_until_it_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gates, "LONGEST_LOOK_S", 60.0)
    async with run_service() as service:
        await _uploaded(service)
        service.vehicle.put(clock=_clock(5.0, 2.0))
        await service.runs.start(service.run_id)
        await service.until_state(RunState.STARTING)
        await service.some_looks()
        assert "arm" not in service.vehicle.sent
        service.vehicle.put(clock=_clock(4.0, 9.0))
        await service.until_state(RunState.FLYING)


@pytest.mark.parametrize(("rate", "arms"), [(1.0, True), (10.0, False)])
async def test_a_clock_that_is_not_measured_yet_is_listened_to_first(
    rate: float, arms: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gates, "LONGEST_UNMEASURED_S", 60.0)
    monkeypatch.setattr(gates, "LONGEST_LOOK_S", 60.0)
    async with run_service() as service:
        await _uploaded(service)
        service.vehicle.put(clock=_clock(rate, 0.5))
        await service.runs.start(service.run_id)
        await service.until_state(RunState.STARTING)
        await service.some_looks()
        assert "arm" not in service.vehicle.sent
        service.vehicle.put(clock=_clock(rate, 5.0))
        await service.until_state(RunState.FLYING if arms else RunState.UPLOADED)
        assert ("arm" in service.vehicle.sent) is arms


async def test_a_vehicle_that_sends_no_positions_is_not_listened_to_for_ever() -> None:
    async with run_service() as service:
        service.vehicle.put(clock=VehicleClock())
        await service.create()
        await service.until_state(RunState.FLYING)


async def test_a_start_that_cannot_be_undone_is_followed_and_not_called_failed() -> None:
    async with run_service() as service:
        service.vehicle.start_error = LinkTimeoutError("no ack of the start")
        service.vehicle.disarm_error = VehicleRefusedError("it flies")
        await service.create()
        await service.until(lambda: "disarm" in service.vehicle.sent, "it must try to disarm")
        service.vehicle.put(mode=FlightMode.MISSION, landed=LandedState.IN_AIR)
        await service.until_state(RunState.FLYING)


async def test_a_start_that_fails_is_disarmed_although_no_heartbeat_said_armed_yet() -> None:
    async with run_service() as service:
        service.vehicle.says_armed = False
        await service.create()
        await service.until_state(RunState.FAILED)
        assert service.vehicle.sent[-1] == "disarm"


async def test_an_abort_too_late_to_disarm_brings_the_vehicle_back() -> None:
    async with run_service() as service:
        service.vehicle.start_gate.clear()
        service.vehicle.disarm_error = VehicleRefusedError("it flies")
        await service.create()
        await service.until(lambda: "start" in service.vehicle.sent, "the start must be sent")
        await service.runs.abort(service.run_id)
        await service.until_state(RunState.RETURNING)
        assert service.vehicle.sent[-2:] == ["disarm", "return"]


@pytest.mark.parametrize(
    ("error", "mode"),
    [
        (LinkTimeoutError("Mission mode was acknowledged but not reported"), FlightMode.POSITION),
        (VehicleTakenError("another gateway may command this vehicle"), FlightMode.HOLD),
    ],
    ids=["by a pilot", "by another gateway"],
)
async def test_a_vehicle_that_is_taken_as_it_starts_is_not_disarmed(error: WaydropError, mode: FlightMode) -> None:
    async with run_service() as service:
        service.vehicle.start_error = error
        service.vehicle.start_gate.clear()
        await service.create()
        await service.until(lambda: "start" in service.vehicle.sent, "the start must be sent")
        service.vehicle.put(mode=mode)
        service.vehicle.start_gate.set()
        await service.until_state(RunState.PAUSED)
        assert service.vehicle.sent[-1] == "start"


async def test_a_failsafe_on_the_ground_takes_no_vehicle() -> None:
    async with run_service() as service:
        service.vehicle.start_error = LinkTimeoutError("no ack of the start")
        service.vehicle.start_gate.clear()
        await service.create()
        await service.until(lambda: "start" in service.vehicle.sent, "the start must be sent")
        service.vehicle.put(mode=FlightMode.RETURN, in_failsafe=True)
        service.vehicle.start_gate.set()
        await service.until_state(RunState.FAILED)
        assert service.vehicle.sent[-1] == "disarm"


async def test_an_abort_of_a_start_leaves_a_pilot_the_vehicle() -> None:
    async with run_service() as service:
        service.vehicle.start_gate.clear()
        await service.create()
        await service.until(lambda: "start" in service.vehicle.sent, "the start must be sent")
        service.vehicle.put(mode=FlightMode.POSITION)
        await service.runs.abort(service.run_id)
        await service.until_state(RunState.PAUSED)
        assert service.vehicle.sent[-1] == "start"


@pytest.mark.parametrize(
    ("landed", "state", "sent"),
    [
        (LandedState.TAKING_OFF, RunState.RETURNING, "return"),
        (LandedState.ON_GROUND, RunState.ABORTED, "disarm"),
    ],
)
async def test_an_abort_in_the_moment_the_start_ends_is_not_lost(
    monkeypatch: pytest.MonkeyPatch, landed: LandedState, state: RunState, sent: str
) -> None:
    start = Preparation.start
    async with run_service() as service:
        await _uploaded(service)

        async def start_and_be_aborted(preparation: Preparation, at_first_item: Callable[[], None]) -> None:
            await start(preparation, at_first_item)
            service.vehicle.put(landed=landed)
            await service.runs.abort(service.run_id)

        monkeypatch.setattr(Preparation, "start", start_and_be_aborted)
        await service.runs.start(service.run_id)
        await service.until_state(state)
        assert [one for one in service.vehicle.sent if one in ("return", "disarm")] == [sent]


async def test_nothing_is_released_while_the_vehicle_still_obeys_a_pause() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.hold_gate.clear()
        pausing = asyncio.create_task(service.runs.pause(service.run_id))
        await service.until(lambda: "hold" in service.vehicle.sent, "the pause must be sent")
        await service.fly_to_drop()
        await service.some_looks()
        assert service.vehicle.releases == []
        service.vehicle.hold_gate.set()
        await pausing
        assert service.drop.outcome is not DropOutcome.RELEASED


async def test_after_a_restart_during_the_start_a_disarmed_vehicle_is_free_again() -> None:
    async with run_service() as service:
        service.vehicle.start_gate.clear()
        await service.create()
        await service.until(lambda: "start" in service.vehicle.sent, "the start must be sent")
        service.vehicle.disarm_error = LinkTimeoutError("killed")
        await restarted(service, meanwhile=lambda: service.vehicle.put(armed=False))
        await service.until_state(RunState.FAILED)
        service.vehicle.start_gate.set()
        service.vehicle.disarm_error = None
        await service.until(lambda: service.fleet.view("v1").run_id is None, "the vehicle must be free")


async def test_after_a_restart_an_uploaded_run_waits_to_be_started_again() -> None:
    async with run_service() as service:
        await _uploaded(service)
        service.events.runs[service.run_id] = service.run.model_copy(update={"start_requested": True})
        sent = list(service.vehicle.sent)
        await restarted(service)
        await service.until(lambda: bool(service.runs.open_runs()), "the run must be taken up")
        await asyncio.sleep(FAST.poll_every_s * 10)  # it is not looked at: nothing can be waited for
        assert service.vehicle.sent == sent
        assert service.run.state is RunState.UPLOADED


@pytest.mark.parametrize("plan", ["clinic-run.json", "multicopter-embedded.json"])
async def test_what_the_vehicle_told_of_its_mission_before_the_arming_is_not_flown(plan: str) -> None:
    """It was left in Mission mode at the last item: MISSION_CURRENT may tell of it before Hold does."""
    async with run_service(plan) as service:
        last = len(service.mission.items) - 1
        service.vehicle.put(mode=FlightMode.MISSION, mission_seq=last)

        async def hold_disarmed() -> None:
            mission_id = service.vehicle.truth.mission_id
            service.vehicle.put(MissionCurrent(last, FlightMode.MISSION, mission_id), mission_seq=last)
            service.vehicle.put(mode=FlightMode.HOLD)

        service.vehicle.hold_disarmed = hold_disarmed  # type: ignore[method-assign]
        await service.create()
        await service.until_state(RunState.FLYING)
        looks = service.vehicle.looks
        await service.until(lambda: service.vehicle.looks > looks + 3, "it must be looked at")
        assert service.run.flown_item_ids == ()


async def test_a_mission_that_another_client_uploads_during_the_arming_is_not_started() -> None:
    async with run_service() as service:
        await _uploaded(service)
        service.vehicle.arm_refusals = 1
        await service.runs.start(service.run_id)
        await service.until(lambda: "arm" in service.vehicle.sent, "it must be commanded to arm")
        service.vehicle.put(mission_id=4711)
        await service.until_state(RunState.UPLOADED)
        assert "the mission on board changed" in describe(service.run.reason)
        assert "start" not in service.vehicle.sent
        assert service.vehicle.sent[-1] == "disarm"


@pytest.mark.parametrize(("changed", "name"), [("fence_id", "geofence"), ("rally_points_id", "rally points")])
async def test_without_its_fence_and_rally_points_a_run_is_not_started(changed: str, name: str) -> None:
    async with run_service() as service:
        service.vehicle.names_as_px4 = True
        await _uploaded(service)
        service.vehicle.put(**{changed: None if getattr(service.vehicle.truth, changed) else 4711})
        await service.runs.start(service.run_id)
        await service.until(lambda: f"the {name} on board changed" in describe(service.run.reason), "it must be told")
        assert service.run.state is RunState.UPLOADED
        assert "arm" not in service.vehicle.sent


async def test_firmware_that_names_no_lists_is_started() -> None:
    async with run_service() as service:
        service.vehicle.upload_id = None
        await _uploaded(service)
        service.vehicle.put(mission_id=None, fence_id=None)
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)


async def test_a_vehicle_that_a_pilot_disarms_as_it_starts_is_not_left_to_take_off() -> None:
    async with run_service() as service:
        await _uploaded(service)
        service.vehicle.start_gate.clear()
        service.vehicle.start_error = LinkTimeoutError("no ack of the start")
        await service.runs.start(service.run_id)
        await service.until(lambda: "start" in service.vehicle.sent, "the start must be sent")
        service.vehicle.put(mode=FlightMode.MISSION, armed=False)
        service.vehicle.start_gate.set()
        await service.until_state(RunState.UPLOADED)
        assert service.vehicle.sent[-1] == "hold_disarmed"
        assert service.vehicle.truth.mode is FlightMode.HOLD


async def test_firmware_with_ids_of_its_own_is_compared_by_its_mission() -> None:
    async with run_service() as service:
        await _uploaded(service)
        service.vehicle.put(fence_id=4712)
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)
