"""A commanded wing that a failsafe, a pilot or an operator has: nothing that was meant before takes it from them."""

from __future__ import annotations

import asyncio
import time

import pytest

from app.domain.errors import LinkTimeoutError, VehicleInFailsafeError, WaydropError
from app.domain.mission import MavCmd
from app.domain.offboard.tasks.commanded import CIRCLE_HERE
from app.domain.reasons import describe
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode
from app.services.vehicle_commands import VehicleCommands, hold_here
from tests.support.commanded_tasks import CIRCLE, FAR, flying, gone_on, ordered, plane
from tests.support.controlled_vehicle import ControlledVehicle, controlled_vehicle
from tests.support.queued_tasks import queue, report
from tests.support.reasons import some

NO_ACK = LinkTimeoutError("no final ack")


async def test_a_failsafe_that_waits_in_hold_ends_the_lease_and_is_left_alone() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.vehicle.put(in_failsafe=True, mode=FlightMode.HOLD)
        assert wing.control.lease is None
        assert "failsafe" in describe(report(wing).reason)
        await gone_on(wing, 0.9)
        assert len(wing.vehicle.orders) == 1, "an order would end what PX4 is about to do"


async def last_word_waits_for_its_ack(wing: ControlledVehicle) -> None:
    """The lease has ended, and "circle here" was sent once."""
    await flying(wing, "goto", **FAR)
    wing.vehicle.order_gate.clear()
    wing.vehicle.order_answers = [NO_ACK]
    wing.control.release(wing.lease, some("its socket closed"))
    await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "the last word is said")


async def test_the_last_word_is_said_until_it_is_heard_and_each_time_once() -> None:
    async with plane() as wing:
        await last_word_waits_for_its_ack(wing)
        wing.vehicle.order_gate.set()
        await wing.until(lambda: len(wing.vehicle.orders) == 3, "it is said again")
        assert wing.vehicle.orders[1:] == [CIRCLE_HERE, CIRCLE_HERE]
        assert CIRCLE_HERE.attempts == 1, "the link says it again without a look at the mode"


@pytest.mark.parametrize("who", ["pilot", "failsafe", "operator"])
async def test_the_last_word_is_not_said_again_to_a_wing_that_somebody_else_has(who: str) -> None:
    async with plane() as wing:
        await last_word_waits_for_its_ack(wing)
        if who == "pilot":
            wing.vehicle.put(mode=FlightMode.POSITION)
        elif who == "failsafe":
            wing.vehicle.put(in_failsafe=True)
        else:
            wing.fleet.vehicle("v1").commanded("return")  # not seen in a HEARTBEAT yet
        wing.vehicle.order_gate.set()
        await wing.quiet()
        assert len(wing.vehicle.orders) == 2
        assert "loiters" not in describe(wing.control.reason)


async def test_the_new_holders_order_waits_for_the_last_word_to_the_old_one_and_keeps_its_own_answer() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.vehicle.order_gate.clear()
        wing.take("admin", override=True)
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "the old order is ended")
        queue(wing, "circle", **CIRCLE)
        await gone_on(wing, 0.9)
        assert len(wing.vehicle.orders) == 2, "what is sent now would be ended by the last word"
        wing.vehicle.order_gate.set()
        assert (await ordered(wing, 3)).command is MavCmd.DO_ORBIT
        order = wing.control.view().command
        assert order is not None
        assert (order.command, order.result) == ("DO_ORBIT", MavResult.ACCEPTED)


async def test_the_same_task_in_a_later_lease_is_ordered_anew() -> None:
    same = {**CIRCLE, "center": {"east_m": 0.0, "north_m": 0.0}, "absolute_altitude_m": 560.0}
    async with plane() as wing:
        await flying(wing, "circle", **same)
        await wing.control.leave(wing.lease, "return")
        wing.take()
        queue(wing, "circle", **same)
        await wing.enter()
        assert (await ordered(wing, 2)).command is MavCmd.DO_ORBIT


async def test_hold_stops_a_wing_that_flies_on_in_hold_after_its_control_has_ended() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.control.end("revoked", some("the service stood still for 2.0 s"))
        await VehicleCommands(wing.fleet, wing.journal).hold("v1", actor="ann")
        assert (wing.vehicle.sent[-1], wing.vehicle.orders[1:]) == ("hold", [CIRCLE_HERE])


async def test_the_last_word_is_not_said_again_by_a_process_that_stood_still(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.domain.vehicle.commands.LATE_S", 0.5)
    async with plane() as wing:
        wing.vehicle.put(mode=FlightMode.HOLD)
        wing.vehicle.order_answers = [NO_ACK]
        wing.vehicle.on_order = lambda: time.sleep(2.0)  # as under SIGSTOP: another gateway has the wing meanwhile
        with pytest.raises(LinkTimeoutError):
            await hold_here(wing.vehicle)
        assert wing.vehicle.orders == [CIRCLE_HERE]


async def test_hold_is_the_mode_alone_for_a_wing_in_another_mode() -> None:
    async with plane() as wing:
        wing.vehicle.put(mode=FlightMode.MISSION)
        await hold_here(wing.vehicle)
        assert (wing.vehicle.sent[-1], wing.vehicle.orders) == ("hold", [])


async def test_a_wing_that_a_failsafe_holds_before_it_acts_is_commanded_nothing() -> None:
    async with plane() as wing:
        wing.vehicle.put(mode=FlightMode.HOLD, in_failsafe=True, failsafe_delay_s=1.0)
        with pytest.raises(VehicleInFailsafeError):
            await hold_here(wing.vehicle)
        assert ("hold" in wing.vehicle.sent, wing.vehicle.orders) == (False, [])


async def test_hold_is_the_mode_alone_for_what_hovers() -> None:
    async with controlled_vehicle() as quad:
        await hold_here(quad.vehicle)
        assert (quad.vehicle.sent[-1], quad.vehicle.orders) == ("hold", [])


async def test_an_entry_in_hold_begins_with_a_circle_here() -> None:
    async with plane() as wing:
        wing.vehicle.put(mode=FlightMode.HOLD)
        await wing.enter()
        assert wing.vehicle.orders == [CIRCLE_HERE]


async def test_an_order_leaves_only_right_after_a_heartbeat_for_a_pilots_switch_is_told_by_the_next() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.vehicle.heartbeat_age_s = 0.6
        queue(wing, "circle", "replace_all", **CIRCLE)
        await gone_on(wing, 0.9)
        assert len(wing.vehicle.orders) == 1, "whether it is in Hold still is not known"
        wing.vehicle.heartbeat_age_s = 0.0
        assert (await ordered(wing, 2)).command is MavCmd.DO_ORBIT


async def test_a_leaving_that_failed_because_somebody_else_took_the_wing_ends_the_lease() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.vehicle.order_gate.clear()
        wing.vehicle.order_answers = [NO_ACK]
        leaving = asyncio.create_task(wing.control.leave(wing.lease, "hold"))
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it is said")
        wing.vehicle.put(mode=FlightMode.POSITION)
        wing.vehicle.order_gate.set()
        with pytest.raises(WaydropError, match="somebody else"):
            await leaving
        await wing.until(lambda: wing.control.lease is None, "it is not ours")
        await wing.quiet()
        assert len(wing.vehicle.orders) == 2
