"""A drop's attachments on the sheet: small pictures are in it, of all others it has name and hash."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping

from app.api.proof_sheet.words import shown_time, typed
from app.domain.proof import AttachmentProof


def attached(attachments: Iterable[AttachmentProof], plan_item_id: str, pictures: Mapping[str, bytes]) -> str:
    """The attachments of one drop; empty without any."""
    shown = [_one(one, pictures.get(one.sha256)) for one in attachments if one.plan_item_id == plan_item_id]
    return f"<h3>Attached</h3>{''.join(shown)}" if shown else ""


def _one(attachment: AttachmentProof, picture: bytes | None) -> str:
    size = f"{attachment.size_bytes / 1000:.1f} kB"
    when = f"{shown_time(attachment.at)} by {typed(attachment.by)}"
    warning = (
        "" if attachment.is_as_attached else "<br><b>WARNING: the stored file is not the one that was attached</b>"
    )
    text = f"{typed(attachment.name)}, {typed(attachment.media_type)}, {size}, {when}"
    text += f"<br><code>SHA-256 {typed(attachment.sha256)}</code>"
    image = "" if picture is None else _image(attachment.media_type, picture)
    return f'<figure class="attached">{image}<figcaption>{text}{warning}</figcaption></figure>'


def _image(media_type: str, content: bytes) -> str:
    """As data: a saved sheet needs nothing from elsewhere, and a picture cannot run anything."""
    return f'<img alt="" src="data:{media_type};base64,{base64.b64encode(content).decode("ascii")}">'
