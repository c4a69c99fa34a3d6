"""The OpenAPI 3.1 document, generated from the route table, so that it always matches what is served.

The frames of the websockets are among its schemas: clients, such as the page, generate all their types from it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any, Final

from pydantic.json_schema import models_json_schema

from app.api.asyncapi import FRAME_MODELS
from app.api.bodies import JSON, Body
from app.api.problems import CONTENT_TYPE, PROBLEMS, Problem
from app.api.routing import BINARY_SCHEMA, Answer, Route

_REF: Final = "#/components/schemas/{model}"
_PATH_NAME: Final = re.compile(r"\{(\w+)\}")
_HEADERS: Final = {
    "Location": "URL of the new or changed resource",
    "ETag": "Version of the resource, for If-None-Match",
    "Content-Disposition": "File name of the document",
    "Link": "Next page, rel=next; absent on the last page",
}
_ModelKey = tuple[Any, str]
"""A model and its mode: validation or serialization."""


def openapi_document(routes: Sequence[Route], *, version: str) -> dict[str, Any]:
    """Return the document as JSON-serializable data."""
    references, definitions = _schemas(routes)
    paths: dict[str, dict[str, Any]] = {}
    for route in routes:
        paths.setdefault(route.path, {})[route.method.lower()] = _operation(route, references)
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "Waydrop",
            "version": version,
            "summary": "Deliveries by drone, from plan to report",
            "description": "Errors are application/problem+json (RFC 9457) with a stable `code`. "
            "Events and telemetry come over a websocket: see /api/v1/asyncapi.json.",
            "license": {"name": "Apache-2.0", "identifier": "Apache-2.0"},
        },
        "servers": [{"url": "/", "description": "This service"}],
        "tags": [{"name": tag} for tag in dict.fromkeys(route.tag for route in routes)],
        "paths": paths,
        "components": {
            "schemas": definitions,
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer", "description": "waydrop token create"}},
        },
    }


def _schemas(routes: Iterable[Route]) -> tuple[dict[_ModelKey, dict[str, Any]], dict[str, Any]]:
    """Return a reference for each model and mode, and the referenced schemas."""
    wanted: dict[_ModelKey, None] = {(Problem, "serialization"): None, **dict.fromkeys(FRAME_MODELS)}
    for route in routes:
        if route.takes_body and JSON in route.body.media:
            wanted[(route.body.model, "validation")] = None
        for answer in route.answers:
            if answer.model is not None:
                wanted[(answer.model, "serialization")] = None
    references, document = models_json_schema(list(wanted), ref_template=_REF)  # type: ignore[arg-type]
    named = {name: _named(name, schema) for name, schema in document.get("$defs", {}).items()}
    return {(model, mode): schema for (model, mode), schema in references.items()}, named


def _named(name: str, schema: dict[str, Any]) -> dict[str, Any]:
    """Use the schema's name as its title: generators name classes by title, and two models may share one."""
    if "$ref" not in schema:
        return {**schema, "title": name}
    return {"allOf": [{"$ref": schema["$ref"]}], "description": schema.get("description", ""), "title": name}


def _operation(route: Route, references: dict[_ModelKey, dict[str, Any]]) -> dict[str, Any]:
    role = "anybody" if route.role is None else f"{route.role.value} or higher"
    operation: dict[str, Any] = {
        "operationId": route.name,
        "summary": route.summary,
        "description": f"Role: {role}.",
        "tags": [route.tag],
        "parameters": [*_path_parameters(route), *_query_parameters(route), *_header_parameters(route)],
        "responses": _responses(route, references),
        "security": [] if route.role is None else [{"token": []}],
    }
    if route.takes_body:
        operation["requestBody"] = _request_body(route.body, references)
    return operation


def _request_body(body: Body[Any], references: dict[_ModelKey, dict[str, Any]]) -> dict[str, Any]:
    schemas = dict.fromkeys(body.media, BINARY_SCHEMA)
    if JSON in schemas:
        schemas[JSON] = references[(body.model, "validation")]
    described: dict[str, Any] = {
        "required": True,
        "content": {media: {"schema": schema} for media, schema in schemas.items()},
    }
    if body.also:
        described["description"] = f"Also accepted with Content-Type {', '.join(body.also)}, if the content matches."
    return described


def _path_parameters(route: Route) -> list[dict[str, Any]]:
    return [
        {"name": name, "in": "path", "required": True, "schema": {"type": "string"}}
        for name in _PATH_NAME.findall(route.path)
    ]


def _query_parameters(route: Route) -> list[dict[str, Any]]:
    model = route.query.model_json_schema()
    properties = _inlined(model.get("properties", {}), model.get("$defs", {}))
    return [
        {
            "name": name,
            "in": "query",
            "required": False,
            "schema": {key: value for key, value in schema.items() if key not in {"title", "description"}},
            **({"description": schema["description"]} if "description" in schema else {}),
        }
        for name, schema in properties.items()
    ]


def _inlined(schema: Any, definitions: dict[str, Any]) -> Any:
    """The schema without references into a document of its own: a parameter has none."""
    if isinstance(schema, list):
        return [_inlined(part, definitions) for part in schema]
    if not isinstance(schema, dict):
        return schema
    if "$ref" in schema:
        return _inlined(definitions[schema["$ref"].rpartition("/")[2]], definitions)
    return {key: _inlined(part, definitions) for key, part in schema.items()}


def _header_parameters(route: Route) -> list[dict[str, Any]]:
    named = []
    if route.is_idempotent:
        named.append(("Idempotency-Key", "Repeat a request with the same key, query and body to execute it only once"))
    if any(answer.status == 304 for answer in route.answers):
        named.append(("If-None-Match", "ETag of the client's copy"))
    return [
        {"name": name, "in": "header", "required": False, "description": text, "schema": {"type": "string"}}
        for name, text in named
    ]


def _responses(route: Route, references: dict[_ModelKey, dict[str, Any]]) -> dict[str, Any]:
    responses: dict[str, Any] = {}
    for answer in route.answers:
        _merge(responses.setdefault(str(answer.status), {}), _good(answer, references))
    by_status: dict[int, list[str]] = {}
    for code in route.problem_codes:
        by_status.setdefault(PROBLEMS[code].status, []).append(code)
    problem = {"schema": references[(Problem, "serialization")]}
    for status, codes in sorted(by_status.items()):
        described = responses.setdefault(str(status), {"description": "", "content": {}})
        text = "; ".join(f"`{code}`: {PROBLEMS[code].title}" for code in codes)
        described["description"] = " / ".join(part for part in (described["description"], text) if part)
        described["content"][CONTENT_TYPE] = problem
        described["x-problem-codes"] = codes
    return responses


def _merge(response: dict[str, Any], further: dict[str, Any]) -> None:
    """A status may have several media types."""
    both = [text for text in (response.get("description"), further["description"]) if text]
    response["description"] = " / ".join(both)
    for part in ("content", "headers"):
        if part in further:
            response[part] = {**response.get(part, {}), **further[part]}


def _good(answer: Answer, references: dict[_ModelKey, dict[str, Any]]) -> dict[str, Any]:
    response: dict[str, Any] = {"description": answer.description, "content": {}}
    schema = references[(answer.model, "serialization")] if answer.model is not None else answer.schema
    if schema is not None:
        response["content"][answer.media] = {"schema": schema}
    if answer.headers:
        response["headers"] = {
            name: {"description": _HEADERS[name], "schema": {"type": "string"}} for name in answer.headers
        }
    return response
