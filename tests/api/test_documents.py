"""The API describes itself, and cannot describe anything else than what it serves."""

from __future__ import annotations

import json
from typing import Any

import pytest
from jsonschema_rs import Draft202012Validator, meta

from app.api.application import ROUTES
from app.api.problems import PROBLEMS
from app.api.websockets import CloseCode
from tests.support.paths import PLANS
from tests.support.service_in_process import Service

EXAMPLE_PLANS = sorted(PLANS.glob("*.json"))


@pytest.fixture
async def openapi(service: Service) -> dict[str, Any]:
    """The served document."""
    status, _, document = await service.call("GET", "/api/v1/openapi.json")
    assert status == 200
    return dict(document)


async def test_the_openapi_document_is_valid(openapi: dict[str, Any]) -> None:
    from openapi_spec_validator import OpenAPIV31SpecValidator  # imports a second of work: not in every worker

    assert openapi["openapi"].startswith("3.1")
    assert [error.message for error in OpenAPIV31SpecValidator(openapi).iter_errors()] == []


async def test_every_route_that_is_served_is_described_and_the_other_way_round(
    service: Service, openapi: dict[str, Any]
) -> None:
    described = {(method.upper(), path) for path, item in openapi["paths"].items() for method in item}
    served = {
        (route.method, route.resource.canonical)
        for route in service.app.router.routes()
        if route.resource is not None and route.method != "HEAD"
    }
    pages = {"/", "/assets/{name}", "/{name}", "/api/v1/docs", "/api/v1/docs/{name}"}
    sockets = {"/api/v1/stream", "/api/v1/targets/{feed}/reports"}
    assert {path for _, path in served - described} == pages | sockets
    assert described <= served


async def test_operations_have_unique_ids_a_role_and_their_errors(openapi: dict[str, Any]) -> None:
    operations = [operation for item in openapi["paths"].values() for operation in item.values()]
    assert len({operation["operationId"] for operation in operations}) == len(operations) == len(ROUTES)
    for operation in operations:
        assert operation["description"].startswith("Role: ")
        assert "500" in operation["responses"]


GENERATED_BODIES = {"application/json", "application/merge-patch+json", "application/octet-stream"}
GENERATED_ANSWERS = ("application/json", "application/octet-stream", "text/")


async def test_a_client_generator_can_express_every_body_and_answer(openapi: dict[str, Any]) -> None:
    operations = [operation for item in openapi["paths"].values() for operation in item.values()]
    for operation in operations:
        bodies = operation.get("requestBody", {"content": {}})["content"]
        assert set(bodies) <= GENERATED_BODIES, operation["operationId"]
        good = [answer["content"] for status, answer in operation["responses"].items() if status < "300"]
        for content in filter(None, good):
            known = [media for media in content if media.startswith(GENERATED_ANSWERS) or media.endswith("+json")]
            assert known, f"{operation['operationId']} answers {list(content)}"
        for content in (bodies, *good):
            assert all(media.get("schema") for media in content.values()), operation["operationId"]


async def test_a_client_generator_can_name_every_schema(openapi: dict[str, Any]) -> None:
    """openapi-python-client names classes by title: it leaves out doubles, and schemas that are only a reference."""
    schemas = openapi["components"]["schemas"]
    assert {name: schema["title"] for name, schema in schemas.items()} == {name: name for name in schemas}
    assert [name for name, schema in schemas.items() if "$ref" in schema] == []


async def test_the_plan_schema_takes_the_example_plans_and_not_everything(service: Service) -> None:
    status, headers, schema = await service.call("GET", "/api/v1/schemas/plan")
    assert (status, headers["Content-Type"]) == (200, "application/schema+json")
    meta.validate(schema)
    validator = Draft202012Validator(schema)
    plans = EXAMPLE_PLANS
    assert plans
    for path in plans:
        assert validator.is_valid(json.loads(path.read_text(encoding="utf-8"))), path.name
    assert not validator.is_valid({"version": 1, "items": []})


async def test_the_asyncapi_document_names_every_frame_and_every_close_code(service: Service) -> None:
    status, _, document = await service.call("GET", "/api/v1/asyncapi.json")
    assert (status, document["asyncapi"]) == (200, "3.0.0")
    assert set(document["channels"]["stream"]["messages"]) == {"hello", "snapshot", "event", "telemetry"}
    told = {"state", "tasks", "lease_granted", "setpoint_ack", "queued", "done", "error"}
    flown = {"acquire_lease", "renew_lease", "enter", "setpoint", "leave", "hand_over_lease", "release_lease"}
    said = flown | {"task", "queue", "move", "change", "remove", "target"}
    assert set(document["channels"]["offboard"]["messages"]) == told | said
    assert set(document["channels"]["reports"]["messages"]) == {"report", "report_ack", "error"}
    for code in CloseCode:
        assert f"- {int(code)}: " in document["info"]["description"]
    for reference in _references(document):
        _resolve(document, reference)


async def test_the_frames_that_come_are_the_frames_that_are_described(service: Service) -> None:
    _, _, document = await service.call("GET", "/api/v1/asyncapi.json")
    seen: set[str] = set()
    async with service.http.ws_connect(f"{service.url}/api/v1/stream?after=0") as socket:
        while seen != {"hello", "snapshot", "event", "telemetry"}:
            frame = await socket.receive_json(timeout=60)
            payload = document["components"]["messages"][frame["type"]]["payload"]
            schema = {**payload, "components": document["components"]}
            assert [error.message for error in Draft202012Validator(schema).iter_errors(frame)] == []
            seen.add(frame["type"])


async def test_every_problem_type_leads_to_the_list_of_codes(service: Service) -> None:
    _, _, problem = await service.call("GET", "/nothing")
    path, _, code = problem["type"].partition("#")
    status, _, body = await service.call("GET", path)
    assert status == 200
    assert {entry["code"] for entry in body["problems"]} == set(PROBLEMS)
    assert code in PROBLEMS


def _references(node: Any) -> list[str]:
    if isinstance(node, dict):
        own = [node["$ref"]] if isinstance(node.get("$ref"), str) else []
        return own + [reference for value in node.values() for reference in _references(value)]
    return [reference for value in node for reference in _references(value)] if isinstance(node, list) else []


def _resolve(document: dict[str, Any], reference: str) -> None:
    node: Any = document
    for part in reference.removeprefix("#/").split("/"):
        node = node[part]
