"""The AsyncAPI 3 document of the websockets, made from the frame models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, get_args

from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from app.api.authentication import SUBPROTOCOL
from app.api.offboard.frames import CLIENT_FRAMES, CLOSE_REASONS, SERVER_FRAMES
from app.api.routing import API, OFFBOARD_PATH, TARGET_REPORTS_PATH
from app.api.stream.frames import FRAMES, CloseCode
from app.api.target_reports import ANSWER_FRAMES, REPORTER_FRAMES, REPORTS_CLOSE_REASONS

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
    told, said = dict.fromkeys((*FRAMES, *SERVER_FRAMES, *ANSWER_FRAMES)), (*CLIENT_FRAMES, *REPORTER_FRAMES)
    models: list[tuple[type[BaseModel], JsonSchemaMode]] = [(model, "serialization") for model in told]
    models += [(model, "validation") for model in said]
    references, document = models_json_schema(models, ref_template=_REF)
    named = {_key(model): _message(model, references[(model, mode)]) for model, mode in models}
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
    """The paths, and what goes over each of them."""
    return {
        "stream": {
            "address": f"{API}/stream",
            "messages": _messages(FRAMES),
            "bindings": {"ws": {"method": "GET", "query": _query()}},
        },
        "offboard": {
            "address": OFFBOARD_PATH,
            "parameters": {"vehicle_id": {"description": "the vehicle in offboard control"}},
            "messages": _messages((*SERVER_FRAMES, *CLIENT_FRAMES)),
        },
        "reports": {
            "address": TARGET_REPORTS_PATH,
            "parameters": {"feed": {"description": "the moving target that is reported"}},
            "messages": _messages((*ANSWER_FRAMES, *REPORTER_FRAMES)),
        },
    }


def _messages(models: Sequence[type[BaseModel]]) -> dict[str, Any]:
    return {_name(model): _ref(f"messages/{_key(model)}") for model in models}


def _operations() -> dict[str, Any]:
    """Who sends what on which channel, as the service sees it."""
    return {
        "receive": {
            "action": "send",
            "summary": "What the service sends; the client only listens",
            "channel": {"$ref": "#/channels/stream"},
            "messages": _of_channel("stream", FRAMES),
        },
        "fly": {
            "action": "receive",
            "summary": "What a pilot sends; each is answered by granted, taken, done or refused with its id",
            "channel": {"$ref": "#/channels/offboard"},
            "messages": _of_channel("offboard", CLIENT_FRAMES),
        },
        "tell": {
            "action": "send",
            "summary": "What the service answers and tells a pilot",
            "channel": {"$ref": "#/channels/offboard"},
            "messages": _of_channel("offboard", SERVER_FRAMES),
        },
        "report": {
            "action": "receive",
            "summary": "What a dispatcher sends of a moving target; each is answered by taken or refused, in order",
            "channel": {"$ref": "#/channels/reports"},
            "messages": _of_channel("reports", REPORTER_FRAMES),
        },
        "answer": {
            "action": "send",
            "summary": "What the service answers to a report; it tells nothing else",
            "channel": {"$ref": "#/channels/reports"},
            "messages": _of_channel("reports", ANSWER_FRAMES),
        },
    }


def _of_channel(channel: str, models: Sequence[type[BaseModel]]) -> list[dict[str, str]]:
    return [{"$ref": f"#/channels/{channel}/messages/{_name(model)}"} for model in models]


def _name(model: type[BaseModel]) -> str:
    """The value of `type`; a client must say it, so there it is no default."""
    (value,) = get_args(model.model_fields["type"].annotation)
    return str(value)


def _key(model: type[BaseModel]) -> str:
    return _name(model)


def _message(model: type[BaseModel], reference: dict[str, Any]) -> dict[str, Any]:
    return {"name": _name(model), "summary": (model.__doc__ or "").strip(), "payload": reference}


def _ref(path: str) -> dict[str, str]:
    return {"$ref": f"#/components/{path}"}


def _query() -> dict[str, Any]:
    after = {"type": "integer", "minimum": 0, "description": "replay all events after this seq; without it, none"}
    return {"type": "object", "properties": {"after": after}}


def _description() -> str:
    codes = "\n".join(f"- {int(code)}: {text}" for code, text in _CLOSE_CODES.items())
    offboard = "\n".join(f"- {code}: {text}" for code, text in CLOSE_REASONS.items())
    reports = "\n".join(f"- {code}: {text}" for code, text in REPORTS_CLOSE_REASONS.items())
    return (
        "Order: hello, snapshot, then events (each once, in order) and telemetry as they come. A browser gives its "
        f'token as a subprotocol: ["{SUBPROTOCOL}", "bearer.<token>"].\n\nClose codes of the stream:\n{codes}\n\n'
        f"Close codes of the offboard socket, whose lease ends with it:\n{offboard}\n\n"
        f"Close codes of the reports socket, whose target stays known:\n{reports}"
    )
