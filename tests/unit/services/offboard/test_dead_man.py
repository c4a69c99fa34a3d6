"""The dead-man and everything else that ends a stream: nothing is sent without a living client and its lease."""

from __future__ import annotations

import asyncio
import contextlib
import time
from dataclasses import replace

import pytest

from app.domain.errors import LeaseLostError, LinkError, SetpointRefusedError
from app.domain.offboard.messages import LocalTarget
from app.domain.offboard.state import OffboardState
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.vehicle.facts import DuplicateSystem, LinkLost, Rebooted
from app.domain.vehicle.state import FlightMode, VehicleState, VehicleType
from tests.support.controlled_vehicle import SETTINGS, ControlledVehicle, controlled_vehicle
from tests.support.reasons import some, words

GAP_S = 2.0
"""A standstill of this process, and not one of a busy machine."""


async def fly_plane(plane: ControlledVehicle) -> None:
    plane.take()
    plane.put("position_velocity_ned")
    plane.vehicle.hold_gate.clear()
    entering = asyncio.ensure_future(plane.enter())
    await plane.until_state(OffboardState.HOLDING)
    plane.put("position_velocity_ned")  # what was put before the fence was read does not count
    plane.vehicle.hold_gate.set()
    await entering


async def test_a_silent_client_is_first_zero_velocity_and_then_hold() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        await quad.silent_for(0.6)
        last = quad.sent[-1]
        assert isinstance(last, LocalTarget)
        assert last.velocity == (0.0, 0.0, 0.0)
        assert quad.control.state is OffboardState.ACTIVE
        assert quad.vehicle.sent.count("hold") == 1, "only the entry's"
        await quad.silent_for(0.6)
        await quad.until(lambda: quad.vehicle.sent[-1] == "hold", "Hold must be commanded")
        assert quad.control.state is OffboardState.IDLE
        assert await quad.quiet() == 0


async def test_a_client_whose_every_setpoint_was_rejected_is_told_that_and_not_that_it_was_silent() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        for _ in range(11):
            await quad.silent_for(0.1)
            with contextlib.suppress(LeaseLostError, SetpointRefusedError):
                quad.put("body_rates")
        await quad.until_state(OffboardState.IDLE)
        reason = quad.control.reason
        assert reason is not None
        assert (reason.code, reason.params["refusal"]) == (ReasonCode.OFFBOARD_ALL_REJECTED, "limit.tilt")
        assert (await quad.recorded("offboard.lease"))[-1]["reason"]["code"] == "offboard.all_rejected"


async def test_a_client_that_falls_silent_after_an_accepted_setpoint_was_silent() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        with pytest.raises(SetpointRefusedError):
            quad.put("body_rates")
        quad.put()
        await quad.silent_for(1.2)
        await quad.until_state(OffboardState.IDLE)
        assert quad.control.reason is not None
        assert quad.control.reason.code is ReasonCode.OFFBOARD_CLIENT_SILENT


async def test_a_wing_that_cannot_stand_is_told_to_hold_at_once() -> None:
    async with controlled_vehicle(VehicleType.FIXED_WING) as plane:
        await fly_plane(plane)
        await plane.silent_for(0.5)
        await plane.until(lambda: plane.vehicle.sent[-1] == "hold", "Hold must be commanded")
        assert not [m for m in plane.sent if isinstance(m, LocalTarget) and m.velocity == (0.0, 0.0, 0.0)]
        assert await plane.quiet() == 0


async def test_a_client_that_goes_away_is_hold_at_once_and_its_lease_ends() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        quad.control.give_up("released", Reason.of(ReasonCode.OFFBOARD_SOCKET_CLOSED))
        await quad.until(lambda: quad.vehicle.truth.mode is FlightMode.HOLD, "Hold must be commanded")
        assert await quad.quiet() == 0
        with pytest.raises(LeaseLostError):
            quad.put()


@pytest.mark.parametrize(
    ("mode", "failsafe"), [(FlightMode.POSITION, False), (FlightMode.RETURN, True), (FlightMode.LAND, True)]
)
async def test_a_mode_that_somebody_else_commands_ends_the_stream_and_is_not_fought(
    mode: FlightMode, failsafe: bool
) -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        before = len(quad.vehicle.sent)
        quad.vehicle.put(mode=mode, in_failsafe=failsafe)
        assert await quad.quiet() == 0
        assert quad.vehicle.sent[before:] == [], "no mode may be commanded"
        assert quad.control.lease is None
        assert ("failsafe" in describe(quad.control.reason)) == failsafe
        lease = (await quad.recorded("offboard.lease"))[-1]
        assert lease["change"] == "revoked"
        assert mode.value in words(lease["reason"])


async def test_a_termination_ends_the_stream_although_the_mode_stays() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        quad.vehicle.put(in_failsafe=True, is_terminated=True)
        assert await quad.quiet() == 0
        assert "a failsafe is active" in describe(quad.control.reason)


@pytest.mark.parametrize("fact", [LinkLost(3.0), Rebooted(), DuplicateSystem(Reason.of(ReasonCode.TWO_CLOCKS))])
async def test_a_lost_link_a_reboot_and_a_quarantine_end_the_stream(
    fact: LinkLost | Rebooted | DuplicateSystem,
) -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        before = len(quad.vehicle.sent)
        quad.vehicle.put(fact)
        assert await quad.quiet() == 0
        assert quad.vehicle.sent[before:] == []
        assert quad.control.state is OffboardState.IDLE


async def test_a_hold_that_a_person_asked_for_is_told_as_theirs_and_one_of_the_entry_is_not() -> None:
    for is_asked in (True, False):
        async with controlled_vehicle() as quad:
            quad.take()
            quad.control.vehicle.commanded("hold")  # before the entry, which commands Hold itself
            quad.put()
            await quad.enter()
            if is_asked:
                quad.control.vehicle.commanded("hold")
            quad.vehicle.put(mode=FlightMode.HOLD)
            assert quad.control.reason is not None
            expected = ReasonCode.OFFBOARD_COMMANDED if is_asked else ReasonCode.OFFBOARD_MODE_BY_OTHERS
            assert quad.control.reason.code is expected


async def test_a_failsafe_is_not_told_as_the_return_that_a_person_asked_for_before() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        quad.control.vehicle.commanded("return")  # it was not answered, and the vehicle flies on
        quad.vehicle.put(mode=FlightMode.RETURN, in_failsafe=True)
        assert "a failsafe is active" in describe(quad.control.reason)


@pytest.mark.parametrize("mode", [FlightMode.POSITION, FlightMode.RETURN])
async def test_a_last_word_that_is_not_answered_yet_is_not_said_to_a_pilot(mode: FlightMode) -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        quad.vehicle.hold_gate.clear()
        quad.control.release(quad.lease, some("the client left"))
        await quad.until(lambda: quad.vehicle.sent[-1] == "hold", "Hold is being said")
        quad.vehicle.put(mode=mode)
        await asyncio.sleep(0)
        quad.vehicle.hold_gate.set()
        assert await quad.quiet() == 0
        assert quad.vehicle.truth.mode is mode


async def test_after_the_process_stood_still_nothing_is_sent_and_nothing_commanded() -> None:
    async with controlled_vehicle(settings=replace(SETTINGS, gap_s=GAP_S)) as quad:
        await quad.flown()
        before = len(quad.vehicle.sent)
        time.sleep(GAP_S + 1.0)  # noqa: ASYNC251 - the whole process stands still, as under SIGSTOP
        sent = len(quad.sent)
        with pytest.raises(LeaseLostError):
            quad.put()  # a frame that was buffered meanwhile comes before the next tick
        assert await quad.quiet() == 0
        assert len(quad.sent) == sent
        assert quad.vehicle.sent[before:] == []
        assert "was suspended" in describe(quad.control.reason)


async def test_what_the_vehicle_did_while_the_process_stood_still_has_that_as_its_cause() -> None:
    async with controlled_vehicle(settings=replace(SETTINGS, gap_s=GAP_S)) as quad:
        await quad.flown()
        time.sleep(GAP_S + 1.0)  # noqa: ASYNC251 - the whole process stands still, as under SIGSTOP
        quad.vehicle.put(mode=FlightMode.RETURN)  # its own failsafe; the message is read before the next tick
        assert "was suspended" in describe(quad.control.reason)


async def test_a_tick_that_stood_still_in_its_middle_sends_nothing() -> None:
    async with controlled_vehicle(settings=replace(SETTINGS, gap_s=GAP_S)) as quad:
        await quad.flown()
        looked, sent = quad.vehicle.state, 0

        def look_and_stand_still() -> VehicleState:
            nonlocal sent
            quad.vehicle.state = looked  # type: ignore[method-assign]
            sent = len(quad.sent)
            time.sleep(GAP_S + 1.0)
            return looked()

        quad.vehicle.state = look_and_stand_still  # type: ignore[method-assign]
        await quad.until_state(OffboardState.IDLE)
        assert await quad.quiet() == 0
        assert len(quad.sent) == sent, "what was looked at before the gap is not sent after it"
        assert "was suspended" in describe(quad.control.reason)


async def test_a_link_that_cannot_send_ends_the_lease() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        quad.vehicle.setpoint_error = LinkError("the link is closed")
        await quad.until_state(OffboardState.IDLE)
        assert "sending failed" in describe(quad.control.reason)


class BrokenSource:
    """Its ticks are a defect once it is told so."""

    def __init__(self) -> None:
        self.is_broken = False

    def tick(self, now_s: float) -> None:
        if self.is_broken:
            raise ZeroDivisionError

    def refuse_client_setpoint(self) -> None:
        """It refuses none."""

    def client_sent_setpoint(self) -> None:
        """It gives no setpoint."""

    def client_leaves(self) -> None:
        """It gives no setpoint."""

    def report(self) -> None:
        """Nothing is queued."""


async def test_a_defect_in_a_tick_is_hold_and_not_a_silent_end_of_the_dead_man() -> None:
    async with controlled_vehicle() as quad:
        source = BrokenSource()
        quad.control.set_setpoint_source(source)
        await quad.flown()
        source.is_broken = True
        await quad.until(lambda: quad.vehicle.truth.mode is FlightMode.HOLD, "Hold must be commanded")
        assert (quad.control.state, quad.control.lease) == (OffboardState.IDLE, None)
        assert (await quad.recorded("offboard.lease"))[-1]["change"] == "revoked"
        assert "internal error" in describe(quad.control.reason)


async def test_a_defect_in_a_tick_ends_an_entry_that_waits_for_the_stream() -> None:
    async with controlled_vehicle() as quad:
        source = BrokenSource()
        quad.control.set_setpoint_source(source)
        quad.take()
        quad.vehicle.hold_gate.clear()
        entering = asyncio.ensure_future(quad.enter())
        await quad.until_state(OffboardState.HOLDING)
        source.is_broken = True
        quad.vehicle.hold_gate.set()
        with pytest.raises(LeaseLostError, match="internal error"):
            await asyncio.wait_for(entering, 10.0)
        assert "offboard" not in quad.vehicle.sent


async def test_the_end_of_the_service_is_hold() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()
        vehicle = quad.vehicle
    assert vehicle.truth.mode is FlightMode.HOLD


async def test_a_hold_that_is_not_confirmed_is_said() -> None:
    async with controlled_vehicle() as quad:
        await quad.flown()

        async def refuse() -> None:
            raise LinkError("no answer")

        quad.vehicle.hold = refuse  # type: ignore[method-assign]
        quad.control.give_up("released", some("gone"))
        await quad.until(lambda: "not confirmed" in describe(quad.control.reason), "it must be said")
