"""An attachment of a drop: a photo, a signature or a document that the dispatcher's own app adds to the evidence."""

from __future__ import annotations

import re
from typing import Final

from app.domain.errors import InvalidInputError
from app.domain.model import Frozen

MAX_NAME_CHARS: Final = 100
MAX_PER_DROP: Final = 20
PICTURES: Final = frozenset({"image/jpeg", "image/png"})
SIGNATURES: Final[dict[str, bytes]] = {
    "image/jpeg": b"\xff\xd8\xff",
    "image/png": b"\x89PNG\r\n\x1a\n",
    "application/pdf": b"%PDF-",
}
"""The media types that are taken, and the bytes that a file of each begins with. None of them is run by a browser."""

_SHA256: Final = re.compile(r"[0-9a-f]{64}")


class Attachment(Frozen):
    """One attachment, as recorded in its event (run.attachment): the journal's chain covers the file by `sha256`.

    `name` is the uploader's name of the file and never used as a path; `size_bytes` and `sha256` are those of the
    uploaded file; `at` is Unix seconds, `actor` who uploaded it.
    """

    plan_item_id: str
    name: str
    media_type: str
    size_bytes: int
    sha256: str
    at: float
    actor: str


ENDINGS: Final[dict[str, tuple[str, ...]]] = {
    "image/jpeg": (".jpg", ".jpeg"),
    "image/png": (".png",),
    "application/pdf": (".pdf",),
}
"""What the name of a file of each type ends with: a computer opens a file by its ending, whatever is in it."""


def with_ending(name: str, media_type: str) -> str:
    """The name, with the ending of its type behind it unless it has that: `door.html` becomes `door.html.jpg`."""
    endings = ENDINGS[media_type]
    if name.lower().endswith(endings) and name.lower() not in endings:
        return name
    return name[: MAX_NAME_CHARS - len(endings[0])] + endings[0]


def checked_name(name: str) -> str:
    """The name without its folders. Raises InvalidInputError unless it can stand in a list and in a header."""
    plain = re.split(r"[/\\]", name.strip())[-1].strip()
    if not plain or plain.strip(".") == "" or len(plain) > MAX_NAME_CHARS or not plain.isprintable():
        raise InvalidInputError(
            f"an attachment's name has 1 to {MAX_NAME_CHARS} printable characters", hint="such as doorstep.jpg"
        )
    return plain


def checked_type(media_type: str | None, content: bytes) -> str:
    """Return the media type of a file; None is detected from its first bytes.

    Raises:
        InvalidInputError: the type is not supported, or the content does not match it.
    """
    found = next((known for known, begin in SIGNATURES.items() if content.startswith(begin)), None)
    if media_type is None and found is None:
        raise InvalidInputError("the file is of no type that is taken", hint=f"one of {', '.join(SIGNATURES)}")
    if media_type is not None and media_type not in SIGNATURES:
        raise InvalidInputError(f"{media_type} is not taken", hint=f"one of {', '.join(SIGNATURES)}")
    if found is None or media_type not in (None, found):
        raise InvalidInputError(f"the file is no {media_type}", hint="send the Content-Type that the file has")
    return found


def is_sha256(text: str) -> bool:
    """Whether a text can name a stored file; nothing else is ever looked for on the disk."""
    return _SHA256.fullmatch(text) is not None
