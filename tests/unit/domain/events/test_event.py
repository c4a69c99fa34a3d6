"""Each kind of event has one payload model; what is stored and sent is what it dumps, and is read by it alone."""

from __future__ import annotations

import hashlib
import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from app.domain.drop.record import DropRecord
from app.domain.events import PAYLOADS, Event, EventKind, NewEvent, payload_of
from app.domain.events.event import GENESIS, event_hash
from app.domain.events.kinds import Payload
from app.domain.events.run import CommandOutcome, RunAck, RunCommand, RunCommandName, RunDrop
from app.domain.events.service import SimulatorFault
from app.domain.events.vehicle import VehicleRebooted
from app.domain.vehicle.commands import MavResult

ACK = RunAck(
    command=RunCommandName.DO_GRIPPER,
    outcome=CommandOutcome.ACKNOWLEDGED,
    result=MavResult.ACCEPTED,
    result_code=0,
)
NUMBER: dict[str, Any] = {"time": 1.0, "seq": 1, "gateway": "gw-1", "hash": "ab"}


def stored(new: NewEvent) -> Event:
    return new.numbered(1, "gw-1", "ab")


def test_every_kind_has_a_payload_that_says_so() -> None:
    assert set(PAYLOADS) == set(EventKind)
    assert all(payload.kind is kind for kind, payload in PAYLOADS.items())


@pytest.mark.parametrize(
    "payload",
    [
        ACK,
        RunCommand(command=RunCommandName.DO_GRIPPER, params=(None, 0.0), attempt=1),
        RunDrop(DropRecord(plan_item_id="drop", supervised=True)),
        SimulatorFault(fault="wind", value=(3.0, -2.5), actor="desk"),
        VehicleRebooted(),
    ],
)
def test_an_event_is_read_as_it_was_written(payload: RunAck | RunCommand | RunDrop | SimulatorFault) -> None:
    event = stored(NewEvent.of(payload, 1.5, vehicle_id="v1", run_id="r1"))
    text = event.model_dump_json()
    assert Event.model_validate(dict(event)) == event, "numbering makes what validation would"
    assert Event.model_validate_json(text).model_dump_json() == text
    assert json.loads(text)["data"] == payload.model_dump(mode="json")
    assert (json.loads(text)["kind"], json.loads(text)["version"]) == (payload.kind.value, 1)


@pytest.mark.parametrize(
    ("kind", "version", "data"),
    [
        (EventKind.RUN_ACK, 2, ACK.model_dump(mode="json")),
        (EventKind.RUN_ACK, 1, {"command": "arm"}),
        (EventKind.RUN_ACK, 1, {**ACK.model_dump(mode="json"), "later": 1}),
        (EventKind.RUN_COMMAND, 1, ACK.model_dump(mode="json")),
        (EventKind.RUN_ACK, 1, None),
        (EventKind.RUN_ACK, 1, {**ACK.model_dump(mode="json"), "result": "accepted"}),
        (EventKind.RUN_ACK, 1, {**ACK.model_dump(mode="json"), "result": "no answer"}),
    ],
)
def test_data_of_another_form_is_refused(kind: EventKind, version: int, data: object) -> None:
    with pytest.raises(ValueError, match=r"."):
        payload_of(kind, version, data)
    with pytest.raises(ValidationError):
        Event.model_validate({**NUMBER, "kind": kind, "version": version, "data": data})


class _Renamed(Payload):
    """As `vehicle.rebooted` would be in a version 2 that has called `text` of version 1 `detail`."""

    kind = EventKind.VEHICLE_REBOOTED
    version = 2

    detail: str

    @classmethod
    def upcast(cls, version: int, data: Any) -> Any:
        return {"detail": data["text"]} if version == 1 else super().upcast(version, data)


def test_an_event_of_an_earlier_version_is_read_in_the_present_form(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PAYLOADS, EventKind.VEHICLE_REBOOTED, _Renamed)
    old = {**NUMBER, "kind": "vehicle.rebooted", "version": 1, "data": {"text": "power"}}
    read = Event.model_validate(old)
    assert (read.version, read.model_dump(mode="json")["data"]) == (2, {"detail": "power"})
    with pytest.raises(ValidationError, match="unsupported version 3"):
        Event.model_validate({**old, "version": 3})


def test_the_payload_of_another_kind_is_refused() -> None:
    with pytest.raises(ValidationError):
        Event(kind=EventKind.RUN_COMMAND, data=ACK, **NUMBER)


def test_the_schema_tells_the_form_of_the_data_by_the_kind() -> None:
    schema = TypeAdapter(list[Event]).json_schema()
    forms = schema["$defs"]["Event"]
    assert set(forms["discriminator"]["mapping"]) == {kind.value for kind in EventKind}
    ack = schema["$defs"]["RunAckEvent"]["properties"]
    assert (ack["kind"]["const"], ack["version"]["const"], ack["data"]) == ("run.ack", 1, {"$ref": "#/$defs/RunAck"})


TEXTS = st.text() | st.text(st.characters(categories=("Cs", "Cc", "Zs", "So")))  # with surrogates and controls
ORDER = ("gateway", "seq", "kind", "version", "time", "vehicle_id", "run_id", "data")
LINKS = st.fixed_dictionaries(
    {
        "gateway": TEXTS,
        "seq": st.integers(),
        "kind": TEXTS,
        "version": st.integers(),
        "time": st.floats(allow_nan=False, allow_infinity=False),
        "vehicle_id": st.none() | TEXTS,
        "run_id": st.none() | TEXTS,
        "data": TEXTS,
    }
)


@given(previous=TEXTS, link=LINKS)
def test_a_hash_covers_the_compact_json_array_of_all_fields(previous: str, link: dict[str, Any]) -> None:
    fields = [previous, *(link[name] for name in ORDER)]
    array = json.dumps(fields, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    assert event_hash(previous, **link) == hashlib.sha256(array.encode("utf-8", "surrogatepass")).hexdigest()


@pytest.mark.parametrize(
    "altered",
    [{"seq": "1"}, {"version": 1.0}, {"time": "0.0"}, {"time": math.inf}, {"kind": None}, {"data": b"{}"}],
    ids=str,
)
def test_what_no_event_can_be_has_no_hash(altered: dict[str, Any]) -> None:
    link = {"gateway": "gw-1", "seq": 1, "kind": "run.item", "version": 1, "time": 0.0}
    link |= {"vehicle_id": None, "run_id": None, "data": "{}"}
    with pytest.raises((TypeError, ValueError)):
        event_hash(GENESIS, **(link | altered))
