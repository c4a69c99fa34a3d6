"""Reads request bodies, within limits, and query parameters, and validates them."""

from __future__ import annotations

import asyncio
import re
import secrets
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final, Generic, TypeVar

from aiohttp import web
from pydantic import BaseModel, ValidationError

from app.api.problems import ApiError, problem_response
from app.domain.model import FrozenForm
from app.domain.plan import Plan, parse_plan
from app.domain.validation import document_of, findings_of
from app.domain.validation.finding import Finding, Severity, UnfitDocumentError, json_pointer

JSON: Final = "application/json"
BodyT = TypeVar("BodyT")
QueryT = TypeVar("QueryT", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class Body(Generic[BodyT]):
    """A request body: its model, and a function that parses it. `codes` are the problem codes that `parse` may raise.

    `media` lists the accepted content types: the model describes JSON, any other is described as bytes. `also` lists
    content types that are accepted but described in prose only, because code generators support JSON, forms and bytes.
    `max_bytes` overrides the size limit.
    """

    model: type[BaseModel]
    parse: Callable[[bytes], BodyT]
    codes: tuple[str, ...]
    required: bool = True
    media: tuple[str, ...] = (JSON,)
    also: tuple[str, ...] = ()
    max_bytes: int | None = None


# Limits the memory that large bodies take together: many slow uploads must not exhaust it.


SMALL_BYTES: Final = 64 * 1024
"""Smaller bodies are not counted: the limit on connections bounds them."""


class BodyMemory:
    """Reserves memory by Content-Length. A body without one reserves the largest size allowed."""

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes = most_bytes
        self._held_bytes = 0

    @contextmanager
    def held(self, request: web.Request, largest_bytes: int) -> Iterator[None]:
        """Reserve memory for a body of at most `largest_bytes` until the block ends. Raises ApiError (503)."""
        size_bytes = self._size_of(request, largest_bytes)
        if size_bytes and self._held_bytes + size_bytes > self._most_bytes:
            raise ApiError(
                "request.body_memory_full",
                "too many large request bodies are in progress",
                hint="retry in a few seconds",
            )
        self._held_bytes += size_bytes
        try:
            yield
        finally:
            self._held_bytes -= size_bytes

    def _size_of(self, request: web.Request, largest_bytes: int) -> int:
        if not request.can_read_body:
            return 0
        declared_bytes = request.content_length
        size_bytes = largest_bytes if declared_bytes is None else min(declared_bytes, largest_bytes)
        return 0 if size_bytes <= SMALL_BYTES else size_bytes


async def meet_expectation(request: web.Request) -> web.StreamResponse | None:
    """aiohttp calls this before all middlewares. Returning a response ends the request."""
    expected = request.headers.get("Expect", "")
    if expected.strip().lower() != "100-continue":
        error = ApiError("request.expectation", "the only supported expectation is 100-continue")
        return problem_response(error, request_id=secrets.token_hex(8))
    if request.version >= (1, 1):
        await request.writer.write(b"HTTP/1.1 100 Continue\r\n\r\n")
        request.writer.output_size = 0  # so that the final response still gets its headers
    return None


MAX_FIELDS: Final = 100
ModelT = TypeVar("ModelT", bound=BaseModel)


class Empty(FrozenForm):
    """An empty body, or `{}`."""


class BodyInvalidError(UnfitDocumentError, code="request.invalid"):
    """The body is valid JSON but fails validation."""


class BodyMalformedError(UnfitDocumentError, code="request.malformed"):
    """The body is not valid JSON."""


NUL: Final = "\0"
"""PostgreSQL stores none, and no text needs one."""
NUL_IN_JSON: Final = re.compile(rb"(?<!\\)(?:\\\\)*\\u0000")
_NUL_FOUND: Final = Finding(
    code="request.nul",
    severity=Severity.ERROR,
    pointer="",
    message="the body has a NUL character (\\u0000)",
    hint="remove it",
)


def json_body(model: type[ModelT], *, with_plan: bool = False) -> Body[ModelT]:
    """Describe a JSON body of this model. Bodies are small unless they contain a plan.

    pydantic blocks the event loop while it lists every error, so a body that has too many fields for the model is
    rejected before validation.
    """

    def parse(raw: bytes) -> ModelT:
        if len(raw) > SMALL_BYTES:
            _refuse_far_off(raw, with_plan=with_plan)
        if NUL_IN_JSON.search(raw):
            raise BodyInvalidError([_NUL_FOUND])
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
    """Check the request's headers. Raises ApiError if the body is missing, too large or of another content type."""
    if not request.can_read_body:
        if body.required:
            hint = "send a JSON document" if body.media == (JSON,) else "send the file as the request body"
            raise ApiError("request.malformed", "the request body is empty", hint=hint)
        return
    # A web page of another origin can send forms and text/plain without a CORS preflight: never accept these.
    taken = (*body.media, *body.also)
    if request.content_type not in taken:
        raise ApiError(
            "request.content_type",
            f"unsupported content type: {request.headers.get('Content-Type', 'none')}",
            hint=f"send Content-Type: {' or '.join(taken)}",
        )
    if request.headers.get("Content-Encoding", "identity").lower() != "identity":
        raise ApiError(
            "request.content_type",
            "compressed request bodies are not supported",
            hint="send the body without Content-Encoding",
        )
    if request.content_length is not None and request.content_length > most_bytes:
        raise _too_large(most_bytes)


async def read_body(request: web.Request, body: Body[Any], *, timeout_s: float) -> bytes:
    """Read the body. Call check_head first.

    Raises:
        ApiError: the body is incomplete, times out, or exceeds the limit of the service or of the route.
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
        raise ApiError("request.malformed", f"failed to read the request body: {error}") from None
    except TimeoutError:
        raise ApiError("request.timeout", f"the request body was incomplete after {timeout_s:g} s") from None


QUERY_INVALID: Final = "request.query_invalid"


def read_query(request: web.Request, model: type[QueryT]) -> QueryT:
    """Validate the query parameters. Raises ApiError if one is unknown, repeated or invalid."""
    query = request.query
    repeated = sorted({name for name in query if len(query.getall(name)) > 1})
    if repeated:
        raise ApiError(QUERY_INVALID, f"repeated query parameters: {', '.join(repeated)}")
    if with_nul := [name for name, value in query.items() if NUL in value]:
        raise ApiError(QUERY_INVALID, f"NUL character in query parameters: {', '.join(with_nul)}")
    try:
        return model.model_validate(dict(query))
    except ValidationError as error:
        findings = findings_of(error, model, dict(query), code_of="query.{}".format, noun="query parameter")
        known = ", ".join(_names(model)) or "none"
        raise ApiError(
            QUERY_INVALID,
            "; ".join(finding.message for finding in findings),
            hint=f"supported query parameters: {known}",
            findings=[finding.model_dump(mode="json") for finding in findings],
        ) from None


def _names(model: type[BaseModel]) -> list[str]:
    return [field.alias or name for name, field in model.model_fields.items()]


def _too_large(most_bytes: int) -> ApiError:
    return ApiError("request.too_large", f"the request body exceeds the limit of {most_bytes} bytes")


def _refuse_far_off(raw: bytes, *, with_plan: bool) -> None:
    """Parse and validate JSON. Raises ApiError, BodyInvalidError."""
    if not with_plan:
        raise _too_large(SMALL_BYTES)
    document = document_of(raw)
    if not isinstance(document, dict):
        return
    parts = ((json_pointer(name), part) for name, part in document.items() if name != "plan")
    for pointer, part in chain([("", document)], parts):
        if isinstance(part, dict | list) and len(part) > MAX_FIELDS:
            message = f"an object has {len(part)} fields; the limit is {MAX_FIELDS}"
            finding = Finding(code="body.too_long", severity=Severity.ERROR, pointer=pointer, message=message)
            raise BodyInvalidError([finding])


def _unfit(error: ValidationError, model: type[BaseModel], raw: bytes) -> UnfitDocumentError:
    findings = findings_of(error, model, document_of(raw), code_of="body.{}".format)
    is_json = findings[0].code != "body.json_invalid"
    return BodyInvalidError(findings) if is_json else BodyMalformedError(findings)


def json_answer(model: BaseModel, *, status: int = 200, headers: Mapping[str, str] | None = None) -> web.Response:
    body = model.model_dump_json().encode()
    return web.Response(body=body, status=status, content_type="application/json", headers=dict(headers or {}))


def etag_of(value: str) -> str:
    """Return a strong ETag."""
    return f'"{value}"'


def is_unchanged(request: web.Request, etag: str) -> bool:
    """Whether If-None-Match lists this ETag."""
    given = request.headers.getall("If-None-Match", [])
    tags = {tag.strip().removeprefix("W/") for line in given for tag in line.split(",")}
    return etag in tags or "*" in tags


def asked_of(request: web.Request, usual: str, *others: str) -> str:
    """Return the media type that the Accept headers prefer, or `usual` without a preference."""
    return preferred(request.headers.getall("Accept", []), usual, *others)


def preferred(accept: Iterable[str], usual: str, *others: str) -> str:
    """Return the media type with the highest weight, or `usual` if none is listed."""
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
