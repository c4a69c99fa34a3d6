"""Events: facts, numbered without gaps by their gateway, and stored before they are sent."""

from __future__ import annotations

import hashlib
import math
from functools import cache
from json.encoder import encode_basestring as _quoted
from typing import Annotated, Any, Final, Literal, NamedTuple, Self, Union, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    PlainSerializer,
    PlainValidator,
    TypeAdapter,
    ValidationInfo,
    create_model,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from app.domain.events.kinds import EventKind
from app.domain.events.run import RunPayload
from app.domain.events.service import ServicePayload
from app.domain.events.vehicle import VehiclePayload
from app.domain.model import FrozenForm

AnyPayload = VehiclePayload | RunPayload | ServicePayload

PAYLOADS: Final[dict[EventKind, type[AnyPayload]]] = {payload.kind: payload for payload in get_args(AnyPayload)}


def payload_of(kind: EventKind, version: int, data: object) -> AnyPayload:
    """Parse the payload that was stored or sent as `data`.

    Raises:
        ValueError: not a payload of this kind and version (pydantic's ValidationError is a ValueError).
    """
    form = PAYLOADS[kind]
    if version != form.version:
        data = form.upcast(version, data)
    return form.model_validate(data)


def _validated(data: object, info: ValidationInfo) -> AnyPayload:
    if "kind" not in info.data or "version" not in info.data:
        raise ValueError("kind and version are required to parse data")
    kind: EventKind = info.data["kind"]
    if isinstance(data, PAYLOADS[kind]):
        return data
    return payload_of(kind, info.data["version"], data)


def _dumped(data: AnyPayload) -> Any:
    return data.model_dump(mode="json")


class NewEvent(NamedTuple):
    """An event without a number. `time` is in Unix seconds."""

    data: AnyPayload
    time: float
    vehicle_id: str | None = None
    run_id: str | None = None

    @classmethod
    def of(
        cls, payload: AnyPayload, time: float, *, vehicle_id: str | None = None, run_id: str | None = None
    ) -> NewEvent:
        return cls(payload, float(time), vehicle_id, run_id)

    @property
    def kind(self) -> EventKind:
        return self.data.kind

    @property
    def version(self) -> int:
        return self.data.version

    def numbered(self, seq: int, gateway: str, link: str, position: int | None = None) -> Event:
        """The event as it is stored. `link` is its hash; `position` is `seq` unless told."""
        event = Event.__new__(Event)  # as unpickled: all is valid, and to validate it again takes twice as long
        fields = {
            "kind": self.data.kind,
            "version": self.data.version,
            "time": self.time,
            "vehicle_id": self.vehicle_id,
            "run_id": self.run_id,
            "data": self.data,
            "seq": seq,
            "gateway": gateway,
            "hash": link,
            "position": seq if position is None else position,
        }
        event.__setstate__({"__dict__": fields, **_STATE})
        return event


class Event(FrozenForm):
    """A stored event. `seq` starts at 1 and has no gaps within a gateway's journal. It is the order in which events
    were stored; `time` is when they happened. A run stores its events itself, so one of its vehicle may come after one
    of the run that is a moment later.

    `version` is the version of the payload's form. Events of earlier versions are converted when parsed: see
    Versioned.upcast.

    `hash` is its link in the journal's chain; a copy of it proves what the journal contained. `position` is its place
    in the stream that it is read from, which `after` refers to: `seq` on a gateway, the cluster's position on an API
    node.
    """

    kind: EventKind
    version: int = 1
    time: float
    vehicle_id: str | None = None
    run_id: str | None = None
    data: Annotated[AnyPayload, PlainValidator(_validated), PlainSerializer(_dumped)]
    seq: int
    gateway: str
    hash: str
    position: int = Field(default_factory=lambda read: read["seq"])

    @model_validator(mode="after")
    def _present_version(self) -> Self:
        return self if self.version == self.data.version else self.model_copy(update={"version": self.data.version})

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """One schema per kind, discriminated by `kind`, so that clients get the type of `data`."""
        return handler(_forms().core_schema)


_STATE: Final = {
    "__pydantic_fields_set__": set(Event.model_fields),
    "__pydantic_extra__": None,
    "__pydantic_private__": None,
}


def _form(kind: EventKind, payload: type[AnyPayload]) -> type[BaseModel]:
    """Return the schema of an event of one kind."""
    fields: dict[str, Any] = {
        "kind": (Literal[kind], ...),
        "version": (Literal[payload.version], ...),
        "time": (float, ...),
        "vehicle_id": (str | None, ...),
        "run_id": (str | None, ...),
        "data": (payload, ...),
        "seq": (int, ...),
        "gateway": (str, ...),
        "hash": (str, ...),
        "position": (int, ...),
    }
    return create_model(
        f"{payload.__name__}Event", __config__=ConfigDict(extra="forbid"), __doc__=payload.__doc__, **fields
    )


@cache
def _forms() -> TypeAdapter[Any]:
    """Built only when a schema is requested, because building takes long."""
    union: Any = Union[tuple(_form(kind, payload) for kind, payload in PAYLOADS.items())]  # noqa: UP007
    return TypeAdapter(Annotated[union, Field(discriminator="kind")])


# The hash chain of the journal: each event's hash covers the event and the hash before it.
#
# With a copy of one event's hash (in a client, in a delivery report), anybody can verify later that no event up to it
# was altered, removed or inserted: `waydrop verify-journal --anchor SEQ:HASH`.


GENESIS: Final = "0" * 64
"""The hash before the first event."""


class JournalHead(FrozenForm):
    """A position in the chain. `hash` is a hexadecimal SHA-256; seq 0 with GENESIS is an empty journal."""

    seq: int = 0
    hash: str = GENESIS


def event_hash(
    previous: str,
    *,
    gateway: str,
    seq: int,
    kind: str,
    version: int,
    time: float,
    vehicle_id: str | None,
    run_id: str | None,
    data: str,
) -> str:
    """SHA-256 of a compact JSON array: [previous, gateway, seq, kind, version, time, vehicle_id, run_id, data].

    `data` is the stored JSON text, as a string in the array, so that the hash does not depend on a JSON encoder.

    Raises:
        TypeError, ValueError: a field has another type, or `time` is infinite: no event was ever stored so.
    """
    # json.dumps of the list takes twice as long; a test holds the two equal. Other types raise TypeError
    text = (
        f"[{_quoted(previous)},{_quoted(gateway)},{int.__repr__(seq)},{_quoted(kind)},{int.__repr__(version)},"
        f"{_finite(time)},{_quoted_or_null(vehicle_id)},{_quoted_or_null(run_id)},{_quoted(data)}]"
    )
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _quoted_or_null(text: str | None) -> str:
    return "null" if text is None else _quoted(text)


def _finite(number: float) -> str:
    if not math.isfinite(number):
        raise ValueError(f"{number} is not JSON")
    return float.__repr__(number)
