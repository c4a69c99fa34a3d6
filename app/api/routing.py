"""A route: what its handler declares defines both the served route and its OpenAPI description."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Final, Generic, Literal, TypeVar, get_args, get_type_hints

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import NO_BODY, Body, BodyT, Empty, json_body
from app.api.idempotency import KeyedRequest
from app.api.services import SERVICES, ApiServices
from app.domain.model import FrozenForm
from app.domain.ports.stores import AnswerTo
from app.services.access import Principal, Role

API: Final = "/api/v1"
OFFBOARD_PATH: Final = f"{API}/vehicles/{{vehicle_id}}/offboard"
TARGET_REPORTS_PATH: Final = f"{API}/targets/{{feed}}/reports"
BINARY: Final = "application/octet-stream"
BINARY_SCHEMA: Final[dict[str, Any]] = {"type": "string", "format": "binary"}
PROBED: Final = frozenset({"/healthz", "/readyz"})
"""Probes request these under an IP address as Host. Their responses are harmless to disclose."""

STORED: Final = ("resource.not_found", "storage.failed")
"""Problem codes of what is read or changed by its ID."""

NEW_WORK: Final = ("cluster.site_taken", "cluster.site_undecided")
"""Problem codes of what begins something at a gateway of a cluster."""

VEHICLE: Final = ("vehicle.quarantined", "vehicle.refused", "vehicle.link", "vehicle.timeout")
"""Problem codes of what is asked of a vehicle over its link."""

QueryT = TypeVar("QueryT", bound=BaseModel)
MadeT = TypeVar("MadeT")


class NoQuery(FrozenForm):
    """No query parameters. An unknown parameter is an error, not ignored."""


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
    """A validated request: principal, query and body. `keyed`: it has an Idempotency-Key."""

    request: web.Request
    principal: Principal
    query: QueryT
    body: BodyT
    keyed: KeyedRequest | None = None

    def path_value(self, name: str) -> str:
        return self.request.match_info[name]

    @property
    def services(self) -> ApiServices:
        return self.request.app[SERVICES]

    def answered(self, respond: Callable[[MadeT], web.Response]) -> AnswerTo[MadeT] | None:
        """For the service that stores what is made: it stores the answer in the same commit. None without a key."""
        keyed = self.keyed
        return None if keyed is None else lambda made: keyed.commit(respond(made))


AnyCall = Call[Any, Any]
Method = Literal["GET", "POST", "PUT", "PATCH", "DELETE"]
HandlerT = TypeVar("HandlerT", bound=Callable[[Any], Awaitable[web.StreamResponse]])


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """A route. `role` None: no authentication. `errors` lists problem codes specific to this route.

    `unkeyed` says why an action takes no Idempotency-Key. `is_urgent`: it brings a vehicle to safety, or a drop waits
    for it, and doing it twice does no harm: the key holds it back for a moment at most. `before_body` may raise to
    reject a request by its path, before a large body is read. `is_audited` false: a check, a measurement or a renewal,
    which the audit does not record.
    """

    method: Method
    path: str
    handler: Callable[[AnyCall], Awaitable[web.StreamResponse]]
    summary: str
    role: Role | None
    answers: tuple[Answer, ...]
    query: type[BaseModel]
    body: Body[Any]
    tag: str
    errors: tuple[str, ...]
    unkeyed: str
    is_urgent: bool
    is_audited: bool
    before_body: Callable[[web.Request], Awaitable[None]] | None

    @property
    def name(self) -> str:
        """The operationId."""
        return self.handler.__name__

    @property
    def is_action(self) -> bool:
        """Whether it changes something on behalf of a user, and is recorded for the audit."""
        return self.method != "GET" and self.is_audited

    @property
    def is_idempotent(self) -> bool:
        """Whether it honours Idempotency-Key. Without one a repeated resume moves a vehicle that was paused since."""
        return self.method == "POST" and self.is_audited and not self.unkeyed

    @property
    def takes_body(self) -> bool:
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
        if self.is_idempotent:
            codes += ["idempotency.key_invalid", "idempotency.key_reused", "idempotency.outcome_unknown"]
        return tuple(dict.fromkeys(codes))


class Routes(list[Route]):
    """The routes of one part of the API."""

    def __init__(self, tag: str, *, prefix: str = API) -> None:
        super().__init__()
        self._tag = tag
        self._prefix = prefix

    def route(
        self,
        method: Method,
        path: str,
        role: Role | None,
        *answers: Answer,
        body: Body[Any] | None = None,
        errors: tuple[str, ...] = (),
        unkeyed: str = "",
        is_urgent: bool = False,
        is_audited: bool = True,
        before_body: Callable[[web.Request], Awaitable[None]] | None = None,
    ) -> Callable[[HandlerT], HandlerT]:
        """Declare the decorated handler as a route; see Route.

        The first line of its docstring is the summary. Its annotation `Call[Query, Body]` names the models of the query
        and of the JSON body; `body` describes any other body.
        """

        def declare(handler: HandlerT) -> HandlerT:
            query, model = get_args(next(iter(get_type_hints(handler).values())))
            self.append(
                Route(
                    method=method,
                    path=self._prefix + path,
                    handler=handler,
                    summary=(handler.__doc__ or "").partition("\n")[0].removesuffix("."),
                    role=role,
                    answers=answers,
                    query=query,
                    body=body or (NO_BODY if model is Empty else json_body(model)),
                    tag=self._tag,
                    errors=errors,
                    unkeyed=unkeyed,
                    is_urgent=is_urgent,
                    is_audited=is_audited,
                    before_body=before_body,
                )
            )
            return handler

        return declare
