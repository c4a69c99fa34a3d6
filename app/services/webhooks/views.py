"""What administrators are shown of a webhook. Never its secret."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

from pydantic import Field

from app.domain.model import Frozen, FrozenForm
from app.domain.validation.plain_text import PLAIN_LINE
from app.domain.webhooks.lifecycle import DeliveryEvent
from app.domain.webhooks.webhook import MAX_URL_CHARS, Backoff, Progress, Webhook


@dataclass(frozen=True, slots=True, kw_only=True)
class WebhookSettings:
    """`http_anywhere` allows plain http to other machines. `chance` is the random part of each wait, in [0, 1).

    `queue_events` bounds the events in memory for a slow receiver, `page_events` those read from the disk at once. A
    cursor that moved over other events is stored each `save_each_events`; while a webhook catches up it is stored at
    most each `save_each_s`, because every store is a sync of the disk, for which the next commit of the journal waits.
    `disk_again_s`: the time before reading the journal again after a disk error.
    """

    backoff: Backoff = field(default_factory=Backoff)
    http_anywhere: bool = False
    queue_events: int = 256
    page_events: int = 50
    save_each_events: int = 500
    save_each_s: float = 0.5
    disk_again_s: float = 5.0
    chance: Callable[[], float] = random.random


_Url = Annotated[str, Field(min_length=1, max_length=MAX_URL_CHARS)]
_Description = Annotated[str, Field(max_length=200), PLAIN_LINE]
_Events = Annotated[tuple[DeliveryEvent, ...], Field(max_length=len(DeliveryEvent))]


class WebhookRequest(FrozenForm):
    """A new webhook. `events` empty: all. `after`: begin behind this event of the journal (0: at its first event);
    without it only what happens from now on is sent.
    """

    url: _Url
    events: _Events = ()
    description: _Description = ""
    after: Annotated[int, Field(ge=0, le=2**53)] | None = None


class WebhookUpdate(FrozenForm):
    """What is given is changed. `skip_missed`: leave out all that was not delivered yet, and go on from now."""

    url: _Url | None = None
    events: _Events | None = None
    description: _Description | None = None
    enabled: bool | None = None
    skip_missed: bool = False


class HookState(StrEnum):
    """The state of a webhook. `stopped` is an internal error: see the log; a change or a restart continues it.

    `secret_lost`: its secret cannot be decrypted, because the key file was lost or replaced. Nothing is sent.
    """

    DELIVERING = "delivering"
    RETRYING = "retrying"
    DISABLED = "disabled"
    STOPPED = "stopped"
    SECRET_LOST = "secret_lost"


class WebhookView(Frozen):
    """A webhook, its progress, and how many events of the journal are still before it."""

    webhook: Webhook
    state: HookState
    progress: Progress
    events_behind: int


class WebhookTestView(Frozen):
    """How a test message went. `status` is the receiver's, null if it gave none."""

    delivered: bool
    status: int | None
    problem: str
    message_id: str
