"""A wing flown by commands when somebody is gone, refuses or takes over: it circles where it is, or nothing is said."""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.errors import ConflictError, LinkTimeoutError
from app.domain.mission import MavCmd
from app.domain.offboard.state import OffboardState
from app.domain.offboard.tasks.commanded import CIRCLE_HERE
from app.domain.reasons import Reason, ReasonCode, describe
from app.domain.vehicle.commands import MavResult
from app.domain.vehicle.state import FlightMode, VehicleType, VtolState
from tests.support.commanded_tasks import CIRCLE, FAR, flying, gone_on, ordered, plane
from tests.support.controlled_vehicle import SETTINGS
from tests.support.queued_tasks import changes, queue, report
from tests.support.reasons import some


@pytest.mark.parametrize("how", ["silent", "release", "service stops"])
async def test_when_its_client_is_gone_it_circles_where_it_is_and_the_queue_is_dropped(how: str) -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        queue(wing, "circle", **CIRCLE)
        if how == "silent":
            await gone_on(wing, SETTINGS.lease_s + 0.6)
        elif how == "release":
            wing.control.release(wing.lease, Reason.of(ReasonCode.OFFBOARD_SOCKET_CLOSED))
        else:
            await wing.control.close()
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it circles where it is")
        assert (wing.control.lease, report(wing).task_list) == (None, [0])
        assert (await changes(wing))[-1][0] == "dropped"


@pytest.mark.parametrize("how", ["gap", "mode"])
async def test_where_somebody_else_may_have_acted_nothing_is_commanded(how: str) -> None:
    async with plane() as wing:
        await flying(wing, "circle", **CIRCLE)
        if how == "gap":
            wing.control.end("revoked", some("the service stood still for 2.0 s"))
        else:
            wing.vehicle.put(mode=FlightMode.RETURN)
        assert wing.control.lease is None
        await wing.quiet()
        assert len(wing.vehicle.orders) == 1


async def test_without_a_position_nothing_is_guided_and_after_a_second_it_circles_where_it_is() -> None:
    async with plane() as wing:
        await flying(wing, "segment", start={"east_m": 0, "north_m": 0}, end={"east_m": 0, "north_m": 400})
        wing.vehicle.put(latitude_deg=None)
        await gone_on(wing, 1.5)
        await wing.until(lambda: wing.control.lease is None, "the lease ends")
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it circles where it is")
        assert "no recent position" in describe(report(wing).reason)


async def test_what_the_vehicle_refuses_stops_the_queue_and_resume_asks_again() -> None:
    async with plane() as wing:
        wing.vehicle.order_answers = [MavResult.DENIED]
        await flying(wing, "circle", **CIRCLE)
        await wing.until(lambda: report(wing).state == "paused", "it must stop")
        assert describe(report(wing).reason) == "the vehicle answered DO_ORBIT with DENIED"
        assert (await ordered(wing, 2)).command is MavCmd.DO_REPOSITION
        wing.tasks.resume(wing.lease)
        assert (await ordered(wing, 3)).command is MavCmd.DO_ORBIT
        assert report(wing).state == "flying"


async def test_a_refused_pause_is_asked_for_again() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.vehicle.order_answers = [MavResult.TEMPORARILY_REJECTED, ConflictError("under way")]
        wing.tasks.pause(wing.lease)
        assert (await ordered(wing, 4)).command is MavCmd.DO_REPOSITION
        order = wing.control.view().command
        assert order is not None
        assert order.result is MavResult.ACCEPTED, "it circles"
        assert (report(wing).state, wing.control.lease is None) == ("paused", False)


async def test_a_pause_that_is_refused_three_times_ends_the_lease_and_says_so() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.vehicle.order_answers = [MavResult.TEMPORARILY_REJECTED] * 3
        wing.tasks.pause(wing.lease)
        await ordered(wing, 4)
        await wing.until(lambda: wing.control.lease is None, "the lease ends")
        assert "rejected 3 commands" in describe(report(wing).reason)
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it is told to circle here at least")


async def test_an_order_without_an_ack_is_sent_again_and_three_end_the_lease() -> None:
    async with plane() as wing:
        wing.vehicle.order_answers = [LinkTimeoutError("no final ack")]
        await flying(wing, "circle", **CIRCLE)
        await ordered(wing, 2)
        order = wing.control.view().command
        assert order is not None
        assert (order.result, len(wing.vehicle.orders)) == (MavResult.ACCEPTED, 2)
        wing.vehicle.order_answers = [LinkTimeoutError("no final ack") for _ in range(3)]
        wing.tasks.pause(wing.lease)
        await ordered(wing, 5)
        await gone_on(wing, 0.6)
        await wing.until(lambda: wing.control.lease is None, "the lease ends")
        assert "did not answer" in describe(report(wing).reason)


async def test_what_is_under_way_when_the_lease_ends_is_never_sent_after_the_last_word() -> None:
    async with plane() as wing:
        wing.vehicle.order_gate.clear()
        queue(wing, "circle", **CIRCLE)
        await wing.enter()
        await wing.until(lambda: len(wing.vehicle.orders) == 1, "the first leaves")
        wing.control.release(wing.lease, Reason.of(ReasonCode.OFFBOARD_RELEASED))
        wing.vehicle.order_gate.set()
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it circles where it is")
        await wing.quiet()
        assert len(wing.vehicle.orders) == 2


async def test_an_override_stops_what_was_flown() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.take("admin", override=True)
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it circles where it is")
        assert (wing.control.state, report(wing).task_list) == (OffboardState.ACTIVE, [0])
        queue(wing, "circle", **CIRCLE)
        assert (await ordered(wing, 3)).command is MavCmd.DO_ORBIT


async def test_somebody_elses_hold_ends_it_though_the_mode_shows_no_change() -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        wing.fleet.vehicle("v1").commanded("hold")
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it circles where it is")
        assert (wing.control.lease, report(wing).reason) == (
            *(None, Reason.of(ReasonCode.OFFBOARD_COMMANDED, command="hold")),
        )


@pytest.mark.parametrize(("to", "mode"), [("hold", FlightMode.HOLD), ("return", FlightMode.RETURN)])
async def test_leaving_to_hold_circles_here_and_any_other_way_is_its_mode(to: Any, mode: FlightMode) -> None:
    async with plane() as wing:
        await flying(wing, "goto", **FAR)
        await wing.control.leave(wing.lease, to)
        assert (wing.control.lease, wing.vehicle.truth.mode) == (None, mode)
        assert (wing.vehicle.orders[-1] == CIRCLE_HERE) is (to == "hold")


async def test_a_vtol_that_begins_to_hover_is_not_flown_on_as_a_wing() -> None:
    async with plane(VehicleType.VTOL, vtol_state=VtolState("fixed_wing")) as wing:
        await flying(wing, "circle", **CIRCLE)
        wing.vehicle.put(vtol_state=VtolState("multicopter"))
        await wing.until(lambda: wing.control.lease is None, "the lease ends")
        assert "hovers" in describe(report(wing).reason)
        await wing.until(lambda: wing.vehicle.orders[-1] == CIRCLE_HERE, "it stays where it is")
