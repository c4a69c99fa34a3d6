"""Reading what a request carries: a JSON body within bounds, and query parameters, each into its model."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import chain
from typing import Any, Final, TypeVar

from aiohttp import web
from pydantic import BaseModel, ConfigDict, ValidationError

from app.api.problems import ApiError, problem_response
from app.api.routing import Body, QueryT
from app.domain.plan import Plan, parse_plan
from app.domain.validation import document_of, findings_of
from app.domain.validation.finding import Finding, Severity, UnfitDocumentError, json_pointer

# The memory that large bodies take together, from head to answer: many slow uploads must not take all of it.


SMALL_BYTES: Final = 64 * 1024
"""So large a body needs no room: the number of connections bounds these."""


class BodyRoom:
    """Room is held by what a body says of its size; one that says nothing may be as large as any."""

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes = most_bytes
        self._held_bytes = 0

    @contextmanager
    def held(self, request: web.Request, largest_bytes: int) -> Iterator[None]:
        """Hold room for a body of at most `largest_bytes` until the block ends. Raises ApiError (503)."""
        size_bytes = self._size_of(request, largest_bytes)
        if size_bytes and self._held_bytes + size_bytes > self._most_bytes:
            raise ApiError(
                "request.body_memory_full", "too many large bodies are being sent", hint="send it again in a moment"
            )
        self._held_bytes += size_bytes
        try:
            yield
        finally:
            self._held_bytes -= size_bytes

    def _size_of(self, request: web.Request, largest_bytes: int) -> int:
        if not request.can_read_body:
            return 0
        told = request.content_length
        size_bytes = largest_bytes if told is None else min(told, largest_bytes)
        return 0 if size_bytes <= SMALL_BYTES else size_bytes


# The Expect header: `100-continue` is met, anything else refused.


async def meet_expectation(request: web.Request) -> web.StreamResponse | None:
    """aiohttp calls this before all middlewares. An answer ends the request."""
    expected = request.headers.get("Expect", "")
    if expected.strip().lower() != "100-continue":
        error = ApiError("request.expectation", "only Expect: 100-continue is understood")
        return problem_response(error, request_id=secrets.token_hex(8))
    if request.version >= (1, 1):
        await request.writer.write(b"HTTP/1.1 100 Continue\r\n\r\n")
        request.writer.output_size = 0  # so that the answer proper still gets its headers
    return None


MAX_FIELDS: Final = 100
ModelT = TypeVar("ModelT", bound=BaseModel)


class Empty(BaseModel):
    """No body, or `{}`."""

    model_config = ConfigDict(extra="forbid")


class BodyInvalidError(UnfitDocumentError):
    """The body is JSON, and not what the request takes."""

    code = "request.invalid"


class BodyMalformedError(UnfitDocumentError):
    """The body is no JSON."""

    code = "request.malformed"


def json_body(model: type[ModelT], *, with_plan: bool = False) -> Body[ModelT]:
    """A body that is one JSON object of this model: a small one, except with a plan in it.

    Everything waits while pydantic names each of many faults, so a body with room for many is refused before.
    """

    def parse(raw: bytes) -> ModelT:
        if len(raw) > SMALL_BYTES:
            _refuse_far_off(raw, with_plan=with_plan)
        try:
            return model.model_validate_json(raw)
        except ValidationError as error:
            raise _unfit(error, model, raw) from None

    return Body(model=model, parse=parse, codes=(BodyMalformedError.code, BodyInvalidError.code))


PLAN_BODY: Final = Body(model=Plan, parse=parse_plan, codes=("request.malformed", "plan.invalid"))


def _nothing(raw: bytes) -> Empty:
    return _EMPTY.parse(raw) if raw else Empty()


_EMPTY = json_body(Empty)
NO_BODY: Final = Body(model=Empty, parse=_nothing, codes=_EMPTY.codes, required=False)


def check_head(request: web.Request, body: Body[Any], *, most_bytes: int) -> None:
    """Raises ApiError for what the head tells: the body is missing, of another content type, or too large."""
    if not request.can_read_body:
        if body.required:
            raise ApiError("request.malformed", "the body is empty", hint="send a document")
        return
    # Forms and text/plain are what a foreign web page can send without asking first: never taken.
    taken = (*body.media, *body.also)
    if request.content_type not in taken:
        raise ApiError(
            "request.content_type",
            f"the content type is {request.headers.get('Content-Type', 'missing')}",
            hint=f"send Content-Type: {' or '.join(taken)}",
        )
    if request.headers.get("Content-Encoding", "identity").lower() != "identity":
        raise ApiError(
            "request.content_type", "compressed bodies are not taken", hint="send it without Content-Encoding"
        )
    if request.content_length is not None and request.content_length > most_bytes:
        raise _too_large(most_bytes)


async def read_body(request: web.Request, body: Body[Any], *, timeout_s: float) -> bytes:
    """The body's bytes; see check_head first.

    Raises:
        ApiError: it breaks off, does not come in time, or is larger than the service's bound, or the body's own.
    """
    if not request.can_read_body:
        return b""
    try:
        async with asyncio.timeout(timeout_s):
            if body.max_bytes is not None:
                request = request.clone(client_max_size=body.max_bytes)
            return await request.read()
    except web.HTTPRequestEntityTooLarge:
        raise _too_large(request.client_max_size) from None
    except web.RequestPayloadError as error:
        raise ApiError("request.malformed", f"the body cannot be read: {error}") from None
    except TimeoutError:
        raise ApiError("request.timeout", f"the body was not complete after {timeout_s:g} s") from None


def read_query(request: web.Request, model: type[QueryT]) -> QueryT:
    """The query parameters. Raises ApiError for unknown, repeated or unusable ones."""
    query = request.query
    repeated = sorted({name for name in query if len(query.getall(name)) > 1})
    if repeated:
        raise ApiError("request.query_invalid", f"given more than once: {', '.join(repeated)}")
    try:
        return model.model_validate(dict(query))
    except ValidationError as error:
        findings = findings_of(error, model, dict(query), code_of="query.{}".format, noun="query parameter")
        known = ", ".join(_names(model)) or "none"
        raise ApiError(
            "request.query_invalid",
            "; ".join(finding.message for finding in findings),
            hint=f"query parameters here: {known}",
            findings=[finding.model_dump(mode="json") for finding in findings],
        ) from None


def _names(model: type[BaseModel]) -> list[str]:
    return [field.alias or name for name, field in model.model_fields.items()]


def _too_large(most_bytes: int) -> ApiError:
    return ApiError("request.too_large", f"the body has more than {most_bytes} bytes, the most that is taken here")


def _refuse_far_off(raw: bytes, *, with_plan: bool) -> None:
    """Raises ApiError, BodyInvalidError."""
    if not with_plan:
        raise _too_large(SMALL_BYTES)
    document = document_of(raw)
    if not isinstance(document, dict):
        return
    parts = ((json_pointer(name), part) for name, part in document.items() if name != "plan")
    for pointer, part in chain([("", document)], parts):
        if isinstance(part, dict | list) and len(part) > MAX_FIELDS:
            message = f"{len(part)} fields, and nothing that can be sent here has more than {MAX_FIELDS}"
            finding = Finding(code="body.too_long", severity=Severity.ERROR, pointer=pointer, message=message)
            raise BodyInvalidError([finding])


def _unfit(error: ValidationError, model: type[BaseModel], raw: bytes) -> UnfitDocumentError:
    findings = findings_of(error, model, document_of(raw), code_of="body.{}".format)
    is_json = findings[0].code != "body.json_invalid"
    return BodyInvalidError(findings) if is_json else BodyMalformedError(findings)


# Making JSON answers.


def json_answer(model: BaseModel, *, status: int = 200, headers: Mapping[str, str] | None = None) -> web.Response:
    """A model as the answer's body."""
    body = model.model_dump_json().encode()
    return web.Response(body=body, status=status, content_type="application/json", headers=dict(headers or {}))


def etag_of(value: str) -> str:
    """A strong ETag."""
    return f'"{value}"'


def is_unchanged(request: web.Request, etag: str) -> bool:
    """Whether the client already has this (If-None-Match)."""
    given = request.headers.getall("If-None-Match", [])
    tags = {tag.strip().removeprefix("W/") for line in given for tag in line.split(",")}
    return etag in tags or "*" in tags


def asked_of(request: web.Request, usual: str, *others: str) -> str:
    """The media type that the Accept headers prefer; `usual` is what everybody gets who does not say."""
    return preferred(request.headers.getall("Accept", []), usual, *others)


def preferred(accept: Iterable[str], usual: str, *others: str) -> str:
    """The one of these media types that is named with the highest weight, `usual` if none is."""
    weights = dict.fromkeys((usual, *others), 0.0)
    for part in ",".join(accept).split(","):
        name, *parameters = (piece.strip().lower() for piece in part.split(";"))
        weight = next((_weight(one[2:]) for one in parameters if one.startswith("q=")), 1.0)
        if name in weights:
            weights[name] = max(weights[name], weight)
    return max(weights, key=weights.__getitem__)


def _weight(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
