"""/runs/{run_id}/drops/{item_id}/attachments: photos, signatures and documents of a drop."""

from __future__ import annotations

import re
from typing import Annotated, Final
from urllib.parse import quote

from aiohttp import web
from pydantic import BaseModel, Field

from app.api.bodies import Body, Empty, asked_of, json_answer
from app.api.routing import BINARY, BINARY_SCHEMA, STORED, Answer, Call, NoQuery, Routes
from app.api.services import SERVICES
from app.domain.model import FrozenForm
from app.domain.run.attachment import MAX_NAME_CHARS, SIGNATURES, Attachment, with_ending
from app.services.access import Role

ROUTES: Final = Routes("runs")

MAX_BYTES: Final = 8 * 1024 * 1024


class AttachmentQuery(FrozenForm):
    """Query parameters of an upload."""

    name: Annotated[str, Field(max_length=MAX_NAME_CHARS, description="file name to display")] = "attachment"


class AttachmentsView(BaseModel):
    """The attachments of a drop, in order of upload."""

    attachments: list[Attachment]


FILE_BODY: Final = Body(
    model=Empty,
    parse=lambda raw: raw,
    codes=("request.malformed",),
    media=(BINARY,),
    also=tuple(SIGNATURES),
    max_bytes=MAX_BYTES,
)


async def find_drop(request: web.Request) -> None:
    """Check that the drop exists before reading the body. Raises NotFoundError, StorageError."""
    await request.app[SERVICES].attachments.find_drop(request.match_info["run_id"], request.match_info["item_id"])


@ROUTES.route(
    "POST",
    "/runs/{run_id}/drops/{item_id}/attachments",
    Role.DISPATCHER,
    Answer(201, "The attachment was created", Attachment, headers=("Location",)),
    Answer(200, "The same file was attached before", Attachment, headers=("Location",)),
    body=FILE_BODY,
    errors=(*STORED, "state.conflict", "input.invalid", "attachment.quota_exceeded"),
    before_body=find_drop,
)
async def add_attachment(call: Call[AttachmentQuery, bytes]) -> web.Response:
    """Attach a photo, signature or document to a drop; the request body is the file, at most 8 MiB."""
    attachment, is_new = await call.services.attachments.add(
        call.path_value("run_id"),
        call.path_value("item_id"),
        name=call.query.name,
        media_type=None if call.request.content_type == BINARY else call.request.content_type,
        content=call.body,
        actor=call.principal.name,
    )
    location = f"{call.request.path}/{attachment.sha256}"
    return json_answer(attachment, status=201 if is_new else 200, headers={"Location": location})


@ROUTES.route(
    "GET",
    "/runs/{run_id}/drops/{item_id}/attachments",
    Role.VIEWER,
    Answer(200, "The attachments", AttachmentsView),
    errors=STORED,
)
async def list_attachments(call: Call[NoQuery, Empty]) -> web.Response:
    """List the attachments of a drop."""
    found = await call.services.attachments.of_drop(call.path_value("run_id"), call.path_value("item_id"))
    return json_answer(AttachmentsView(attachments=list(found)))


@ROUTES.route(
    "GET",
    "/runs/{run_id}/drops/{item_id}/attachments/{sha256}",
    Role.VIEWER,
    *(
        Answer(200, text, media=media, schema=BINARY_SCHEMA, headers=("Content-Disposition",))
        for media, text in (
            *((media, "") for media in SIGNATURES),
            (BINARY, "The file, in its own media type or as application/octet-stream"),
        )
    ),
    errors=(*STORED, "attachment.expired", "attachment.altered"),
)
async def get_attachment(call: Call[NoQuery, Empty]) -> web.Response:
    """Download an attachment; fails if the stored file has been altered."""
    names = (call.path_value(name) for name in ("run_id", "item_id", "sha256"))
    attachment, content = await call.services.attachments.get(*names)
    name = with_ending(attachment.name, attachment.media_type)  # files of earlier versions may have any
    headers = {"Content-Disposition": _disposition(name), "Vary": "Accept"}
    media = asked_of(call.request, attachment.media_type, BINARY)
    return web.Response(body=content, content_type=media, headers=headers)


def _disposition(name: str) -> str:
    """Always download, never display inline: the file comes from an untrusted source."""
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", name)
    return f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(name, safe='')}"
