"""Every subscriber gets each event once and in order, or is cut off."""

from __future__ import annotations

import asyncio

import pytest

from app.domain.events import Event, NewEvent
from app.services.journal import Fanout, SubscriptionClosedError, SubscriptionOverflowError
from tests.support.events import item


def events(*seqs: int) -> list[Event]:
    return [NewEvent.of(item(seq), 0.0).numbered(seq, "gw-1", "") for seq in seqs]


async def test_a_subscriber_gets_what_is_published_after_it_came() -> None:
    fanout = Fanout()
    fanout.publish(events(1))
    subscription = fanout.subscribe(10, after=1)
    fanout.publish(events(2, 3))
    assert [(await subscription.get()).seq for _ in range(2)] == [2, 3]
    assert subscription.after == 1


async def test_get_waits_for_the_next_event() -> None:
    fanout = Fanout()
    subscription = fanout.subscribe(10, after=0)
    getting = asyncio.create_task(subscription.get())
    await asyncio.sleep(0)
    assert not getting.done()
    fanout.publish(events(1))
    assert (await getting).seq == 1


async def test_a_cancelled_get_takes_no_event() -> None:
    fanout = Fanout()
    subscription = fanout.subscribe(10, after=0)
    getting = asyncio.create_task(subscription.get())
    await asyncio.sleep(0)
    fanout.publish(events(1))
    getting.cancel()
    await asyncio.gather(getting, return_exceptions=True)
    assert (await subscription.get()).seq == 1


async def test_a_reader_that_is_full_when_more_comes_is_cut_off_and_told_at_once() -> None:
    fanout = Fanout()
    subscription = fanout.subscribe(2, after=0)
    fanout.publish(events(1, 2))
    assert not subscription.overflowed
    fanout.publish(events(3))
    assert subscription.overflowed
    for _ in range(2):
        with pytest.raises(SubscriptionOverflowError) as cut:
            await subscription.get()
    assert cut.value.hint
    assert len(fanout) == 0


async def test_a_reader_that_keeps_up_is_not_cut_off_by_one_big_commit() -> None:
    fanout = Fanout()
    subscription = fanout.subscribe(2, after=0)
    fanout.publish(events(*range(1, 100)))
    assert [(await subscription.get()).seq for _ in range(99)] == list(range(1, 100))
    fanout.publish(events(100))
    assert (await subscription.get()).seq == 100


async def test_a_waiting_reader_is_told_when_its_subscription_closes() -> None:
    fanout = Fanout()
    subscription = fanout.subscribe(2, after=0)
    getting = asyncio.create_task(subscription.get())
    await asyncio.sleep(0)
    fanout.close()
    with pytest.raises(SubscriptionClosedError):
        await getting


async def test_a_closed_subscription_gets_no_more_and_is_forgotten() -> None:
    fanout = Fanout()
    subscription = fanout.subscribe(2, after=0)
    fanout.publish(events(1))
    subscription.close()
    subscription.close()
    fanout.publish(events(2))
    assert len(fanout) == 0
    assert (await subscription.get()).seq == 1
    with pytest.raises(SubscriptionClosedError) as closed:
        await subscription.get()
    assert not isinstance(closed.value, SubscriptionOverflowError)


def test_a_subscription_has_room() -> None:
    with pytest.raises(ValueError, match="capacity"):
        Fanout().subscribe(0, after=0)


async def test_who_comes_after_the_end_is_told_so() -> None:
    fanout = Fanout()
    fanout.close()
    with pytest.raises(SubscriptionClosedError):
        await fanout.subscribe(2, after=0).get()
