"""Access: who a bearer token belongs to, and what that one may do."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from app.domain.errors import InvalidInputError, NotFoundError
from app.domain.ports.stores import StoredToken, TokenStore
from app.services.clock import Clock

TOKEN_PREFIX: Final = "wd_"
"""Scanners that look for leaked secrets know ours by it."""

MAX_TOKEN_CHARS: Final = 256
MIN_BOOTSTRAP_CHARS: Final = 16
CACHED_TOKENS: Final = 256
CACHED_FOR_S: Final = 5.0
"""How long a token that the command line revoked in another process may still be taken here."""


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
    """Who asks. Names are for people and may repeat; `token_id` tells tokens apart."""

    name: str
    role: Role
    token_id: str = ""


@dataclass(frozen=True, slots=True)
class _Known:
    """A token that was found live at `looked_up` (monotonic seconds)."""

    token_id: str
    principal: Principal
    looked_up: float


class Access:
    """Knows tokens by their SHA-256 alone: neither disk nor memory holds a secret that opens anything.

    A plain hash is enough, for a token is 32 random bytes and not a password that could be guessed.
    """

    def __init__(self, store: TokenStore, clock: Clock, bootstrap_token: str | None) -> None:
        self._store = store
        self._clock = clock
        self._bootstrap_digest = _bootstrap_digest(bootstrap_token)
        self._known: OrderedDict[str, _Known] = OrderedDict()
        self._revocations = 0
        self._tokens_exist = self._bootstrap_digest is not None

    async def authenticate(self, token: str) -> Principal | None:
        """Whose token it is; None if it is unknown or revoked. Raises StorageError."""
        if not token or len(token) > MAX_TOKEN_CHARS or not token.isascii():
            return None
        digest = _digest(token)
        if self._bootstrap_digest is not None and hmac.compare_digest(digest, self._bootstrap_digest):
            return Principal("bootstrap", Role.ADMIN)
        known = self._known.get(digest)
        if known is not None and self._clock.monotonic() - known.looked_up < CACHED_FOR_S:
            return known.principal
        return await self._look_up(digest)

    async def create_token(self, name: str, role: Role) -> tuple[StoredToken, str]:
        """A new token and its secret, which nobody can show again. Raises InvalidInputError, StorageError."""
        name = name.strip()
        if not 1 <= len(name) <= 100 or not name.isprintable():
            raise InvalidInputError("a token's name has 1 to 100 printable characters", hint="name who uses it")
        secret = TOKEN_PREFIX + secrets.token_urlsafe(32)
        token = StoredToken(
            id=f"token-{secrets.token_hex(6)}",
            name=name,
            role=role.value,
            token_hash=_digest(secret),
            created_at=self._clock.now(),
        )
        await self._store.add(token)
        self._tokens_exist = True
        return token, secret

    async def revoke(self, token_id: str) -> None:
        """Make a token open nothing any more. Raises NotFoundError if there is no such live token, StorageError."""
        revoked = await self._store.revoke(token_id, now=self._clock.now())
        self._revocations += 1
        for digest in [digest for digest, known in self._known.items() if known.token_id == token_id]:
            del self._known[digest]
        if not revoked:
            raise NotFoundError(f"no live token {token_id!r}", hint="list the tokens to see their ids")

    async def list_tokens(self) -> Sequence[StoredToken]:
        """All tokens, revoked ones too, oldest first. Raises StorageError."""
        return await self._store.list_tokens()

    async def has_tokens(self) -> bool:
        """Whether a token was ever made, or a bootstrap token is set: then even this machine needs one.

        Revoked ones count: to revoke the last token must not open the service to everybody on the machine.
        """
        if not self._tokens_exist:
            self._tokens_exist = bool(await self._store.list_tokens())
        return self._tokens_exist

    async def _look_up(self, digest: str) -> Principal | None:
        revocations = self._revocations
        looked_up = self._clock.monotonic()
        found = await self._store.find_by_hash(digest)
        self._known.pop(digest, None)
        if found is None or not hmac.compare_digest(found.token_hash, digest):
            return None
        try:
            principal = Principal(found.name, Role(found.role), found.id)
        except ValueError:  # a role of another version: what it may do here is not known, so nothing
            return None
        if revocations == self._revocations:  # else it may have been revoked after it was read
            self._known[digest] = _Known(found.id, principal, looked_up)
            if len(self._known) > CACHED_TOKENS:
                self._known.popitem(last=False)
        return principal


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("ascii")).hexdigest()


def _bootstrap_digest(token: str | None) -> str | None:
    """An empty one, as from an empty environment variable, is none: it must never open the door."""
    if not token:
        return None
    if len(token) < MIN_BOOTSTRAP_CHARS or len(token) > MAX_TOKEN_CHARS or not token.isascii():
        raise InvalidInputError(
            f"the bootstrap token must have {MIN_BOOTSTRAP_CHARS} to {MAX_TOKEN_CHARS} ASCII characters",
            hint="make one with: openssl rand -base64 32",
        )
    return _digest(token)
