"""Events: facts that happened, numbered without gaps by the gateway that saw them, stored before they are sent."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from typing import Annotated, Any, Final, Literal, Self, Union, get_args

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
from app.domain.events.run import (
    DropConsentAsked,
    DropConsentClosed,
    RunAck,
    RunAttachment,
    RunChanged,
    RunCommand,
    RunContinued,
    RunCreated,
    RunDrop,
    RunItem,
    RunItemEnded,
    RunMissionChanged,
    RunPlanRefused,
    RunPredicted,
    RunTargetMoved,
    RunTargetNotFollowed,
    RunUploadProgress,
)
from app.domain.events.service import (
    JobChanged,
    JobQueueChanged,
    LoopStalled,
    PlanCreated,
    ServiceStarted,
    ServiceStopped,
    SimulatorFault,
    SimulatorSpeedSet,
    WebhookChanged,
)
from app.domain.events.vehicle import (
    OffboardChanged,
    OffboardLease,
    TasksChanged,
    TasksGripper,
    VehicleChanged,
    VehicleCommand,
    VehicleLinkLost,
    VehicleLinkRestored,
    VehicleParameters,
    VehicleQuarantined,
    VehicleRebooted,
    VehicleSeen,
    VehicleStatusText,
)

VehiclePayload = (
    VehicleSeen
    | VehicleLinkLost
    | VehicleLinkRestored
    | VehicleChanged
    | VehicleParameters
    | VehicleRebooted
    | VehicleStatusText
    | VehicleQuarantined
    | VehicleCommand
    | OffboardLease
    | OffboardChanged
    | TasksChanged
    | TasksGripper
)
RunPayload = (
    RunCreated
    | RunChanged
    | RunPredicted
    | RunPlanRefused
    | RunUploadProgress
    | RunMissionChanged
    | RunContinued
    | RunTargetMoved
    | RunTargetNotFollowed
    | RunItem
    | RunItemEnded
    | RunCommand
    | RunAck
    | RunDrop
    | RunAttachment
    | DropConsentAsked
    | DropConsentClosed
)
ServicePayload = (
    ServiceStarted
    | ServiceStopped
    | LoopStalled
    | WebhookChanged
    | SimulatorFault
    | SimulatorSpeedSet
    | PlanCreated
    | JobChanged
    | JobQueueChanged
)
AnyPayload = VehiclePayload | RunPayload | ServicePayload

PAYLOADS: Final[dict[EventKind, type[AnyPayload]]] = {payload.kind: payload for payload in get_args(AnyPayload)}


def payload_of(kind: EventKind, version: int, data: object) -> AnyPayload:
    """The payload that was stored or sent as `data`.

    Raises:
        ValueError: it is no payload of this kind and version (pydantic's ValidationError is one).
    """
    form = PAYLOADS[kind]
    if version != form.version:
        data = form.upcast(version, data)
    return form.model_validate(data)


def _validated(data: object, info: ValidationInfo) -> AnyPayload:
    if "kind" not in info.data or "version" not in info.data:
        raise ValueError("kind and version tell how the data is read")
    kind: EventKind = info.data["kind"]
    if isinstance(data, PAYLOADS[kind]):
        return data
    return payload_of(kind, info.data["version"], data)


def _dumped(data: AnyPayload) -> Any:
    return data.model_dump(mode="json")


class NewEvent(BaseModel):
    """An event before the journal has numbered it. `time` is Unix seconds, `version` that of the payload's form.

    An event of an earlier version is read as one of the present version: see Versioned.upcast.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: EventKind
    version: int = 1
    time: float
    vehicle_id: str | None = None
    run_id: str | None = None
    data: Annotated[AnyPayload, PlainValidator(_validated), PlainSerializer(_dumped)]

    @model_validator(mode="after")
    def _present_version(self) -> Self:
        return self if self.version == self.data.version else self.model_copy(update={"version": self.data.version})

    @classmethod
    def of(
        cls, payload: AnyPayload, time: float, *, vehicle_id: str | None = None, run_id: str | None = None
    ) -> NewEvent:
        """The event that tells `payload`."""
        return NewEvent(
            kind=payload.kind,
            version=payload.version,
            time=time,
            vehicle_id=vehicle_id,
            run_id=run_id,
            data=payload,
        )


class Event(NewEvent):
    """A stored event. `seq` starts at 1 and has no gaps within one gateway's journal.

    `hash` is its link of the journal's chain: keep it, and it proves what the journal said. `position` is its place
    in the stream that it is read from, which `after` counts: `seq` on a gateway, the cluster's on an API node.
    """

    seq: int
    gateway: str
    hash: str
    position: int = Field(default_factory=lambda read: read["seq"])

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """One form for each kind, told apart by `kind`: a client gets the type of `data` with it."""
        return handler(_forms().core_schema)


def _form(kind: EventKind, payload: type[AnyPayload]) -> type[BaseModel]:
    """The schema of an event of one kind."""
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
    """Made for a description alone: to make them takes long."""
    union: Any = Union[tuple(_form(kind, payload) for kind, payload in PAYLOADS.items())]  # noqa: UP007
    return TypeAdapter(Annotated[union, Field(discriminator="kind")])


# The journal's hash chain: each event's hash covers the event and the hash before it.
#
# Whoever keeps one event's hash (a client's copy, a delivery report) can show later that nothing up to that event
# was altered, left out or put in between: `waydrop verify-journal --anchor SEQ:HASH`.


GENESIS: Final = "0" * 64
"""What stands before the first event."""


class JournalHead(BaseModel):
    """An event's place in the chain. `hash` is hexadecimal SHA-256; seq 0 with GENESIS is an empty journal."""

    model_config = ConfigDict(frozen=True, extra="forbid")

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

    `data` is the JSON text as it is stored, a string in the array: no two readers need agree on how to write JSON.
    """
    fields = [previous, gateway, seq, kind, version, time, vehicle_id, run_id, data]
    text = json.dumps(fields, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
