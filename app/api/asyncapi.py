"""The AsyncAPI 3 document of the websockets, generated from the frame models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, get_args

from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from app.api.authentication import SUBPROTOCOL
from app.api.offboard.frames import CLIENT_FRAMES, SERVER_FRAMES
from app.api.offboard.frames import CLOSE_REASONS as OFFBOARD_CLOSE_REASONS
from app.api.routing import API, OFFBOARD_PATH, TARGET_REPORTS_PATH
from app.api.stream.frames import CLOSE_REASONS, FRAMES
from app.api.target_reports import ANSWER_FRAMES, REPORTER_FRAMES, REPORTS_CLOSE_REASONS

_REF: Final = "#/components/schemas/{model}"
_SENT: Final = dict.fromkeys((*FRAMES, *SERVER_FRAMES, *ANSWER_FRAMES))
FRAME_MODELS: Final[Sequence[tuple[type[BaseModel], JsonSchemaMode]]] = (
    *((model, "serialization") for model in _SENT),
    *((model, "validation") for model in (*CLIENT_FRAMES, *REPORTER_FRAMES)),
)
"""The frames of all websockets: those that the service sends, and those that clients send."""


def asyncapi_document(*, version: str) -> dict[str, Any]:
    """Return the document as JSON-serializable data."""
    references, document = models_json_schema(FRAME_MODELS, ref_template=_REF)
    named = {_key(model): _message(model, references[(model, mode)]) for model, mode in FRAME_MODELS}
    return {
        "asyncapi": "3.0.0",
        "info": {"title": "Waydrop stream", "version": version, "description": _description()},
        "defaultContentType": "application/json",
        "servers": {
            "service": {"host": "127.0.0.1:8080", "protocol": "ws", "security": [_ref("securitySchemes/token")]}
        },
        "channels": _channels(),
        "operations": _operations(),
        "components": {
            "messages": named,
            "schemas": document.get("$defs", {}),
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    }


def _channels() -> dict[str, Any]:
    return {
        "stream": {
            "address": f"{API}/stream",
            "messages": _messages(FRAMES),
            "bindings": {"ws": {"method": "GET", "query": _query()}},
        },
        "offboard": {
            "address": OFFBOARD_PATH,
            "parameters": {"vehicle_id": {"description": "ID of the vehicle"}},
            "messages": _messages((*SERVER_FRAMES, *CLIENT_FRAMES)),
        },
        "reports": {
            "address": TARGET_REPORTS_PATH,
            "parameters": {"feed": {"description": "name of the moving target's feed"}},
            "messages": _messages((*ANSWER_FRAMES, *REPORTER_FRAMES)),
        },
    }


def _messages(models: Sequence[type[BaseModel]]) -> dict[str, Any]:
    return {_name(model): _ref(f"messages/{_key(model)}") for model in models}


def _operations() -> dict[str, Any]:
    """The operations of each channel, from the point of view of the service."""
    return {
        "receive": {
            "action": "send",
            "summary": "Frames that the service sends. The client sends nothing.",
            "channel": {"$ref": "#/channels/stream"},
            "messages": _of_channel("stream", FRAMES),
        },
        "fly": {
            "action": "receive",
            "summary": "Frames that a pilot sends. Answered by lease_granted, setpoint_ack, done or error.",
            "channel": {"$ref": "#/channels/offboard"},
            "messages": _of_channel("offboard", CLIENT_FRAMES),
        },
        "notify": {
            "action": "send",
            "summary": "Answers and notifications that the service sends to a pilot.",
            "channel": {"$ref": "#/channels/offboard"},
            "messages": _of_channel("offboard", SERVER_FRAMES),
        },
        "report": {
            "action": "receive",
            "summary": "Position reports of a moving target. The service answers each one in order.",
            "channel": {"$ref": "#/channels/reports"},
            "messages": _of_channel("reports", REPORTER_FRAMES),
        },
        "answer": {
            "action": "send",
            "summary": "Answers to reports. The service sends nothing else on this channel.",
            "channel": {"$ref": "#/channels/reports"},
            "messages": _of_channel("reports", ANSWER_FRAMES),
        },
    }


def _of_channel(channel: str, models: Sequence[type[BaseModel]]) -> list[dict[str, str]]:
    return [{"$ref": f"#/channels/{channel}/messages/{_name(model)}"} for model in models]


def _name(model: type[BaseModel]) -> str:
    """The value of `type`. Required in client frames, so it has no default there."""
    (value,) = get_args(model.model_fields["type"].annotation)
    return str(value)


def _key(model: type[BaseModel]) -> str:
    return _name(model)


def _message(model: type[BaseModel], reference: dict[str, Any]) -> dict[str, Any]:
    return {"name": _name(model), "summary": (model.__doc__ or "").strip(), "payload": reference}


def _ref(path: str) -> dict[str, str]:
    return {"$ref": f"#/components/{path}"}


def _query() -> dict[str, Any]:
    after = {
        "type": "integer",
        "minimum": 0,
        "description": "replay all events after this position; without it, no events are replayed",
    }
    gateway = {
        "type": "string",
        "description": "the `gateway` of the hello frame that `after` belongs to; only with `after`",
    }
    return {"type": "object", "properties": {"after": after, "gateway": gateway}}


def _description() -> str:
    codes, offboard, reports = (
        "\n".join(f"- {code}: {text}" for code, text in sorted(reasons.items()))
        for reasons in (CLOSE_REASONS, OFFBOARD_CLOSE_REASONS, REPORTS_CLOSE_REASONS)
    )
    return (
        "The service sends hello, then snapshot, then events (each once, in order) and telemetry. A browser sends its "
        f'token as a subprotocol: ["{SUBPROTOCOL}", "bearer.<token>"].\n\nClose codes of the stream:\n{codes}\n\n'
        f"Close codes of the offboard socket, whose lease ends with it:\n{offboard}\n\n"
        f"Close codes of the reports socket, whose target stays known:\n{reports}"
    )
