"""What an administrator asks for: a new webhook, or changes to one."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from app.domain.webhooks.address import MAX_URL_CHARS
from app.domain.webhooks.lifecycle import DeliveryEvent

_Url = Annotated[str, Field(min_length=1, max_length=MAX_URL_CHARS)]
_Description = Annotated[str, Field(max_length=200)]
_Events = Annotated[tuple[DeliveryEvent, ...], Field(max_length=len(DeliveryEvent))]


class WebhookOrder(BaseModel):
    """A new webhook. `events` empty: all. `after`: begin behind this event of the journal (0: at its first event);
    without it only what happens from now on is told."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    url: _Url
    events: _Events = ()
    description: _Description = ""
    after: Annotated[int, Field(ge=0, le=2**53)] | None = None


class WebhookChange(BaseModel):
    """What is given is changed. `skip_missed`: leave out all that was not delivered yet, and go on from now."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    url: _Url | None = None
    events: _Events | None = None
    description: _Description | None = None
    enabled: bool | None = None
    skip_missed: bool = False
