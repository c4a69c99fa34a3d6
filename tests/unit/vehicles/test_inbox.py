"""Another station that has all parameters listed on our link costs neither memory nor turns of the loop."""

from __future__ import annotations

import asyncio
import json

from app.vehicles.decoders import Heartbeat, ParamValue
from app.vehicles.inbox import Inbox

CAPACITY = 8


def posted(inbox: Inbox, name: str, value: float) -> None:
    inbox.post("PARAM_VALUE", json.dumps({"param_id": name, "param_type": 9, "param_value": value}))


async def test_of_a_flood_of_parameters_only_the_newest_of_those_in_use_are_let_in() -> None:
    inbox = Inbox(asyncio.get_running_loop(), capacity=CAPACITY)
    inbox.parameters.update({"NAV_ACC_RAD"})
    values: list[tuple[str, float | None]] = []
    beats: list[Heartbeat] = []
    inbox.on(ParamValue, lambda message, _: values.append((message.param_id, message.value)))
    inbox.on(Heartbeat, lambda message, _: beats.append(message))
    for number in range(1000):
        posted(inbox, f"OTHER_{number}", 1.0)
        posted(inbox, "NAV_ACC_RAD", float(number))
    inbox.post("HEARTBEAT", json.dumps({"type": 2}))
    async with asyncio.timeout(5.0):
        while not beats:
            await asyncio.sleep(0)
    assert values == [("NAV_ACC_RAD", 999.0)]
    assert inbox.overflowed == 0
