"""Who takes the vehicle during an entry keeps it: a pilot, or another operator."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import replace

import pytest

from app.domain.errors import LeaseLostError, OffboardNotReadyError
from app.domain.offboard.state import OffboardState
from app.domain.run.run import RunState
from app.domain.vehicle.state import FlightMode
from tests.support.commanded_tasks import plane
from tests.support.controlled_vehicle import WITHIN_S, ControlledVehicle, controlled_vehicle, paused_run


def recorded_late(controlled: ControlledVehicle) -> asyncio.Event:
    """The run's Hold is seen, and its record waits on the disk until this is set."""
    stored, pause = asyncio.Event(), controlled.runs.pause

    async def pause_and_record(run_id: str) -> None:
        await pause(run_id)
        await stored.wait()

    controlled.runs.pause = pause_and_record  # type: ignore[method-assign]
    return stored


async def is_left_to_the_pilot(controlled: ControlledVehicle, entering: asyncio.Future[object]) -> None:
    with pytest.raises(LeaseLostError, match="position mode, commanded by another client or pilot"):
        await entering
    assert (controlled.sent, controlled.control.state) == ([], OffboardState.IDLE)
    assert controlled.vehicle.sent == ["hold"], "and not again"
    assert controlled.vehicle.truth.mode is FlightMode.POSITION


async def test_who_takes_the_sticks_after_hold_was_seen_gets_no_setpoint_and_no_mode() -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        quad.take()
        quad.put()
        stored = recorded_late(quad)
        entering = asyncio.ensure_future(quad.enter())
        await quad.until(lambda: quad.vehicle.sent == ["hold"], "Hold is commanded and seen")
        quad.vehicle.put(mode=FlightMode.POSITION)
        stored.set()
        await is_left_to_the_pilot(quad, entering)


async def test_who_takes_the_sticks_before_the_failsafe_is_reported_over_gets_no_setpoint_and_no_mode() -> None:
    async with controlled_vehicle(mode=FlightMode.RETURN, in_failsafe=True) as quad:
        quad.take()
        quad.put()
        entering = asyncio.ensure_future(quad.enter())
        await quad.until(lambda: quad.vehicle.truth.mode is FlightMode.HOLD, "Hold is commanded and seen")
        quad.vehicle.put(mode=FlightMode.POSITION, in_failsafe=False)
        await is_left_to_the_pilot(quad, entering)


async def test_a_wing_whose_pilot_takes_it_after_hold_was_seen_is_commanded_nothing() -> None:
    async with plane(run=paused_run()) as wing:
        stored = recorded_late(wing)
        entering = asyncio.ensure_future(wing.enter())
        await wing.until(lambda: wing.vehicle.truth.mode is FlightMode.HOLD, "Hold is commanded and seen")
        wing.vehicle.put(mode=FlightMode.POSITION)
        stored.set()
        await is_left_to_the_pilot(wing, entering)
        assert wing.vehicle.orders == []


def change_mode_unsaid(controlled: ControlledVehicle) -> None:
    """The vehicle is in another mode, and no fact of it has been told yet."""
    controlled.vehicle.truth = replace(controlled.vehicle.truth, mode=FlightMode.POSITION)


async def test_the_mode_is_looked_at_once_more_right_before_offboard_is_commanded() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        entering = asyncio.ensure_future(quad.enter())
        await quad.until_state(OffboardState.STREAMING)
        change_mode_unsaid(quad)
        with pytest.raises(LeaseLostError, match="position mode"):
            await entering
        assert quad.vehicle.sent == ["hold"]
        assert await quad.quiet() == 0


async def test_a_vehicle_that_was_in_offboard_and_has_left_it_again_is_not_under_control() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        switch = quad.vehicle.enter_offboard

        async def seen_and_left() -> None:
            await switch()
            change_mode_unsaid(quad)

        quad.vehicle.enter_offboard = seen_and_left  # type: ignore[method-assign]
        with pytest.raises(LeaseLostError, match="position mode"):
            await quad.enter()
        assert quad.vehicle.sent == ["hold", "offboard"], "the pilot's mode is left as it is"
        assert await quad.quiet() == 0


def parameters_read_late(controlled: ControlledVehicle) -> asyncio.Event:
    """The vehicle answers with its parameters once this is set."""
    answers, read = asyncio.Event(), controlled.vehicle.read_parameters

    async def read_late(names: Sequence[str]) -> Mapping[str, float | int]:
        await answers.wait()
        return await read(names)

    controlled.vehicle.read_parameters = read_late  # type: ignore[method-assign]
    return answers


async def test_a_run_that_is_resumed_during_the_checks_flies_on() -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        quad.take()
        answers = parameters_read_late(quad)
        entering = asyncio.ensure_future(quad.enter())
        await quad.until_state(OffboardState.CHECKING)
        quad.runs.run = paused_run(RunState.FLYING)
        quad.vehicle.put(mode=FlightMode.MISSION)
        answers.set()
        with pytest.raises(OffboardNotReadyError, match="run-1, which is flying"):
            await entering
        assert (quad.runs.asked, quad.sent, quad.vehicle.sent) == ([], [], [])
        assert (quad.control.state, quad.vehicle.truth.mode) == (OffboardState.LEASED, FlightMode.MISSION)


async def test_a_vehicle_that_is_disarmed_during_the_checks_is_not_entered() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        answers = parameters_read_late(quad)
        entering = asyncio.ensure_future(quad.enter())
        await quad.until_state(OffboardState.CHECKING)
        quad.vehicle.put(armed=False)
        answers.set()
        with pytest.raises(OffboardNotReadyError, match="not armed"):
            await entering
        assert (quad.sent, quad.vehicle.sent) == ([], [])


@pytest.mark.parametrize("is_offered", [False, True])
@pytest.mark.parametrize("at", [OffboardState.CHECKING, OffboardState.HOLDING, OffboardState.STREAMING])
async def test_who_takes_the_lease_over_during_an_entry_has_not_entered(at: OffboardState, is_offered: bool) -> None:
    async with controlled_vehicle() as quad:
        anns = quad.take("ann")
        quad.vehicle.hold_gate.clear()
        answers = parameters_read_late(quad)
        entering = asyncio.ensure_future(quad.enter())
        await quad.until_state(OffboardState.CHECKING)
        if at is not OffboardState.CHECKING:
            answers.set()
        if at is OffboardState.STREAMING:
            quad.vehicle.hold_gate.set()
        await quad.until_state(at)
        quad.control.offer(anns, "ben" if is_offered else None)
        quad.take("ben", override=not is_offered)
        assert quad.control.state is OffboardState.LEASED
        with pytest.raises(LeaseLostError, match="the lease ended meanwhile: ben has acquired it"):
            await entering
        answers.set()
        quad.vehicle.hold_gate.set()
        assert await quad.quiet() == 0, "nothing is streamed for who has not asked"
        assert (quad.control.state, "offboard" in quad.vehicle.sent) == (OffboardState.LEASED, False)
        assert quad.control.lease is not None
        assert quad.control.lease.holder == "ben"
        quad.put()
        await quad.enter()
        assert quad.control.state is OffboardState.ACTIVE, "and may enter now"


async def test_an_entry_that_has_just_begun_ends_with_its_lease_too() -> None:
    async with controlled_vehicle() as quad:
        quad.take("ann")
        entering = asyncio.ensure_future(quad.enter())
        await asyncio.sleep(0)
        quad.take("ben", override=True)
        with pytest.raises(LeaseLostError):
            await entering
        assert (quad.control.state, quad.vehicle.sent) == (OffboardState.LEASED, [])


async def test_a_lease_that_is_taken_over_as_the_mode_is_requested_is_hold() -> None:
    async with controlled_vehicle() as quad:
        quad.take("ann")
        seen = asyncio.Event()

        async def obeyed_and_not_seen() -> None:
            quad.vehicle.sent.append("offboard")
            quad.vehicle.truth = replace(quad.vehicle.truth, mode=FlightMode.OFFBOARD)
            await seen.wait()

        quad.vehicle.enter_offboard = obeyed_and_not_seen  # type: ignore[method-assign]
        entering = asyncio.ensure_future(quad.enter())
        await quad.until(lambda: "offboard" in quad.vehicle.sent, "the mode is requested")
        quad.take("ben", override=True)
        with pytest.raises(LeaseLostError):
            await asyncio.wait_for(entering, WITHIN_S)
        await quad.until(lambda: quad.vehicle.truth.mode is FlightMode.HOLD, "it holds")
        assert quad.vehicle.sent == ["hold", "offboard", "hold"]
        assert quad.control.state is OffboardState.LEASED
        assert await quad.quiet() == 0
