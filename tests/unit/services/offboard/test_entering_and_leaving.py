"""Entering: Hold seen, a second of stream, then the mode. Leaving: to hold, to the mission, to a return."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from app.domain.errors import (
    AuditFailedError,
    ConflictError,
    LeaseLostError,
    OffboardNotReadyError,
    SetpointRefusedError,
    VehicleInFailsafeError,
    VehicleRefusedError,
)
from app.domain.offboard.state import OffboardState
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunState
from app.domain.vehicle.clock import VehicleClock
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode, GlobalPosition, VehicleType, VtolState
from tests.support.controlled_vehicle import SETTINGS, controlled_vehicle, paused_run
from tests.support.fences import MIDDLE, square
from tests.support.queued_tasks import queue


async def test_hold_comes_before_the_first_setpoint_and_a_second_of_stream_before_the_mode() -> None:
    async with controlled_vehicle() as quad:
        sent_at: dict[str, int] = {}
        quad.take()
        quad.vehicle.hold_gate.clear()
        entering = asyncio.ensure_future(quad.enter())
        await quad.until_state(OffboardState.HOLDING)
        assert await quad.quiet() == 0, "a stream alone could pull a vehicle out of a failsafe"
        quad.vehicle.hold_gate.set()
        original = quad.vehicle.enter_offboard

        async def enter() -> None:
            sent_at["mode"] = len(quad.sent)
            await original()

        quad.vehicle.enter_offboard = enter  # type: ignore[method-assign]
        await entering
        assert sent_at["mode"] >= SETTINGS.stream_s * 50.0
        states = [event["state"] for event in await quad.recorded("offboard.changed")]
        assert states == ["leased", "checking", "holding", "streaming", "switching", "active"]
        order = quad.control.view().command
        assert order is not None
        assert (order.command, order.result) == ("DO_SET_MODE", MavResult.ACCEPTED)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"armed": False}, "not armed"),
        ({"connected": False}, "link"),
        ({"clock": VehicleClock(samples=tuple((t / 2, 5.0 * t) for t in range(21)))}, "times faster"),
    ],
)
async def test_a_vehicle_that_is_not_ready_is_not_entered_and_nothing_is_sent(
    changes: dict[str, object], reason: str
) -> None:
    async with controlled_vehicle(**changes) as quad:
        quad.take()
        with pytest.raises(OffboardNotReadyError, match=reason):
            await quad.enter()
        assert (quad.control.state, quad.vehicle.sent, quad.sent) == (OffboardState.LEASED, [], [])


async def test_a_failsafe_that_holds_before_it_acts_is_not_cancelled_by_another_hold() -> None:
    async with controlled_vehicle(mode=FlightMode.HOLD, in_failsafe=True, failsafe_delay_s=1.0) as quad:
        quad.take()
        with pytest.raises(VehicleInFailsafeError):
            await quad.enter()
        assert (quad.vehicle.sent, quad.sent) == ([], [])


async def test_a_failsafe_ends_by_the_hold_that_is_commanded_or_the_vehicle_is_not_entered() -> None:
    async with controlled_vehicle(
        mode=FlightMode.RETURN, in_failsafe=True, settings=replace(SETTINGS, calm_s=0.05)
    ) as quad:
        quad.take()
        with pytest.raises(OffboardNotReadyError, match="failsafe"):
            await quad.enter()
        assert (quad.sent, quad.vehicle.truth.mode) == ([], FlightMode.HOLD)
    async with controlled_vehicle(mode=FlightMode.RETURN, in_failsafe=True) as quad:
        quad.take()
        entering = asyncio.ensure_future(quad.enter())
        await quad.until(lambda: quad.vehicle.truth.mode is FlightMode.HOLD, "Hold must be commanded")
        assert quad.sent == []
        quad.vehicle.put(in_failsafe=False)
        await entering


async def test_an_airship_and_a_vtol_in_transition_are_refused() -> None:
    async with controlled_vehicle(VehicleType.AIRSHIP) as airship:
        airship.take()
        with pytest.raises(OffboardNotReadyError, match="airship"):
            await airship.enter()
    async with controlled_vehicle(VehicleType.VTOL, vtol_state=VtolState("transition_to_fixed_wing")) as vtol:
        vtol.take()
        with pytest.raises(OffboardNotReadyError, match="transition"):
            await vtol.enter()


@pytest.mark.parametrize("action", [0, 1, 2, 6, 7, None])
async def test_a_loss_action_that_needs_sticks_is_refused_with_all_parameters_shown(action: int | None) -> None:
    async with controlled_vehicle() as quad:
        quad.vehicle.parameters = {} if action is None else {"COM_OBL_RC_ACT": action}
        quad.take()
        with pytest.raises(AuditFailedError, match="COM_OBL_RC_ACT") as failed:
            await quad.enter()
        shown = failed.value.extra["audit"]
        assert isinstance(shown, list)
        assert {entry["parameter"] for entry in shown} >= {"COM_OBL_RC_ACT", "COM_RC_OVERRIDE", "COM_RCL_EXCEPT"}
        assert "hold" not in quad.vehicle.sent


async def test_of_newer_firmware_the_parameter_is_read_that_others_were_merged_into() -> None:
    async with controlled_vehicle() as quad:
        quad.vehicle.parameters = {"COM_OBL_RC_ACT": 0, "MAN_OVERRIDE_SPD": -1.0}
        quad.take()
        with pytest.raises(AuditFailedError) as failed:
            await quad.enter()
        shown = {entry["parameter"]: entry["value"] for entry in failed.value.extra["audit"]}
        assert shown["MAN_OVERRIDE_SPD"] == -1.0
        assert "COM_RC_OVERRIDE" not in shown


async def test_with_a_pilot_at_the_sticks_position_mode_is_a_right_answer_to_a_loss() -> None:
    async with controlled_vehicle() as quad:
        quad.vehicle.parameters = {"COM_OBL_RC_ACT": 0}
        quad.take()
        await quad.control.enter(quad.lease, sticks_held=True)
        assert quad.control.state is OffboardState.ACTIVE


async def test_the_vehicles_refusal_is_given_back_with_its_reasons() -> None:
    async with controlled_vehicle() as quad:

        async def refuse() -> None:
            texts = ("Switching to Offboard is currently not available",)
            raise VehicleRefusedError("refused", result="DENIED", texts=texts)

        quad.vehicle.enter_offboard = refuse  # type: ignore[method-assign]
        quad.take()
        with pytest.raises(VehicleRefusedError) as refused:
            await quad.enter()
        assert refused.value.extra["texts"]
        order = quad.control.view().command
        assert order is not None
        assert (order.command, order.result) == ("DO_SET_MODE", MavResult.DENIED), "the ack is shown to everybody"
        assert quad.control.state is OffboardState.LEASED
        assert await quad.quiet() == 0


async def test_a_run_must_be_paused_first_and_is_paused_anew() -> None:
    async with controlled_vehicle(run=paused_run(RunState.FLYING)) as quad:
        quad.take()
        with pytest.raises(OffboardNotReadyError, match="run-1, which is flying"):
            await quad.enter()
        assert quad.runs.asked == []
    async with controlled_vehicle(run=paused_run()) as quad:
        await quad.flown()
        assert quad.runs.asked == ["pause"]


async def test_a_mode_change_on_the_way_in_ends_the_entry() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        entering = asyncio.ensure_future(quad.enter())
        await quad.until_state(OffboardState.STREAMING)
        quad.vehicle.put(mode=FlightMode.RETURN, in_failsafe=True)
        with pytest.raises(LeaseLostError, match="failsafe"):
            await entering
        assert "offboard" not in quad.vehicle.sent
        assert await quad.quiet() == 0


async def test_a_client_that_goes_away_on_the_way_in_ends_the_entry() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        entering = asyncio.ensure_future(quad.enter())
        await quad.until_state(OffboardState.STREAMING)
        quad.control.give_up("released", Reason.of(ReasonCode.OFFBOARD_SOCKET_CLOSED))
        with pytest.raises(LeaseLostError):
            await entering
        assert "offboard" not in quad.vehicle.sent


async def test_a_wing_without_a_setpoint_does_not_enter_keeps_its_lease_and_is_not_commanded_to_hold() -> None:
    async with controlled_vehicle(VehicleType.FIXED_WING) as plane:
        plane.take()
        with pytest.raises(OffboardNotReadyError, match="nothing to stream"):
            await plane.enter()
        assert (plane.sent, plane.vehicle.sent, plane.control.state) == ([], [], OffboardState.LEASED)


async def test_leaving_before_the_entry_gives_the_lease_back_and_is_no_change_of_the_state() -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        quad.take()
        await quad.control.leave(quad.lease, "hold")
        assert [event["state"] for event in await quad.recorded("offboard.changed")] == ["leased", "idle"]


async def test_a_leave_that_another_clients_lease_ends_is_told_so() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        quad.vehicle.hold_gate.clear()
        leaving = asyncio.ensure_future(quad.control.leave(quad.lease, "hold"))
        await quad.until_state(OffboardState.LEAVING)
        quad.take("ben", override=True)
        with pytest.raises(LeaseLostError, match="meanwhile: ben has acquired it"):
            await leaving


@pytest.mark.parametrize("vtol_state", [VtolState.FIXED_WING, VtolState.MULTICOPTER])
async def test_the_entry_check_of_a_wing_asks_for_a_setpoint_or_a_task(vtol_state: VtolState) -> None:
    """What hovers is told to stand until the client speaks."""
    hovers = vtol_state is VtolState.MULTICOPTER
    async with controlled_vehicle(VehicleType.VTOL, vtol_state=vtol_state) as vtol:
        before = await vtol.control.preflight(sticks_held=False)
        assert (before.ready, "nothing to stream" in before.reason) == (hovers, not hovers)
        vtol.take()
        vtol.put("position_velocity_ned")
        assert (await vtol.control.preflight(sticks_held=False)).ready
        vtol.clock.time_s += 5.0
        assert (await vtol.control.preflight(sticks_held=False)).ready is hovers
        queue(vtol, "circle", radius_m=-60.0)
        assert (await vtol.control.preflight(sticks_held=False)).ready


async def test_entering_twice_is_refused() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        with pytest.raises(OffboardNotReadyError, match="active"):
            await quad.enter()


@pytest.mark.parametrize(
    ("to", "asked", "mode"),
    [
        ("hold", "pause", FlightMode.HOLD),
        ("mission", "resume", FlightMode.MISSION),
        ("return", "return", FlightMode.RETURN),
    ],
)
async def test_leaving_goes_through_the_run_and_gives_the_lease_back(to: str, asked: str, mode: FlightMode) -> None:
    async with controlled_vehicle(run=paused_run()) as quad:
        await quad.flown()
        await quad.control.leave(quad.lease, to)  # type: ignore[arg-type]
        assert (quad.runs.asked[-1], quad.vehicle.truth.mode) == (asked, mode)
        assert quad.control.lease is None
        assert await quad.quiet() == 0
        assert (await quad.recorded("offboard.lease"))[-1]["change"] == "released"


async def test_without_a_run_there_is_no_mission_to_leave_to() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        with pytest.raises(ConflictError, match="no run"):
            await quad.control.leave(quad.lease, "mission")
        assert quad.control.state is OffboardState.ACTIVE
        await quad.control.leave(quad.lease, "return")
        assert quad.vehicle.truth.mode is FlightMode.RETURN


async def test_a_leaving_that_fails_keeps_the_lease_and_the_stream() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()

        async def refuse() -> None:
            raise VehicleRefusedError("no")

        quad.vehicle.hold = refuse  # type: ignore[method-assign]
        with pytest.raises(VehicleRefusedError):
            await quad.control.leave(quad.lease, "hold")
        assert quad.control.state is OffboardState.ACTIVE
        await quad.ticks(2)


async def test_a_refused_setpoint_says_why_and_leaves_the_one_before_in_its_place() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        newest = quad.sent[-1]
        with pytest.raises(SetpointRefusedError, match="frame"):
            quad.put("position_body")
        await quad.ticks(2)
        assert quad.sent[-1] == newest


async def test_a_clamped_setpoint_is_what_leaves_and_it_is_said() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        clamps = quad.put(north_m_s=30.0, east_m_s=0.0, down_m_s=0.0)
        assert [clamp.code for clamp in clamps] == ["limit.speed"]
        await quad.ticks(2)
        sent = quad.control.view().sent
        assert sent is not None
        assert (sent.setpoint["north_m_s"], sent.clamped, sent.source) == (10.0, ["limit.speed"], "client")


async def test_the_slot_is_overwritten_and_never_queued() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        for speed in range(9):
            quad.put(north_m_s=float(speed), east_m_s=0.0)
        before = len(quad.sent)
        await quad.ticks(3)
        assert {message.velocity[0] for message in quad.sent[before + 1 :]} == {8.0}  # type: ignore[union-attr]


async def test_an_entry_that_was_broken_off_says_nothing_of_the_next_lease() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        entering = asyncio.create_task(quad.enter())
        await quad.until_state(OffboardState.STREAMING)
        quad.clock.time_s += 10.0
        quad.take("ben")  # before the tick that would have noticed
        with pytest.raises(LeaseLostError):
            await entering
        assert (quad.control.state, quad.control.reason) == (OffboardState.LEASED, None)


async def test_two_entries_at_once_are_one() -> None:
    async with controlled_vehicle() as quad:
        quad.take()
        quad.put()
        first, second = await asyncio.gather(quad.enter(), quad.enter(), return_exceptions=True)
        assert not isinstance(first, Exception)
        assert isinstance(second, OffboardNotReadyError)
        assert quad.vehicle.sent.count("hold") == 1


async def test_the_fence_stays_where_it_is_when_somebody_sets_another_home_in_flight() -> None:
    async with controlled_vehicle() as quad:
        quad.vehicle.on_board = square(50.0)
        await quad.flown()
        latitude, longitude = MIDDLE.to_global(0.0, 100.0)
        home = GlobalPosition(latitude, longitude, 488.0)
        quad.vehicle.put(home=home, home_ned_m=(100.0, 0.0, 0.0))
        assert not quad.put("position_ned", north_m=40.0, east_m=0.0, down_m=-20.0)
        assert not quad.put("velocity_ned", north_m_s=5.0, east_m_s=0.0, down_m_s=0.0)
        with pytest.raises(SetpointRefusedError) as refused:
            quad.put("position_ned", north_m=60.0, east_m=0.0, down_m=-20.0)
        assert refused.value.refusal == "limit.fence"
        latitude, longitude = MIDDLE.to_global(0.0, 45.0)
        quad.vehicle.put(latitude_deg=latitude, longitude_deg=longitude)
        (clamp,) = quad.put("velocity_ned", north_m_s=5.0, east_m_s=0.0, down_m_s=0.0)
        assert clamp.code == "limit.fence"
