"""Frames for the websockets, made from the AsyncAPI document, and what the service may answer."""

from __future__ import annotations

import json
from functools import cache
from typing import Any, Final

import jsonschema_rs
import schemathesis
from hypothesis import strategies as st
from schemathesis import GenerationMode

from app.api.asyncapi import asyncapi_document

DOCUMENT: Final = asyncapi_document(version="0.0-test")
SAID: Final = {"offboard": "fly", "reports": "report"}
"""The operation that has a channel's frames of the client."""
TOLD: Final = {"stream": "receive", "offboard": "notify", "reports": "answer"}
"""And of the service."""

nonsense = st.one_of(
    st.binary(max_size=200),
    st.text(max_size=200),
    st.dictionaries(
        st.sampled_from(["type", "id", "vehicle", "velocity", "position", "lease", "after", "x"]),
        st.one_of(st.none(), st.integers(), st.floats(), st.text(max_size=12), st.lists(st.integers(), max_size=4)),
        max_size=6,
    ).map(json.dumps),
)


@cache
def frames_of(channel: str) -> st.SearchStrategy[Any]:
    """Right frames and wrong ones as data, and nonsense as text or bytes."""
    if channel not in SAID:
        return nonsense
    schema = {"oneOf": _payloads(SAID[channel])}
    operation = _as_operation(schema)
    right = operation.as_strategy(generation_mode=GenerationMode.POSITIVE).map(lambda case: case.body)
    wrong = operation.as_strategy(generation_mode=GenerationMode.NEGATIVE).map(lambda case: case.body)
    return st.one_of(right, right, right, wrong, nonsense)


def assert_told(channel: str, frame: str) -> None:
    """Fails unless the service may send this frame on this channel."""
    told = json.loads(frame)
    validator = _validator(channel, told["type"])
    errors = [error.message for error in validator.iter_errors(told)]
    assert not errors, f"{told['type']}: {errors}"


@cache
def _validator(channel: str, kind: str) -> jsonschema_rs.Draft202012Validator:
    keys = [message["$ref"].rpartition("/")[2] for message in DOCUMENT["operations"][TOLD[channel]]["messages"]]
    assert kind in keys, f"a frame of type {kind} is not described for {channel}"
    return jsonschema_rs.Draft202012Validator({**_payload(kind), "components": DOCUMENT["components"]})


def _payloads(operation: str) -> list[Any]:
    messages = DOCUMENT["operations"][operation]["messages"]
    return [_payload(message["$ref"].rpartition("/")[2]) for message in messages]


def _payload(key: str) -> dict[str, Any]:
    return dict(DOCUMENT["components"]["messages"][key]["payload"])


def _as_operation(schema: dict[str, Any]) -> Any:
    """Schemathesis knows requests only: a frame is the body of one."""
    body = {"required": True, "content": {"application/json": {"schema": schema}}}
    document = {
        "openapi": "3.1.0",
        "info": {"title": "frames", "version": "1"},
        "paths": {"/frame": {"post": {"requestBody": body, "responses": {"200": {"description": "frame"}}}}},
        "components": {"schemas": DOCUMENT["components"]["schemas"]},
    }
    return next(result.ok() for result in schemathesis.openapi.from_dict(document).get_all_operations())
