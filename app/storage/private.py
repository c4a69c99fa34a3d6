"""What lies beside the journal and is for its owner alone: private files, the key of secrets, the tokens' marker."""

from __future__ import annotations

import os
import secrets
from pathlib import Path
from typing import Final

from cryptography.fernet import Fernet, InvalidToken

from app.domain.errors import StorageError

FOLDER_MODE: Final = 0o700
FILE_MODE: Final = 0o600


def private_folder(folder: Path) -> None:
    """Create a folder with mode 0700. Raises OSError."""
    folder.mkdir(mode=FOLDER_MODE, parents=True, exist_ok=True)


def private_file(path: Path) -> None:
    """Create an empty file with mode 0600 unless it exists; SQLite gives its mode to the files beside it.

    Raises OSError.
    """
    os.close(os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, FILE_MODE))


def sync_folder(folder: Path) -> None:
    """Write the names in a folder to the disk. Raises OSError."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


# Secrets that Waydrop itself needs in plain text are stored encrypted. The key has a file of its own, so that a copy of
# the journal alone reveals none of them.


SEALED: Final = "fernet:"
KEY_NAME: Final = "secret.key"


class SecretBox:
    """Encrypts and decrypts short texts (Fernet: AES-128-CBC with HMAC-SHA256)."""

    def __init__(self, key: bytes) -> None:
        self._fernet = Fernet(key)

    def seal(self, text: str) -> str:
        return SEALED + self._fernet.encrypt(text.encode()).decode("ascii")

    def open(self, sealed: str) -> str | None:
        """The plain text; None if it was encrypted with another key, or altered."""
        try:
            return self._fernet.decrypt(sealed.removeprefix(SEALED).encode()).decode()
        except InvalidToken:
            return None


def secret_box(path: Path) -> SecretBox:
    """The box with the key in a file, which is created with a new key if there is none. Blocking.

    Raises:
        StorageError: the file cannot be read or created, or contains no key.
    """
    try:
        if not path.exists():
            _make_key(path)
        return SecretBox(path.read_bytes().strip())
    except OSError as error:
        raise StorageError(
            f"key file {path}: {error.strerror or error}", hint="give the user that runs Waydrop access to it"
        ) from error
    except ValueError as error:
        raise StorageError(
            f"key file {path} does not contain a key",
            hint="restore it from a backup; without a backup, delete it and create the webhooks again",
        ) from error


def _make_key(path: Path) -> None:
    """The name comes with the content: a full disk or a kill leaves no empty key. Raises OSError."""
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        with open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, FILE_MODE), "wb") as file:
            file.write(Fernet.generate_key() + b"\n")
            file.flush()
            os.fsync(file.fileno())
        try:
            os.link(part, path)
        except FileExistsError:
            pass  # another node has made one
        except PermissionError:  # the file system has no hard links
            part.rename(path)
    finally:
        part.unlink(missing_ok=True)
    sync_folder(path.parent)


# A journal that is empty beside what belongs to it was lost, by a file system that was repaired or a restore that was
# broken off. SQLite would take it for a new one, and delete the write-ahead log, which may have the newest events.


def refuse_lost_journal(journal: Path) -> None:
    """Before anything opens the journal. Blocking. Raises StorageError: it is empty or gone, and what it had is not."""
    if _has_content(journal):
        return
    log, files = journal.with_name(journal.name + "-wal"), journal.with_name("attachments")
    for left, is_full in ((log, _has_content(log)), (files, files.is_dir() and any(files.glob("[0-9a-f][0-9a-f]/*")))):
        if is_full:
            state = "is empty" if journal.exists() else "is gone"
            raise StorageError(
                f"journal {journal} {state}, but {left} is not: it was lost",
                hint="restore the journal from a backup; to start a new one, move the other files out of the folder",
            )


def _has_content(path: Path) -> bool:
    return path.exists() and path.stat().st_size > 0


# A file that says that access tokens were created. A journal that was lost or emptied must not open the service to
# everybody on this machine, as a new one would.


_NOTE: Final = b"Access tokens exist in the journal beside this file. Without them Waydrop does not start.\n"


def tokens_marker(journal: Path) -> Path:
    """The file beside a journal."""
    return journal.with_name("tokens-exist")


def mark_tokens(journal: Path) -> None:
    """Write the marker; on the disk when this returns. Blocking. Raises StorageError."""
    path = tokens_marker(journal)
    try:
        if path.exists():
            return
        private_file(path)
        with path.open("r+b") as file:
            file.write(_NOTE)
            file.flush()
            os.fsync(file.fileno())
        sync_folder(path.parent)
    except OSError as error:
        raise StorageError(
            f"{path} cannot be written: {error.strerror or error}", hint="free space, and allow writing there"
        ) from error


def refuse_lost_tokens(journal: Path, tokens: int | None = None) -> None:
    """Compare the marker with the journal: before it is opened (None), and with the number of its tokens. Blocking.

    Raises:
        StorageError: access tokens were created, and the journal is empty, gone, or has none.
    """
    marker = tokens_marker(journal)
    if not marker.exists():
        return
    is_lost = not _has_content(journal) if tokens is None else tokens == 0
    if is_lost:
        state = "contains none" if tokens == 0 else "is empty" if journal.exists() else "is gone"
        raise StorageError(
            f"access tokens were created for journal {journal}, which {state}: it was lost or replaced",
            hint=f"restore the journal from a backup; to start a new one without access tokens, delete {marker}",
        )
