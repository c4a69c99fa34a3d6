"""The data folder: its owner alone has access to it, or nothing starts."""

from __future__ import annotations

import os
import stat
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import structlog

from app.config import PREFIX, SettingsError

log = structlog.get_logger(__name__)

FOLDER_MODE: Final = 0o700
FILE_MODE: Final = 0o600
PRIVATE_UMASK: Final = 0o077
"""Of the whole process: libraries write files too."""

OURS: Final = frozenset({"waydrop.db", "waydrop.db.lock", "simulator.lock"})
"""A folder that contains one of these was used by Waydrop before."""


def claim_data_folder(folder: Path) -> None:
    """Create the folder with mode 0700. Remove access of others from a folder that Waydrop used before.

    Access of a group stays where another user owns the folder, as on a volume of Kubernetes.

    Raises:
        SettingsError: it cannot be created, or other users have access to it and it contains files of others.
    """
    try:
        folder.mkdir(mode=FOLDER_MODE, parents=True, exist_ok=True)
        found = folder.stat()
        if found.st_mode & 0o077:
            _restrict(folder, found)
    except OSError as error:
        raise SettingsError(
            f"{PREFIX}DATA_DIR: {folder} is not usable: {error.strerror or error}",
            hint="give the user that runs Waydrop write access, or use another folder",
        ) from error


def folder_address(folder: Path) -> str:
    """The same for each process on this folder until this machine restarts, and another for every copy of the folder.

    The lock of the journal lets only one process at a time use a folder.
    """
    try:
        machine = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:  # not Linux
        machine = f"{uuid.getnode():x}"
    found = folder.stat()
    return f"{machine}:{found.st_dev:x}:{found.st_ino:x}"


def _restrict(folder: Path, found: os.stat_result) -> None:
    if found.st_uid != os.geteuid():
        if found.st_mode & 0o007:
            raise _shared(folder, "and another user owns it")
        log.warning("the data folder is accessible to its group", folder=str(folder))
        return
    names = set(os.listdir(folder))
    if found.st_mode & stat.S_ISVTX or (names and not names & OURS):
        raise _shared(folder, "and it contains files that are not Waydrop's")
    folder.chmod(FOLDER_MODE)
    for path in _entries(folder):
        path.chmod(FOLDER_MODE if path.is_dir() else FILE_MODE)
    log.info("the data folder is now accessible to its owner only", folder=str(folder))


def _entries(folder: Path) -> Iterator[Path]:
    """Everything in the folder that belongs to this user. Symbolic links are not followed."""
    for root, folders, files in os.walk(folder):
        for name in (*folders, *files):
            path = Path(root, name)
            entry = path.lstat()
            if entry.st_uid == os.geteuid() and not stat.S_ISLNK(entry.st_mode):
                yield path


def _shared(folder: Path, why: str) -> SettingsError:
    return SettingsError(
        f"{PREFIX}DATA_DIR: other users of this machine have access to {folder}, {why}",
        hint="use a directory of its own for Waydrop, or remove their access: chmod 700",
    )
