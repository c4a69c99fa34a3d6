"""NATS: core messages and requests, and JetStream for what relays publish. Implements Bus."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import ParseResult

import nats.errors
import structlog
from nats.aio.client import Client
from nats.aio.msg import Msg
from nats.aio.subscription import Subscription
from nats.js import JetStreamContext
from nats.js.api import AckPolicy, ConsumerConfig, KeyValueConfig, RetentionPolicy, StreamConfig
from nats.js.errors import APIError, NotFoundError
from nats.js.errors import Error as JetStreamError

from app.cluster.credentials import read_credentials
from app.domain.cluster.envelope import Envelope
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, LeaseMovedError, NoReplyError
from app.domain.cluster.lease import LEASE_TTL_S
from app.domain.cluster.ports import ALL_EVENTS, LEASES, Answering, Hearing, events_of, lease_of

log = structlog.get_logger(__name__)

STREAM: Final = "WAYDROP"
CONSUMER: Final = "projection"
ACK_S: Final = 5.0
UNCONFIRMED_S: Final = 20.0
"""An envelope that nobody confirms for so long comes again."""
RECONNECT_S: Final = 1
LOOK_S: Final = 5.0
"""How often a feed without messages looks whether its consumer is still there: a server may have lost it."""
WRONG_REVISION: Final = frozenset({10071, 10164})
"""The codes of nats-server for a write after another revision than the newest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BusSettings:
    """`servers` are `nats://` or `tls://` URLs, with user and password in them or in a `credentials` file."""

    servers: tuple[str, ...]
    name: str
    credentials: Path | None = None
    ca: Path | None = None


def unusable_files(settings: BusSettings) -> Mapping[Path, str]:
    """Files that cannot be used, and why."""
    found: dict[Path, str] = {}
    for path, read in ((settings.credentials, read_credentials), (settings.ca, _trusting)):
        if path is None:
            continue
        try:
            read(path)
        except _UNUSABLE as error:
            found[path] = _words(error)
    return found


def _trusting(authority: Path) -> ssl.SSLContext:
    return ssl.create_default_context(cafile=authority)


_UNUSABLE: Final = (nats.errors.Error, OSError)


def _words(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


@asynccontextmanager
async def open_bus(settings: BusSettings) -> AsyncIterator[NatsBus]:
    """The bus until the block ends. It connects on its own, now or as soon as a server can be reached."""
    client = Client()
    connecting = asyncio.create_task(_connect(client, settings), name="nats connecting")
    connecting.add_done_callback(_not_connecting)
    try:
        yield NatsBus(client, connecting)
    finally:
        connecting.cancel()
        await asyncio.gather(connecting, return_exceptions=True)
        if client.is_connected or client.is_reconnecting:
            await client.close()


def _not_connecting(connecting: asyncio.Task[None]) -> None:
    if not connecting.cancelled() and (error := connecting.exception()) is not None:
        log.error("NATS is not connected to any more, until a restart", exc_info=error)


async def _connect(client: Client, settings: BusSettings) -> None:
    """Connect, and begin again where nats-py gives up, as with a file that is missing for now."""
    while True:
        try:
            return await _connect_once(client, settings)
        except _UNUSABLE as error:
            log.error("NATS cannot be connected to", error=_words(error))
        await asyncio.sleep(RECONNECT_S)


async def _connect_once(client: Client, settings: BusSettings) -> None:
    async def failed(error: Exception) -> None:
        log.warning("NATS cannot be reached", error=str(error) or type(error).__name__)

    async def reconnected() -> None:
        log.info("NATS is reached again", server=_address(client.connected_url))

    file = settings.credentials
    await client.connect(
        servers=list(settings.servers),
        name=settings.name,
        error_cb=failed,
        reconnected_cb=reconnected,
        max_reconnect_attempts=-1,
        reconnect_time_wait=RECONNECT_S,
        ping_interval=5,
        max_outstanding_pings=2,
        # read at each connect: credentials expire, and the file is replaced
        user_jwt_cb=None if file is None else lambda: bytearray(read_credentials(file).claims),
        signature_cb=None if file is None else lambda nonce: read_credentials(file).sign(nonce),
        tls=None if settings.ca is None else _trusting(settings.ca),
    )


def _address(url: ParseResult | None) -> str:
    """Without the password that may stand before it."""
    return "" if url is None else url.netloc.rpartition("@")[2]


@contextmanager
def _cancellable() -> Iterator[None]:
    """nats-py waits by `asyncio.wait_for`, which before Python 3.12 loses a cancellation that comes with the reply."""
    try:
        yield
    finally:
        task = asyncio.current_task()
        if task is not None and task.cancelling():
            raise asyncio.CancelledError


@contextmanager
def _bus_errors() -> Iterator[None]:
    try:
        yield
    except (nats.errors.Error, JetStreamError, OSError, TimeoutError) as error:
        raise BusDownError(f"NATS: {str(error) or type(error).__name__}", hint=_HINT) from error


_HINT: Final = "see that NATS runs and can be reached; vehicles fly on without it"


class NatsBus:
    """Bus on one connection. Nothing is buffered while it is down: what would be sent is refused."""

    def __init__(self, client: Client, connecting: asyncio.Task[None]) -> None:
        self._client = client
        self._connecting = connecting
        self._jetstream: Final[JetStreamContext] = client.jetstream(timeout=ACK_S)

    async def publish_envelope(self, envelope: Envelope) -> None:
        self._require_connected()
        with _bus_errors(), _cancellable():
            await self._jetstream.publish(
                events_of(envelope.site),
                envelope.to_json(),
                timeout=ACK_S,
                stream=STREAM,
                headers={"Nats-Msg-Id": envelope.message_id},
            )

    @asynccontextmanager
    async def envelopes(self) -> AsyncIterator[NatsEnvelopeFeed]:
        """See Bus. The stream, its consumer and the bucket of leases are made if they are missing."""
        self._require_connected()
        with _bus_errors(), _cancellable():
            await self._jetstream.create_key_value(KeyValueConfig(bucket=LEASES, ttl=LEASE_TTL_S, direct=True))
            await self._jetstream.add_stream(
                StreamConfig(name=STREAM, subjects=[ALL_EVENTS], retention=RetentionPolicy.WORK_QUEUE)
            )
            subscription = await self._jetstream.pull_subscribe(
                ALL_EVENTS,
                durable=CONSUMER,
                stream=STREAM,
                config=ConsumerConfig(ack_policy=AckPolicy.EXPLICIT, ack_wait=UNCONFIRMED_S),
            )
        try:
            yield NatsEnvelopeFeed(subscription)
        finally:
            if self._client.is_connected:
                with _bus_errors():
                    await subscription.unsubscribe()

    # Leases are written without nats-py's KeyValue, which asks for the stream first: a gateway may use the subjects
    # of its own lease alone.

    async def read_lease(self, site: str) -> tuple[bytes, int]:
        self._require_connected()
        with _bus_errors(), _cancellable():
            try:
                found = await self._jetstream.get_last_msg(f"KV_{LEASES}", lease_of(site), direct=True)
            except NotFoundError:
                return b"", 0
        return found.data or b"", found.seq or 0

    async def write_lease(self, site: str, lease: bytes, *, after: int) -> int:
        self._require_connected()
        headers = {"Nats-Expected-Last-Subject-Sequence": str(after)}
        if not lease:
            headers["KV-Operation"] = "DEL"
        with _bus_errors(), _cancellable():
            try:
                written = await self._jetstream.publish(lease_of(site), lease, timeout=ACK_S, headers=headers)
            except APIError as error:
                if error.err_code in WRONG_REVISION:
                    raise LeaseMovedError(f"the lease of {site} has another revision than {after}") from error
                raise
        return written.seq

    async def request(self, subject: str, message: bytes, *, timeout_s: float) -> bytes:
        self._require_connected()
        try:
            with _cancellable():
                return (await self._client.request(subject, message, timeout=timeout_s)).data
        except nats.errors.NoRespondersError as error:
            raise GatewayUnreachableError(
                f"nobody answers {subject}",
                hint="see that the gateway of this site runs and reaches NATS; its own page works at the site",
            ) from error
        except (nats.errors.TimeoutError, TimeoutError) as error:
            raise NoReplyError(
                f"no answer on {subject} within {timeout_s:g} s: it may have been carried out",
                hint="look at the vehicle and its runs before you repeat it",
            ) from error
        except (nats.errors.Error, OSError) as error:
            raise BusDownError(f"NATS: {str(error) or type(error).__name__}", hint=_HINT) from error

    @asynccontextmanager
    async def answering(self, subject: str, answer: Answering, *, in_queue_group: bool = False) -> AsyncIterator[None]:
        """See Bus. Answers under way are finished at the end of the block."""
        tasks: set[asyncio.Task[None]] = set()

        async def respond(message: Msg) -> None:
            reply = await answer(message.data)
            if reply and self._client.is_connected:
                await message.respond(reply)

        async def take(message: Msg) -> None:
            task = asyncio.create_task(respond(message), name=f"answering {subject}")
            tasks.add(task)
            task.add_done_callback(lambda done: _answered(tasks, done))

        try:
            async with self._subscribed(subject, take, queue=subject if in_queue_group else ""):
                yield
        finally:
            if tasks:
                await asyncio.wait(tasks)

    async def publish(self, subject: str, message: bytes) -> None:
        self._require_connected()
        with _bus_errors():
            await self._client.publish(subject, message)

    @asynccontextmanager
    async def hearing(self, subject: str, hear: Hearing) -> AsyncIterator[None]:
        async def take(message: Msg) -> None:
            hear(message.data)

        async with self._subscribed(subject, take):
            yield

    @asynccontextmanager
    async def _subscribed(
        self, subject: str, take: Callable[[Msg], Awaitable[None]], *, queue: str = ""
    ) -> AsyncIterator[None]:
        subscribing = asyncio.create_task(self._subscribe(subject, take, queue), name=f"subscribing {subject}")
        try:
            yield
        finally:
            subscribing.cancel()
            (subscription,) = await asyncio.gather(subscribing, return_exceptions=True)
            if isinstance(subscription, Subscription) and not self._client.is_closed:
                with suppress(nats.errors.Error):  # also while NATS is away, or it would be subscribed again
                    await subscription.unsubscribe()

    async def _subscribe(self, subject: str, take: Callable[[Msg], Awaitable[None]], queue: str) -> Subscription:
        await asyncio.shield(self._connecting)  # after it the client subscribes again by itself
        return await self._client.subscribe(subject, queue=queue, cb=take)

    def _require_connected(self) -> None:
        if not self._client.is_connected:
            raise BusDownError("NATS is not connected", hint=_HINT)


def _answered(tasks: set[asyncio.Task[None]], done: asyncio.Task[None]) -> None:
    tasks.discard(done)
    if not done.cancelled() and (error := done.exception()) is not None:
        log.error("a request was not answered", exc_info=error)


class NatsEnvelopeFeed:
    """EnvelopeFeed on a pull consumer."""

    def __init__(self, subscription: JetStreamContext.PullSubscription) -> None:
        self._subscription = subscription
        self._looked_s = asyncio.get_running_loop().time()

    async def next(self, *, most: int, timeout_s: float) -> Sequence[NatsReceivedEnvelope]:
        now_s = asyncio.get_running_loop().time()
        if now_s - self._looked_s > LOOK_S:
            self._looked_s = now_s
            with _bus_errors(), _cancellable():  # without NATS there would be no message, and no error
                await self._subscription.consumer_info()
        try:
            with _bus_errors(), _cancellable():
                return [NatsReceivedEnvelope(one) for one in await self._subscription.fetch(most, timeout=timeout_s)]
        except BusDownError as error:
            if isinstance(error.__cause__, TimeoutError):  # nats' own is one
                return []
            raise


class NatsReceivedEnvelope:
    """ReceivedEnvelope of JetStream."""

    def __init__(self, received: Msg) -> None:
        self._received = received

    @property
    def message(self) -> bytes:
        return self._received.data

    async def confirm(self) -> None:
        with _bus_errors():
            await self._received.ack()

    async def postpone(self, delay_s: float) -> None:
        with _bus_errors():
            await self._received.nak(delay=delay_s)
