"""Whatever is sent, the answer says what is wrong in words of the document, and points into it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from app.api.application import ROUTES
from app.api.offboard.frames import ClientDocument
from app.api.target_reports import ReportFrame
from app.api.websockets import unreadable
from app.domain.validation import document_of, findings_of
from app.domain.validation.finding import Finding
from tests.support.service_in_process import Service

BODIES = sorted(
    {route.body.model for route in ROUTES} | {ClientDocument, ReportFrame}, key=lambda model: model.__name__
)
QUERIES = sorted({route.query for route in ROUTES}, key=lambda model: model.__name__)
SCHEMAS = {model: model.model_json_schema() for model in (*BODIES, *QUERIES)}
LIVELY = settings(max_examples=200, suppress_health_check=list(HealthCheck), deadline=None)
OURS = {name for model, schema in SCHEMAS.items() for name in (model.__name__, *schema.get("$defs", {}))}
NOT_FOR_PEOPLE = re.compile(
    rf"\b({'|'.join(OURS)}|Input|valid|tags?|discriminator|dict|class)\b|Extra inputs|Field required"
)

numbers = st.sampled_from([0, -1, 1, 0.5, 91, 1e9, 10**30, 1e300, float("nan"), float("inf")])
scrap = st.recursive(
    st.none() | st.booleans() | numbers | st.sampled_from(["", "nix", "2026-01-01", "x" * 2500, "\0"]),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from(["x", "type", "goto", "a/b~"]), inner),
    max_leaves=4,
)


@st.composite
def near(draw: st.DrawFn, schema: Mapping[str, Any], definitions: Mapping[str, Any]) -> Any:
    """Nearly what the schema wants: now and then a field is missing, is another thing, or is one too many."""
    if draw(st.integers(0, 9)) == 0:
        return draw(scrap)
    branches = schema.get("anyOf") or schema.get("oneOf")
    if branches:
        return draw(near(draw(st.sampled_from(branches)), definitions))
    if "$ref" in schema:
        return draw(near(definitions[schema["$ref"].rpartition("/")[2]], definitions))
    if "properties" in schema:
        names = [name for name in schema["properties"] if draw(st.integers(0, 5)) > 0]
        more = draw(st.sampled_from([[], [], ["nix"], [f"{name}s" for name in names[:1]]]))
        return {name: draw(near(schema["properties"].get(name, {}), definitions)) for name in (*names, *more)}
    if schema.get("type") == "array":
        inner = schema.get("items") or {"anyOf": schema.get("prefixItems", [{}])}
        return [draw(near(inner, definitions)) for _ in range(draw(st.integers(0, 3)))]
    if "const" in schema or "enum" in schema:
        return draw(st.sampled_from(schema.get("enum") or [schema["const"]]))
    return draw(st.sampled_from([1, 47.5, "v1", True])) if schema.get("type") else draw(scrap)


def leads_there(finding: Finding, document: Any, *, missing: bool) -> bool:
    parts = [part.replace("~1", "/").replace("~0", "~") for part in finding.pointer.split("/")[1:]]
    for part in parts[:-1] if missing else parts:
        document = document[int(part)] if isinstance(document, list) else document[part]
    return isinstance(document, dict | list) or not missing


def refusal(validate: Callable[[Any], object], value: Any) -> ValidationError | None:
    try:
        validate(value)
    except ValidationError as error:
        return error
    return None


def assert_in_plain_words(findings: list[Finding], document: Any) -> None:
    assert findings
    for finding in findings:
        assert leads_there(finding, document, missing=finding.code.endswith(".missing"))
        found = NOT_FOR_PEOPLE.search(f"{finding.message} {finding.hint}")
        assert found is None, finding


@LIVELY
@given(data=st.data(), model=st.sampled_from(BODIES))
def test_no_body_gets_an_answer_with_our_own_names_or_a_place_that_is_not_in_it(
    data: st.DataObject, model: type[BaseModel]
) -> None:
    text = json.dumps(data.draw(near(SCHEMAS[model], SCHEMAS[model].get("$defs", {}))))
    error = refusal(model.model_validate_json, text)
    assume(error is not None)
    assert error is not None
    document = document_of(text)
    assert_in_plain_words(findings_of(error, model, document, code_of="body.{}".format), document)
    assert unreadable(text, model, error).detail


@LIVELY
@given(data=st.data(), model=st.sampled_from(QUERIES))
def test_no_query_gets_an_answer_with_our_own_names(data: st.DataObject, model: type[BaseModel]) -> None:
    names = [*SCHEMAS[model].get("properties", {}), "nix"]
    values = st.sampled_from(
        ["", "nix", "-1", "1", "1e9", "true", "2026", "2026-01-01", "queued,flying", "qgc", "é" * 300]
    )
    query = data.draw(st.dictionaries(st.sampled_from(names), values))
    error = refusal(model.model_validate, query)
    assume(error is not None)
    assert error is not None
    assert_in_plain_words(findings_of(error, model, query, code_of="query.{}".format), query)


@pytest.mark.parametrize(
    ("path", "detail", "hint"),
    [
        (
            "runs?state=nix",
            "unknown state 'nix'; known states: created, uploading, ",
            "supported query parameters: limit, ",
        ),
        ("jobs?state=queued,nix", "unknown state 'nix'; known states: queued, ", "supported query parameters: limit, "),
        ("plans?limit=many", "'limit' must be an integer, not 'many'", "supported query parameters: limit"),
        ("plans?limit=501", "'limit' must be at most 500, not 501", "supported query parameters: limit"),
        ("plans?limt=5", "unknown query parameter 'limt'", "supported query parameters: limit"),
        (
            "vehicles?nix=1&nox=2",
            "unknown query parameter 'nix'; unknown query parameter 'nox'",
            "supported query parameters: none",
        ),
        ("runs?open=perhaps", "'open' must be true or false, not 'perhaps'", "supported query parameters: limit, "),
    ],
)
async def test_a_query_is_refused_in_plain_words(service: Service, path: str, detail: str, hint: str) -> None:
    status, _, problem = await service.call("GET", f"/api/v1/{path}")
    assert (status, problem["code"]) == (400, "request.query_invalid")
    assert problem["detail"].startswith(detail)
    assert problem["hint"].startswith(hint)


async def test_a_body_is_refused_in_plain_words_with_a_hint(service: Service) -> None:
    asked = {"lease": "x", "task": {"type": "circle", "centre": {"latitude_deg": 47}, "radius_m": 9}}
    status, _, problem = await service.call("POST", "/api/v1/vehicles/v1/tasks", json=asked)
    assert (status, problem["code"]) == (422, "request.invalid")
    assert problem["detail"] == "the field 'center' is missing (at /task/center)"
    assert [(one["pointer"], one["message"], one["hint"]) for one in problem["findings"]] == [
        ("/task/center", "the field 'center' is missing", ""),
        ("/task/centre", "unknown field 'centre'", "did you mean 'center'?"),
    ]


async def test_a_frame_is_refused_in_plain_words_with_a_hint(service: Service) -> None:
    async with service.http.ws_connect(f"{service.url}/api/v1/vehicles/v1/offboard") as socket:
        await socket.send_json({"type": "setpoint", "setpoint": {"type": "velocity_nde"}, "id": 4})
        async for message in socket:
            if (answer := message.json())["type"] == "error":
                break
    assert (answer["id"], answer["code"], answer["hint"]) == (4, "request.invalid", "did you mean 'velocity_ned'?")
    assert answer["detail"].startswith("unknown type 'velocity_nde'; known values: acceleration_body, ")
    assert answer["detail"].endswith(" (at /setpoint)")
