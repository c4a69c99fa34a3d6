"""A token opens what its role allows, until it is revoked; no secret is kept."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
from collections.abc import Sequence
from dataclasses import replace

import pytest

from app.domain.errors import ConflictError, InvalidInputError, NotFoundError, StorageError, TooManyAttemptsError
from app.domain.ports.stores import StoredToken
from app.services.access import CACHED_FOR_S, CACHED_TOKENS, Access, Principal, Role
from app.services.attempts import ADDRESSES_KEPT, MOST_FAILURES, WINDOW_S
from tests.support.fakes import ManualClock

BOOTSTRAP = "a-bootstrap-token-of-32-chars..."


class MemoryTokenStore:
    """TokenStore in a dict; `hold` keeps an answer back after it was read."""

    def __init__(self) -> None:
        self.tokens: dict[str, StoredToken] = {}
        self.look_ups = 0
        self.lists = 0
        self.touches = 0
        self.full = False
        self.broken = False
        self.hold = asyncio.Event()
        self.hold.set()

    async def add(self, token: StoredToken) -> None:
        """See TokenStore."""
        self.tokens[token.id] = token

    async def find_by_hash(self, token_hash: str) -> StoredToken | None:
        """See TokenStore."""
        self.look_ups += 1
        live = [token for token in self.tokens.values() if token.revoked_at is None and token.token_hash == token_hash]
        await self.hold.wait()
        return live[0] if live else None

    async def list_tokens(self) -> Sequence[StoredToken]:
        """See TokenStore."""
        self.lists += 1
        tokens = list(self.tokens.values())
        await self.hold.wait()
        if self.broken:
            raise StorageError("the disk failed to read")
        return tokens

    async def revoke(self, token_id: str, *, now: float) -> bool:
        """See TokenStore."""
        token = self.tokens.get(token_id)
        if token is None or token.revoked_at is not None:
            return False
        self.tokens[token_id] = replace(token, revoked_at=now)
        return True

    async def touch(self, token_id: str, *, now: float) -> None:
        """See TokenStore."""
        if self.full:
            raise StorageError("the disk is full")
        self.touches += 1
        self.tokens[token_id] = replace(self.tokens[token_id], last_used_at=now)


def _who(principal: Principal | None) -> tuple[str, Role] | None:
    return None if principal is None else (principal.name, principal.role)


@pytest.fixture
def store() -> MemoryTokenStore:
    return MemoryTokenStore()


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(1234.5)


@pytest.fixture
def access(store: MemoryTokenStore, clock: ManualClock) -> Access:
    return Access(store, clock, None)


def test_each_role_may_do_what_those_before_it_may() -> None:
    roles = [Role.VIEWER, Role.DISPATCHER, Role.PILOT, Role.ADMIN]
    for height, role in enumerate(roles):
        assert [role.allows(needed) for needed in roles] == [needed <= height for needed in range(4)]


async def test_a_token_opens_with_its_name_and_role(access: Access) -> None:
    _, secret = await access.create_token("ward 3", Role.DISPATCHER)
    assert _who(await access.authenticate(secret)) == ("ward 3", Role.DISPATCHER)


async def test_a_secret_has_our_prefix_and_32_random_bytes_and_is_not_kept(
    access: Access, store: MemoryTokenStore
) -> None:
    stored, secret = await access.create_token("ward 3", Role.VIEWER)
    assert secret.startswith("wd_")
    assert len(secret) == 3 + 43
    assert stored.token_hash == hashlib.sha256(secret.encode()).hexdigest()
    assert secret[3:] not in repr(store.tokens) + repr(vars(access))
    assert (stored.role, stored.created_at, stored.revoked_at) == ("viewer", 1234.5, None)
    assert list(await access.list_tokens()) == [stored]


@pytest.mark.parametrize("wrong", ["", "wd_", "wd_" + "x" * 43, "x" * 100_000, "größe", "\udcff", "a b"])
async def test_anything_else_opens_nothing(access: Access, wrong: str) -> None:
    await access.create_token("ward 3", Role.ADMIN)
    assert await access.authenticate(wrong) is None


async def test_a_hash_is_no_token(access: Access) -> None:
    stored, _ = await access.create_token("ward 3", Role.ADMIN)
    assert await access.authenticate(stored.token_hash) is None


async def test_a_revoked_token_opens_nothing_from_then_on(access: Access) -> None:
    stored, secret = await access.create_token("ward 3", Role.PILOT)
    assert await access.authenticate(secret) is not None
    await access.revoke(stored.id)
    assert await access.authenticate(secret) is None


async def test_revoking_one_token_leaves_the_others(access: Access) -> None:
    stored, _ = await access.create_token("ward 3", Role.PILOT)
    _, other = await access.create_token("ward 4", Role.PILOT)
    await access.revoke(stored.id)
    assert _who(await access.authenticate(other)) == ("ward 4", Role.PILOT)


async def test_only_a_live_token_can_be_revoked(access: Access) -> None:
    stored, _ = await access.create_token("ward 3", Role.PILOT)
    await access.revoke(stored.id)
    for token_id in (stored.id, "token-0"):
        with pytest.raises(NotFoundError):
            await access.revoke(token_id)


async def test_a_look_up_that_a_revocation_overtakes_is_not_remembered(access: Access, store: MemoryTokenStore) -> None:
    stored, secret = await access.create_token("ward 3", Role.PILOT)
    store.hold.clear()
    overtaken = asyncio.create_task(access.authenticate(secret))
    await asyncio.sleep(0)
    await access.revoke(stored.id)
    store.hold.set()
    await overtaken
    assert await access.authenticate(secret) is None


async def test_a_known_token_is_not_looked_up_each_time(access: Access, store: MemoryTokenStore) -> None:
    _, secret = await access.create_token("ward 3", Role.PILOT)
    for _ in range(5):
        assert _who(await access.authenticate(secret)) == ("ward 3", Role.PILOT)
    assert store.look_ups == 1


async def test_a_revocation_by_another_process_counts_after_seconds(
    access: Access, store: MemoryTokenStore, clock: ManualClock
) -> None:
    stored, secret = await access.create_token("ward 3", Role.PILOT)
    assert await access.authenticate(secret) is not None
    await store.revoke(stored.id, now=1.0)
    clock.time_s += CACHED_FOR_S
    assert await access.authenticate(secret) is None


async def test_an_unknown_token_that_is_made_later_opens(access: Access, store: MemoryTokenStore) -> None:
    secret = "wd_made-elsewhere"
    assert await access.authenticate(secret) is None
    digest = hashlib.sha256(secret.encode()).hexdigest()
    await store.add(StoredToken("token-1", "ward 3", "viewer", digest, created_at=0.0))
    assert _who(await access.authenticate(secret)) == ("ward 3", Role.VIEWER)


async def test_memory_of_known_tokens_is_bounded(access: Access, store: MemoryTokenStore) -> None:
    secrets = [(await access.create_token(f"ward {number}", Role.VIEWER))[1] for number in range(CACHED_TOKENS + 1)]
    for secret in [*secrets, secrets[0]]:
        assert await access.authenticate(secret) is not None
    assert store.look_ups == CACHED_TOKENS + 2


async def test_a_role_of_another_version_opens_nothing(access: Access, store: MemoryTokenStore) -> None:
    stored, secret = await access.create_token("ward 3", Role.PILOT)
    await store.add(replace(stored, role="emperor"))
    assert await access.authenticate(secret) is None


async def test_comparisons_take_constant_time(
    store: MemoryTokenStore, clock: ManualClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    compared: list[tuple[str, str]] = []

    def compare(a: str, b: str) -> bool:
        compared.append((a, b))
        return a == b

    access = Access(store, clock, BOOTSTRAP)
    _, secret = await access.create_token("ward 3", Role.PILOT)
    monkeypatch.setattr(hmac, "compare_digest", compare)
    await access.authenticate(secret)
    digest = hashlib.sha256(secret.encode()).hexdigest()
    assert compared == [(digest, hashlib.sha256(BOOTSTRAP.encode()).hexdigest()), (digest, digest)]


@pytest.mark.parametrize("name", ["", "   ", "x" * 101, "a\nb", "a\x1b[31m", "local", "Bootstrap", "anybody"])
async def test_a_name_is_a_short_line(access: Access, name: str) -> None:
    with pytest.raises(InvalidInputError):
        await access.create_token(name, Role.VIEWER)


async def test_the_bootstrap_token_is_an_admin(store: MemoryTokenStore, clock: ManualClock) -> None:
    access = Access(store, clock, BOOTSTRAP)
    assert _who(await access.authenticate(BOOTSTRAP)) == ("bootstrap", Role.ADMIN)
    assert await access.authenticate(BOOTSTRAP[:-1]) is None
    assert await access.has_tokens()


@pytest.mark.parametrize("empty", [None, ""])
async def test_an_empty_bootstrap_token_is_none(store: MemoryTokenStore, clock: ManualClock, empty: str | None) -> None:
    access = Access(store, clock, empty)
    assert await access.authenticate("") is None
    assert not await access.has_tokens()


@pytest.mark.parametrize("weak", ["short", "x" * 15, "x" * 257, "größe" * 10])
def test_a_weak_bootstrap_token_is_refused(store: MemoryTokenStore, clock: ManualClock, weak: str) -> None:
    with pytest.raises(InvalidInputError, match="bootstrap"):
        Access(store, clock, weak)


async def test_tokens_exist_from_the_first_on_and_for_ever(access: Access, store: MemoryTokenStore) -> None:
    assert not await access.has_tokens()
    stored, _ = await access.create_token("ward 3", Role.ADMIN)
    assert await access.has_tokens()
    await access.revoke(stored.id)
    assert await access.has_tokens()
    assert await Access(store, ManualClock(), None).has_tokens()


async def test_the_first_token_of_another_process_is_seen(access: Access, store: MemoryTokenStore) -> None:
    assert not await access.has_tokens()
    await store.add(StoredToken("token-1", "ward 3", "viewer", "0", created_at=0.0))
    assert await access.has_tokens()


async def test_many_that_ask_at_once_whether_tokens_exist_share_two_looks(
    access: Access, store: MemoryTokenStore
) -> None:
    store.hold.clear()
    asking = [asyncio.create_task(access.has_tokens()) for _ in range(1000)]
    await asyncio.sleep(0)
    store.hold.set()
    assert not any(await asyncio.gather(*asking))
    assert store.lists == 2


async def test_those_who_share_a_look_share_its_failure_and_the_next_look_is_a_new_one(
    access: Access, store: MemoryTokenStore
) -> None:
    store.broken = True
    store.hold.clear()
    asking = [asyncio.create_task(access.has_tokens()) for _ in range(1000)]
    await asyncio.sleep(0)
    store.hold.set()
    found = await asyncio.gather(*asking, return_exceptions=True)
    assert {type(one) for one in found} == {StorageError}
    assert store.lists == 2
    store.broken = False
    assert not await access.has_tokens()


async def test_who_asks_after_the_first_token_does_not_take_an_answer_from_before(
    access: Access, store: MemoryTokenStore
) -> None:
    store.hold.clear()
    before = asyncio.create_task(access.has_tokens())
    await asyncio.sleep(0)  # it has read the tokens, and waits
    await store.add(StoredToken("token-1", "ward 3", "viewer", "0", created_at=0.0))
    after = asyncio.create_task(access.has_tokens())
    store.hold.set()
    assert await after
    await before


async def test_two_live_tokens_never_have_one_name(access: Access) -> None:
    stored, _ = await access.create_token("Dispatch desk", Role.PILOT)
    for twin in ("Dispatch desk", " dispatch DESK "):
        with pytest.raises(ConflictError, match=stored.id):
            await access.create_token(twin, Role.PILOT)
    await access.revoke(stored.id)
    await access.create_token("Dispatch desk", Role.PILOT)


async def test_a_name_is_one_however_it_is_encoded(access: Access) -> None:
    await access.create_token("Kr\u00e4he", Role.PILOT)
    with pytest.raises(ConflictError):
        await access.create_token("Kra\u0308he", Role.PILOT)


async def test_a_token_opens_nothing_once_it_has_expired_though_it_was_known(
    access: Access, clock: ManualClock, store: MemoryTokenStore
) -> None:
    stored, secret = await access.create_token("ward 3", Role.PILOT, lifetime_s=3600.0)
    assert stored.expires_at == clock.now() + 3600.0
    clock.time_s += 3599.0
    assert await access.authenticate(secret) is not None
    clock.time_s += 1.0
    assert await access.authenticate(secret) is None, "without being looked up again"
    clock.time_s += CACHED_FOR_S
    assert await access.authenticate(secret) is None
    assert store.look_ups == 2


@pytest.mark.parametrize("lifetime_s", [0.0, -1.0, 1e12, float("nan")])
async def test_a_lifetime_is_above_zero_and_bounded(access: Access, lifetime_s: float) -> None:
    with pytest.raises(InvalidInputError):
        await access.create_token("ward 3", Role.PILOT, lifetime_s=lifetime_s)


async def test_the_last_use_is_stored_to_the_minute_and_costs_no_write_each_time(
    access: Access, clock: ManualClock, store: MemoryTokenStore
) -> None:
    stored, secret = await access.create_token("ward 3", Role.PILOT)
    for _ in range(60):
        await access.authenticate(secret)
        clock.time_s += CACHED_FOR_S
    assert store.touches == 5
    assert (store.tokens[stored.id].last_used_at or 0.0) > clock.now() - 65.0


async def test_a_full_disk_keeps_nobody_out(access: Access, store: MemoryTokenStore) -> None:
    _, secret = await access.create_token("ward 3", Role.PILOT)
    store.full = True
    assert await access.authenticate(secret) is not None


async def failed(access: Access, address: str, times: int = MOST_FAILURES) -> None:
    for number in range(times):
        assert await access.authenticate(f"wd_guess-{number}", address) is None


async def test_an_address_that_guesses_is_held_off_and_the_others_are_not(
    access: Access, clock: ManualClock, store: MemoryTokenStore
) -> None:
    _, secret = await access.create_token("ward 3", Role.PILOT)
    await failed(access, "203.0.113.7")
    looked_up = store.look_ups
    with pytest.raises(TooManyAttemptsError) as refused:
        await access.authenticate(secret, "203.0.113.7")
    assert store.look_ups == looked_up, "nothing is looked up, so nothing can be learnt"
    assert 0 < int(str(refused.value.extra["retry_after_s"])) <= WINDOW_S
    assert await access.authenticate(secret, "203.0.113.8") is not None
    clock.time_s += WINDOW_S
    assert await access.authenticate(secret, "203.0.113.7") is not None


async def test_who_was_in_already_goes_on_though_others_behind_its_address_guess(
    access: Access, clock: ManualClock
) -> None:
    stored, secret = await access.create_token("ward 3", Role.PILOT)
    _, other = await access.create_token("ward 4", Role.PILOT)
    assert await access.authenticate(secret, "203.0.113.7") is not None
    await failed(access, "203.0.113.7")
    for _ in range(8):
        clock.time_s += CACHED_FOR_S + 1.0
        assert await access.authenticate(secret, "203.0.113.7") is not None
    with pytest.raises(TooManyAttemptsError):
        await access.authenticate(other, "203.0.113.7")
    await access.revoke(stored.id)
    with pytest.raises(TooManyAttemptsError):
        await access.authenticate(secret, "203.0.113.7")


async def test_the_bootstrap_token_cannot_be_guessed_either(store: MemoryTokenStore, clock: ManualClock) -> None:
    access = Access(store, clock, BOOTSTRAP)
    await failed(access, "203.0.113.7")
    with pytest.raises(TooManyAttemptsError):
        await access.authenticate(BOOTSTRAP, "203.0.113.7")


async def test_a_host_of_ipv6_has_many_addresses_and_counts_once(access: Access) -> None:
    for number in range(MOST_FAILURES):
        await access.authenticate("wd_guess", f"2001:db8::{number:x}")
    with pytest.raises(TooManyAttemptsError):
        await access.authenticate("wd_guess", "2001:db8::ffff")
    assert await access.authenticate("wd_guess", "2001:db8:0:1::1") is None


async def test_memory_of_failed_attempts_is_bounded(access: Access) -> None:
    await failed(access, "203.0.113.7")
    for number in range(ADDRESSES_KEPT):
        await access.authenticate("wd_guess", f"10.{number >> 16}.{number >> 8 & 255}.{number & 255}")
    assert await access.authenticate("wd_guess", "203.0.113.7") is None, "the oldest is removed"
