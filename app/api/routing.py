"""A route: one row of data that defines both the served route and its OpenAPI description."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Any, Final, Generic, Literal, TypeVar

from aiohttp import web
from pydantic import BaseModel, ConfigDict

from app.api.bodies import NO_BODY, Body, BodyT
from app.services.access import Principal, Role

API: Final = "/api/v1"
OFFBOARD_PATH: Final = f"{API}/vehicles/{{vehicle_id}}/offboard"
TARGET_REPORTS_PATH: Final = f"{API}/targets/{{feed}}/reports"
BINARY: Final = "application/octet-stream"
BINARY_SCHEMA: Final[dict[str, Any]] = {"type": "string", "format": "binary"}
PROBED: Final = frozenset({"/healthz", "/readyz"})
"""Probes request these under an IP address as Host. Their responses are harmless to disclose."""

QueryT = TypeVar("QueryT", bound=BaseModel)


class NoQuery(BaseModel):
    """No query parameters. An unknown parameter is an error, not ignored."""

    model_config = ConfigDict(extra="forbid")


@dataclass(frozen=True, slots=True)
class Answer:
    """A successful response. `model` is None for an empty body and for media types other than JSON."""

    status: int
    description: str
    model: type[BaseModel] | None = None
    media: str = "application/json"
    headers: tuple[str, ...] = ()
    schema: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Call(Generic[QueryT, BodyT]):
    """A validated request: principal, query and body."""

    request: web.Request
    principal: Principal
    query: QueryT
    body: BodyT

    def path_value(self, name: str) -> str:
        """A path parameter."""
        return self.request.match_info[name]


@dataclass(frozen=True, slots=True, kw_only=True)
class Route(Generic[QueryT, BodyT]):
    """A route. `role` None: no authentication. `errors` lists problem codes specific to this route.

    `query` and `body` are empty unless given. `idempotent`: accepts Idempotency-Key. `before_body` may raise to reject
    a request by its path, before a large body is read. `is_audited` false: a check, a measurement or a renewal, which
    the audit does not record.
    """

    method: Literal["GET", "POST", "PUT", "PATCH", "DELETE"]
    path: str
    handler: Callable[[Call[QueryT, BodyT]], Awaitable[web.StreamResponse]]
    summary: str
    role: Role | None
    answers: tuple[Answer, ...]
    query: type[QueryT] = NoQuery  # type: ignore[assignment]
    body: Body[BodyT] = NO_BODY  # type: ignore[assignment]
    tag: str = ""
    errors: tuple[str, ...] = ()
    idempotent: bool = False
    is_audited: bool = True
    before_body: Callable[[web.Request], Awaitable[None]] | None = None

    @property
    def name(self) -> str:
        """The operationId."""
        return self.handler.__name__

    @property
    def is_action(self) -> bool:
        """Whether it changes something on behalf of a user, and is recorded for the audit."""
        return self.method != "GET" and self.is_audited

    @property
    def takes_body(self) -> bool:
        """Whether the route requires a body."""
        return self.body.required

    @property
    def problem_codes(self) -> tuple[str, ...]:
        """All problem codes of this route, except those that any path may return."""
        codes = [*self.errors, "request.query_invalid", "request.expectation", "service.internal_error"]
        if self.path not in PROBED:
            codes.append("host.not_allowed")
        if self.role is not None:
            codes += ["auth.required", "auth.invalid", "auth.too_many_attempts"]
            codes += ["cluster.bus_down", "gateway.unreachable", "gateway.no_reply"]
            codes += ["role.insufficient"] if self.role is not Role.VIEWER else []
        if self.method != "GET":
            codes += ["origin.not_allowed", "request.content_type", "request.too_large", "request.timeout"]
            codes.append("request.body_memory_full")
            codes += self.body.codes
        if self.idempotent:
            codes += ["idempotency.key_invalid", "idempotency.key_reused", "idempotency.outcome_unknown"]
        return tuple(dict.fromkeys(codes))


AnyRoute = Route[Any, Any]
AnyCall = Call[Any, Any]


def tagged(tag: str, *routes: AnyRoute) -> tuple[AnyRoute, ...]:
    """The routes of one part of the API."""
    return tuple(replace(route, tag=tag) for route in routes)
