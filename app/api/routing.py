"""What a route is: one row of data from which the server's route and its OpenAPI description are both made."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Final, Generic, Literal, TypeVar

from aiohttp import web
from pydantic import BaseModel, ConfigDict

from app.services.access import Principal, Role

API: Final = "/api/v1"
OFFBOARD_PATH: Final = f"{API}/vehicles/{{vehicle_id}}/offboard"
TARGET_REPORTS_PATH: Final = f"{API}/targets/{{feed}}/reports"
JSON: Final = "application/json"
BINARY: Final = "application/octet-stream"
BINARY_SCHEMA: Final[dict[str, Any]] = {"type": "string", "format": "binary"}
PROBED: Final = frozenset({"/healthz", "/readyz"})
"""Asked by probes under an address as Host; they say nothing that a foreign page could use."""

QueryT = TypeVar("QueryT", bound=BaseModel)
BodyT = TypeVar("BodyT")


class NoQuery(BaseModel):
    """No query parameter is taken; a misspelt one is an error and not silently ignored."""

    model_config = ConfigDict(extra="forbid")


@dataclass(frozen=True, slots=True)
class Body(Generic[BodyT]):
    """A body: its model for the description, and how bytes become it. `codes` are what `parse` may answer.

    `media` are the content types that are taken and described; the model describes the JSON one, any other is plain
    bytes. `also` are taken too and named in words: code generators know no content type but JSON, forms and bytes.
    `max_bytes`: a bound of its own.
    """

    model: type[BaseModel]
    parse: Callable[[bytes], BodyT]
    codes: tuple[str, ...]
    required: bool = True
    media: tuple[str, ...] = (JSON,)
    also: tuple[str, ...] = ()
    max_bytes: int | None = None


@dataclass(frozen=True, slots=True)
class Answer:
    """One good answer. `model` is None for an empty body or for another `media` type than JSON."""

    status: int
    description: str
    model: type[BaseModel] | None = None
    media: str = "application/json"
    headers: tuple[str, ...] = ()
    schema: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Call(Generic[QueryT, BodyT]):
    """One checked request: who asks, and the query and body as the route's models have read them."""

    request: web.Request
    principal: Principal
    query: QueryT
    body: BodyT

    def path_value(self, name: str) -> str:
        """A variable part of the path."""
        return self.request.match_info[name]


@dataclass(frozen=True, slots=True, kw_only=True)
class Route(Generic[QueryT, BodyT]):
    """One row. `role` None: anybody may. `errors` are the codes of this route's own; the common ones are added.

    `idempotent`: an Idempotency-Key makes a repetition answer as the first time did. `before_body` refuses, by raising,
    what the path alone forbids, before a large body is taken.
    """

    method: Literal["GET", "POST", "PUT", "PATCH", "DELETE"]
    path: str
    handler: Callable[[Call[QueryT, BodyT]], Awaitable[web.StreamResponse]]
    summary: str
    tag: str
    role: Role | None
    query: type[QueryT]
    body: Body[BodyT]
    answers: tuple[Answer, ...]
    errors: tuple[str, ...] = ()
    idempotent: bool = False
    before_body: Callable[[web.Request], Awaitable[None]] | None = None

    @property
    def name(self) -> str:
        """The operation's id."""
        return self.handler.__name__

    @property
    def takes_body(self) -> bool:
        """Whether a body is expected."""
        return self.body.required

    @property
    def problem_codes(self) -> tuple[str, ...]:
        """Every code that this route may answer, without those that any path may."""
        codes = [*self.errors, "request.query_invalid", "request.expectation", "service.internal_error"]
        if self.path not in PROBED:
            codes.append("host.not_allowed")
        if self.role is not None:
            codes += ["auth.required", "auth.invalid"]
            codes += ["role.insufficient"] if self.role is not Role.VIEWER else []
        if self.method != "GET":
            codes += ["origin.not_allowed", "request.content_type", "request.too_large", "request.timeout"]
            codes.append("request.body_memory_full")
            codes += self.body.codes
        if self.idempotent:
            codes += ["idempotency.key_invalid", "idempotency.key_reused"]
        return tuple(dict.fromkeys(codes))


AnyRoute = Route[Any, Any]
