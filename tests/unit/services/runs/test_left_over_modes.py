"""A start finds the vehicle in any mode, and whoever has it armed or changes its mode meanwhile keeps it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace

import pytest

from app.domain.errors import (
    ConflictError,
    LinkTimeoutError,
    VehicleQuarantinedError,
    VehicleRefusedError,
    VehicleTakenError,
)
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode, LandedState
from app.services.vehicle_commands import VehicleCommands
from tests.support.events import data_of
from tests.support.run_service import RunService, run_service
from tests.support.scripted_link import FAST

PATIENT = replace(FAST, armable_s=60.0)
LEFT_OVER = tuple(mode for mode in FlightMode if mode is not FlightMode.HOLD)


@pytest.mark.parametrize("mode", LEFT_OVER)
async def test_hold_is_commanded_before_arming_in_whatever_mode_the_vehicle_was_left(mode: FlightMode) -> None:
    async with run_service() as service:
        service.vehicle.put(mode=mode)
        await service.create()
        await service.until_state(RunState.FLYING)
        sent = service.vehicle.sent
        assert [step for step in sent if step in ("hold_disarmed", "arm", "start")] == ["hold_disarmed", "arm", "start"]


async def test_a_vehicle_that_holds_is_not_told_again() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        assert not [step for step in service.vehicle.sent if "hold" in step]


async def test_a_vehicle_that_stays_in_its_mode_is_not_armed_and_the_reason_names_the_mode() -> None:
    async with run_service() as service:
        service.vehicle.put(mode=FlightMode.OFFBOARD)
        service.vehicle.hold_error = VehicleRefusedError("the vehicle refused to enter hold mode: DENIED")
        await service.create()
        await service.until_state(RunState.FAILED)
        assert "disarmed in OFFBOARD mode; PX4 arms in this mode only with a setpoint stream" in describe(
            service.run.reason
        )
        assert "refused to enter hold mode" in describe(service.run.reason)
        assert "stop what keeps it in this mode" in describe(service.run.reason), "the remedy stays with the run"
        assert "arm" not in service.vehicle.sent


async def test_a_vehicle_on_which_a_run_waits_says_what_its_own_commands_are() -> None:
    async with run_service() as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        with pytest.raises(ConflictError) as refused:
            await VehicleCommands(service.fleet, service.journal).hold("v1", "ann")
        assert "pause the run" in refused.value.hint
        assert "abort it before takeoff" in refused.value.hint


@pytest.mark.parametrize(
    ("mode", "why"),
    [
        (FlightMode.OFFBOARD, "only with a setpoint stream"),
        (FlightMode.POSITION, "only with manual control input"),
        (FlightMode.RETURN, "never"),
    ],
)
async def test_an_arming_refusal_names_the_mode_that_somebody_else_has_commanded(mode: FlightMode, why: str) -> None:
    async with run_service(settings=PATIENT) as service:
        await _refused_arming(service)
        service.vehicle.put(mode=mode)
        await service.until_state(RunState.FAILED)
        assert f"the vehicle is disarmed in {mode.value.upper()} mode; PX4 arms in this mode {why}" in describe(
            service.run.reason
        )
        assert not {"start", "disarm", "hold_disarmed"} & set(service.vehicle.sent), "its mode is not fought for"


async def test_a_vehicle_that_somebody_else_arms_meanwhile_is_neither_started_nor_disarmed() -> None:
    async with run_service(settings=PATIENT) as service:
        await _refused_arming(service)
        service.vehicle.put(armed=True)
        await service.until_state(RunState.FAILED)
        assert "is armed in HOLD mode, not by this start" in describe(service.run.reason)
        assert not {"start", "disarm"} & set(service.vehicle.sent)


async def test_a_vehicle_armed_by_an_arming_without_an_answer_is_ours() -> None:
    async with run_service(settings=PATIENT) as service:
        service.vehicle.arm_errors = [LinkTimeoutError("no ack")]
        service.vehicle.arm_refusals = 1000
        asked = service.vehicle.arm

        async def arm(leaves: Callable[[], None]) -> None:
            try:
                await asked(leaves)
            finally:
                service.vehicle.put(armed=True)  # the HEARTBEAT says so before it is asked again

        service.vehicle.arm = arm  # type: ignore[method-assign, assignment]
        await service.create()
        await service.until_state(RunState.FLYING)
        assert service.vehicle.sent.count("arm") == 1


@pytest.mark.parametrize("aborted", [False, True])
async def test_it_is_ours_no_more_once_the_vehicle_has_refused_to_arm_since(aborted: bool) -> None:
    async with run_service(settings=PATIENT) as service:
        service.vehicle.arm_errors = [LinkTimeoutError("no ack")]
        service.vehicle.arm_refusals = 1000
        await service.create()
        await service.until(lambda: service.vehicle.sent.count("arm") > 5, "asked again and refused again")
        service.vehicle.put(armed=True)  # a pilot, in Hold
        if aborted:
            await service.runs.abort(service.run_id)
        await service.until(lambda: service.run.is_over, "the start must end")
        assert not {"start", "disarm"} & set(service.vehicle.sent)


async def test_a_mode_that_changes_while_it_is_armed_is_a_pilots_and_no_mission_is_started() -> None:
    async with run_service(settings=PATIENT) as service:

        async def arm(leaves: Callable[[], None]) -> None:
            leaves()
            service.vehicle.put(mode=FlightMode.POSITION, armed=True)

        service.vehicle.arm = arm  # type: ignore[method-assign, assignment]
        await service.create()
        await service.until_state(RunState.FAILED)
        assert "is now in POSITION mode: a pilot" in describe(service.run.reason)
        assert not {"start", "disarm"} & set(service.vehicle.sent)


@pytest.mark.parametrize("pilot_arms", [False, True])
async def test_an_abort_before_the_arming_left_disarms_nobody(pilot_arms: bool) -> None:
    async with run_service(settings=PATIENT) as service:
        waits = asyncio.Event()

        async def arm(leaves: Callable[[], None]) -> None:
            if pilot_arms:
                service.vehicle.put(armed=True)
            waits.set()
            await asyncio.Event().wait()  # for the HEARTBEAT after which it may leave

        service.vehicle.arm = arm  # type: ignore[method-assign, assignment]
        await service.create()
        await asyncio.wait_for(waits.wait(), 5.0)
        await service.runs.abort(service.run_id)
        await service.until_state(RunState.ABORTED)
        assert not {"disarm", "return"} & set(service.vehicle.sent)


async def test_an_arming_that_a_quarantine_kept_back_leaves_no_flight() -> None:
    async with run_service(settings=PATIENT) as service:
        service.vehicle.arm_errors = [VehicleQuarantinedError("two vehicles use system id 1")]
        await service.create()
        await service.until_state(RunState.FAILED)
        assert not {"start", "disarm"} & set(service.vehicle.sent)


async def test_so_it_is_when_the_next_try_finds_it_armed_and_it_is_not_asked_for_the_third_time() -> None:
    async with run_service(settings=PATIENT) as service:

        async def arm(leaves: Callable[[], None]) -> None:
            service.vehicle.sent.append("arm")
            if service.vehicle.sent.count("arm") == 1:
                leaves()
                raise LinkTimeoutError("no ack")
            service.vehicle.put(armed=True)
            raise VehicleTakenError("it is armed", armed=True)

        service.vehicle.arm = arm  # type: ignore[method-assign]
        await service.create()
        await service.until_state(RunState.FLYING)
        assert service.vehicle.sent.count("arm") == 2


async def test_who_arms_in_the_moment_of_the_first_try_keeps_the_vehicle() -> None:
    async with run_service() as service:
        service.vehicle.arm_errors = [VehicleTakenError("it is armed in POSITION mode")]
        await service.create()
        await service.until_state(RunState.FAILED)
        assert "armed in POSITION mode" in describe(service.run.reason)
        assert not {"start", "disarm"} & set(service.vehicle.sent)


async def test_taken_before_hold_could_be_commanded_it_is_left_alone() -> None:
    async with run_service() as service:
        service.vehicle.put(mode=FlightMode.POSITION)
        service.vehicle.hold_error = VehicleTakenError("it is armed in POSITION mode")
        await service.create()
        await service.until_state(RunState.FAILED)
        assert "armed in POSITION mode" in describe(service.run.reason)
        assert not {"arm", "start", "disarm"} & set(service.vehicle.sent)


async def test_a_return_out_of_offboard_goes_through_hold_and_nobody_else_is_blamed_for_that() -> None:
    async with run_service() as service:
        await service.create()
        await service.until_state(RunState.FLYING)
        service.vehicle.put(mode=FlightMode.OFFBOARD, landed=LandedState.IN_AIR)
        await service.until(
            lambda: "offboard control" in describe(service.run.reason), "it must be in offboard control"
        )
        service.vehicle.return_gate.clear()
        returning = asyncio.create_task(service.runs.return_to_launch(service.run_id))
        await service.until(
            lambda: service.run.reason == Reason.of(ReasonCode.RETURNING_AS_ASKED),
            "Hold on the way must be told as the return",
        )
        assert service.run.state is RunState.PAUSED
        service.vehicle.return_gate.set()
        await returning
        await service.until_state(RunState.RETURNING)
        assert not [event for event in service.events.events if "another client or pilot" in str(data_of(event))]


async def _refused_arming(service: RunService) -> None:
    """It is asked to arm again and again."""
    service.vehicle.arm_refusals = 1000
    await service.create()
    await service.until(lambda: service.vehicle.sent.count("arm") > 1, "it must be asked again")
