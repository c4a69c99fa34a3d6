"""The AsyncAPI 3 document of the websocket, made from the frame models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, get_args

from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from app.api.authentication import SUBPROTOCOL
from app.api.by_hand.frames import CLIENT_FRAMES, CLOSE_REASONS, SERVER_FRAMES
from app.api.routing import API, BY_HAND_PATH
from app.api.stream.frames import FRAMES, CloseCode

_REF: Final = "#/components/schemas/{model}"
_CLOSE_CODES: Final = {
    CloseCode.GOING_AWAY: "the service stops; connect again with after=",
    CloseCode.POLICY: "the client sent frames; it should only listen",
    CloseCode.DEFECT: "a defect of the service",
    CloseCode.TRY_AGAIN: "the journal cannot be read now",
    CloseCode.BAD_AFTER: "after is not a whole number of 0 or more",
    CloseCode.UNAUTHORIZED: "no token, or not a valid one",
    CloseCode.TOO_SLOW: "the client did not read in time; connect again with after= the last event seen",
    CloseCode.AFTER_AHEAD: "after is higher than the newest event: it belongs to another journal",
}


def asyncapi_document(*, version: str) -> dict[str, Any]:
    """The document as JSON-able data."""
    told, said = (*FRAMES, *SERVER_FRAMES), CLIENT_FRAMES
    models: list[tuple[type[BaseModel], JsonSchemaMode]] = [(model, "serialization") for model in told]
    models += [(model, "validation") for model in said]
    references, document = models_json_schema(models, ref_template=_REF)
    named = {_name(model): _message(model, references[(model, mode)]) for model, mode in models}
    messages = {name: named[name] for name in (_name(model) for model in FRAMES)}
    return {
        "asyncapi": "3.0.0",
        "info": {"title": "Waydrop stream", "version": version, "description": _description()},
        "defaultContentType": "application/json",
        "servers": {
            "service": {"host": "127.0.0.1:8080", "protocol": "ws", "security": [_ref("securitySchemes/token")]}
        },
        "channels": {
            "stream": {
                "address": f"{API}/stream",
                "messages": {name: _ref(f"messages/{name}") for name in messages},
                "bindings": {"ws": {"method": "GET", "query": _query()}},
            },
            "offboard": {
                "address": BY_HAND_PATH,
                "parameters": {"vehicle_id": {"description": "the vehicle that is flown by hand"}},
                "messages": {_name(model): _ref(f"messages/{_name(model)}") for model in (*SERVER_FRAMES, *said)},
            },
        },
        "operations": _operations(),
        "components": {
            "messages": named,
            "schemas": document.get("$defs", {}),
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    }


def _operations() -> dict[str, Any]:
    """Who sends what on which channel, as the service sees it."""
    return {
        "receive": {
            "action": "send",
            "summary": "What the service sends; the client only listens",
            "channel": {"$ref": "#/channels/stream"},
            "messages": [{"$ref": f"#/channels/stream/messages/{name}"} for name in _names(FRAMES)],
        },
        "fly": {
            "action": "receive",
            "summary": "What a pilot sends; each is answered by granted, taken, done or refused with its id",
            "channel": {"$ref": "#/channels/offboard"},
            "messages": [{"$ref": f"#/channels/offboard/messages/{_name(model)}"} for model in CLIENT_FRAMES],
        },
        "tell": {
            "action": "send",
            "summary": "What the service answers and tells a pilot",
            "channel": {"$ref": "#/channels/offboard"},
            "messages": [{"$ref": f"#/channels/offboard/messages/{_name(model)}"} for model in SERVER_FRAMES],
        },
    }


def _names(models: Sequence[type[BaseModel]]) -> list[str]:
    return [_name(model) for model in models]


def _name(model: type[BaseModel]) -> str:
    """The value of `type`; a client must say it, so there it is no default."""
    (value,) = get_args(model.model_fields["type"].annotation)
    return str(value)


def _message(model: type[BaseModel], reference: dict[str, Any]) -> dict[str, Any]:
    return {"name": _name(model), "summary": (model.__doc__ or "").strip(), "payload": reference}


def _ref(path: str) -> dict[str, str]:
    return {"$ref": f"#/components/{path}"}


def _query() -> dict[str, Any]:
    after = {"type": "integer", "minimum": 0, "description": "replay all events after this seq; without it, none"}
    return {"type": "object", "properties": {"after": after}}


def _description() -> str:
    codes = "\n".join(f"- {int(code)}: {text}" for code, text in _CLOSE_CODES.items())
    by_hand = "\n".join(f"- {code}: {text}" for code, text in CLOSE_REASONS.items())
    return (
        "Order: hello, snapshot, then events (each once, in order) and telemetry as they come. A browser gives its "
        f'token as a subprotocol: ["{SUBPROTOCOL}", "bearer.<token>"].\n\nClose codes of the stream:\n{codes}\n\n'
        f"Close codes of the offboard socket, whose lease ends with it:\n{by_hand}"
    )
