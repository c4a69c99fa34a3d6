"""What sockets that answer frame by frame have in common: the id of a frame, and the refusal of one."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, Field, ValidationError
from pydantic_core import to_jsonable_python

from app.domain.errors import SetpointRefusedError, TaskRefusedError, WaydropError
from app.domain.validation import document_of, findings_of

MAX_FINDINGS: Final = 3
FrameId = Annotated[int, Field(ge=0, le=2**53, description="comes back with the answer")]


class RefusedFrame(BaseModel):
    """What was asked is not done. Decide by `code`; for a setpoint it is the reason's own."""

    type: Literal["refused"] = "refused"
    id: int | None = None
    code: str
    detail: str
    hint: str = ""
    extra: dict[str, Any] = {}


class _Head(BaseModel):
    """All that is read of a frame that is unfit otherwise."""

    id: FrameId


def refused(frame_id: int | None, error: WaydropError) -> RefusedFrame:
    """The answer to what cannot be done."""
    code = error.refusal if isinstance(error, SetpointRefusedError | TaskRefusedError) else error.code
    extra: dict[str, Any] = to_jsonable_python(dict(error.extra), fallback=str)
    return RefusedFrame(id=frame_id, code=code, detail=error.detail, hint=error.hint, extra=extra)


def unreadable(text: str, model: type[BaseModel], error: ValidationError) -> RefusedFrame:
    """The answer to what is no frame of this model, with the id that it has all the same, if any."""
    found = findings_of(error, model, document_of(text), code_of="frame.{}".format)[:MAX_FINDINGS]
    detail = "; ".join(f"{one.message} (at {one.pointer})" if one.pointer else one.message for one in found)
    return RefusedFrame(id=_id_of(text), code="request.invalid", detail=detail, hint=found[0].hint)


def unspeakable(frame_id: int | None) -> RefusedFrame:
    """The answer to a frame that is fit by itself, and out of which no message to the vehicle can be made."""
    detail = "a number that follows from this is beyond what can be told to the vehicle"
    return RefusedFrame(id=frame_id, code="request.invalid", detail=detail, hint="ask for less")


def _id_of(text: str) -> int | None:
    try:
        return _Head.model_validate_json(text, strict=True).id
    except ValidationError:
        return None
