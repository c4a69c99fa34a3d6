"""A webhook: its URL, its secret and signature, how far its deliveries are, and when they are retried."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final, Protocol

import standardwebhooks
from pydantic import HttpUrl, TypeAdapter, ValidationError

from app.domain.errors import InvalidInputError
from app.domain.model import FrozenForm
from app.domain.reasons import Reason
from app.domain.webhooks.lifecycle import DeliveryEvent

MAX_HOOKS: Final = 20
"""Each one has a task and reads the journal itself."""


class Webhook(FrozenForm):
    """What an administrator set. Times are Unix seconds; `events` empty: all.

    `disabled_reason` says why nothing is sent while `enabled` is false.
    """

    id: str
    url: str
    events: tuple[DeliveryEvent, ...] = ()
    description: str = ""
    enabled: bool = True
    disabled_reason: Reason | None = None
    created_at: float
    created_by: str

    def wants(self, event: DeliveryEvent) -> bool:
        """Whether it receives this type."""
        return not self.events or event in self.events


class Progress(FrozenForm):
    """How far a webhook has come, and how its last attempts went. Times are Unix seconds.

    `cursor` is the newest event of the journal that is done: delivered and acknowledged, or not subscribed. `failures`
    are consecutive failed attempts since `failing_since`; `last_status` is the HTTP status of the receiver, None
    without one, and `last_problem` is why the last attempt failed.
    """

    cursor: int
    last_delivered_id: str | None = None
    last_delivered_at: float | None = None
    last_attempt_at: float | None = None
    last_status: int | None = None
    last_problem: str = ""
    failures: int = 0
    failing_since: float | None = None
    next_attempt_at: float | None = None

    def delivered(self, message_id: str, status: int, *, now: float) -> Progress:
        """After an attempt that the receiver acknowledged. The cursor moves when the whole event is done."""
        return Progress(
            cursor=self.cursor,
            last_delivered_id=message_id,
            last_delivered_at=now,
            last_attempt_at=now,
            last_status=status,
        )

    def failed(self, status: int | None, problem: str, *, now: float, retry_s: float | None) -> Progress:
        """After an attempt that did not count; `retry_s` is None if there will be no other."""
        changes: dict[str, object] = {
            "last_attempt_at": now,
            "last_status": status,
            "last_problem": problem,
            "failures": self.failures + 1,
            "failing_since": self.failing_since or now,
            "next_attempt_at": None if retry_s is None else now + retry_s,
        }
        return self.model_copy(update=changes)

    def moved_to(self, cursor: int) -> Progress:
        """With everything up to `cursor` done."""
        return self.model_copy(update={"cursor": cursor})


@dataclass(frozen=True, slots=True, repr=False)
class StoredWebhook:
    """A webhook with its secret: never shown, never logged. None: it was encrypted with a key that is lost."""

    hook: Webhook
    secret: str | None
    progress: Progress


# Where a webhook may lead: Waydrop sends to it from inside its own network, so not everything is taken.


MAX_URL_CHARS: Final = 2000
_URL: Final = TypeAdapter(HttpUrl)


def checked_url(url: str, *, http_anywhere: bool) -> str:
    """The URL in its normal form.

    Raises:
        InvalidInputError: it is no http(s) URL, has a user name or a fragment, or is plain http to another machine and
            `http_anywhere` is not set.
    """
    try:
        parsed = _URL.validate_python(url.strip())
    except ValidationError as error:
        raise InvalidInputError(
            "url: this is no http or https address", hint="write it as https://dispatch.example/waydrop"
        ) from error
    if len(str(parsed)) > MAX_URL_CHARS:
        raise InvalidInputError(f"url: longer than {MAX_URL_CHARS} characters", hint="use a shorter one")
    if parsed.username or parsed.password or parsed.fragment is not None:
        raise InvalidInputError(
            "url: a user name, password or fragment is not taken",
            hint="the signature shows who sends; put a token into the path if the receiver needs one",
        )
    host = parsed.host or ""
    if parsed.scheme == "http" and not http_anywhere and not is_loopback(host):
        raise InvalidInputError(
            f"url: plain http to {host} could be read and altered on the way",
            hint="use https; WAYDROP_WEBHOOK_HTTP_ANYWHERE=true allows http to other machines",
        )
    return str(parsed)


def is_loopback(host: str) -> bool:
    """Whether a URL's host is this machine by its name or address."""
    try:
        return host == "localhost" or ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def host_of(url: str) -> str:
    """The host of a checked URL: the rest may be secret, and is not written to the journal."""
    return _URL.validate_python(url).host or ""


@dataclass(frozen=True, slots=True)
class Backoff:
    """Waits double from `first_s` to `longest_s`; a part of each is chance, so that hooks do not come in step."""

    first_s: float = 2.0
    longest_s: float = 3600.0

    def wait_s(self, failures: int, *, chance: float, asked_s: float | None = None) -> float:
        """The wait after this many consecutive failures (1 or more).

        `chance` is in [0, 1): the wait is between half of its step and all of it. `asked_s` is the receiver's
        Retry-After: the next attempt is not before it, but never later than `longest_s`.
        """
        doublings = min(max(failures, 1) - 1, 60)  # 2**60 steps are longer than any cap
        step_s = min(self.first_s * 2.0**doublings, self.longest_s)
        wait_s = step_s * (0.5 + 0.5 * chance)
        return wait_s if asked_s is None else min(max(wait_s, asked_s), self.longest_s)


ID: Final = "webhook-id"
TIMESTAMP: Final = "webhook-timestamp"
SIGNATURE: Final = "webhook-signature"
WEBHOOK: Final = "Waydrop-Webhook"
SECRET_PREFIX: Final = "whsec_"
"""Before the key in base64, as Standard Webhooks writes it."""


def signed_headers(secret: str, message_id: str, time_s: float, body: bytes) -> dict[str, str]:
    """The headers of Standard Webhooks (version 1): id, time of this attempt in Unix seconds, signature.

    The signature covers all three; a receiver rejects old ones, so that nobody can repeat a message later.
    """
    at = datetime.fromtimestamp(int(time_s), UTC)
    signature = standardwebhooks.Webhook(secret).sign(message_id, at, body.decode("utf-8"))
    return {ID: message_id, TIMESTAMP: str(int(time_s)), SIGNATURE: signature}


@dataclass(frozen=True, slots=True)
class Reply:
    """The result of one request. `status` is None without an HTTP response; `problem` then has the reason.

    `retry_after_s` is the receiver's Retry-After in seconds, if it is valid.
    """

    status: int | None
    problem: str = ""
    retry_after_s: float | None = None

    @property
    def is_good(self) -> bool:
        """Whether the receiver has it: any 2xx."""
        return self.status is not None and 200 <= self.status < 300


class WebhookSender(Protocol):
    """Sends one request. No redirect is followed, nothing of the answer but its status is read."""

    async def post(self, url: str, headers: Mapping[str, str], body: bytes) -> Reply:
        """POST `body`. Never raises for what a receiver or the network does; ends within the sender's time limit."""


class WebhookStore(Protocol):
    """Webhooks on disk. Each method may raise StorageError."""

    async def add(self, stored: StoredWebhook) -> None:
        """Store a new one."""

    async def list_webhooks(self) -> Sequence[StoredWebhook]:
        """All, oldest first."""

    async def change(self, hook: Webhook) -> None:
        """Store what an administrator changed; the secret and the progress stay."""

    async def save_progress(self, hook_id: str, progress: Progress) -> None:
        """Store the progress; nothing happens if the webhook was deleted."""

    async def delete(self, hook_id: str) -> None:
        """Forget it."""
