"""A vehicle that its pilot disarms during a start is not armed again, and its mission is not started."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from app.domain.errors import CommandExpiredError, LinkTimeoutError, VehicleTakenError
from app.domain.reasons import ReasonCode, describe
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode
from tests.support.events import data_of
from tests.support.run_service import RunService, run_service
from tests.support.scripted_link import FAST

PATIENT = replace(FAST, armable_s=60.0)
NO_ANSWER = LinkTimeoutError("no final acknowledgement of COMPONENT_ARM_DISARM: 1 attempt without an answer")


def _commands(service: RunService, name: str) -> list[tuple[str, Any]]:
    """The commands of this name and their outcomes, as recorded."""
    told = [(event.kind.value, data_of(event)) for event in service.events.events]
    return [(kind, data.get("outcome")) for kind, data in told if data.get("command") == name]


async def _ends_disarmed(service: RunService) -> None:
    """It fails with the reason, and nothing is sent after the arming."""
    await service.until_state(RunState.FAILED)
    reason = service.run.reason
    assert reason is not None
    assert (reason.code, reason.params["error"]) == (ReasonCode.ERROR_WITH_HINT, "vehicle.taken")
    assert "disarmed again, not by Waydrop" in reason.params["detail"]
    assert service.vehicle.sent[-1] == "arm"
    assert service.vehicle.sent.count("arm") == 1


def _arming(service: RunService, *then: bool, error: Exception | None = None) -> Callable[..., Any]:
    """An arming after which HEARTBEATs say so one after the other."""

    async def arm(leaves: Callable[[], None]) -> None:
        service.vehicle.sent.append("arm")
        leaves()
        for armed in then:
            service.vehicle.put(armed=armed)
        if error is not None:
            raise error

    return arm


async def test_disarmed_before_an_unanswered_arming_is_tried_again() -> None:
    async with run_service(settings=PATIENT) as service:
        service.vehicle.arm = _arming(service, True, False, error=NO_ANSWER)  # type: ignore[method-assign]
        await service.create()
        await _ends_disarmed(service)


async def test_disarmed_while_the_newest_heartbeat_still_says_armed() -> None:
    async with run_service(settings=PATIENT) as service:
        service.vehicle.arm = _arming(service, True, error=NO_ANSWER)  # type: ignore[method-assign]

        async def wait_armed() -> None:
            service.vehicle.put(armed=False)
            raise VehicleTakenError("the vehicle was disarmed again, not by Waydrop", hint="start again", armed=False)

        service.vehicle.wait_armed = wait_armed  # type: ignore[method-assign]
        await service.create()
        await _ends_disarmed(service)
        assert _commands(service, "arm") == [("run.command", None), ("run.ack", "failed"), ("run.ack", "failed")]


async def test_disarmed_right_after_an_arming_that_was_acknowledged() -> None:
    async with run_service(settings=PATIENT) as service:
        service.vehicle.arm = _arming(service, True, False)  # type: ignore[method-assign]
        await service.create()
        await _ends_disarmed(service)


async def test_disarmed_and_armed_again_it_is_somebody_elses() -> None:
    async with run_service(settings=PATIENT) as service:
        service.vehicle.arm = _arming(service, True, False, True, error=NO_ANSWER)  # type: ignore[method-assign]
        await service.create()
        await service.until_state(RunState.FAILED)
        assert "is armed in HOLD mode, not by this start" in describe(service.run.reason)
        assert service.vehicle.sent[-1] == "arm"


async def test_disarmed_while_the_start_of_the_mission_is_not_answered() -> None:
    async with run_service() as service:
        service.vehicle.start_error = LinkTimeoutError("no ack of the start")
        service.vehicle.start_gate.clear()
        await service.create()
        await service.until(lambda: "start" in service.vehicle.sent, "the start must be sent")
        service.vehicle.put(armed=False)
        service.vehicle.start_gate.set()
        await service.until_state(RunState.FAILED)
        assert service.vehicle.sent[-1] == "start"
        assert _commands(service, "start_mission") == [("run.command", None), ("run.ack", "failed")]


async def test_an_abort_of_such_a_start_disarms_nobody() -> None:
    async with run_service() as service:
        service.vehicle.start_gate.clear()
        await service.create()
        await service.until(lambda: "start" in service.vehicle.sent, "the start must be sent")
        service.vehicle.put(armed=False)
        await service.runs.abort(service.run_id)
        await service.until_state(RunState.ABORTED)
        assert service.vehicle.sent[-1] == "start"


async def test_a_run_that_waits_is_started_again_after_such_a_start() -> None:
    async with run_service(settings=PATIENT) as service:
        await service.create(start=False)
        await service.until_state(RunState.UPLOADED)
        asked = service.vehicle.arm
        service.vehicle.arm = _arming(service, True, False)  # type: ignore[method-assign]
        await service.runs.start(service.run_id)
        await service.until(lambda: "disarmed again" in describe(service.run.reason), "the reason must be told")
        assert service.run.state is RunState.UPLOADED
        service.vehicle.arm = asked  # type: ignore[method-assign]
        await service.runs.start(service.run_id)
        await service.until_state(RunState.FLYING)


async def test_found_armed_after_an_unanswered_arming_no_second_command_is_recorded() -> None:
    async with run_service(settings=PATIENT) as service:
        service.vehicle.arm = _arming(service, True, error=NO_ANSWER)  # type: ignore[method-assign]
        await service.create()
        await service.until_state(RunState.FLYING)
        assert _commands(service, "arm") == [("run.command", None), ("run.ack", "failed"), ("run.ack", "done")]


@pytest.mark.parametrize(
    "error",
    [VehicleTakenError("it is armed in POSITION mode"), CommandExpiredError("no HEARTBEAT")],
    ids=["somebody else arms it", "nothing is heard"],
)
async def test_an_arming_that_was_not_sent_is_recorded_so(error: VehicleTakenError | CommandExpiredError) -> None:
    async with run_service() as service:

        async def arm(_leaves: Callable[[], None]) -> None:
            raise error

        service.vehicle.arm = arm  # type: ignore[method-assign, assignment]
        await service.create()
        await service.until_state(RunState.FAILED)
        assert {outcome for _, outcome in _commands(service, "arm")} == {None, "not_sent"}


async def test_one_that_the_next_heartbeat_says_to_be_needless_too() -> None:
    async with run_service(settings=PATIENT) as service:

        async def arm(leaves: Callable[[], None]) -> None:
            service.vehicle.sent.append("arm")
            if service.vehicle.sent.count("arm") == 1:
                leaves()
                raise NO_ANSWER
            service.vehicle.put(armed=True)
            raise VehicleTakenError("it is armed", armed=True)

        service.vehicle.arm = arm  # type: ignore[method-assign, assignment]
        await service.create()
        await service.until_state(RunState.FLYING)
        assert [outcome for _, outcome in _commands(service, "arm")] == [None, "failed", None, "not_sent", "done"]


async def test_a_vehicle_that_somebody_arms_before_it_holds_leaves_an_outcome() -> None:
    async with run_service() as service:
        service.vehicle.put(mode=FlightMode.POSITION)
        service.vehicle.hold_error = VehicleTakenError("it is armed in POSITION mode", armed=True)
        await service.create()
        await service.until_state(RunState.FAILED)
        assert _commands(service, "hold") == [("run.command", None), ("run.ack", "failed")]
