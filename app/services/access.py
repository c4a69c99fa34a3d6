"""Access: who a bearer token belongs to, and what that one may do."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import math
import secrets
import unicodedata
from collections import OrderedDict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from app.domain.errors import ConflictError, InvalidInputError, NotFoundError, StorageError, TooManyAttemptsError
from app.domain.ports.stores import StoredToken, TokenStore
from app.services.attempts import FailedAttempts
from app.services.clock import Clock

TOKEN_PREFIX: Final = "wd_"
"""A prefix by which secret scanners recognize leaked tokens."""

MAX_TOKEN_CHARS: Final = 256
MIN_BOOTSTRAP_CHARS: Final = 16
CACHED_TOKENS: Final = 256
CACHED_FOR_S: Final = 5.0
"""How long a token that the command line revoked in another process may still be taken here."""

TOUCHED_EVERY_S: Final = 60.0
"""How exact the time of a token's last use is: each time it is stored costs a write."""

RESERVED_NAMES: Final = frozenset({"local", "bootstrap", "anybody"})
"""Principals without a stored token have these names in the journal."""


class Role(StrEnum):
    """What a principal may do; each role may do what those before it may."""

    VIEWER = "viewer"
    DISPATCHER = "dispatcher"
    PILOT = "pilot"
    ADMIN = "admin"

    def allows(self, needed: Role) -> bool:
        """Whether this role may do what `needed` may."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


@dataclass(frozen=True, slots=True)
class Principal:
    """The authenticated principal. Names of valid tokens are unique; `token_id` is unique for ever."""

    name: str
    role: Role
    token_id: str = ""


@dataclass(frozen=True, slots=True)
class _Known:
    """A token that was found live at `looked_up` (monotonic seconds)."""

    principal: Principal
    looked_up: float
    expires_at: float | None = None


BOOTSTRAP: Final = Principal("bootstrap", Role.ADMIN)
MAX_LIFETIME_S: Final = 10 * 366 * 24 * 3600.0


class Access:
    """Tokens are stored as SHA-256 only: neither disk nor memory contains a usable secret.

    An unsalted hash is sufficient, because a token is 32 random bytes and not a password.
    """

    def __init__(self, store: TokenStore, clock: Clock, bootstrap_token: str | None) -> None:
        self._store = store
        self._clock = clock
        self._bootstrap_digest = _bootstrap_digest(bootstrap_token)
        self._known: OrderedDict[str, _Known] = OrderedDict()
        self._attempts = FailedAttempts(clock)
        self._revocations = 0
        self._tokens_exist = self._bootstrap_digest is not None
        self._looking = asyncio.Lock()
        self._asked = 0
        self._answered = 0
        self._failure: StorageError | None = None

    async def authenticate(self, token: str, address: str = "") -> Principal | None:
        """Return the principal of a token; None if it is unknown, expired or revoked.

        An address with too many failures may only use tokens that were valid recently, so that guessing reveals nothing
        and other clients of the same address are not affected.

        Raises:
            TooManyAttemptsError: too many failures of this address.
            StorageError: the token cannot be looked up.
        """
        digest = _digest(token) if 0 < len(token) <= MAX_TOKEN_CHARS and token.isascii() else ""
        retry_after_s = self._attempts.retry_after_s(address)
        if retry_after_s is not None and digest not in self._known:
            raise TooManyAttemptsError(
                "too many attempts with invalid tokens from this address",
                hint=f"wait {math.ceil(retry_after_s)} s",
                retry_after_s=math.ceil(retry_after_s),
            )
        principal = await self._principal(digest) if digest else None
        if principal is None:
            self._attempts.count(address)
        return principal

    async def create_token(self, name: str, role: Role, *, lifetime_s: float | None = None) -> tuple[StoredToken, str]:
        """A new token and its secret, which nobody can show again. `lifetime_s` None: it does not expire.

        Raises:
            InvalidInputError: the name or the lifetime cannot be used.
            ConflictError: a token that is not revoked has this name.
            StorageError: it is not stored.
        """
        name = await self._free_name(name)
        if lifetime_s is not None and not 0 < lifetime_s <= MAX_LIFETIME_S:
            raise InvalidInputError(
                "the lifetime of a token must be more than 0 and at most 10 years", hint="such as 90d"
            )
        secret = TOKEN_PREFIX + secrets.token_urlsafe(32)
        token = StoredToken(
            id=f"token-{secrets.token_hex(6)}",
            name=name,
            role=role.value,
            token_hash=_digest(secret),
            created_at=self._clock.now(),
            expires_at=None if lifetime_s is None else self._clock.now() + lifetime_s,
        )
        await self._store.add(token)
        self._tokens_exist = True
        return token, secret

    async def revoke(self, token_id: str) -> None:
        """Make a token open nothing any more. Raises NotFoundError if there is no such live token, StorageError."""
        revoked = await self._store.revoke(token_id, now=self._clock.now())
        self._revocations += 1
        for digest in [digest for digest, known in self._known.items() if known.principal.token_id == token_id]:
            del self._known[digest]
        if not revoked:
            raise NotFoundError(f"no valid token {token_id!r}", hint="list the tokens to see their IDs")

    async def list_tokens(self) -> Sequence[StoredToken]:
        """All tokens, revoked ones too, oldest first. Raises StorageError."""
        return await self._store.list_tokens()

    async def has_tokens(self) -> bool:
        """Whether a token was ever made, or a bootstrap token is set: then even this machine needs one.

        Revoked ones count: to revoke the last token must not open the service to everybody on the machine. Many may ask
        at once, such as a thousand websockets: they share a look that began after they asked. Raises StorageError.
        """
        if self._tokens_exist:
            return True
        self._asked += 1
        place = self._asked
        async with self._looking:
            if place > self._answered:
                asked = self._asked
                self._failure = None
                try:
                    if await self._store.list_tokens():
                        self._tokens_exist = True
                except StorageError as error:
                    self._failure = error
                self._answered = asked
            if self._failure is not None:
                raise self._failure.with_traceback(None)
        return self._tokens_exist

    async def _free_name(self, name: str) -> str:
        name = unicodedata.normalize("NFC", name.strip())
        if not 1 <= len(name) <= 100 or not name.isprintable() or name.casefold() in RESERVED_NAMES:
            raise InvalidInputError(
                "a token name must have 1 to 100 printable characters and must not be one of "
                + ", ".join(sorted(RESERVED_NAMES)),
                hint="use the name of the client or user",
            )
        live = [token for token in await self._store.list_tokens() if token.revoked_at is None]
        taken = next((token for token in live if token.name.casefold() == name.casefold()), None)
        if taken is not None:
            raise ConflictError(
                f"token {taken.id} has the name {taken.name!r}: names must be unique",
                hint=f"choose another name, or revoke it first: waydrop token revoke {taken.id}",
            )
        return name

    async def _principal(self, digest: str) -> Principal | None:
        if self._bootstrap_digest is not None and hmac.compare_digest(digest, self._bootstrap_digest):
            self._remember(digest, _Known(BOOTSTRAP, self._clock.monotonic()))
            return BOOTSTRAP
        known = self._known.get(digest)
        if known is not None and self._clock.monotonic() - known.looked_up < CACHED_FOR_S:
            return None if self._is_expired(known.expires_at) else known.principal
        return await self._look_up(digest)

    async def _look_up(self, digest: str) -> Principal | None:
        revocations = self._revocations
        looked_up = self._clock.monotonic()
        found = await self._store.find_by_hash(digest)
        principal = None if found is None else self._principal_of(found, digest)
        if found is None or principal is None or revocations != self._revocations:  # it may have been revoked meanwhile
            self._known.pop(digest, None)
            return principal
        self._remember(digest, _Known(principal, looked_up, found.expires_at))
        if self._clock.now() - (found.last_used_at or 0.0) >= TOUCHED_EVERY_S:
            with suppress(StorageError):  # a full disk must not prevent reading
                await self._store.touch(found.id, now=self._clock.now())
        return principal

    def _principal_of(self, found: StoredToken, digest: str) -> Principal | None:
        if not hmac.compare_digest(found.token_hash, digest) or self._is_expired(found.expires_at):
            return None
        try:
            return Principal(found.name, Role(found.role), found.id)
        except ValueError:  # a role of another version: its permissions are unknown, so it has none
            return None

    def _is_expired(self, expires_at: float | None) -> bool:
        return expires_at is not None and self._clock.now() >= expires_at

    def _remember(self, digest: str, known: _Known) -> None:
        self._known[digest] = known
        self._known.move_to_end(digest)
        if len(self._known) > CACHED_TOKENS:
            self._known.popitem(last=False)


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("ascii")).hexdigest()


def _bootstrap_digest(token: str | None) -> str | None:
    """An empty one, as from an empty environment variable, is none: it must never open the door."""
    if not token:
        return None
    if len(token) < MIN_BOOTSTRAP_CHARS or len(token) > MAX_TOKEN_CHARS or not token.isascii():
        raise InvalidInputError(
            f"the bootstrap token must have {MIN_BOOTSTRAP_CHARS} to {MAX_TOKEN_CHARS} ASCII characters",
            hint="create one with: openssl rand -base64 32",
        )
    return _digest(token)
