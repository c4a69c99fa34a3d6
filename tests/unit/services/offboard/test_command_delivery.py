"""An order's answer: COMMAND_ACK names the command and not the order, so a late one may be another order's."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from app.domain.errors import LinkError
from app.domain.offboard.tasks.commanded import CIRCLE_HERE, FlyTo, order_request
from app.domain.vehicle.state import FlightMode
from app.services.offboard.commands import CommandDelivery
from app.vehicles.command_sender import CommandSender
from app.vehicles.decoders import CommandAckReport
from app.vehicles.encoders import Outgoing
from tests.support.fakes import ManualClock
from tests.support.scripted_link import ScriptedVehicle
from tests.support.task_examples import ORIGIN

CARROT = order_request(FlyTo((3000.0, 0.0), 50.0), ORIGIN)


class Wire:
    """What leaves, and the acks that the test lets come."""

    def __init__(self) -> None:
        self.sent: list[Outgoing] = []
        self.vehicle = ScriptedVehicle()
        self._take: Callable[[CommandAckReport, float], None] | None = None
        sender = CommandSender(self.sent.append, self, None, 245)  # type: ignore[arg-type]
        self.vehicle.command = sender.acks  # type: ignore[method-assign]
        self.delivery = CommandDelivery(self.vehicle, ManualClock())

    def on(self, _kind: object, take: Callable[[CommandAckReport, float], None]) -> None:
        self._take = take

    def ack(self, result: int = 0) -> None:
        assert self._take is not None
        self._take(CommandAckReport(192, result, progress=255, target_system=245, target_component=190), 0.0)

    async def until_sent(self, count: int) -> None:
        async with asyncio.timeout(10.0):
            while len(self.sent) < count:
                await asyncio.sleep(0)
        assert len(self.sent) == count


async def broken_off(wire: Wire) -> None:
    """A carrot was sent, and nobody waits for its ack any more."""
    sending = asyncio.create_task(wire.delivery.send(CARROT))
    await wire.until_sent(1)
    sending.cancel()
    await asyncio.wait({sending})


async def test_the_late_ack_of_an_order_that_was_broken_off_confirms_nothing() -> None:
    wire = Wire()
    await broken_off(wire)
    last_word = asyncio.create_task(wire.delivery.send(CIRCLE_HERE))
    await wire.until_sent(2)
    wire.ack()  # of the carrot, for all that is known
    await wire.until_sent(3)
    assert not last_word.done()
    wire.ack()
    await asyncio.wait_for(last_word, 10.0)
    assert len(wire.sent) == 3


async def test_the_late_refusal_of_an_order_that_was_broken_off_refuses_nothing() -> None:
    wire = Wire()
    await broken_off(wire)
    last_word = asyncio.create_task(wire.delivery.send(CIRCLE_HERE))
    await wire.until_sent(2)
    wire.ack(result=2)
    await wire.until_sent(3)
    wire.ack()
    await asyncio.wait_for(last_word, 10.0)


async def test_after_an_answer_the_next_order_needs_one_ack_again() -> None:
    wire = Wire()
    for count, request in enumerate((CARROT, CIRCLE_HERE, CARROT), 1):
        sending = asyncio.create_task(wire.delivery.send(request))
        await wire.until_sent(count)
        wire.ack()
        await asyncio.wait_for(sending, 10.0)


async def test_no_order_leaves_once_somebody_else_has_the_vehicle_not_the_second_time_either() -> None:
    wire = Wire()
    await broken_off(wire)
    last_word = asyncio.create_task(wire.delivery.send(CIRCLE_HERE))
    await wire.until_sent(2)
    wire.vehicle.put(mode=FlightMode.RETURN)
    wire.ack()
    with pytest.raises(LinkError, match="somebody else"):
        await asyncio.wait_for(last_word, 10.0)
    assert len(wire.sent) == 2
