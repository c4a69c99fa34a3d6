"""Timestamps outlive a restart and a crash, and keys that are made meanwhile are found."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

import pytest

from app.domain.ports.link_keys import LinkKeyError
from app.services.flight_threads import flight_threads
from app.vehicles.link_guard.key_file import KeyFile, MemoryFile
from app.vehicles.link_guard.memory import SigningStore
from app.vehicles.link_guard.signing import SigningKey, StreamKey, ticks
from tests.support.busy_pool import busy_default_pool

UNIX_S = 1.8e9
KEY, NEXT_KEY = SigningKey(b"k" * 32), SigningKey(b"n" * 32)


@pytest.fixture
def files(tmp_path: Path) -> tuple[KeyFile, MemoryFile]:
    return KeyFile(tmp_path / "link-keys.json"), MemoryFile(tmp_path / "link-state.json")


def opened(files: tuple[KeyFile, MemoryFile], unix_s: float = UNIX_S) -> SigningStore:
    return SigningStore(*files, clock=lambda: unix_s)


def test_after_a_crash_no_timestamp_is_sent_twice(files: tuple[KeyFile, MemoryFile]) -> None:
    sent: list[int] = []
    for _ in range(5):  # it crashes each time, and the machine's clock begins anew each time
        store = opened(files)
        sent += [store.timestamp(KEY) for _ in range(100)]
    assert sent == sorted(set(sent))


def test_after_an_orderly_end_the_clock_goes_on_where_it_was(files: tuple[KeyFile, MemoryFile]) -> None:
    store = opened(files)
    last = [store.timestamp(KEY) for _ in range(3)][-1]
    store.close()
    assert opened(files, UNIX_S - 1000.0).timestamp(KEY) == last + 1


def test_a_vehicle_that_changes_its_key_hears_no_earlier_timestamp(files: tuple[KeyFile, MemoryFile]) -> None:
    store = opened(files)
    store.signing.clocks.of(KEY).observe(ticks(UNIX_S + 86_400.0))
    before = store.timestamp(KEY)
    assert store.timestamp(NEXT_KEY, former=KEY) > before


async def test_time_is_reserved_for_a_key_before_its_vehicle_is_heard(files: tuple[KeyFile, MemoryFile]) -> None:
    files[0].add(1, KEY.secret)
    store = opened(files)
    await store.tick(time.monotonic() + 10.0)
    store.timestamp(KEY)
    assert files[1].read().reserved[KEY.fingerprint] > store.signing.clocks.of(KEY).last
    assert not store.signing.clocks.of(KEY).needs_reservation


async def test_what_could_not_be_stored_is_not_reserved_and_commands_go_on(files: tuple[KeyFile, MemoryFile]) -> None:
    files[0].add(1, KEY.secret)
    store = opened(files)
    files[1].path.mkdir()  # it cannot be replaced
    sent = [store.timestamp(KEY) for _ in range(10)]
    await store.tick(time.monotonic() + 10.0)
    assert sent == sorted(set(sent))
    assert store.signing.clocks.of(KEY).needs_reservation
    files[1].path.rmdir()
    await store.tick(time.monotonic() + 20.0)
    assert not store.signing.clocks.of(KEY).needs_reservation


def test_the_clock_of_a_key_that_is_not_used_now_is_kept(files: tuple[KeyFile, MemoryFile]) -> None:
    store = opened(files)
    last = store.timestamp(KEY)
    store.close()
    between = opened(files)
    between.timestamp(NEXT_KEY)
    between.close()
    assert opened(files, UNIX_S - 1000.0).timestamp(KEY) == last + 1


def test_a_service_that_signs_nothing_writes_nothing(files: tuple[KeyFile, MemoryFile]) -> None:
    store = opened(files)
    store.close()
    assert not files[1].path.exists()


async def test_what_a_vehicle_said_is_stored_now_and_then(files: tuple[KeyFile, MemoryFile]) -> None:
    store = opened(files)
    stream = StreamKey(KEY.fingerprint, 1, 1, 0)
    store.signing.times.accept(stream, 77)
    await store.tick(time.monotonic() + 10.0)
    assert not opened(files).signing.times.is_new(stream, 77, 77)


async def test_nothing_waits_for_the_work_of_others(files: tuple[KeyFile, MemoryFile]) -> None:
    async with flight_threads() as threads, busy_default_pool() as other, asyncio.timeout(20.0):
        store = SigningStore(*files, clock=lambda: UNIX_S, in_thread=threads.run)
        files[0].add(1, KEY.secret)
        assert await store.tick(time.monotonic() + 10.0)
        assert KEY.fingerprint in files[1].read().reserved
        assert not other.done()


async def test_a_key_that_is_made_meanwhile_is_found(files: tuple[KeyFile, MemoryFile]) -> None:
    store = opened(files)
    assert store.signing.ring.of(1) is None
    made = files[0].add(1)
    assert await store.tick(time.monotonic() + 2.0)
    found = store.signing.ring.of(1)
    assert found is not None
    assert found.newest == made.key
    assert not await store.tick(time.monotonic() + 4.0)


async def test_a_key_file_that_others_may_read_from_now_on_is_noticed(
    files: tuple[KeyFile, MemoryFile], caplog: pytest.LogCaptureFixture
) -> None:
    files[0].add(1)
    store = opened(files)
    files[0].path.chmod(0o644)
    await store.tick(time.monotonic() + 2.0)
    assert "can be read or written by others" in caplog.text


@pytest.mark.parametrize("spoil", ["remove", "open", "break"])
async def test_keys_go_on_as_they_were_when_their_file_cannot_be_used_any_more(
    files: tuple[KeyFile, MemoryFile], spoil: str
) -> None:
    files[0].add(1)
    store = opened(files)
    if spoil == "remove":
        files[0].path.unlink()
    else:
        files[0].path.write_text("{" if spoil == "break" else files[0].path.read_text() + " ")
        files[0].path.chmod(0o600 if spoil == "break" else 0o644)
    assert not await store.tick(time.monotonic() + 2.0)
    assert store.signing.ring.of(1) is not None


def test_a_service_does_not_start_with_keys_that_others_can_read(files: tuple[KeyFile, MemoryFile]) -> None:
    files[0].add(1)
    files[0].path.chmod(0o644)
    with pytest.raises(LinkKeyError):
        opened(files)
