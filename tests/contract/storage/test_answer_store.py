"""What every AnswerStore promises."""

from __future__ import annotations

import pytest

from app.domain.errors import StorageError
from tests.contract.storage.conftest import Opener, Stores
from tests.support.stored_samples import answer, event, plan


async def test_an_unknown_key_is_none(stores: Stores) -> None:
    assert await stores.answers.get("key-1") is None


async def test_an_answer_comes_back_byte_for_byte(stores: Stores) -> None:
    body = bytes(range(256))
    await stores.answers.put(answer(body=body))
    assert await stores.answers.get("key-1") == answer(body=body)


async def test_an_answer_survives_a_restart(opener: Opener) -> None:
    async with opener() as stores:
        await stores.answers.put(answer())
    async with opener() as stores:
        assert await stores.answers.get("key-1") == answer()


async def test_the_first_answer_of_a_key_stands(stores: Stores) -> None:
    await stores.answers.put(answer())
    await stores.answers.put(answer(body=b"second"))
    assert await stores.answers.get("key-1") == answer()


async def test_an_answer_may_replace_the_one_that_was_stored_with_an_event(stores: Stores) -> None:
    await stores.events.append([event()], answers=[answer()])
    await stores.answers.put(answer(body=b"second"))
    assert await stores.answers.get("key-1") == answer()
    await stores.answers.put(answer(body=b"third"), replaces=True)
    assert await stores.answers.get("key-1") == answer(body=b"third")


async def test_an_answer_that_is_forgotten_leaves_its_key_free(stores: Stores) -> None:
    await stores.events.append([event()], answers=[answer()])
    await stores.answers.forget("key-1")
    assert await stores.answers.get("key-1") is None
    await stores.answers.forget("key-1")
    await stores.answers.put(answer(body=b"second"))
    assert await stores.answers.get("key-1") == answer(body=b"second")


async def test_an_answer_is_stored_with_its_events_or_not_at_all(stores: Stores) -> None:
    await stores.events.append([event(1)], plans=[plan()], answers=[answer()])
    with pytest.raises(StorageError):  # the id of the plan is taken
        await stores.events.append([event(2)], plans=[plan()], answers=[answer("key-2")])
    assert await stores.answers.get("key-1") == answer()
    assert await stores.answers.get("key-2") is None
