"""What every TokenStore promises."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.errors import StorageError
from app.domain.ports.stores import StoredToken
from tests.contract.storage.conftest import Opener, Stores
from tests.support.stored_samples import token


async def test_an_unknown_hash_finds_nothing(stores: Stores) -> None:
    assert await stores.tokens.find_by_hash("hash-1") is None


async def test_a_token_is_found_by_its_hash(stores: Stores) -> None:
    await stores.tokens.add(token(1))
    await stores.tokens.add(token(2))
    assert await stores.tokens.find_by_hash("hash-2") == token(2)


async def test_a_token_survives_a_restart(opener: Opener) -> None:
    async with opener() as stores:
        await stores.tokens.add(token())
    async with opener() as stores:
        assert await stores.tokens.find_by_hash("hash-1") == token()


@pytest.mark.parametrize(
    "twin", [replace(token(2), id="token-1"), replace(token(2), token_hash="hash-1"), replace(token(2), name="ward 1")]
)
async def test_ids_hashes_and_names_are_unique(stores: Stores, twin: StoredToken) -> None:
    await stores.tokens.add(token(1))
    with pytest.raises(StorageError):
        await stores.tokens.add(twin)


async def test_a_revoked_token_is_found_no_more_but_still_listed(stores: Stores) -> None:
    await stores.tokens.add(token())
    assert await stores.tokens.revoke("token-1", now=2000.0)
    assert await stores.tokens.find_by_hash("hash-1") is None
    assert list(await stores.tokens.list_tokens()) == [replace(token(), revoked_at=2000.0)]


async def test_only_a_live_token_can_be_revoked_and_the_first_time_stands(stores: Stores) -> None:
    await stores.tokens.add(token())
    assert not await stores.tokens.revoke("token-2", now=2000.0)
    assert await stores.tokens.revoke("token-1", now=2000.0)
    assert not await stores.tokens.revoke("token-1", now=3000.0)
    assert (await stores.tokens.list_tokens())[0].revoked_at == 2000.0


async def test_tokens_are_listed_in_order_of_creation(stores: Stores) -> None:
    for number in (2, 1, 3):
        await stores.tokens.add(token(number))
    assert [one.id for one in await stores.tokens.list_tokens()] == ["token-2", "token-1", "token-3"]


async def test_the_name_of_a_revoked_token_is_free(stores: Stores) -> None:
    await stores.tokens.add(token(1))
    await stores.tokens.revoke("token-1", now=2000.0)
    await stores.tokens.add(replace(token(2), name="ward 1"))


async def test_the_last_use_is_kept(opener: Opener) -> None:
    async with opener() as stores:
        await stores.tokens.add(token())
        await stores.tokens.touch("token-1", now=3000.0)
        await stores.tokens.touch("token-9", now=3000.0)
    async with opener() as stores:
        assert await stores.tokens.find_by_hash("hash-1") == replace(token(), last_used_at=3000.0)
