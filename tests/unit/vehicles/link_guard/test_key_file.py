"""Keys are on the disk for their owner alone, changed whole or not at all, and never shown."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path

import pytest

from app.domain.ports.link_keys import LinkKeyError
from app.vehicles.link_guard.key_file import KeyFile, MemoryFile, SigningMemory
from app.vehicles.link_guard.signing import SigningKey, StreamKey

SECRET = bytes(range(1, 33))


@pytest.fixture
def keys(tmp_path: Path) -> KeyFile:
    return KeyFile(tmp_path / "data" / "link-keys.json")


def test_without_a_file_there_are_no_keys(keys: KeyFile) -> None:
    assert keys.read() == {}
    assert keys.version() is None


def test_a_new_key_is_random_and_on_no_vehicle_yet(keys: KeyFile) -> None:
    one, other = keys.add(1), keys.add(7)
    assert one.key != other.key
    assert not one.in_use
    assert keys.read() == {1: [one], 7: [other]}


def test_the_file_is_for_its_owner_alone(keys: KeyFile) -> None:
    before = os.umask(0)
    try:
        keys.add(1)
    finally:
        os.umask(before)
    assert stat.S_IMODE(keys.path.stat().st_mode) == 0o600
    assert [path.name for path in keys.path.parent.iterdir() if path.suffix not in (".json", ".lock")] == []


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660, 0o644])
def test_a_file_that_others_can_read_or_write_is_refused(keys: KeyFile, mode: int) -> None:
    keys.add(1)
    keys.path.chmod(mode)
    with pytest.raises(LinkKeyError, match=f"{mode:04o}") as caught:
        keys.read()
    assert "chmod 600" in caught.value.hint


def test_a_key_from_elsewhere_counts_as_in_use(keys: KeyFile) -> None:
    stored = keys.add(1, SECRET)
    assert stored.in_use
    assert keys.read()[1][0].key == SigningKey(SECRET)
    with pytest.raises(LinkKeyError, match="already"):
        keys.add(1, SECRET)


def test_a_vehicle_has_two_keys_at_most(keys: KeyFile) -> None:
    keys.add(1)
    second = keys.add(1)
    with pytest.raises(LinkKeyError, match="2 keys"):
        keys.add(1)
    keys.remove(1, second.key.fingerprint)
    keys.add(1)


def test_a_key_that_is_not_there_cannot_be_removed(keys: KeyFile) -> None:
    known = keys.add(1).key.fingerprint
    with pytest.raises(LinkKeyError, match="no key") as caught:
        keys.remove(1, "0" * 16)
    assert known in caught.value.hint


def test_a_folder_that_cannot_be_written_is_named(keys: KeyFile) -> None:
    keys.path.with_suffix(".lock").mkdir(parents=True)
    with pytest.raises(LinkKeyError, match=f"cannot write {keys.path}"):
        keys.add(1)


def test_the_last_key_removed_leaves_an_empty_file(keys: KeyFile) -> None:
    keys.remove(1, keys.add(1).key.fingerprint)
    assert keys.read() == {}
    assert keys.path.exists()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        '{"version": 2}',
        '{"vehicles": {"0": []}}',
        '{"vehicles": {"1": [{"secret": "00"}]}}',
        '{"vehicles": {"1": [{"secret": "' + "0" * 64 + '"}]}}',
        '{"vehicles": {"1": [{"secret": "zz"}]}}',
        '{"other": 1}',
    ],
)
def test_what_is_no_key_file_is_refused(keys: KeyFile, text: str) -> None:
    keys.path.parent.mkdir()
    keys.path.write_text(text)
    keys.path.chmod(0o600)
    with pytest.raises(LinkKeyError, match="no file of link keys"):
        keys.read()


def test_a_mistake_in_the_file_shows_no_secret(keys: KeyFile) -> None:
    keys.path.parent.mkdir()
    keys.path.write_text(json.dumps({"vehicles": {"1": [{"secret": SECRET.hex() + "00"}]}}))
    keys.path.chmod(0o600)
    with pytest.raises(LinkKeyError) as caught:
        keys.read()
    assert SECRET.hex() not in caught.value.detail + caught.value.hint


def test_what_is_remembered_outlives_a_restart(tmp_path: Path) -> None:
    file = MemoryFile(tmp_path / "link-state.json")
    assert file.read() == SigningMemory()
    memory = SigningMemory({"abc": 123}, {StreamKey("abc", 1, 1, 0): 5, StreamKey("def", 2, 1, 3): 1 << 47}, {1: "abc"})
    file.write(memory)
    assert file.read() == memory
    assert stat.S_IMODE(file.path.stat().st_mode) == 0o600


INFINITE = '{"reserved": {}, "streams": [["a", 1e400, 1, 1, 1]], "used": {}}'


@pytest.mark.parametrize(
    "text", ["", "[]", '{"reserved": {}}', '{"reserved": {}, "streams": [[1]], "used": {}}', INFINITE]
)
def test_a_memory_that_cannot_be_read_is_not_taken_for_none(tmp_path: Path, text: str) -> None:
    file = MemoryFile(tmp_path / "link-state.json")
    file.path.write_text(text)
    with pytest.raises(LinkKeyError, match="cannot read"):
        file.read()
