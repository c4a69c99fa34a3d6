"""Calls to gateways are carried out once, for whom this cluster trusts, and fail in words."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import pytest
from pydantic import BaseModel

from app.domain.cluster.errors import GatewayUnreachableError, NoReplyError
from app.domain.cluster.ports import GatewaySite, calls_of
from app.domain.errors import (
    InvalidInputError,
    LinkTimeoutError,
    NotFoundError,
    UploadError,
    VehicleBusyError,
    WaydropError,
)
from app.services.remote.calls import CALL_TIMEOUT_S, Caller, CallRefusedError, CallServer, RemoteProblem, error_of
from app.services.remote.journal import ClusterJournal
from app.storage.postgres.database import CommitLostError
from tests.support.fakes import ManualClock
from tests.support.memory_cluster import MemoryBus, MemoryClusterEvents
from tests.support.stored_samples import event

KEY, OTHER_KEY = b"k" * 32, b"o" * 32


class Climb(BaseModel):
    """An argument that is a model."""

    height_m: float


_CALLS = ("climb", "names", "busy", "unknown", "lost", "strange")


class Commands:
    """What a gateway does here."""

    def __init__(self) -> None:
        self.done: list[str] = []

    async def climb(self, vehicle_id: str, climb: Climb) -> Climb:
        self.done.append(vehicle_id)
        return Climb(height_m=climb.height_m + 1)

    async def names(self) -> Sequence[str]:
        return ("a", "b")

    async def busy(self) -> None:
        raise VehicleBusyError("it flies", hint="wait", run_id="run-1")

    async def unknown(self) -> None:
        raise CommitLostError("it may be stored")

    async def lost(self) -> None:
        error = LinkTimeoutError("no answer to the last item")
        error.mark_may_be_done()
        raise error

    async def strange(self) -> None:
        raise NewerError("of a newer version", findings=[{"code": "x"}])


class NewerError(WaydropError):
    """An error that API nodes do not know."""

    code = "vehicle.newer_error"


class Rig:
    """A node and a gateway on one bus."""

    def __init__(self, *, node_key: bytes = KEY, skew_s: float = 0.0) -> None:
        self.bus = MemoryBus()
        self.clock = ManualClock()
        self.commands = Commands()
        self.events = MemoryClusterEvents()
        part = GatewaySite(gateway="gw-1", site="north", address="here")
        self.has_site = True
        late = ManualClock(self.clock.now() + skew_s)
        functions = {name: getattr(self.commands, name) for name in _CALLS}
        self.server = CallServer(part, functions, KEY, lambda: 0, late, lambda: self.has_site)
        self.caller = Caller(self.bus, node_key, ClusterJournal(self.events, self.clock).reached, self.clock)

    async def call(self, method: str, returns: Any, *, site: str = "north", **arguments: object) -> Any:
        async with self.bus.answering(calls_of("north"), self.server.answer):
            return await self.caller.call(calls_of("north"), site, method, returns, **arguments)


async def test_arguments_and_answers_are_validated_models() -> None:
    rig = Rig()
    assert await rig.call("climb", Climb, vehicle_id="north-v1", climb=Climb(height_m=4)) == Climb(height_m=5)
    assert await rig.call("names", list[str]) == ["a", "b"]
    with pytest.raises(InvalidInputError, match="climb"):
        await rig.call("climb", Climb, vehicle_id="north-v1", climb={"height_m": "high"})
    assert rig.commands.done == ["north-v1"]


async def test_an_error_keeps_its_class_code_and_facts() -> None:
    rig = Rig()
    with pytest.raises(VehicleBusyError, match="it flies") as caught:
        await rig.call("busy", type(None))
    assert (caught.value.hint, caught.value.extra) == ("wait", {"run_id": "run-1"})
    assert not caught.value.may_be_done
    with pytest.raises(LinkTimeoutError) as lost:
        await rig.call("lost", type(None))
    assert lost.value.may_be_done
    with pytest.raises(NoReplyError, match="may be stored"):  # the claim of an Idempotency-Key then stays
        await rig.call("unknown", type(None))
    with pytest.raises(WaydropError, match="newer version") as strange:
        await rig.call("strange", type(None))
    assert (strange.value.code, strange.value.extra) == ("vehicle.newer_error", {"findings": [{"code": "x"}]})


@pytest.mark.parametrize("method", ["nothing", "__init__"])
async def test_only_public_methods_are_calls(method: str) -> None:
    rig = Rig()
    with pytest.raises(NotFoundError, match="knows no call"):
        await rig.call(method, type(None))
    assert rig.commands.done == []


@pytest.mark.parametrize("rig", [Rig(node_key=OTHER_KEY), Rig(skew_s=16.0), Rig(skew_s=-31.0)])
async def test_a_call_with_another_key_or_of_another_time_is_refused(rig: Rig) -> None:
    with pytest.raises((CallRefusedError, NoReplyError)):
        await rig.call("climb", Climb, vehicle_id="north-v1", climb=Climb(height_m=4))
    assert rig.commands.done == []


@pytest.mark.parametrize("ahead_s", [0.0, 4.0])
async def test_a_call_begins_only_while_the_one_who_asked_waits(ahead_s: float) -> None:
    """Who asked was told that the outcome is unknown, and may have flown another one since."""
    rig = Rig()
    arguments = {"vehicle_id": "north-v1", "climb": Climb(height_m=4)}
    held: list[bytes] = []

    async def hold(message: bytes) -> bytes:
        held.append(message)
        return b""  # no answer

    async with rig.bus.answering(calls_of("north"), hold):
        with pytest.raises(NoReplyError):
            await rig.caller.call(calls_of("north"), "north", "climb", Climb, **arguments)
    clock = ManualClock(rig.clock.now() + CALL_TIMEOUT_S - ahead_s)
    part = GatewaySite(gateway="gw-1", site="north", address="here")
    server = CallServer(part, {"climb": rig.commands.climb}, KEY, lambda: 0, clock)
    late = json.loads(json.loads(await server.answer(held[0]))["body"])
    assert late["error"]["code"] == "cluster.call_refused"
    assert rig.commands.done == []


async def test_who_has_lost_the_right_to_carry_calls_out_does_nothing_and_says_so() -> None:
    """Two nodes may both believe that they lead: what the old one would make, the new one does not know."""
    rig = Rig()

    async def lost() -> None:
        raise GatewayUnreachableError("the node does not write any more: nothing was done")

    part = GatewaySite(gateway="gw-1", site="north", address="here")
    rig.server = CallServer(
        part, {"climb": rig.commands.climb}, KEY, lambda: 0, rig.clock, lambda: rig.has_site, require_right=lost
    )
    with pytest.raises(WaydropError, match="nothing was done") as caught:
        await rig.call("climb", Climb, vehicle_id="north-v1", climb=Climb(height_m=4))
    assert caught.value.code == "gateway.unreachable"
    assert rig.commands.done == []


async def test_a_call_for_another_gateway_of_the_site_is_neither_carried_out_nor_answered() -> None:
    rig = Rig()
    arguments = {"vehicle_id": "north-v1", "climb": Climb(height_m=4)}
    async with rig.bus.answering(calls_of("north"), rig.server.answer):
        with pytest.raises(NoReplyError):
            await rig.caller.call(calls_of("north"), "north", "climb", Climb, "elsewhere", **arguments)
        assert rig.commands.done == []
        await rig.caller.call(calls_of("north"), "north", "climb", Climb, "here", **arguments)
        assert rig.commands.done == ["north-v1"]
        rig.has_site = False
        with pytest.raises(NoReplyError):
            await rig.caller.call(calls_of("north"), "north", "climb", Climb, **arguments)
        await rig.caller.call(calls_of("north"), "north", "climb", Climb, "here", **arguments)
    assert rig.commands.done == ["north-v1", "north-v1"]


async def test_a_call_for_another_site_or_one_that_is_repeated_is_refused() -> None:
    rig = Rig()
    with pytest.raises(CallRefusedError, match="a call for south"):
        await rig.call("names", list[str], site="south")
    heard: list[bytes] = []

    async def listen(message: bytes) -> bytes:
        heard.append(message)
        return await rig.server.answer(message)

    async with rig.bus.answering(calls_of("north"), listen):
        await rig.caller.call(
            calls_of("north"), "north", "climb", Climb, vehicle_id="north-v1", climb=Climb(height_m=4)
        )
    again = json.loads(json.loads(await rig.server.answer(heard[0]))["body"])
    assert again["error"]["code"] == "cluster.call_refused"
    assert rig.commands.done == ["north-v1"]


async def test_a_forged_answer_is_no_answer() -> None:
    rig = Rig()

    async def forged(message: bytes) -> bytes:
        return b'{"body": "{}", "signature": "00"}'

    async with rig.bus.answering(calls_of("north"), forged):
        with pytest.raises(NoReplyError, match="not signed"):
            await rig.caller.call(calls_of("north"), "north", "names", list[str])


async def test_nobody_there_is_told() -> None:
    rig = Rig()
    with pytest.raises(GatewayUnreachableError):
        await rig.caller.call(calls_of("north"), "north", "names", list[str])


async def test_a_journal_of_a_node_tells_what_others_store_and_returns_after_its_own_was_told() -> None:
    events = MemoryClusterEvents()
    one, other = ClusterJournal(events, ManualClock()), ClusterJournal(events, ManualClock())
    await one.start()
    await other.start()
    try:
        heard = other.subscribe(10)
        (stored,) = await one.record(event(1))
        assert one.last_seq == stored.position == 1
        assert (await heard.get()) == stored
        await other.reached(stored.gateway, stored.seq)
        assert list(await other.read(0, 10)) == [stored]
    finally:
        await one.close()
        await other.close()


@pytest.mark.parametrize(
    ("code", "cls"), [("mission.upload_failed", UploadError), ("input.invalid", InvalidInputError)]
)
def test_a_code_that_several_classes_have_is_read_as_the_most_general_of_them(
    code: str, cls: type[WaydropError]
) -> None:
    assert type(error_of(RemoteProblem(code=code, detail="x"))) is cls
