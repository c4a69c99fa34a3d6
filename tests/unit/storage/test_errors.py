"""Errors of SQLite are told in words that help."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path

import pytest

from app.domain.errors import StorageError
from app.storage.database import storage_errors

PATH = Path("journal.db")


def sqlite_error(name: str) -> sqlite3.Error:
    error = sqlite3.OperationalError("as SQLite says it")
    error.sqlite_errorname = name
    return error


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("SQLITE_FULL", "the disk is full"),
        ("SQLITE_READONLY", "read-only"),
        ("SQLITE_READONLY_DIRECTORY", "read-only"),
        ("SQLITE_IOERR_WRITE", "failed to read or write"),
        ("SQLITE_CORRUPT", "damaged"),
        ("SQLITE_CORRUPT_INDEX", "damaged"),
        ("SQLITE_CANTOPEN", "cannot be opened"),
        ("SQLITE_BUSY_RECOVERY", "another program has locked it"),
    ],
)
def test_each_cause_has_its_words_and_a_hint(name: str, words: str) -> None:
    with pytest.raises(StorageError, match=words) as caught, storage_errors(PATH):
        raise sqlite_error(name)
    assert caught.value.detail.startswith("journal journal.db: ")
    assert caught.value.hint
    assert caught.value.extra["sqlite"] == name


def test_an_error_that_is_not_known_is_still_a_storage_error_with_its_text() -> None:
    with pytest.raises(StorageError, match="as SQLite says it"), storage_errors(PATH):
        raise sqlite_error("SQLITE_NOLFS")


def test_other_errors_pass_unchanged() -> None:
    with pytest.raises(KeyError), storage_errors(PATH):
        raise KeyError


@pytest.mark.parametrize(("blocks", "words"), [(0, "the disk is full"), (1_000_000, "failed to read or write")])
def test_an_error_of_reading_on_a_full_disk_is_told_as_the_full_disk(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, blocks: int, words: str
) -> None:
    found = os.statvfs(tmp_path)
    room = os.statvfs_result((*found[:4], blocks, *found[5:]))
    monkeypatch.setattr(os, "statvfs", lambda folder: room if folder == tmp_path else found)
    # SQLite cannot make the shared memory beside an existing journal, and calls that an input/output error
    with pytest.raises(StorageError, match=words), storage_errors(tmp_path / "journal.db"):
        raise sqlite_error("SQLITE_IOERR_SHMSIZE")
