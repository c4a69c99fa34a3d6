"""Holds every answer that a test sees to the OpenAPI document."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import jsonschema_rs

from app.api.application import ROUTES
from app.api.openapi import openapi_document

DOCUMENT = openapi_document(ROUTES, version="0.0-test")


def assert_described(method: str, path: str, status: int, content_type: str, body: Any) -> None:
    """Fails unless the document has this status for this path, with this media type and a body of its schema."""
    operation = _operation(method, path.partition("?")[0])
    if operation is None or status == 405:
        return
    assert str(status) in operation["responses"], f"{method} {path} answered {status}, which is not described"
    content = operation["responses"][str(status)]["content"]
    if not content:
        assert body in ("", b"", None)
        return
    assert content_type in content, f"{method} {path} {status} is {content_type}, described are {list(content)}"
    if content_type.endswith("json"):
        errors = [error.message for error in _validator(content[content_type]["schema"]).iter_errors(body)]
        assert not errors, f"{method} {path} {status}: {errors}"
    if content_type == "application/problem+json":
        codes = operation["responses"][str(status)]["x-problem-codes"]
        assert body["code"] in codes, f"{method} {path} {status}: {body['code']} is not described ({body['detail']})"


def _operation(method: str, path: str) -> dict[str, Any] | None:
    exact = DOCUMENT["paths"].get(path)
    if exact is not None:
        return exact.get(method.lower())  # type: ignore[no-any-return]
    for pattern, item in DOCUMENT["paths"].items():
        if re.fullmatch(re.sub(r"\{\w+\}", "[^/]+", pattern), path):
            return item.get(method.lower())  # type: ignore[no-any-return]
    return None


@cache
def _validator_of(reference: str) -> jsonschema_rs.Draft202012Validator:
    return jsonschema_rs.Draft202012Validator({"$ref": reference, "components": DOCUMENT["components"]})


def _validator(schema: dict[str, Any]) -> jsonschema_rs.Draft202012Validator:
    if "$ref" in schema:
        return _validator_of(schema["$ref"])
    return jsonschema_rs.Draft202012Validator({**schema, "components": DOCUMENT["components"]})
