"""The AsyncAPI 3 document of the websocket, made from the frame models."""

from __future__ import annotations

from typing import Any, Final

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from app.api.authentication import SUBPROTOCOL
from app.api.routing import API
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
    references, document = models_json_schema([(model, "serialization") for model in FRAMES], ref_template=_REF)
    messages = {_name(model): _message(model, references[(model, "serialization")]) for model in FRAMES}
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
            }
        },
        "operations": {
            "receive": {
                "action": "send",
                "summary": "What the service sends; the client only listens",
                "channel": {"$ref": "#/channels/stream"},
                "messages": [{"$ref": f"#/channels/stream/messages/{name}"} for name in messages],
            }
        },
        "components": {
            "messages": messages,
            "schemas": document.get("$defs", {}),
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    }


def _name(model: type[BaseModel]) -> str:
    return str(model.model_fields["type"].default)


def _message(model: type[BaseModel], reference: dict[str, Any]) -> dict[str, Any]:
    return {"name": _name(model), "summary": (model.__doc__ or "").strip(), "payload": reference}


def _ref(path: str) -> dict[str, str]:
    return {"$ref": f"#/components/{path}"}


def _query() -> dict[str, Any]:
    after = {"type": "integer", "minimum": 0, "description": "replay all events after this seq; without it, none"}
    return {"type": "object", "properties": {"after": after}}


def _description() -> str:
    codes = "\n".join(f"- {int(code)}: {text}" for code, text in _CLOSE_CODES.items())
    return (
        "Order: hello, snapshot, then events (each once, in order) and telemetry as they come. A browser gives its "
        f'token as a subprotocol: ["{SUBPROTOCOL}", "bearer.<token>"].\n\nClose codes:\n{codes}'
    )
